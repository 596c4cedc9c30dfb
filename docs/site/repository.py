"""Links from pages to files and folders of the repository that are not pages of the site.

A code host shows such a file or folder. Here the link leads to a page `files/PATH.html`, which shows the text of the
file or the list of the folder's files. A link to a page whose text is the page's file name shows the page's title.
"""

from __future__ import annotations

import html
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from docutils import nodes
from sphinx import addnodes
from sphinx.application import Sphinx

LANGUAGES = {".py": "python", ".yml": "yaml", ".yaml": "yaml", ".json": "json", ".toml": "toml"}
HIDDEN = {"__pycache__", ".venv", ".git"}


def target(app: Sphinx, docname: str, link: str) -> Path | None:
    """Return the path from the root of a file or folder outside docs/ that a link names; None for all other links."""
    if "://" in link or link.startswith("#"):
        return None
    root = Path(app.srcdir).resolve()
    path = (root / docname).parent.joinpath(link.partition("#")[0]).resolve()
    inside = path.is_relative_to(root) and not path.is_relative_to(root / "docs")
    return path.relative_to(root) if inside and path.exists() and path != root else None


def link_files(app: Sphinx, doctree: nodes.document) -> None:
    """Lead links to files and folders of the repository to their pages."""
    docname = app.env.docname
    for node in list(
        doctree.findall(lambda each: isinstance(each, addnodes.download_reference | addnodes.pending_xref))
    ):
        is_file = isinstance(node, addnodes.download_reference)
        if not is_file and node["refdomain"] == "doc" and node.astext().endswith(".md"):
            node["refexplicit"] = False
        if not is_file and (node["reftype"] != "myst" or node["refdomain"] is not None):
            continue
        path = target(app, docname, node["reftarget"])
        if path is None:
            continue
        shown: dict[str, set[str]] = app.env.__dict__.setdefault("labgym_files", {})
        shown.setdefault(docname, set()).add(path.as_posix())
        uri = app.builder.get_relative_uri(docname, f"files/{path.as_posix()}")
        text = node.children[0].children if is_file and node["refexplicit"] else node.children
        node.replace_self(nodes.reference("", "", *text, refuri=uri, internal=True))


def file_pages(app: Sphinx) -> Iterator[tuple[str, dict[str, Any], str]]:
    """Yield the pages of the linked files and folders, and of the files in these folders."""
    root = Path(app.srcdir)
    linked = {path for paths in getattr(app.env, "labgym_files", {}).values() for path in paths}
    folders = [root / name for name in sorted(linked) if (root / name).is_dir()]
    below = {each.relative_to(root).as_posix() for folder in folders for each in folder.iterdir() if _shown(each)}
    for name in sorted(linked | below):
        path, page, title = root / name, f"files/{name}", html.escape(name)
        if path.is_dir():
            body = "".join(_item(app, page, each, root) for each in sorted(path.iterdir()) if each.name not in HIDDEN)
            body = f"<ul>{body}</ul>"
        else:
            language = LANGUAGES.get(path.suffix, "text")
            body = app.builder.highlighter.highlight_block(path.read_text(encoding="utf-8"), language)
        yield page, {"title": title, "body": f"<h1>{title}</h1>{body}", "parents": []}, "page.html"


def _shown(path: Path) -> bool:
    return path.is_file() and path.suffix in LANGUAGES


def _item(app: Sphinx, page: str, path: Path, root: Path) -> str:
    name = html.escape(path.name)
    if not _shown(path):
        return f"<li>{name}{'/' if path.is_dir() else ''}</li>"
    uri = app.builder.get_relative_uri(page, f"files/{path.relative_to(root).as_posix()}")
    return f'<li><a href="{html.escape(uri)}">{name}</a></li>'


def forget(app: Sphinx, env: object, docname: str) -> None:
    """Drop the links of a page that is read again or was removed."""
    getattr(env, "labgym_files", {}).pop(docname, None)


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the extension."""
    app.connect("doctree-read", link_files, priority=100)
    app.connect("env-purge-doc", forget)
    app.connect("html-collect-pages", file_pages)
    return {"parallel_read_safe": False, "parallel_write_safe": True, "env_version": 1}
