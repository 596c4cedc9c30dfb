from __future__ import annotations

import base64
import re
from html.parser import HTMLParser

import pytest

from labgym.eval.reports.report import Card, Picture, Report, Tile, render_report, write_report
from labgym.table import Table

PNG = base64.b64decode(
    "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNk+M9QDwADhgGAWjR9awAAAABJRU5ErkJggg=="
)
EVIL = '<script>alert("x")</script>'


def page() -> str:
    table = Table(EVIL, ("name", EVIL), ((EVIL, "1"),), (EVIL,))
    cards = (
        Card("a", EVIL, EVIL, Picture("a", PNG), ((EVIL, "1"),), (EVIL,), table),
        Card("b", "B", "", violations=()),
        Card("c", "C", ""),
    )
    return render_report(Report(EVIL, EVIL, (Tile(EVIL, "1"),), (table,), (Picture(EVIL, PNG),), cards, (("k", EVIL),)))


class Page(HTMLParser):
    VOID = frozenset({"meta", "img", "br", "hr", "link", "input"})

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.tags: list[tuple[str, dict[str, str | None]]] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag


@pytest.fixture(scope="module")
def parsed() -> Page:
    parser = Page()
    parser.feed(page())
    return parser


def test_the_page_is_well_formed(parsed):
    assert parsed.open == []


def test_the_page_loads_nothing_and_runs_nothing(parsed):
    assert not [tag for tag, _ in parsed.tags if tag in {"script", "link", "iframe", "object", "embed", "base"}]
    for tag, attributes in parsed.tags:
        assert not [name for name in attributes if name.startswith("on")]
        for name in ("src", "href", "srcset", "data", "poster"):
            address = attributes.get(name)
            assert address is None or address.startswith(("data:image/png;base64,", "#")), (tag, address)
    assert not re.search(r"url\(|@import", page())


def test_names_and_messages_cannot_become_markup():
    assert "<script" not in page()
    assert page().count("&lt;script&gt;") >= 10


def test_the_pictures_travel_inside(parsed):
    sources = [attributes["src"] for tag, attributes in parsed.tags if tag == "img"]
    assert len(sources) == 2
    assert all(base64.b64decode(source.partition(",")[2]) == PNG for source in sources)


def test_every_link_has_its_target(parsed):
    targets = {attributes.get("id") for _, attributes in parsed.tags}
    links = {attributes["href"][1:] for tag, attributes in parsed.tags if tag == "a"}
    assert links == {"top", "layout-a", "layout-b", "layout-c"} <= targets


def test_layouts_say_whether_they_were_scored():
    assert page().count("1 violation<") == 1
    assert page().count("No violations") == 1


def test_the_same_report_gives_the_same_page(tmp_path):
    report = Report("t", "s")
    assert write_report(report, tmp_path / "r.html").read_text() == render_report(report)
