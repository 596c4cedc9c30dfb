"""JSON Schemas of labgym's documents: files of the site, to which the names on docs/schemas.md lead."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from generate import DOCUMENTS, schema, schema_name
from sphinx.application import Sphinx

PAGE = "docs/schemas"
NAMES = {document.SCHEMA: schema_name(document) for document in DOCUMENTS}


def link_names(app: Sphinx, docname: str, source: list[str]) -> None:
    """Lead the name of each schema on the page to its file."""
    if docname == PAGE:
        source[0] = re.sub(r"^\| `([^`]+)`", _linked, source[0], flags=re.MULTILINE)


def _linked(match: re.Match[str]) -> str:
    name = match[1]
    return f'| <a href="schemas/{NAMES[name]}.json"><code>{name}</code></a>' if name in NAMES else match[0]


def write_schemas(app: Sphinx, exception: Exception | None) -> None:
    """Write the schemas next to the page."""
    if exception is None and app.builder.format == "html":
        folder = Path(app.outdir) / "docs" / "schemas"
        folder.mkdir(parents=True, exist_ok=True)
        for document in DOCUMENTS:
            (folder / f"{schema_name(document)}.json").write_text(schema(document), encoding="utf-8")


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the extension."""
    app.connect("source-read", link_names)
    app.connect("build-finished", write_schemas)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
