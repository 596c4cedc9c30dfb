"""What the theme leaves out for keyboards and screen readers; axe finds nothing serious afterwards."""

from __future__ import annotations

import re
from typing import Any

from docutils import nodes
from sphinx.application import Sphinx

PARAMETERS = re.compile(r"<dl>\n((?:<dd>[^\n]*</dd>\n)+)</dl>")
"""The parameters of a signature, which Sphinx writes as a list of definitions without terms."""
SCROLLING = re.compile(r'<(pre|div class="table-wrapper[^"]*"|div class="formula")>')
"""Boxes that scroll if their content is too wide."""


def mend(app: Sphinx, page: str, template: str, context: dict[str, Any], doctree: nodes.document | None) -> None:
    """Give headings of the navigation a level, let the keyboard scroll, and make signatures lists."""
    if "furo_navigation_tree" in context:
        tree = context["furo_navigation_tree"]
        context["furo_navigation_tree"] = tree.replace('role="heading"', 'role="heading" aria-level="2"')
    if "body" in context:
        body = PARAMETERS.sub(_listed, context["body"])
        context["body"] = SCROLLING.sub(r'<\1 tabindex="0">', body)


def _listed(match: re.Match[str]) -> str:
    items = match[1].replace("<dd>", "<li>").replace("</dd>", "</li>")
    return f'<ul class="parameters">\n{items}</ul>'


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the extension, after the theme."""
    app.connect("html-page-context", mend, priority=900)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
