"""Blocks of DXF drawings: doors with their swing, windows, columns and furniture, with attributes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from labgym.assets import Asset
from labgym.exchange.dxf import layers

if TYPE_CHECKING:
    from ezdxf.document import Drawing
    from ezdxf.layouts.blocklayout import BlockLayout
    from ezdxf.layouts.layout import Modelspace

DOOR_LEFT, DOOR_RIGHT, WINDOW, GLAZING, PASSAGE = "DOOR_LEFT", "DOOR_RIGHT", "WINDOW", "GLAZING", "PASSAGE"
COLUMN, KEEP_OUT, SERVICE, SPACE_TAG = "COLUMN", "KEEP_OUT", "SERVICE", "SPACE_TAG"
ATTRIBUTE_HEIGHT = 0.08

ATTRIBUTES: dict[str, tuple[str, ...]] = {
    DOOR_LEFT: ("KIND", "WIDTH", "HEIGHT", "SILL", "STATE", "ANGLE"),
    DOOR_RIGHT: ("KIND", "WIDTH", "HEIGHT", "SILL", "STATE", "ANGLE"),
    WINDOW: ("KIND", "WIDTH", "HEIGHT", "SILL", "STATE", "ANGLE", "SWING", "HINGE"),
    GLAZING: ("KIND", "WIDTH", "HEIGHT", "SILL", "STATE", "ANGLE", "SWING", "HINGE"),
    PASSAGE: ("KIND", "WIDTH", "HEIGHT", "SILL", "STATE", "ANGLE", "SWING", "HINGE"),
    COLUMN: ("ID",),
    KEEP_OUT: ("ID", "REASON"),
    SERVICE: ("KIND", "Z", "REACH", "REQUIRED"),
    SPACE_TAG: ("ID", "USE", "CEILING"),
}
"""Invisible attributes of each block."""


def add_blocks(drawing: Drawing) -> None:
    """Define the blocks of a drawing. They have unit size and are scaled where they are inserted.

    A door's origin is its hinge, its closed leaf points along x and it opens to a right angle: the left one
    counter-clockwise. A window's, a passage's and a column's origin is its middle; x runs along the wall.
    """
    for name, side in ((DOOR_LEFT, 1.0), (DOOR_RIGHT, -1.0)):
        block = _block(drawing, name)
        block.add_line((0.0, 0.0), (0.0, side))
        block.add_arc((0.0, 0.0), 1.0, 0.0 if side > 0 else 270.0, 90.0 if side > 0 else 360.0)
    for name, lines in ((WINDOW, (-0.5, 0.0, 0.5)), (GLAZING, (-0.1, 0.1)), (PASSAGE, (-0.5, 0.5))):
        block = _block(drawing, name)
        for y in lines:
            block.add_line((-0.5, y), (0.5, y), {"linetype": "DASHED" if name == PASSAGE else "BYLAYER"})
        if name != PASSAGE:
            for x in (-0.5, 0.5):
                block.add_line((x, -0.5), (x, 0.5))
    square = ((-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5))
    for name in (COLUMN, KEEP_OUT):
        block = _block(drawing, name)
        block.add_lwpolyline(square, close=True)
        block.add_line(square[0], square[2])
        block.add_line(square[1], square[3])
    _block(drawing, SERVICE).add_circle((0.0, 0.0), 0.06)
    _block(drawing, SPACE_TAG)


def furniture_block(drawing: Drawing, name: str, asset: Asset) -> str:
    """Define the block of an asset's footprint if it is new, and return its name; its front has a double line."""
    if name not in drawing.blocks:
        block = drawing.blocks.new(name)
        x, y = asset.size.width / 2.0, asset.size.depth / 2.0
        block.add_lwpolyline(((-x, -y), (x, -y), (x, y), (-x, y)), close=True)
        inset = min(0.04, y / 4.0)
        block.add_line((-x, y - inset), (x, y - inset))
        for tag in ("ID", "ASSET"):
            block.add_attdef(tag, (0.0, 0.0), height=ATTRIBUTE_HEIGHT, dxfattribs={"flags": 1})
    return name


def insert(
    model: Modelspace,
    name: str,
    layer: str,
    position: tuple[float, float],
    values: Mapping[str, object],
    scale: tuple[float, float] = (1.0, 1.0),
    rotation: float = 0.0,
) -> None:
    """Insert a block with attributes; the rotation is in degrees."""
    attributes = {"layer": layer, "xscale": scale[0], "yscale": scale[1], "rotation": rotation}
    reference = model.add_blockref(name, position, dxfattribs=attributes)
    for tag, value in values.items():
        place = {"layer": layer, "height": ATTRIBUTE_HEIGHT, "flags": 1}
        reference.add_attrib(tag, str(value), position, dxfattribs=place)


def _block(drawing: Drawing, name: str) -> BlockLayout:
    block = drawing.blocks.new(name)
    for tag in ATTRIBUTES[name]:
        block.add_attdef(tag, (0.0, 0.0), height=ATTRIBUTE_HEIGHT, dxfattribs={"flags": 1})
    return block


LAYER_OF = {"door": layers.DOORS, "passage": layers.DOORS, "window": layers.WINDOWS, "glazing": layers.WINDOWS}
"""Layer of each kind of opening."""
