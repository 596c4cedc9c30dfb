"""Wavefront OBJ: polygons with the colors of an MTL file in the same folder."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from labgym.assets.meshes.model import (
    LIMITS,
    Limits,
    MeshError,
    MeshPart,
    RawMesh,
    Rgba,
    bounded_metadata,
    printable,
)
from labgym.assets.meshes.polygons import triangulate

MAX_MTL_BYTES = 1024**2


@dataclass
class _Group:
    counts: list[int] = field(default_factory=list)
    corners: list[int] = field(default_factory=list)


def read_obj(path: Path, content: bytes, limits: Limits = LIMITS) -> RawMesh:
    """Return the polygons of an OBJ file, one part for each object and material.

    Colors come from MTL files in the OBJ's own folder; a library named elsewhere is not opened. Curves, lines,
    normals and texture coordinates are passed over.

    Raises:
        MeshError: a line that cannot be read, an index out of range, or too many vertices or faces.
    """
    vertices: list[tuple[float, float, float]] = []
    groups: dict[tuple[str, str], _Group] = {}
    colors: dict[str, Rgba] = {}
    title, thing, material, faces = "", path.stem, "", 0
    for number, line in enumerate(content.decode("utf-8", "replace").replace("\\\n", " ").split("\n"), start=1):
        keyword, _, rest = line.strip().partition(" ")
        try:
            if keyword == "v":
                x, y, z = rest.split()[:3]
                vertices.append((float(x), float(y), float(z)))
            elif keyword == "f":
                corners = [_index(token, len(vertices)) for token in rest.split()]
                group = groups.setdefault((thing, material), _Group())
                group.counts.append(len(corners))
                group.corners += corners
                faces += len(corners) - 2
            elif keyword in ("o", "g"):
                thing = printable(rest) or thing
                title = title or (thing if keyword == "o" else "")
            elif keyword == "usemtl":
                material = printable(rest)
            elif keyword == "mtllib":
                colors |= _colors(path, rest.strip())
        except ValueError as error:
            raise MeshError(path, f"line {number}: {error}; expected a Wavefront OBJ file") from None
        if len(vertices) > limits.vertices or faces > limits.faces:
            most = f"{limits.vertices} vertices and {limits.faces} faces"
            raise MeshError(path, f"has more than {most}; simplify the mesh")
    points = np.array(vertices, dtype=np.float64).reshape(-1, 3)
    parts = [_part(path, points, key, group, colors) for key, group in groups.items()]
    return RawMesh(tuple(parts), title or path.stem, None, None, bounded_metadata({"title": title}))


def _index(token: str, count: int) -> int:
    """Return the zero-based vertex of a corner such as "7", "7/1/2" or "-1"."""
    number = int(token.partition("/")[0])
    index = number - 1 if number > 0 else count + number
    if number == 0 or not 0 <= index < count:
        raise ValueError(f"corner {number} names no vertex, {count} are defined before it")
    return index


def _part(path: Path, points: np.ndarray, key: tuple[str, str], group: _Group, colors: dict[str, Rgba]) -> MeshPart:
    thing, material = key
    try:
        faces, _ = triangulate(points, np.array(group.counts), np.array(group.corners, dtype=np.int64))
    except ValueError as error:
        raise MeshError(path, f"object {thing!r}: {error}; triangulate the mesh before export") from None
    used, compact = np.unique(faces, return_inverse=True)
    return MeshPart(thing, points[used], compact.reshape(-1, 3), colors.get(material), material or None)


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
        return min(max(float(text), 0.0), 1.0)
    except ValueError:
        return 0.0
