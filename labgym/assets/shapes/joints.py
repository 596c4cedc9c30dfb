"""Joints of the parts of an asset that move: drawers, doors and sashes, with their masses and resistances."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal

from labgym.geometry import OrientedBox

if TYPE_CHECKING:
    from labgym.assets.shapes.parts import Part, Point, Spans, Vector

SWING_RAD = math.radians(110.0)
"""Angle to which doors of furniture open: concealed hinges of 110 degrees, the usual kind."""
DRAWER_DEPTH_M = 0.45
"""Depth of a drawer behind its front where the furniture is deep enough, meters (usual slides: 450 mm)."""
DRAWER_RIM_SHARE = 0.7
"""Height of the box of a drawer, as a share of that of its front (assumption)."""
BOARD_KG_M2 = 8.2
"""Mass of the boards of that box, kg/m²: 12 mm of 680 kg/m³."""
DRAWER_OVERLAP_M = 0.05
"""Depth of a drawer that stays inside the furniture when it is open, meters."""


@dataclass(frozen=True)
class Mechanism:
    """How a kind of part moves.

    Attributes:
        force: resistance at the handle that does not depend on speed, N.
        damping: resistance at the handle per speed, N s/m (assumptions).
        areal_mass: mass per area of the front, kg/m².
        content: mass of what is in it, which the catalog's mass does not include, kg.
        source: of force and mass.
    """

    force: float
    damping: float
    areal_mass: float
    content: float
    source: str


_ADA = "ADA 309.4 and 404.2.9: at most 22.2 N (5 lbf)"
MECHANISMS = {
    "drawer": Mechanism(
        10.0, 20.0, 12.2, 2.0, f"force: assumption, {_ADA}; 18 mm particle board of 680 kg/m³; contents assumed"
    ),
    "cupboard door": Mechanism(5.0, 5.0, 12.2, 0.0, f"force: assumption, {_ADA}; 18 mm particle board of 680 kg/m³"),
    "cabinet door": Mechanism(5.0, 5.0, 15.7, 0.0, f"force: assumption, {_ADA}; two sheets of steel of 1 mm"),
    "glazed door": Mechanism(5.0, 5.0, 12.0, 0.0, f"force: assumption, {_ADA}; 4 mm glass of 2500 kg/m³ and a frame"),
    "appliance door": Mechanism(10.0, 10.0, 20.0, 0.0, f"force: assumption, {_ADA}; mass assumed; no gasket"),
    "sash": Mechanism(
        20.0, 40.0, 16.0, 2.0, f"force: assumption, {_ADA}; 6.4 mm laminated glass of 2500 kg/m³; rails assumed"
    ),
}
"""Kinds of moving parts."""


@dataclass(frozen=True)
class Joint:
    """A part of an asset that moves along or about one axis, in the asset's frame.

    Attributes:
        name: unique in the asset.
        mechanism: name in `MECHANISMS`.
        kind: slide or hinge; hinges are upright.
        axis: unit vector; positive motion along it, or about it by the right hand, opens.
        origin: a point on the axis of a hinge, meters.
        travel: range of the motion from closed to open, meters or radians.
        drawn: place in that range at which the shape is drawn, meters or radians.
        solid: the part's box as drawn.
        mass: kg.
        friction: resistance that does not depend on speed, N or N m.
        damping: resistance per speed, N s/m or N m s/rad.
        balanced: whether a counterweight carries it.
        closes: whether it closes the asset's hollow.
    """

    name: str
    mechanism: str
    kind: Literal["slide", "hinge"]
    axis: Vector
    origin: Vector
    travel: float
    drawn: float
    solid: OrientedBox
    mass: float
    friction: float
    damping: float
    balanced: bool = False
    closes: bool = False


def moving(joint: Joint, parts: Iterable[Part]) -> Iterator[Part]:
    """Yield parts as parts of a joint."""
    for part in parts:
        yield replace(part, joint=joint)


def hidden(parts: Iterable[Part]) -> Iterator[Part]:
    """Yield parts as those that only an open asset shows."""
    for part in parts:
        yield replace(part, hidden=True)


def drawer(name: str, x: Point, front: float, z: Point, depth: float, side: float = 1.0) -> Joint:
    """Return the joint of a drawer.

    Args:
        x, z: spans of its front. front: y of the outer face of its front.
        depth: depth behind that face, meters.
        side: 1 if it opens toward +y, -1 toward -y.
    """
    mechanism = MECHANISMS["drawer"]
    width, height = x[1] - x[0], z[1] - z[0]
    box = width * depth + 2.0 * DRAWER_RIM_SHARE * height * (depth + width / 2.0)  # bottom, sides and back
    y = front - side * depth / 2.0
    return Joint(
        name=name,
        mechanism="drawer",
        kind="slide",
        axis=(0.0, side, 0.0),
        origin=(0.0, 0.0, 0.0),
        travel=depth - DRAWER_OVERLAP_M,
        drawn=0.0,
        solid=OrientedBox((x[0] + x[1]) / 2.0, y, width, depth, 0.0, z[0], z[1]),
        mass=mechanism.areal_mass * width * height + BOARD_KG_M2 * box + mechanism.content,
        friction=mechanism.force,
        damping=mechanism.damping,
    )


def door(
    name: str, kind: str, leaf: Spans, hinge: Literal["low", "high"], side: float = 1.0, closes: bool = False
) -> Joint:
    """Return the joint of a door that is hinged on the edge of its outer face.

    Args:
        kind: name in `MECHANISMS`.
        leaf: its ends along x, y (inner and outer face) and z.
        hinge: the end of x that is hinged.
        side: 1 if it opens toward +y, -1 toward -y.
        closes: whether it closes the asset's hollow.
    """
    mechanism = MECHANISMS[kind]
    x, y, z = leaf
    width, height = x[1] - x[0], z[1] - z[0]
    turn = side if hinge == "low" else -side
    box = OrientedBox((x[0] + x[1]) / 2.0, (y[0] + y[1]) / 2.0, width, abs(y[1] - y[0]), 0.0, z[0], z[1])
    return Joint(
        name=name,
        mechanism=kind,
        kind="hinge",
        axis=(0.0, 0.0, turn),
        origin=(x[0] if hinge == "low" else x[1], y[1], 0.0),
        travel=SWING_RAD,
        drawn=0.0,
        solid=box,
        mass=mechanism.areal_mass * width * height + mechanism.content,
        friction=mechanism.force * width,
        damping=mechanism.damping * width * width,
        closes=closes,
    )


def sash(x: Point, y: Point, z: Point, lowest: float, highest: float) -> Joint:
    """Return the joint of a vertical sash with a counterweight.

    Args:
        x, y, z: spans of the sash as drawn.
        lowest, highest: heights of its lower edge when it is closed and fully open, meters.
    """
    mechanism = MECHANISMS["sash"]
    width, height = x[1] - x[0], z[1] - z[0]
    return Joint(
        name="sash",
        mechanism="sash",
        kind="slide",
        axis=(0.0, 0.0, 1.0),
        origin=(0.0, 0.0, 0.0),
        travel=highest - lowest,
        drawn=z[0] - lowest,
        solid=OrientedBox((x[0] + x[1]) / 2.0, (y[0] + y[1]) / 2.0, width, y[1] - y[0], 0.0, z[0], z[1]),
        mass=mechanism.areal_mass * width * height + mechanism.content,
        friction=mechanism.force,
        damping=mechanism.damping,
        balanced=True,
        closes=True,
    )
