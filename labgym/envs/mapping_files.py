"""Files of arguments: configurations of environments and hyperparameters, as JSON or YAML."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from labgym.documents import read_json, read_yaml
from labgym.errors import DocumentError

MAX_FILE_BYTES = 2**18
"""Largest size of a file; PyYAML takes 20 s for a megabyte."""
_PLACE = re.compile(r"[^\W\d][\w.]*:[^\W\d][\w.]*")
"""A class or a function as "module:name", which is imported and called."""


def read_mapping(path: str | Path) -> Mapping[str, Any]:
    """Return the mapping in a .json or .yaml file, which is data: it may name no code.

    Raises:
        DocumentError: the file cannot be read, exceeds the limits of documents, holds something else than a mapping, or
            names a class or a function as "module:name".
        MissingDependencyError: PyYAML is not installed.
    """
    path = Path(path)
    if path.suffix in (".yaml", ".yml"):
        data = read_yaml(path, MAX_FILE_BYTES, f"reading {path.name}")
    else:
        data = read_json(path, MAX_FILE_BYTES)
    if not isinstance(data, Mapping):
        raise DocumentError(path, "", f"holds a {type(data).__name__}, expected a mapping of arguments")
    for text in _texts(data):
        if _PLACE.fullmatch(text):
            raise DocumentError(
                path, "", f"names the code {text[:80]!r}, which runs; if you trust it, pass the content as a mapping"
            )
    return data


def _texts(data: Any) -> Iterator[str]:
    """Yield the texts in plain data."""
    if isinstance(data, str):
        yield data
    elif isinstance(data, Mapping):
        for value in data.values():
            yield from _texts(value)
    elif isinstance(data, list | tuple | set):
        for value in data:
            yield from _texts(value)
