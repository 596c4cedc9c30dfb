"""STL: triangles without a unit, as text or in binary."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from labgym.assets.meshes.model import LIMITS, Limits, MeshError, MeshPart, RawMesh, bounded_metadata, printable

HEADER, RECORD = 84, 50
MAX_DIGITS = 64
"""Longest number of a text file, characters."""
_TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_NUMBER = rb"[-+]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][-+]?\d+)?|[-+]?(?:nan|inf)(?:inity)?"
_VERTEX = re.compile(
    rb"\bvertex\s+(" + _NUMBER + rb")\s+(" + _NUMBER + rb")\s+(" + _NUMBER + rb")(?=\s)", re.IGNORECASE
)


def read_stl(path: Path, content: bytes, limits: Limits = LIMITS) -> RawMesh:
    """Return the triangles of an STL file; corners with equal coordinates become one vertex.

    Raises:
        MeshError: neither binary nor text STL, cut off, or too many triangles.
    """
    count = int.from_bytes(content[80:84], "little") if len(content) >= HEADER else -1
    if len(content) == HEADER + RECORD * count:
        _check_count(path, count, limits)
        corners = np.frombuffer(content, _TRIANGLE, count, HEADER)["corners"].astype(np.float64)
        title = content[:80].split(b"\0")[0]
    elif content.lstrip()[:5].lower() == b"solid" and b"\0" not in content:
        vertices_text = _VERTEX.findall(content)
        stated = len(re.findall(rb"\bvertex\b", content, re.IGNORECASE))
        if len(vertices_text) != stated or stated % 3:
            raise MeshError(path, "a facet does not have three corners of three numbers; export the STL again")
        _check_count(path, stated // 3, limits)
        if any(len(number) > MAX_DIGITS for corner in vertices_text for number in corner):
            raise MeshError(path, f"has a number of more than {MAX_DIGITS} characters; export the STL again")
        corners = np.array(vertices_text, dtype=f"S{MAX_DIGITS}").astype(np.float64).reshape(-1, 3, 3)
        title = content.lstrip()[5:].split(b"\n", 1)[0]
    else:
        header = f"; its header says {count} triangles, {HEADER + RECORD * count} bytes" if count >= 0 else ""
        raise MeshError(path, f"not an STL file or cut off at {len(content)} bytes{header}; export it again")
    vertices, inverse = np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
    part = MeshPart(path.stem, vertices, inverse.reshape(-1, 3).astype(np.int64))
    name = printable(title.decode("utf-8", "replace"))
    return RawMesh((part,), path.stem, None, None, bounded_metadata({"title": name}))


def _check_count(path: Path, count: int, limits: Limits) -> None:
    if count > limits.faces:
        raise MeshError(path, f"has {count} faces, expected at most {limits.faces}; simplify the mesh")
