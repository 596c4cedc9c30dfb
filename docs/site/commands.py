"""Colors for blocks of commands that a page shows without naming a language."""

from __future__ import annotations

from typing import Any

from docutils import nodes
from sphinx.application import Sphinx

COMMANDS = ("labgym ", "make ", "pip ", "dask ", "openssl ", "export ", "python ")


def color_commands(app: Sphinx, doctree: nodes.document) -> None:
    """Highlight blocks without a language that begin with a command as shell commands."""
    for node in doctree.findall(nodes.literal_block):
        if node.get("language", "none") in ("none", "text") and node.astext().startswith(COMMANDS):
            node["language"] = "bash"


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the extension."""
    app.connect("doctree-read", color_commands)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
