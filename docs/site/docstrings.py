"""Docstrings in the reference of the Python API.

Fields of a class are described in its section "Attributes"; here each description moves to the entry of its field,
which has the type. Names that only pydantic and `Document` use are left out, and so are constants without a docstring.
"""

from __future__ import annotations

import builtins
import inspect
from typing import Any

from docutils import nodes
from generate import SECTION, fields
from pydantic import BaseModel
from sphinx import addnodes
from sphinx.application import Sphinx

MACHINERY = {"model_config", "model_post_init", "ADDED", "SCHEMA"}
"""Members that serve pydantic and `Document`, not the reader."""

PAGES = {"LabPointNavEnv": "docs/environment", "LabFloorNavGoalEnv": "docs/environment"}
"""Classes whose docstring is a page: the reference shows the first paragraph and links to the page."""

VALUES = ("attribute", "property", "data", "type")
"""Kinds of members that are values."""

TYPE = ":type: "


def skip(app: Sphinx, what: str, name: str, member: object, skipped: bool, options: object) -> bool | None:
    """Leave out the machinery, and values of a module that have no docstring."""
    constant = what == "module" and not (inspect.isclass(member) or inspect.isroutine(member))
    return True if name in MACHINERY or constant else None


def arrange(app: Sphinx, what: str, name: str, member: object, options: object, lines: list[str]) -> None:
    """Shorten docstrings that are pages, move descriptions of fields, and list the names of a module."""
    owner, _, last = name.rpartition(".")
    if what == "class" and last in PAGES:
        first = inspect.cleandoc("\n".join(lines)).split("\n\n")[0]
        lines[:] = [*first.splitlines(), "", f"Specified in :doc:`/{PAGES[last]}`.", ""]
    elif what == "class":
        text = "\n".join(lines) + "\n"
        lines[:] = SECTION.sub("", text).splitlines()
        app.env.temp_data.setdefault("labgym_fields", {})[name] = fields(text)
    elif what in VALUES and not any(line.strip() for line in lines):
        described = app.env.temp_data.get("labgym_fields", {}).get(owner, {})
        lines[:] = [described.get(last, ""), ""]
    elif what == "module":
        names = [each for each in getattr(member, "__all__", ()) if not each.isupper()]
        links = ", ".join(f":py:obj:`~{name}.{each}`" for each in names)
        lines += ["", links, ""] if links else []


def hide_fields(
    app: Sphinx, what: str, name: str, member: object, options: object, signature: str | None, returned: str | None
) -> tuple[str, str] | None:
    """Leave out the signature of a pydantic model: its fields follow, each with its type."""
    return ("", "") if what == "class" and isinstance(member, type) and issubclass(member, BaseModel) else None


def rejoin(app: Sphinx, what: str, name: str, member: object, options: object, lines: list[str]) -> None:
    """Put back the words before a colon in the first line of a value, which napoleon takes for a type."""
    place = next((index for index, line in enumerate(lines) if line.startswith(TYPE)), None)
    if what in VALUES and place is not None:
        words = lines.pop(place).removeprefix(TYPE)
        lines[0] = f"{words}: {lines[0]}"


def unlink_builtins(app: Sphinx, doctree: nodes.document) -> None:
    """Show names of Python's own types as text: Sphinx would look for a field of the same name, such as `object`."""
    for node in list(doctree.findall(addnodes.pending_xref)):
        if node["refdomain"] == "py" and hasattr(builtins, node["reftarget"]):
            node.replace_self(nodes.Text(node["reftarget"]))


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the extension: napoleon has priority 500."""
    app.connect("autodoc-skip-member", skip)
    app.connect("autodoc-process-signature", hide_fields)
    app.connect("autodoc-process-docstring", arrange, priority=400)
    app.connect("autodoc-process-docstring", rejoin, priority=600)
    app.connect("doctree-read", unlink_builtins)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
