"""The files of an ONNX graph: the graph itself and the files that hold its weights, checked before loading."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from labgym.documents import read_bytes
from labgym.errors import DocumentError
from labgym.protobuf import sized_fields

MAX_GRAPH_BYTES = 256 * 2**20
"""Largest size of a graph."""
MAX_WEIGHTS_BYTES = 256 * 2**20
"""Largest sum of the other files of a graph."""
MAX_NODES = 10_000
MAX_FIELDS = 1_000_000
"""Largest number of fields of the parts of a graph that are searched; weights in a graph count as one each."""

PARTS: dict[str, dict[int, str]] = {
    "model": {7: "graph", 20: "training", 25: "function"},
    "graph": {1: "node", 5: "tensor", 15: "sparse tensor"},
    "node": {5: "attribute"},
    "attribute": {5: "tensor", 6: "graph", 10: "tensor", 11: "graph", 22: "sparse tensor", 23: "sparse tensor"},
    "sparse tensor": {1: "tensor", 2: "tensor"},
    "training": {1: "graph", 2: "graph"},
    "tensor": {13: "entry"},
    "entry": {},
}
"""Messages in messages of an ONNX file by field number (onnx.proto3); `entry` is a pair of `external_data`."""
KEY, VALUE = 1, 2


def graph_files(path: Path) -> tuple[Path, ...]:
    """Return the graph's file and the files that hold its weights, sorted by name.

    Raises:
        DocumentError: the file is damaged or exceeds a limit, has local functions, or names weights that are missing or
            outside of its folder.
    """
    content = read_bytes(path, MAX_GRAPH_BYTES)
    try:
        locations = sorted(set(_locations(path, content)))
    except ValueError:
        raise DocumentError(path, "", "is not an ONNX graph (no protocol buffer, or cut off)") from None
    files = [_weights_file(path, location) for location in locations]
    size = sum(file.stat().st_size for file in files)
    if size > MAX_WEIGHTS_BYTES:
        raise DocumentError(path, "external_data", f"weights take {size} bytes; at most {MAX_WEIGHTS_BYTES} are loaded")
    return (path, *files)


def _locations(path: Path, content: bytes) -> Iterator[str]:
    """Yield the location of each tensor whose data are in another file; count nodes and fields."""
    nodes = fields = 0
    waiting = [("model", 0, len(content))]
    while waiting:
        message, start, end = waiting.pop()
        key, values = b"", []
        for number, first, last in sized_fields(content, start, end):
            fields += 1
            part = PARTS[message].get(number)
            nodes += part == "node"
            if nodes > MAX_NODES or fields > MAX_FIELDS:
                raise DocumentError(path, "graph", f"has more than {MAX_NODES} nodes or {MAX_FIELDS} fields")
            if part == "function":
                raise DocumentError(path, "functions", "has local functions, which are not loaded: export it inlined")
            if part is not None:
                waiting.append((part, first, last))
            elif message == "entry" and number == KEY:
                key = content[first:last]
            elif message == "entry" and number == VALUE:
                values.append(content[first:last])
        if key == b"location":
            yield from (value.decode("utf-8", "replace") for value in values)


def _weights_file(path: Path, location: str) -> Path:
    """Return the file of some weights, which must lie in the folder of the graph or below it."""
    home = path.resolve().parent
    try:
        file = (home / location).resolve()
        inside = file.is_relative_to(home)
        exists = inside and file.is_file()
    except (OSError, ValueError, RuntimeError):
        inside = exists = False
    if not exists:
        problem = "is no file" if inside else "is outside of its folder"
        raise DocumentError(path, "external_data", f"{location[:80]!r} {problem}; export it with its weights inside")
    return home / location
