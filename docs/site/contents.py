"""The navigation of the site: the lists of links in docs/index.md, a section per heading.

A list item that begins with a link to a page is an entry, and the link's text is its title. A code host shows the same
lists, so that the order of the pages is written once and needs no directive in a page.
"""

from __future__ import annotations

import re
from typing import Any

from sphinx.application import Sphinx

HEADING = re.compile(r"^## +(?P<caption>.+?) *$")
ENTRY = re.compile(r"^- \[(?P<title>[^\]]+)\]\((?P<page>[^)#:]+)\.(?:md|rst)\)")


def sections(text: str) -> dict[str, list[tuple[str, str]]]:
    """Return the entries under each heading of level 2 that has some: pairs of title and page without suffix."""
    entries: dict[str, list[tuple[str, str]]] = {}
    caption = ""
    for line in text.splitlines():
        if heading := HEADING.match(line):
            caption = heading["caption"]
        elif entry := ENTRY.match(line):
            entries.setdefault(caption, []).append((entry["title"], entry["page"]))
    return entries


def toctrees(text: str) -> str:
    """Return the hidden tables of contents of a page, as MyST directives."""
    blocks = []
    for caption, entries in sections(text).items():
        lines = [f"{title} <{page}>" for title, page in entries]
        blocks.append("\n".join(["```{toctree}", ":hidden:", f":caption: {caption}", "", *lines, "```"]))
    return "\n\n".join(blocks)


def add_toctrees(app: Sphinx, docname: str, source: list[str]) -> None:
    """Append the tables of contents to the root page."""
    if docname == app.config.root_doc:
        source[0] += f"\n\n{toctrees(source[0])}\n"


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the extension."""
    app.connect("source-read", add_toctrees)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
