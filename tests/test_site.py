"""The site builds without warnings and without network, and every link inside it leads to a place that exists."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

import pytest
from headless_browser import browser, chromium

pytest.importorskip("sphinx", reason="the extra docs is not installed")

ROOT = Path(__file__).resolve().parents[1]


class Page(HTMLParser):
    """Links, ids and headings of a page."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.links: set[str] = set()
        self.ids: set[str] = set()
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        for name, value in attrs:
            if value and name in ("href", "src"):
                self.links.add(value)
            elif value and name in ("id", "name"):
                self.ids.add(value)


@pytest.fixture(scope="module")
def site(tmp_path_factory) -> Path:
    """The built site, with warnings as errors and every connection refused."""
    folder = tmp_path_factory.mktemp("site")
    refused = {f"{name}_proxy": "http://127.0.0.1:9" for name in ("http", "https", "all")}
    done = subprocess.run(
        [sys.executable, "-m", "sphinx", "-q", "-W", "--keep-going", "-c", "docs", ".", str(folder)],
        cwd=ROOT,
        env={**os.environ, **refused},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return folder


@pytest.fixture(scope="module")
def pages(site) -> dict[Path, Page]:
    return {path: Page(path) for path in site.rglob("*.html")}


def inner_links(pages: dict[Path, Page]) -> Iterator[tuple[Path, str, Path, str]]:
    """Yield page, link, file and anchor of every link without a host."""
    for path, page in pages.items():
        for link in page.links:
            parts = urlsplit(link)
            if not (parts.scheme or parts.netloc):
                yield path, link, (path.parent / unquote(parts.path)).resolve() if parts.path else path, parts.fragment


def test_every_link_inside_the_site_leads_somewhere(site, pages):
    broken = [
        f"{path.relative_to(site)}: {link}"
        for path, link, file, anchor in inner_links(pages)
        if not file.is_file() or (anchor and file in pages and unquote(anchor) not in pages[file].ids)
    ]
    assert not broken, "\n".join(broken)
    assert sum(1 for _ in inner_links(pages)) > 1000


def test_the_site_fetches_nothing_from_elsewhere(pages):
    for path, page in pages.items():
        fetched = [link for link in page.links if link.startswith("//") or link.endswith((".js", ".css", ".woff2"))]
        assert not [link for link in fetched if "//" in link], path


def test_every_page_of_the_documentation_is_in_the_navigation(site, pages):
    landing = pages[site / "docs/index.html"].links
    for source in [*ROOT.glob("docs/*.md"), *ROOT.glob("docs/tutorials/*.md"), *ROOT.glob("policies/*/CARD.md")]:
        name = source.relative_to(ROOT).with_suffix(".html").as_posix()
        href = name.removeprefix("docs/") if name.startswith("docs/") else f"../{name}"
        assert href in landing or name == "docs/index.html", name


def test_the_root_of_the_site_forwards_to_the_landing_page(site, pages):
    assert "docs/index.html" in pages[site / "index.html"].links


def test_formulas_are_mathml(pages, site):
    text = (site / "docs/labnav-tasks.html").read_text(encoding="utf-8")
    assert text.count("<math") >= 8
    assert "$" not in text.partition("<article")[2].partition("</article>")[0]


@pytest.mark.parametrize("name", ["labgym.envs.LabPointNavEnv", "labgym.policies.Policy", "labgym.layouts.generate"])
def test_public_names_are_in_the_reference(name, pages):
    assert any(name in page.ids for page in pages.values())


def test_a_link_named_by_its_file_shows_the_title_of_the_page(site):
    text = (site / "docs/training.html").read_text(encoding="utf-8")
    assert ">environment.md<" not in text
    assert ">LabPointNav<" in text


def test_blocks_of_commands_are_highlighted(site):
    text = (site / "docs/training.html").read_text(encoding="utf-8")
    assert "highlight-bash" in text.partition("pip")[0]


FOUND = "[...document.querySelectorAll('#search-results li a')].map(link => link.getAttribute('href'))"


@pytest.mark.skipif(chromium() is None, reason="no Chromium is installed")
def test_the_search_finds_the_guide_that_a_newcomer_means_among_its_first_three_pages(site, tmp_path):
    words = json.loads((ROOT / "tests" / "search_words.json").read_text(encoding="utf-8"))
    missed = []
    with browser(tmp_path) as tab:
        for word, guides in words.items():
            tab.open(f"{(site / 'search.html').as_uri()}?q={word.replace(' ', '+')}", 1200, 900)
            tab.wait("/finished|did not match/.test((document.querySelector('.search-summary') || {}).innerText)")
            pages = dict.fromkeys(re.split("[?#]", link)[0].removesuffix(".html") for link in tab.value(FOUND))
            if not any(page.endswith(guide) for page in list(pages)[:3] for guide in guides):
                missed.append(word)
    assert len(missed) <= len(words) // 10, missed
