"""The lines of a DXF drawing whatever its form: recovered, blocks exploded, curves as chords."""

from __future__ import annotations

import io
import math
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from labgym.documents import read_bytes
from labgym.errors import DocumentError
from labgym.exchange.dxf import layers
from labgym.exchange.dxf.opening import (
    FAULTS,
    MAX_BYTES,
    MAX_DEPTH,
    MAX_ENTITIES,
    MAX_LINES,
    Context,
    block_name,
    dxf_errors,
    hidden_layers,
)
from labgym.exchange.recognition.picture import Array

if TYPE_CHECKING:
    from ezdxf.document import Drawing
    from ezdxf.entities.dxfentity import DXFEntity

CURVED = ("ARC", "CIRCLE", "ELLIPSE", "SPLINE", "LWPOLYLINE", "POLYLINE", "LINE", "SOLID", "TRACE", "3DFACE")
"""Entities that are read as lines; text, dimensions, hatches and images are not."""
CURVES = ("ELLIPSE", "SPLINE", "LWPOLYLINE", "POLYLINE")
"""Entities that may draw an arc, such as that of a scaled block."""
ROUND = 0.03
"""Greatest distance of points of an arc, and of the middles of its chords, from its circle as a share of the radius."""
CHORDS = (0.95, 1.55)
"""Chords of curves that are read as arcs, of 57 to 102 degrees, as shares of the radius."""
CHORD = 0.01
"""Deviation of chords from a curve as a share of its size."""
MAX_POINTS = 400_000
"""Largest number of points of all lines."""
FARTHEST = 1e9
"""Largest coordinate that is read, in units of the drawing."""


@dataclass(frozen=True)
class Line:
    """A line of a drawing.

    Attributes:
        points: (n, 2) corners, in units of the drawing.
        layer: its layer, or that on which the block around it is inserted.
        role: what the names of the layer and of blocks say.
        arc: center x, y, radius of a circular arc, None for other lines; outside of walls curves count, too.
    """

    points: Array
    layer: str
    role: str | None
    arc: tuple[float, float, float] | None = None

    @property
    def length(self) -> float:
        """Length in units of the drawing."""
        return float(np.hypot(*np.diff(self.points, axis=0).T).sum())

    @property
    def closed(self) -> bool:
        """Whether it ends where it starts."""
        return len(self.points) > 3 and math.dist(self.points[0], self.points[-1]) <= 1e-6 * (1.0 + self.length)


def lines_of(path: Path) -> tuple[list[Line], int, list[str]]:
    """Return the lines of a drawing, its $INSUNITS, and what was left out.

    Raises:
        DocumentError: the file is missing, too large, binary, or damaged beyond recovery.
        MissingDependencyError: ezdxf is not installed.
    """
    layers.load_ezdxf()
    from ezdxf import recover

    raw = read_bytes(path, MAX_BYTES)
    if raw.count(b"\n") + raw.count(b"\r") > 2 * MAX_LINES:
        raise DocumentError(path, "", f"more than {MAX_LINES} lines: keep only walls, doors and outlines")
    try:
        drawing, _ = recover.read(io.BytesIO(raw))
        skipped: Counter[str] = Counter()
        lines = list(_lines(drawing, skipped))
        code = int(drawing.header.get("$INSUNITS", 0))
    except dxf_errors() as error:
        raise DocumentError(path, "", f"not a readable DXF drawing ({str(error)[:120]})") from None
    except FAULTS as error:
        raise DocumentError(path, "", f"a damaged DXF drawing ({type(error).__name__})") from None
    return lines, code, [f"{count} x {what}" for what, count in sorted(skipped.items())]


def _lines(drawing: Drawing, skipped: Counter[str]) -> Iterator[Line]:
    points = 0
    for context, entity in _entities(drawing, skipped):
        kind = entity.dxftype()
        if kind not in CURVED:
            if kind not in ("INSERT", "ATTDEF", "ATTRIB"):
                skipped[kind] += 1
            continue
        line = _line(context, entity)
        if line is None:
            skipped[f"damaged {kind}"] += 1
            continue
        points += len(line.points)
        if points > MAX_POINTS:
            skipped[f"lines after the first {MAX_POINTS} points"] += 1
            return
        yield line


def _line(context: Context, entity: DXFEntity) -> Line | None:
    """Return the line of an entity, None if it has no length or its coordinates are absurd."""
    from ezdxf.path import make_path

    try:
        if entity.dxftype() in ("SOLID", "TRACE", "3DFACE"):
            vertices = list(entity.wcs_vertices())  # type: ignore[attr-defined]
            vertices.append(vertices[0])
        else:
            path = make_path(entity)
            size = max((v.distance(path.start) for v in path.control_vertices()), default=0.0)
            vertices = list(path.flattening(max(CHORD * size, 1e-9), segments=1)) if len(path) else []
        points = np.array([(v.x, v.y) for v in vertices], dtype=np.float64).reshape(-1, 2)
    except FAULTS + dxf_errors():
        return None
    if len(points) < 2 or not np.isfinite(points).all() or np.abs(points).max() > FARTHEST:
        return None
    role = layers.role(context.layers, context.blocks)
    arc = None
    if entity.dxftype() == "ARC":
        arc = _circle(points)
    elif role != layers.WALLS and entity.dxftype() in CURVES:
        for part in (points, points[1:], points[:-1], points[1:-1]):  # a leaf may begin or end at the hinge
            if arc is None and len(part) > 3:
                circle = _circle(part)
                chord = math.dist(part[0], part[-1])
                if circle is not None and CHORDS[0] * circle[2] <= chord <= CHORDS[1] * circle[2]:
                    points, arc = part, circle
    return Line(points, context.layers[0], role, arc)


def _circle(points: Array) -> tuple[float, float, float] | None:
    """Return center x, y and radius of the circle of points (n, 2) of an open arc, None if they lie on none."""
    offset = points - points[0]
    chord = offset[-1]
    aside = np.abs(offset @ (-chord[1], chord[0]))
    if not aside.max() > 1e-3 * float(chord @ chord) > 0.0:
        return None
    corners = np.array([offset[int(aside.argmax())], chord])
    center = np.linalg.solve(2.0 * corners, (corners**2).sum(axis=1))
    radius = float(np.hypot(*center))
    places = np.concatenate([offset, (offset[:-1] + offset[1:]) / 2.0])
    if np.abs(np.hypot(*(places - center).T) - radius).max() > ROUND * radius:
        return None
    x, y = (points[0] + center).tolist()
    return x, y, radius


def _entities(drawing: Drawing, skipped: Counter[str]) -> Iterator[tuple[Context, DXFEntity]]:
    """Yield the visible entities of the model space with those of blocks; what cannot be drawn is counted."""
    off, frozen = hidden_layers(drawing)
    stack: list[tuple[Context, DXFEntity]] = [(Context(), entity) for entity in reversed(list(drawing.modelspace()))]
    count = 0
    while stack:
        around, entity = stack.pop()
        count += 1
        if count > MAX_ENTITIES:
            skipped[f"entities after the first {MAX_ENTITIES}"] += 1
            return
        layer = str(entity.dxf.get("layer", "0"))
        here = around.layers if layer == "0" and around.blocks else (layer, *around.layers)
        name = here[0].casefold()
        if entity.dxf.get("invisible", 0) or name in frozen or (name in off and entity.dxftype() != "INSERT"):
            skipped["hidden entities"] += 1
            continue
        if entity.dxftype() not in ("INSERT", "MLINE"):
            yield Context(here, around.blocks), entity
            continue
        if len(around.blocks) >= MAX_DEPTH:
            skipped["blocks nested too deeply"] += 1
            continue
        inside = Context(here, (block_name(entity), *around.blocks) if entity.dxftype() == "INSERT" else around.blocks)
        room = MAX_ENTITIES - count - len(stack) + 1
        stack += [(inside, part) for part in reversed(_parts(entity, max(room, 0), skipped))]


def _parts(entity: DXFEntity, most: int, skipped: Counter[str]) -> list[DXFEntity]:
    """Return the parts of an inserted block, of an array of blocks or of a multiline, at most some."""
    parts: list[DXFEntity] = []
    try:
        if entity.dxftype() == "INSERT":
            block = entity.block()  # type: ignore[attr-defined]
            if block is None or (block.block is not None and block.block.is_xref):
                skipped[f"block {block_name(entity)[:40]!r}, which is not in the file"] += 1
                return []
            copies: list[Any] = list(islice(entity.multi_insert(), most)) if entity.mcount > 1 else [entity]  # type: ignore[attr-defined]
        else:
            copies = [entity]
        for copy in copies:
            for part in copy.virtual_entities():
                parts.append(part)
                if len(parts) >= most:
                    return parts
    except FAULTS + dxf_errors():
        skipped[f"damaged {entity.dxftype()}"] += 1
    return parts
