from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from labgym.artefacts import artefacts
from labgym.cli import main
from labgym.envs.tasks import each_layout
from labgym.errors import DocumentError, OptionError
from labgym.eval import aggregate, score
from labgym.eval.scoring import many
from labgym.eval.scoring.many import read_scores, score_layouts
from labgym.layouts import Placement, generate, load_published
from labgym.runs import ExecutorOptions

NAMES = ("test-sub_01", "test-sub_02", "test-red_01")


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    """A folder of three layouts, with one of them in a subfolder."""
    folder = tmp_path_factory.mktemp("layouts")
    (folder / "more").mkdir()
    for name, place in zip(NAMES, (folder, folder / "more", folder), strict=True):
        shutil.copy(artefacts("layouts") / "test" / f"{name}.json", place)
    return folder


@pytest.fixture(scope="module")
def alone(folder):
    return {name: score(load_published("test", name)) for name in NAMES}


@pytest.mark.cases(1)
@pytest.mark.parametrize("workers", [1, 2])
def test_scores_are_those_of_each_layout_alone_in_the_order_of_the_names(alone, tmp_path, workers, monkeypatch):
    monkeypatch.setattr(many, "PER_SHARD", 1)
    out = tmp_path / "scores"
    options = ExecutorOptions(workers=workers)
    reports = list(score_layouts(lambda: each_layout(NAMES), out, executor=options, progress=False))
    assert reports == [alone[name] for name in NAMES]
    assert list(read_scores(out)) == reports
    assert sorted(path.name for path in out.iterdir() if not path.name.startswith(".")) == [
        "manifest.json", "provenance.jsonl", "run.json", "scores.jsonl",
    ]  # fmt: skip


def test_an_interrupted_command_does_not_score_a_finished_layout_again(alone, tmp_path, monkeypatch):
    monkeypatch.setattr(many, "PER_SHARD", 1)
    calls = []

    def counted(layout, *arguments):
        calls.append(layout.id)
        if len(calls) == 2:
            raise KeyboardInterrupt
        return alone[layout.id]

    monkeypatch.setattr(many, "score", counted)
    with pytest.raises(KeyboardInterrupt):
        list(score_layouts(lambda: each_layout(NAMES), tmp_path / "s", progress=False))
    assert list(score_layouts(lambda: each_layout(NAMES), tmp_path / "s", progress=False)) == list(alone.values())
    assert calls == [NAMES[0], NAMES[1], NAMES[1], NAMES[2]]


def test_a_folder_of_other_scores_is_refused_by_what_differs(tmp_path):
    out = tmp_path / "scores"
    list(score_layouts(lambda: each_layout(NAMES[:1]), out, progress=False))
    with pytest.raises(
        OptionError, match=r'differs in layouts, count \(1 there, 2 requested\), profile \("default" th'
    ):
        list(score_layouts(lambda: each_layout(NAMES[:2]), out, profile="strict", progress=False))


def test_the_command_prints_the_means_over_a_folder_and_writes_the_rows(folder, alone, tmp_path, capsys):
    passing = sum(report.passed for report in alone.values())
    assert main(["score", str(folder), "--out", str(tmp_path / "s"), "--check"]) == int(passing < 3)
    printed = capsys.readouterr().out
    assert "Layout metrics, 3 layouts" in printed
    assert f"{passing} of 3 layouts pass" in printed
    rows = [json.loads(line) for line in (tmp_path / "s" / "scores.jsonl").read_text().splitlines()]
    assert sorted(row["layout"] for row in rows) == sorted(NAMES)
    assert main(["score", *NAMES, "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == aggregate(alone.values()).to_json()


def test_a_layout_with_a_violation_is_named_and_fails_the_check(tmp_path, capsys):
    layout = generate("sub_01", seed=3)
    item = next(item for item in layout.placements if item.support == "floor")
    twin = Placement(**(dict(item) | {"id": "twin"}))
    paths = [
        str(layout.replace(id="whole").save(tmp_path / "whole.json")),
        str(layout.replace(id="broken", placements=(*layout.placements, twin)).save(tmp_path / "broken.json")),
    ]
    assert main(["score", *paths, "--check"]) == 1
    assert "1 of 2 layouts pass; failing: broken" in capsys.readouterr().out
    assert main(["score", *paths]) == 0


def test_a_broken_row_is_named(tmp_path):
    (tmp_path / "scores.jsonl").write_text('{"schema": "labgym.layout-report/1"}\n')
    with pytest.raises(DocumentError, match=r"scores.jsonl:1: field layout"):
        list(read_scores(tmp_path))
    with pytest.raises(OptionError, match="holds no scores"):
        list(read_scores(tmp_path / "none"))
