from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import numpy as np
import pytest

from labgym.geometry import OrientedBox
from labgym.protocols import Protocol, ReagentUse, Step


@dataclass(frozen=True)
class Extent:
    width: float = 8.0
    depth: float = 8.0


@dataclass(frozen=True)
class Rectangle:
    """A floor of one rectangular room."""

    room: Extent = Extent()

    @property
    def solids(self) -> tuple[OrientedBox, ...]:
        width, depth = self.room.width, self.room.depth
        return (
            OrientedBox(width / 2.0, -0.1, width + 0.4, 0.2),
            OrientedBox(width / 2.0, depth + 0.1, width + 0.4, 0.2),
            OrientedBox(-0.1, depth / 2.0, 0.2, depth + 0.4),
            OrientedBox(width + 0.1, depth / 2.0, 0.2, depth + 0.4),
        )

    @property
    def bounds(self) -> tuple[float, float, float, float]:
        return -0.2, -0.2, self.room.width + 0.2, self.room.depth + 0.2

    def inside(self, points: np.ndarray) -> np.ndarray:
        return ((points >= 0.0) & (points <= (self.room.width, self.room.depth))).all(axis=1)


@dataclass(frozen=True)
class Item:
    id: str
    asset: str


@dataclass(frozen=True)
class Plan:
    """A floor plan of bare boxes; named ones can be found, `on` says what stands on what."""

    boxes: tuple[OrientedBox, ...] = ()
    named: dict[str, OrientedBox] = field(default_factory=dict)
    on: dict[str, str] = field(default_factory=dict)
    floor: Rectangle = Rectangle()
    protocols: tuple[Protocol, ...] = ()
    protocol: Protocol | None = None

    def obstacles(self, below: float) -> Iterator[OrientedBox]:
        floor = [box for name, box in self.named.items() if name not in self.on]
        yield from (box for box in (*self.boxes, *floor) if box.z0 < below)

    def find(self, asset: str) -> Item | None:
        return Item(asset, asset) if asset in self.named else None

    def root(self, placement_id: str) -> Item:
        root = self.on.get(placement_id, placement_id)
        return Item(root, root)

    def box(self, placement_id: str) -> OrientedBox:
        return self.named[placement_id]


@pytest.fixture(scope="session")
def make_plan() -> Callable[..., Plan]:
    def make(*boxes: OrientedBox, width: float = 8.0, depth: float = 8.0, **fields: object) -> Plan:
        return Plan(tuple(boxes), floor=Rectangle(Extent(width, depth)), **fields)

    return make


@pytest.fixture(scope="session")
def make_protocol() -> Callable[..., Protocol]:
    def make(*locations: str) -> Protocol:
        return Protocol(
            id="drive",
            name="Drive",
            reaction_type="redox",
            reagents=(ReagentUse(name="Water", role="solvent"),),
            instruments=("Beaker",),
            steps=tuple(Step(index=k, location=name, action="go", text="go") for k, name in enumerate(locations, 1)),
        )

    return make
