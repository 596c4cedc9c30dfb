"""Opens untrusted DXF files within limits of size, entities and nesting, and yields their contents."""

from __future__ import annotations

import io
import math
import struct
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from labgym.documents import read_bytes
from labgym.errors import DocumentError, OptionError
from labgym.exchange.dxf import layers
from labgym.exchange.dxf.layers import load_ezdxf
from labgym.geometry.frames import PlanarPose

if TYPE_CHECKING:
    from ezdxf.document import Drawing
if TYPE_CHECKING:
    from ezdxf.document import Drawing
    from ezdxf.entities.dxfentity import DXFEntity
    from ezdxf.entities.insert import Insert


MAX_BYTES = 16 * 1024 * 1024
MAX_LINES = 1_000_000
"""Largest number of lines of a file; ezdxf takes up to 400 bytes of memory for each pair of lines."""
MAX_ENTITIES = 50_000
"""Largest number of entities of a drawing, with those of inserted blocks counted each time."""
MAX_DEPTH = 6
"""Deepest nesting of blocks."""
UNITS = {"in": 0.0254, "ft": 0.3048, "mm": 0.001, "cm": 0.01, "dm": 0.1, "m": 1.0}
"""Meters per unit of a drawing."""
CODES = {1: "in", 2: "ft", 4: "mm", 5: "cm", 6: "m", 14: "dm"}
"""Values of $INSUNITS that are read."""
FARTHEST = 2e7
"""Largest coordinate of a drawing, meters: those of national grids are below."""
ORIGIN = "LABGYM_ORIGIN"
"""Property of a drawing that labgym wrote: pose x, y, yaw of the floor's frame, meters and radians."""
XREF_FLAGS = 4 | 8 | 32
"""Flags of blocks that refer to other files."""

FAULTS = (
    ArithmeticError,
    AssertionError,
    AttributeError,
    LookupError,
    OSError,
    RecursionError,
    RuntimeError,
    TypeError,
    ValueError,
    struct.error,
)
"""Errors that ezdxf raises on damaged files besides its own."""
MOST = 6
"""Greatest number of layers that a message names."""
USUAL = (2.0, 200.0)
"""Least and greatest length of the longer side of a floor whose unit is not doubted, meters."""


def open_drawing(path: str | Path) -> Drawing:
    """Return the drawing in a DXF text file.

    Raises:
        DocumentError: the file is missing, too large, binary, damaged or refers to other files.
        MissingDependencyError: ezdxf is not installed.
    """
    ezdxf = load_ezdxf()
    raw = _content(Path(path))
    try:
        text = raw.decode("utf-8")
    except UnicodeDecodeError:
        text = raw.decode("cp1252", "replace")
    try:
        drawing: Drawing = ezdxf.read(io.StringIO(text.replace("\r\n", "\n").replace("\r", "\n")))
        blocks = list(drawing.blocks)
    except dxf_errors() as error:
        raise DocumentError(path, "", f"not a readable DXF drawing ({str(error)[:120]})") from None
    except FAULTS as error:
        raise DocumentError(path, "", f"a damaged DXF drawing ({type(error).__name__})") from None
    for block in blocks:
        if block.block is not None and int(block.block.dxf.get("flags", 0)) & XREF_FLAGS:
            raise DocumentError(path, "", f"block {block.name[:60]!r} refers to another file: bind or remove the XREF")
    return drawing


def dxf_errors() -> tuple[type[Exception], ...]:
    """Return the errors of ezdxf, some of which are none of `FAULTS`."""
    load_ezdxf()
    from ezdxf.lldxf.const import DXFError

    return (DXFError,)


def meters_per_unit(drawing: Drawing, path: str | Path, unit: str | None) -> float:
    """Return the length of a unit of a drawing in meters.

    Args:
        unit: in, ft, mm, cm, dm or m; None for the drawing's $INSUNITS.

    Raises:
        OptionError: the unit is unknown.
        DocumentError: the drawing has no unit, or one that is not read.
    """
    if unit is not None:
        if unit not in UNITS:
            raise OptionError(f"unit {unit[:20]!r} must be one of {', '.join(UNITS)}")
        return UNITS[unit]
    code = drawing.header.get("$INSUNITS", 0)
    if code not in CODES:
        what = "no unit" if code == 0 else f"the unit {code}"
        raise DocumentError(
            path,
            "$INSUNITS",
            f"the drawing has {what}: set it, or read the floor with labgym outline --unit {'|'.join(UNITS)}",
        )
    return UNITS[CODES[code]]


def placed_at(drawing: Drawing, path: str | Path) -> PlanarPose:
    """Return the pose of the floor's frame in a drawing that labgym wrote; zeros for other drawings.

    Raises:
        DocumentError: the property of the drawing is no pose.
    """
    text = str(drawing.header.custom_vars.get(ORIGIN, "0 0 0"))
    try:
        x, y, yaw = (float(value) for value in text[:100].split())
    except ValueError:
        x = y = yaw = math.nan
    if not (abs(x) <= FARTHEST and abs(y) <= FARTHEST and abs(yaw) <= math.tau):
        raise DocumentError(path, ORIGIN, f"{text[:40]!r} is no pose: remove this property of the drawing")
    return x, y, yaw


@dataclass(frozen=True)
class Context:
    """Where an entity is drawn: its layer, then those of the blocks around it, and the names of these blocks."""

    layers: tuple[str, ...] = ()
    blocks: tuple[str, ...] = ()


def entities(drawing: Drawing, path: str | Path) -> Iterator[tuple[Context, DXFEntity]]:
    """Yield the visible entities of a drawing's model space.

    The content of an inserted block follows the block, and the lines of a multiline follow the multiline.
    Entities are invisible if they are marked so, as in the unused states of dynamic blocks, or if their layer is off or
    frozen. As in CAD programs, a frozen layer hides all of a block that is inserted on it, one that is off does not.

    Raises:
        DocumentError: there are too many entities, a block is not defined, or blocks are nested too deeply.
    """
    off, frozen = hidden_layers(drawing)
    count = 0
    stack: list[tuple[Context, DXFEntity]] = [(Context(), entity) for entity in reversed(list(drawing.modelspace()))]
    while stack:
        around, entity = stack.pop()
        count += 1
        if count > MAX_ENTITIES:
            raise DocumentError(path, "", f"more than {MAX_ENTITIES} entities: keep only walls, doors and outlines")
        layer = str(entity.dxf.get("layer", "0"))
        # Entities of a block on layer 0 are drawn on the layer on which the block is inserted.
        here = around.layers if layer == "0" and around.blocks else (layer, *around.layers)
        if entity.dxf.get("invisible", 0) or here[0].casefold() in frozen:
            continue
        if here[0].casefold() not in off:
            yield Context(here, around.blocks), entity
        if entity.dxftype() == "INSERT":
            if len(around.blocks) >= MAX_DEPTH:
                raise DocumentError(path, "", f"blocks are nested deeper than {MAX_DEPTH} levels")
            inside = Context(here, (block_name(entity), *around.blocks))
            stack += [(inside, part) for part in reversed(_parts(entity, path))]  # type: ignore[arg-type]
        elif entity.dxftype() == "MLINE":
            lines: list[DXFEntity] = list(entity.virtual_entities())  # type: ignore[attr-defined]
            stack += [(around, line) for line in reversed(lines)]


def _parts(insert: Insert, path: str | Path) -> list[DXFEntity]:
    """Return the content of an inserted block in the coordinates of the drawing, without nested blocks' content."""
    if max(insert.dxf.get("row_count", 1), insert.dxf.get("column_count", 1)) > 1:
        raise DocumentError(path, "", f"block {block_name(insert)!r} is inserted as an array: explode it")
    if insert.block() is None:
        raise DocumentError(path, "", f"block {block_name(insert)!r} is inserted but not defined: define or delete it")
    return list(insert.virtual_entities())


def hidden_layers(drawing: Drawing) -> tuple[frozenset[str], frozenset[str]]:
    """Return the case-folded names of the layers that are off, and of those that are frozen."""
    layers = list(drawing.layers)
    off = frozenset(str(layer.dxf.name).casefold() for layer in layers if layer.is_off())
    return off, frozenset(str(layer.dxf.name).casefold() for layer in layers if layer.is_frozen())


def block_name(insert: DXFEntity) -> str:
    """Return the name of the block that an INSERT draws."""
    return str(insert.dxf.get("name", ""))[:80]


def _content(path: Path) -> bytes:
    raw = read_bytes(path, MAX_BYTES)
    if raw.startswith(b"AutoCAD Binary DXF"):
        raise DocumentError(path, "", "a binary DXF file: save it as DXF text")
    if raw.count(b"\n") + raw.count(b"\r") > MAX_LINES:
        raise DocumentError(path, "", f"more than {MAX_LINES} lines: keep only walls, doors and outlines")
    return raw


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
