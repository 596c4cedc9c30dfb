"""Files that users edit: a command replaces one of other content only with --overwrite."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from tyro.conf import arg

from labgym.cli.outcome import written
from labgym.documents import Document, folder_path, json_bytes, parse_json, write_bytes
from labgym.errors import DocumentError, OptionError

Overwrite = Annotated[bool, arg(aliases=("--replace",))]
"""The option --overwrite; --replace, its name in earlier versions of some commands, is an alias."""


def layout_path(out: Path, name: str | None = None) -> Path:
    """Return the .json file of a layout.

    Args:
        out: file, or a folder if there is a name.
        name: name of the file in a folder, without suffix; None if `out` must be a file.

    Raises:
        OptionError: the path does not end in .json, and is not a folder or looks like another kind of file.
    """
    if out.suffix == ".json":
        return out
    if name is None:
        raise OptionError(f"layout file {out.name!r} must end in .json")
    return folder_path(out) / f"{name}.json"


def save(document: Document, path: Path, overwrite: bool) -> int:
    """Write a document, print its path, and return the exit code; a file with the same content stays as it is.

    Raises:
        OptionError: the file exists with other content, and `overwrite` is False.
    """
    refuse_other_content(document, path, overwrite)
    if path.exists() and not overwrite:
        return written(path)
    return written(document.save(path))


def save_text(text: str, path: Path, overwrite: bool) -> int:
    """Write a text, print its path, and return the exit code.

    Raises:
        OptionError: the file exists with other content, and `overwrite` is False.
    """
    return save_bytes(text.encode(), path, overwrite)


def save_bytes(content: bytes, path: Path, overwrite: bool) -> int:
    """Write a file, print its path, and return the exit code.

    Raises:
        OptionError: the file exists with other content, and `overwrite` is False.
    """
    if path.exists() and not overwrite and not (path.is_file() and path.read_bytes() == content):
        raise _other_content(path)
    return written(write_bytes(path, content))


def refuse_other_content(document: Document, path: Path, overwrite: bool) -> None:
    """Raise an error if a document would replace a file of other content.

    Raises:
        OptionError: the file exists with other content, and `overwrite` is False.
    """
    if path.exists() and not overwrite and not _holds(path, document):
        raise _other_content(path)


def _other_content(path: Path) -> OptionError:
    return OptionError(f"{path} exists with other content: name another file, or replace it with --overwrite")


def _holds(path: Path, document: Document) -> bool:
    """Return whether a file has the content of a document, however it is formatted."""
    if not path.is_file():
        return False
    content = path.read_bytes()
    try:
        return content == json_bytes(document.to_json()) or parse_json(content, path) == document.to_json()
    except DocumentError:
        return False
