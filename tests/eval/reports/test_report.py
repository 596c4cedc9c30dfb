"""The site of a run: hostile names do no harm, pictures are files beside the page, and links have targets."""

from __future__ import annotations

from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import pytest

from labgym.eval.labnav.suites import CHECK
from labgym.eval.reports.report import Card
from labgym.eval.reports.site.page import render_site, site_of, write_site
from labgym.table import Table

EVIL = '<script>alert("x")</script>'


def site():
    table = Table(EVIL, ("name", EVIL), ((EVIL, "1"),), (EVIL,))
    cards = (
        Card("a", EVIL, EVIL, "pictures/a.png", ((EVIL, "1"),), (EVIL,), table),
        Card("b", "B", "", violations=()),
        Card("c", "C", ""),
    )
    empty = site_of((), CHECK, Path(), EVIL, problems=(EVIL,), facts=(("k", EVIL),))
    return replace(empty, tables=(table,), views=((EVIL, "views/a.png"),), cards=cards)


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
    parser.feed(render_site(site()))
    return parser


def test_the_page_is_well_formed(parsed):
    assert parsed.open == []


def test_the_page_refers_only_to_itself_and_to_pictures_of_its_folder(parsed):
    for tag, attributes in parsed.tags:
        assert not [name for name in attributes if name.startswith("on")]
        for name in ("src", "href", "srcset", "poster"):
            address = attributes.get(name)
            assert address is None or address.startswith(("#", "pictures/", "views/")), (tag, address)
    assert [attributes["src"] for tag, attributes in parsed.tags if tag == "img"] == ["views/a.png", "pictures/a.png"]


def test_names_and_messages_cannot_become_markup():
    page = render_site(site())
    assert "<script>alert" not in page
    assert page.count("&lt;script&gt;") >= 10


def test_every_link_has_its_target(parsed):
    targets = {attributes.get("id") for _, attributes in parsed.tags}
    links = {attributes["href"][1:] for tag, attributes in parsed.tags if tag == "a"}
    assert links == {"main", "laboratories", "about"} <= targets


def test_layouts_say_whether_they_were_scored():
    page = render_site(site())
    assert page.count("1 violation<") == 1
    assert page.count("No violations") == 1


def test_the_same_results_give_the_same_page(tmp_path):
    assert write_site(site(), tmp_path / "r.html").read_text() == render_site(site())
    assert [path.name for path in tmp_path.iterdir()] == ["r.html"]
