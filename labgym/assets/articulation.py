"""Moving parts of an asset: joints, parts and solids with drawers and doors open, and how it rolls on the floor.

A state maps names of joints to the share of their range, 0 closed and 1 open, as pairs. Joints that it does not name
stay where the shape is drawn: drawers and doors closed, the sash of a hood at its stop.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from labgym.assets.model import Asset
from labgym.assets.shapes import Part, build
from labgym.assets.shapes.joints import Joint
from labgym.errors import OptionError, check_name
from labgym.geometry import OrientedBox, rotate

State = tuple[tuple[str, float], ...]


@dataclass(frozen=True)
class Footing:
    """How an asset stands on the floor: the force that moves it is `friction` times its weight.

    Attributes:
        friction: coefficient of rolling or sliding friction.
        castors: whether it rolls.
        source: of the coefficient.
    """

    friction: float
    castors: bool
    source: str


_ROLLING = "f / r with f = 1.4 mm (0.057 in, polyurethane tread, Hamilton Caster white paper 11)"
FOOTINGS = {
    "stool": Footing(0.06, True, f"{_ROLLING}, wheels of 46 mm"),
    "trolley": Footing(0.03, True, f"{_ROLLING}, wheels of 90 mm"),
    "cylinder_trolley": Footing(0.2, True, "assumption: half of the weight on a steel plate (0.4), half on wheels"),
    "pallet_truck": Footing(0.03, True, f"{_ROLLING}, rollers of 80 mm"),
    "carton": Footing(0.4, False, "assumption: cardboard on vinyl"),
    "steel_drum": Footing(0.4, False, "assumption: steel on vinyl"),
    "floor_sign": Footing(0.4, False, "assumption: plastic on vinyl"),
    "bin": Footing(0.4, False, "assumption: plastic on vinyl"),
}
"""Footing of the shapes that a push moves."""


def footing(asset: Asset) -> Footing | None:
    """Return how an asset that a push moves stands on the floor; None for furniture that stays in its place."""
    return FOOTINGS.get(asset.shape.name) if asset.placing == "floor" else None


def joints(asset: Asset) -> dict[str, Joint]:
    """Return the joints of an asset by name, in the order of its parts."""
    return {part.joint.name: part.joint for part in all_parts(asset) if part.joint is not None}


@lru_cache(maxsize=512)
def all_parts(asset: Asset) -> tuple[Part, ...]:
    """Return the visible parts of an asset as drawn, with those that only an open asset shows."""
    return build(asset, hidden=True)


def check_state(asset: Asset, state: State) -> None:
    """Check that an asset has the joints of a state and that shares are in [0, 1].

    Raises:
        UnknownNameError: the asset has no such joint.
        OptionError: a share is out of range, or a joint is named twice.
    """
    known = joints(asset)
    for k, (name, share) in enumerate(state):
        check_name(f"moving part of {asset.name}", name, known)
        if not 0.0 <= share <= 1.0:
            raise OptionError(f"state of {name!r} must be 0 (closed) to 1 (open), got {share:g}")
        if any(name == other for other, _ in state[:k]):
            raise OptionError(f"the state names {name!r} twice: name it once")


def values(asset: Asset, state: State) -> dict[str, float]:
    """Return the place of each joint in its range, meters or radians from closed; errors as in `check_state`."""
    check_state(asset, state)
    shares = dict(state)
    return {
        name: shares[name] * joint.travel if name in shares else joint.drawn for name, joint in joints(asset).items()
    }


def posed_parts(asset: Asset, state: State) -> tuple[Part, ...]:
    """Return the visible parts of an asset in a state, in its own frame."""
    places = values(asset, state)
    return tuple(part if part.joint is None else posed_part(part, places[part.joint.name]) for part in all_parts(asset))


def posed_part(part: Part, value: float) -> Part:
    """Return a part where its joint is at a place in its range."""
    if part.joint is None or value == part.joint.drawn:
        return part
    joint, motion = part.joint, value - part.joint.drawn
    if joint.kind == "slide":
        x, y, z = (at + motion * along for at, along in zip(part.position, joint.axis, strict=True))
        return replace(part, position=(x, y, z))
    angle = motion * joint.axis[2]
    dx, dy = rotate(part.position[0] - joint.origin[0], part.position[1] - joint.origin[1], angle)
    w, x, y, z = part.quaternion
    c, s = math.cos(angle / 2.0), math.sin(angle / 2.0)
    return replace(
        part,
        position=(joint.origin[0] + dx, joint.origin[1] + dy, part.position[2]),
        quaternion=(c * w - s * z, c * x - s * y, c * y + s * x, c * z + s * w),
    )


def posed_solid(joint: Joint, value: float) -> OrientedBox:
    """Return the box of a joint's part where the joint is at a place in its range, in the asset's frame."""
    box, motion = joint.solid, value - joint.drawn
    if joint.kind == "slide":
        dx, dy, dz = (motion * along for along in joint.axis)
        return replace(box, x=box.x + dx, y=box.y + dy, z0=box.z0 + dz, z1=box.z1 + dz)
    angle = motion * joint.axis[2]
    dx, dy = rotate(box.x - joint.origin[0], box.y - joint.origin[1], angle)
    return replace(box, x=joint.origin[0] + dx, y=joint.origin[1] + dy, yaw=box.yaw + angle)


def fixed_solids(asset: Asset) -> tuple[OrientedBox, ...]:
    """Return the solids of an asset without its moving parts; doors that close a hollow leave its front open."""
    return asset.solids(closed=not any(joint.closes for joint in joints(asset).values()))


@lru_cache(maxsize=512)
def posed_solids(asset: Asset, state: State) -> tuple[OrientedBox, ...]:
    """Return the solids of an asset in a state, in its own frame: those of the fixed part, then one for each joint."""
    places = values(asset, state)
    return (
        *fixed_solids(asset),
        *(posed_solid(joint, places[name]) for name, joint in joints(asset).items()),
    )


@lru_cache(maxsize=512)
def protruding(asset: Asset, state: State) -> tuple[OrientedBox, ...]:
    """Return the solids of open drawers and doors that stand out of the asset's bounding box, in its own frame."""
    places = values(asset, state)
    reach = np.array([asset.size.width, asset.size.depth]) / 2.0 + 1e-3
    boxes = (posed_solid(joint, places[name]) for name, joint in joints(asset).items())
    return tuple(box for box in boxes if bool((np.abs(box.corners()) > reach).any()))
