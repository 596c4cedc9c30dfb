"""Messages for drawings without walls and rooms: the layers, what is on them, and a doubtful unit."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

from labgym.exchange.dxf import layers
from labgym.exchange.dxf.opening import hidden_layers

if TYPE_CHECKING:
    from ezdxf.document import Drawing

MOST = 6
"""Greatest number of layers that a message names."""
USUAL = (2.0, 200.0)
"""Least and greatest length of the longer side of a floor whose unit is not doubted, meters."""


def nothing_read(drawing: Drawing, scale: float) -> str:
    """Return the problem of a drawing without walls and rooms: its layers, what is on them, its size and the remedy.

    Args:
        scale: meters per unit.
    """
    off, frozen = hidden_layers(drawing)
    named_layers: Counter[str] = Counter()
    other_layers: Counter[str] = Counter()
    kinds: dict[str, set[str]] = {}
    count = 0
    for entity in drawing.modelspace():
        layer = str(entity.dxf.get("layer", "0"))
        count += 1
        kinds.setdefault(layer, set()).add(entity.dxftype())
        (named_layers if layers.role((layer,)) in (layers.WALLS, layers.SPACES) else other_layers)[layer] += 1
    problem = "no wall and no outline of a room"
    if not count:
        paper = any(len(layout) for layout in drawing.layouts if layout.name != "Model")
        return f"{problem}: the model space is empty" + (": move the plan there from the paper space" if paper else "")

    def listed(counts: Counter[str]) -> str:
        names = [
            f"{layer[:40]} ({', '.join(sorted(kinds[layer])[:3])}{_hidden(layer, off, frozen)})"
            for layer, _ in counts.most_common(MOST)
        ]
        return ", ".join(names) + (f" and {len(counts) - MOST} more" if len(counts) > MOST else "")

    if named_layers:
        problem += f" on {listed(named_layers)}: walls are closed rectangles, wide polylines, pairs of lines or hatches"
    else:
        problem += ": no layer is named as one of walls or rooms; "
        problem += f"the layers are {listed(other_layers)}: rename that of the walls"
    width, depth = _size(drawing, scale)
    if width and not USUAL[0] <= max(width, depth) <= USUAL[1]:
        problem += f"; with its unit the drawing is {width:.3g} x {depth:.3g} m: check the unit"
    return f"{problem}; see DXF drawings in docs/engineers.md"


def _hidden(layer: str, off: frozenset[str], frozen: frozenset[str]) -> str:
    name = layer.casefold()
    return "; frozen" if name in frozen else "; off" if name in off else ""


def _size(drawing: Drawing, scale: float) -> tuple[float, float]:
    """Return width and depth of the lines of the model space, meters; zeros without lines."""
    from ezdxf import bbox

    box = bbox.extents(drawing.modelspace().query("LINE LWPOLYLINE POLYLINE ARC HATCH MLINE"), fast=True)
    return (box.size.x * scale, box.size.y * scale) if box.has_data else (0.0, 0.0)
