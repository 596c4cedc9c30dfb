"""An installation: parts that connect a placement with the building, or with another placement."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

from labgym.assets.shapes import Part, tessellate
from labgym.assets.shapes.parts import Quaternion, Vector
from labgym.geometry import rotate
from labgym.scenes.patches import Patch, join

Kind = Literal["duct", "trunking", "turret", "sink", "cable", "hose", "restraint", "gas_line"]


@dataclass(frozen=True)
class Installation:
    """Visible parts that belong to a placement but not to its asset.

    Attributes:
        owner: id of the placement.
        kind: what it is.
        parts: in the frame of the floor.
        wall: name of the wall, or of the upper part of one, on which it is mounted; empty for none. Pictures hide it
            with that wall.
    """

    owner: str
    kind: Kind
    parts: tuple[Part, ...]
    wall: str = ""

    @cached_property
    def patches(self) -> tuple[Patch, ...]:
        """One mesh for each material, in the frame of the floor."""
        by_material: dict[str, list[Part]] = {}
        for part in self.parts:
            by_material.setdefault(part.material, []).append(part)
        return tuple(
            Patch(
                self.wall,
                f"{self.owner}/{self.kind}/{material}",
                material,
                *join([tessellate(part) for part in parts]),
            )
            for material, parts in by_material.items()
        )


def moved(parts: Iterable[Part], x: float, y: float, z: float, yaw: float = 0.0) -> tuple[Part, ...]:
    """Return parts of a frame at (x, y, z), turned by yaw about the vertical, in the frame around it."""
    turn = (math.cos(yaw / 2.0), 0.0, 0.0, math.sin(yaw / 2.0))
    return tuple(
        replace(part, position=_point(part.position, x, y, z, yaw), quaternion=_product(turn, part.quaternion))
        for part in parts
    )


def _point(point: Vector, x: float, y: float, z: float, yaw: float) -> Vector:
    dx, dy = rotate(point[0], point[1], yaw)
    return x + dx, y + dy, z + point[2]


def _product(a: Quaternion, b: Quaternion) -> Quaternion:
    """Return the rotation b followed by the rotation a."""
    return (
        a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
        a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
        a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
        a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
    )
