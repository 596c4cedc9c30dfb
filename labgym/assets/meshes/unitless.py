"""STL and Wavefront OBJ: meshes without a unit, with the colors of an MTL file in the OBJ's folder."""

from __future__ import annotations

import io
import math
import re
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path

import numpy as np

from labgym.assets.meshes.model import (
    LIMITS,
    MeshError,
    MeshLimits,
    MeshPart,
    RawMesh,
    Rgba,
    bounded_metadata,
    printable,
)
from labgym.assets.meshes.polygons import triangulate

HEADER, RECORD = 84, 50
MAX_DIGITS = 64
"""Longest number of a text file, characters."""
_TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_NUMBER = rb"[-+]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][-+]?\d+)?|[-+]?(?:nan|inf)(?:inity)?"
_VERTEX = re.compile(
    rb"\bvertex\s+(" + _NUMBER + rb")\s+(" + _NUMBER + rb")\s+(" + _NUMBER + rb")(?=\s)", re.IGNORECASE
)


def read_stl(path: Path, content: bytes, limits: MeshLimits = LIMITS) -> RawMesh:
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


def _check_count(path: Path, count: int, limits: MeshLimits) -> None:
    if count > limits.faces:
        raise MeshError(path, f"has {count} faces, expected at most {limits.faces}; simplify the mesh")


MAX_MTL_BYTES, MAX_LIBRARIES = 1024**2, 16
"""Bytes that are read of a material library, and libraries that are read of an OBJ; further ones give no colors."""


@dataclass
class _Group:
    counts: list[int] = field(default_factory=list)
    corners: list[int] = field(default_factory=list)


def read_obj(path: Path, content: bytes, limits: MeshLimits = LIMITS) -> RawMesh:
    """Return the polygons of an OBJ file, one part for each object and material.

    Colors come from MTL files in the OBJ's own folder; a library named elsewhere is not opened. Curves, lines,
    normals and texture coordinates are passed over.

    Raises:
        MeshError: a line that cannot be read, an index out of range, or too many vertices, faces or parts.
    """
    vertices: list[tuple[float, float, float]] = []
    groups: dict[tuple[str, str], _Group] = {}
    libraries: dict[str, None] = {}
    title, thing, material, faces = "", path.stem, "", 0
    # A list of all lines of a file would take 20 times its size.
    for number, line in enumerate(io.BytesIO(content.replace(b"\\\n", b" ")), start=1):
        keyword, _, rest = line.decode("utf-8", "replace").strip().partition(" ")
        try:
            if keyword == "v":
                x, y, z = rest.split()[:3]
                vertices.append((float(x), float(y), float(z)))
            elif keyword == "f":
                corners = [_index(token, len(vertices)) for token in rest.split()]
                group = groups.setdefault((thing, material), _Group())
                group.counts.append(len(corners))
                group.corners += corners
                faces += max(len(corners) - 2, 1)
            elif keyword in ("o", "g"):
                thing = printable(rest) or thing
                title = title or (thing if keyword == "o" else "")
            elif keyword == "usemtl":
                material = printable(rest)
            elif keyword == "mtllib" and len(libraries) < MAX_LIBRARIES:
                libraries[rest.strip()] = None
        except ValueError as error:
            raise MeshError(path, f"line {number}: {error}; expected a Wavefront OBJ file") from None
        if len(vertices) > limits.vertices or faces > limits.faces or len(groups) > limits.parts:
            most = f"{limits.vertices} vertices, {limits.faces} faces and {limits.parts} parts"
            raise MeshError(path, f"has more than {most}; simplify the mesh")
    points = np.array(vertices, dtype=np.float64).reshape(-1, 3)
    sizes = np.array([count for group in groups.values() for count in group.counts], dtype=np.int64)
    indices = np.array([corner for group in groups.values() for corner in group.corners], dtype=np.int64)
    try:
        triangles, owners = triangulate(points, sizes, indices)
    except ValueError as error:
        raise MeshError(path, f"{error}; triangulate the mesh before export") from None
    ends = np.cumsum([0, *(len(group.counts) for group in groups.values())])
    bounds = np.searchsorted(owners, ends).tolist()
    colors = {name: color for library in libraries for name, color in _colors(path, library).items()}
    parts = []
    for (name, look), (first, end) in zip(groups, pairwise(bounds), strict=True):
        used, compact = np.unique(triangles[first:end], return_inverse=True)
        parts.append(MeshPart(name, points[used], compact.reshape(-1, 3), colors.get(look), look or None))
    return RawMesh(tuple(parts), title or path.stem, None, None, bounded_metadata({"title": title}))


def _index(token: str, count: int) -> int:
    """Return the zero-based vertex of a corner such as "7", "7/1/2" or "-1"."""
    number = int(token.partition("/")[0])
    index = number - 1 if number > 0 else count + number
    if number == 0 or not 0 <= index < count:
        raise ValueError(f"corner {number} names no vertex, {count} are defined before it")
    return index


def _colors(path: Path, name: str) -> dict[str, Rgba]:
    """Return diffuse color and opacity of each material of an MTL file in the same folder, or nothing."""
    library = path.parent / name
    try:
        if Path(name).name != name or not library.is_file() or library.resolve().parent != path.resolve().parent:
            return {}
        with library.open("rb") as stream:
            text = stream.read(MAX_MTL_BYTES).decode("utf-8", "replace")
    except OSError:  # a name that the file system does not take, or a file that cannot be read: no colors
        return {}
    materials: dict[str, Rgba] = {}
    current = ""
    for line in text.splitlines():
        keyword, _, rest = line.strip().partition(" ")
        values = rest.split()
        if keyword == "newmtl":
            current = printable(rest)
            materials[current] = (0.8, 0.8, 0.8, 1.0)
        elif current and keyword == "Kd" and len(values) >= 3:
            red, green, blue = (_share(value) for value in values[:3])
            materials[current] = (red, green, blue, materials[current][3])
        elif current and keyword in ("d", "Tr") and values:
            share = _share(values[-1])
            materials[current] = (*materials[current][:3], share if keyword == "d" else 1.0 - share)
    return materials


def _share(text: str) -> float:
    try:
        share = float(text)
    except ValueError:
        return 0.0
    return 0.0 if math.isnan(share) else min(max(share, 0.0), 1.0)
