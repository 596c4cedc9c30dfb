"""The frame of studies: rows in order, resume, equal bytes with several workers, and what the page and the CSV say."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Sequence
from dataclasses import dataclass
from html.parser import HTMLParser
from pathlib import Path
from typing import Any, ClassVar

import pytest

from labgym.documents import Record
from labgym.errors import OptionError
from labgym.paper.reproduction import figures as figuring
from labgym.paper.reproduction.figures import (
    FigureCell,
    FigureColumn,
    FigureLine,
    FigureTable,
    PublishedFigures,
    mean_cell,
    paper_line,
)
from labgym.paper.reproduction.page import StudySection
from labgym.paper.reproduction.study import Study, reproduce, rows_output
from labgym.runs import ExecutorOptions, Shard, ShardOutput

EVIL = '<script>alert("x")</script>'
COLUMN = FigureColumn(key="square", heading="Square", digits=1)
CALLS: list[int] = []


class SquareRow(Record):
    number: int
    square: int


def squared(number: int, stop: bool = False) -> ShardOutput:
    if stop and len(CALLS) == 2:
        raise KeyboardInterrupt
    CALLS.append(number)
    return rows_output(f"n{number}", [SquareRow(number=number, square=number * number)], {f"files/{number}": b"kept"})


@dataclass(frozen=True)
class SquareStudy(Study[SquareRow]):
    count: int = 5
    stop: bool = False
    name: ClassVar[str] = "squares"
    row: ClassVar[type[Record]] = SquareRow

    def inputs(self) -> dict[str, Any]:
        return {"count": self.count}

    def shards(self) -> Sequence[Shard]:
        return [Shard(f"n{k}", squared, (k, self.stop)) for k in range(self.count)]

    def figures(self, rows: Sequence[SquareRow]) -> PublishedFigures:
        cell = mean_cell([row.square for row in rows], [str(row.number) for row in rows], "amount")
        lines = (
            FigureLine(name=EVIL, detail="by hand", cells={"square": cell}),
            paper_line({"method": "Holodeck", "square": 3.5, "other": 1}, (COLUMN,)),
            FigureLine(name="nothing", cells={}),
        )
        table = FigureTable(key="squares", title=EVIL, columns=(COLUMN,), lines=lines, notes=(EVIL,))
        return PublishedFigures(
            study="squares", title="Squares", source="Table 9", facts={"seeds": "0"}, tables=(table,)
        )

    def sections(self, rows: Sequence[SquareRow], folder: Path) -> Sequence[StudySection]:
        assert (folder / "files/0").read_bytes() == b"kept"
        return (StudySection(f"{len(rows)} rows", (EVIL,)),)


def content(folder: Path) -> dict[str, bytes]:
    skipped = ("provenance.jsonl", "ledger.jsonl")
    paths = [path for path in sorted(folder.rglob("*")) if path.is_file() and path.name not in skipped]
    return {str(path.relative_to(folder)): path.read_bytes() for path in paths if not path.name.startswith(".")}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("study") / "squares"
    reproduce(SquareStudy(), folder, progress=False)
    return folder


def test_the_rows_are_in_the_order_of_the_shards(folder):
    rows = [json.loads(line) for line in (folder / "rows.jsonl").read_text().splitlines()]
    assert rows == [{"number": k, "square": k * k} for k in range(5)]


def test_the_figures_are_read_from_a_finished_folder_without_running(folder):
    CALLS.clear()
    figures = reproduce(SquareStudy(), folder, progress=False)
    assert CALLS == []
    assert (
        figures
        == PublishedFigures.load(folder / "figures.json")
        == SquareStudy().figures([SquareRow(number=k, square=k * k) for k in range(5)])
    )


def test_an_interrupted_study_resumes_and_ends_with_the_same_bytes(folder, tmp_path):
    CALLS.clear()
    with pytest.raises(KeyboardInterrupt):
        reproduce(SquareStudy(stop=True), tmp_path / "again", progress=False)
    assert CALLS == [0, 1]
    reproduce(SquareStudy(), tmp_path / "again", progress=False)
    assert CALLS == [0, 1, 2, 3, 4]
    assert content(tmp_path / "again") == content(folder)


@pytest.mark.slow  # test_shards.py has workers
def test_two_workers_write_the_same_bytes_as_one(folder, tmp_path):
    reproduce(SquareStudy(), tmp_path / "two", ExecutorOptions(workers=2), progress=False)
    assert content(tmp_path / "two") == content(folder)


def test_another_study_in_the_folder_is_refused(folder):
    with pytest.raises(OptionError, match=r"count \(5 there, 6 requested\)"):
        reproduce(SquareStudy(6), folder, progress=False)


def test_the_csv_has_a_line_for_each_figure(folder):
    lines = list(csv.DictReader(io.StringIO((folder / "figures.csv").read_text())))
    assert [(line["row"], line["origin"], line["value"]) for line in lines] == [
        (EVIL, "labgym", "6.0"),
        ("Holodeck", "paper", "3.5"),
        ("nothing", "labgym", ""),
    ]
    assert float(lines[0]["low"]) < 6.0 < float(lines[0]["high"])
    assert lines[0]["cases"] == "5"


class Page(HTMLParser):
    VOID = frozenset({"meta", "img", "br"})

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.text: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        assert tag not in {"script", "link", "iframe"}
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.text.append(data)


def test_the_page_is_well_formed_escapes_text_and_marks_the_paper_s_rows(folder):
    page = Page()
    html = (folder / "index.html").read_text()
    page.feed(html)
    assert page.open == []
    assert page.text.count(EVIL) == 4
    assert 'class="paper"' in html
    assert "5 rows" in page.text
    assert "Table 9" in html


def test_means_are_clustered_by_protocol():
    values, protocols = [0.0, 0.0, 1.0, 1.0] * 5, [f"p{k // 2}" for k in range(20)]
    clustered, alone = (mean_cell(values, names, "share") for names in (protocols, [f"p{k}" for k in range(20)]))
    assert clustered.value == alone.value == 0.5
    assert clustered.high - clustered.low > alone.high - alone.low
    assert mean_cell([None, None], ["a", "b"], "share") == FigureCell(value=None, cases=0)
    assert mean_cell([10.0, 10.0], ["a", "b"], "points").value == 10.0


def test_a_row_of_the_paper_has_the_printed_columns_alone():
    columns = (
        FigureColumn(key="ob", heading="OB"),
        FigureColumn(key="step_nav", heading="Step nav"),
        FigureColumn(key="x", heading="X"),
    )
    line = paper_line({"method": "Holodeck", "ob": 10.8, "step_nav": None}, columns)
    assert line == figuring.FigureLine(name="Holodeck", origin="paper", cells={"ob": FigureCell(value=10.8)})
