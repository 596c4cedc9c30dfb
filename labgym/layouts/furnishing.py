"""What furniture a room gets for a protocol, and which walls it likes: rules of thumb of laboratory planning.

Named walls are those of the room; `store` and `work` are its two side walls, which of them is left is up to the
seed. The hood line is on the far wall, rotary evaporators and waste beside it, storage on one side, wet work and
cleaning on the other, weighing and analysis on the clean side by the entrance.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from labgym.assets import Asset, Catalog
from labgym.layouts.brief import Stance, Unit, Wall
from labgym.layouts.model import Room
from labgym.protocols import Protocol

Side = Literal["front", "back", "store", "work"]
Furnishing = Literal["full", "reduced", "required"]
LEVELS: tuple[Furnishing, ...] = ("full", "reduced", "required")
"""How much furniture beyond what the protocol asks for; the fuller ones are tried first."""

GOAL_FRONT = 1.0
"""Free depth in front of a location: the stand-off of 0.60 m, the robot's 0.30 m, and two cells of the grid."""


Span = tuple[float, float]


@dataclass(frozen=True)
class Habit:
    """Where a kind of furniture likes to stand.

    Attributes:
        walls: the liked ones first.
        side: liked span of the side walls, 0 at the front to 1 at the back.
        front: liked span of the front wall, 0 at the end with the door to 1 at the other.
        back: liked span of the back wall, 0 at the store side to 1 at the work side.
        clear: free depth before it, metres; None for the catalogue's clearance.
    """

    walls: tuple[Side, ...]
    side: Span | None = None
    front: Span | None = None
    back: Span | None = None
    clear: float | None = None


HABITS: dict[str, Habit] = {
    "FumeHood": Habit(("back",), back=(0.35, 0.65), clear=1.5),
    "FumeHood1200": Habit(("back",), clear=1.5),
    "RotaryEvaporatorStation": Habit(("back", "work"), side=(0.75, 0.9)),
    "DryingStation": Habit(("work", "store"), side=(0.5, 0.8)),
    "GloveBox": Habit(("store", "work", "back"), side=(0.4, 0.7), clear=1.2),
    "PreparationBench": Habit(("front", "store", "work"), side=(0.2, 0.45), front=(0.7, 0.95)),
    "ValidationPlatform": Habit(("front", "work", "store"), side=(0.2, 0.45), front=(0.4, 0.8)),
    "SinkBench": Habit(("work", "store"), side=(0.4, 0.7)),
    "MainWorkbench": Habit(("work", "store", "front"), side=(0.3, 0.7)),
    "PurificationBench": Habit(("work", "back", "store"), side=(0.6, 0.85)),
    "FlammableCabinet": Habit(("store", "front", "work"), side=(0.1, 0.5)),
    "AcidCabinet": Habit(("store", "work", "front")),
    "BaseCabinet": Habit(("work", "store", "front")),
    "OxidizerCabinet": Habit(("store", "work", "front")),
    "ToxicCabinet": Habit(("store", "work", "front")),
    "WaterReactiveCabinet": Habit(("store", "front", "work")),
    "GeneralCabinet": Habit(("store", "work", "front")),
    "FlammableSafeRefrigerator": Habit(("store", "work", "front")),
    "GasCylinderCabinet": Habit(("store", "work", "front")),
    "WasteStation": Habit(("back", "store", "work"), side=(0.8, 0.95)),
    "EyewashStation": Habit(("work", "store", "back"), side=(0.6, 0.85), clear=1.0),
    "EmergencyShower": Habit(("work", "store", "front"), side=(0.3, 0.6), clear=1.0),
    "GlasswareCabinet": Habit(("work", "store", "front"), side=(0.3, 0.6)),
    "HandWashSink": Habit(("front", "work", "store"), side=(0.05, 0.2), front=(0.25, 0.45)),
    "WritingDesk": Habit(("front", "work", "store"), side=(0.1, 0.3), front=(0.3, 0.9)),
    "SpillKit": Habit(("work", "store", "front", "back")),
    "NitrogenCylinder": Habit(("store", "back", "work"), side=(0.6, 0.95)),
    "LabRefrigerator": Habit(("store", "work", "front")),
    "LabBench1800": Habit(("work", "store", "front"), side=(0.3, 0.8)),
    "LabBench": Habit(("store", "work", "front"), side=(0.3, 0.8)),
}
ANYWHERE = Habit(("store", "work", "front", "back"))

ALWAYS = ("FumeHood", "PreparationBench", "ValidationPlatform", "SinkBench")
"""Places that every laboratory has, whether the protocol goes there or not: to ventilate, weigh, analyse, wash."""
SAFETY = ("EmergencyShower", "EyewashStation", "WasteStation")
REDUCED = ("SpillKit", "GlasswareCabinet")
FULL = ("FumeHood1200", "HandWashSink", "WritingDesk", "NitrogenCylinder")
FILLING = (
    "LabBench1800",
    "LabRefrigerator",
    "EquipmentRack",
    "LabBench",
    "IceMachine",
    "UltraLowFreezer",
    "LabBench1800",
)
"""What a room with wall to spare gets beyond that, in this order."""
FILLED = 0.7
"""Share of the wall length up to which a room is filled."""
ISLANDS = ("IslandBench", "IslandBench2400", "IslandBench1800")
HEAVY_AISLE = 1.5
AISLE = 1.2
"""Clear width around islands, metres: 1.5 where it fits, 1.2 at least."""


def location_units(
    protocol: Protocol, sides: dict[Side, Wall], room: Room, generator: np.random.Generator
) -> list[Unit]:
    """Return a unit for every location of the protocol and every place that a laboratory always has."""
    names = dict.fromkeys((*ALWAYS, *(location for location in protocol.locations)))
    return [habitual_unit(name, f"{name}_1", sides, room, generator, GOAL_FRONT) for name in names]


def extra_units(
    furnishing: Furnishing, sides: dict[Side, Wall], room: Room, generator: np.random.Generator
) -> list[Unit]:
    """Return what a room gets beside its locations, cabinets and fillings."""
    names = list(SAFETY)
    if furnishing != "required":
        names += REDUCED
    if furnishing == "full":
        names += FULL
    return [habitual_unit(name, f"{name}_1", sides, room, generator) for name in names]


def filling_units(
    units: Sequence[Unit], sides: dict[Side, Wall], room: Room, generator: np.random.Generator
) -> list[Unit]:
    """Return benches, cold storage and racks for the wall that the other units leave free."""
    offered = 2.0 * (room.width + room.depth) - sum(max(door.width, 1.2) for door in room.doors)
    used = sum(unit.width for unit in units if unit.stance == "wall")
    filling: list[Unit] = []
    for name in FILLING:
        number = 1 + sum(unit.asset == name for unit in filling)
        unit = habitual_unit(name, f"{name}_{number}", sides, room, generator)
        if used + unit.width <= FILLED * offered:
            filling.append(unit)
            used += unit.width
    return filling


def habitual_unit(
    name: str,
    unit_id: str,
    sides: dict[Side, Wall],
    room: Room,
    generator: np.random.Generator,
    least_front: float = 0.0,
) -> Unit:
    """Return a wall unit of that catalogue name with the habits of its kind."""
    asset, habit = Catalog.load().get(name), HABITS.get(name, ANYWHERE)
    place = generator.random()
    anchors: dict[str, float] = {}
    for span, kinds in ((habit.side, ("left", "right")), (habit.front, ("front",)), (habit.back, ("back",))):
        if span is not None:
            liked = span[0] + place * (span[1] - span[0])
            anchors |= {wall: 1.0 - liked if _turned(wall, sides, room) else liked for wall in kinds}
    walls = tuple(dict.fromkeys(sides[side] for side in habit.walls))
    front = max(least_front, asset.clearance if habit.clear is None else habit.clear)
    return Unit(unit_id, name, asset.size.width, asset.size.depth, front, walls=walls, anchors=anchors)


def _turned(wall: str, sides: dict[Side, Wall], room: Room) -> bool:
    """Whether a span of the wall counts from its end instead of its start."""
    if wall == "back":
        return sides["store"] == "right"
    return wall == "front" and any(door.wall == "front" and door.offset > room.width / 2.0 for door in room.doors)


def island_units(room: Room, furnishing: Furnishing, generator: np.random.Generator) -> list[Unit]:
    """Return islands or a peninsula, as many and as large as the room can take beside a full row on every wall."""
    if furnishing == "required":
        return []
    wide, deep = room.width - 2 * 0.85 - 2 * AISLE, room.depth - 0.85 - 0.8 - 1.5 - AISLE
    catalog = Catalog.load()
    rows = max(1, min(3, int((deep + AISLE) / (1.5 + AISLE))))
    if furnishing == "reduced":
        rows = 1
    fitting = [name for name in ISLANDS if catalog.get(name).size.width <= wide] or [ISLANDS[-1]]
    name = fitting[0] if furnishing == "full" else fitting[-1]
    stance: Stance = "peninsula" if generator.random() < 0.25 and rows == 1 else "island"
    units = []
    for row in range(rows):
        asset: Asset = catalog.get("Peninsula2400" if stance == "peninsula" else name)
        anchor = float(
            np.clip((0.8 + AISLE + 0.75 + row * (deep / rows)) / room.depth + generator.uniform(-0.03, 0.03), 0, 1)
        )
        units.append(
            Unit(
                f"{asset.name}_{row + 1}",
                asset.name,
                asset.size.width,
                asset.size.depth,
                0.0,
                stance=stance,
                walls=("left", "right") if stance == "peninsula" else (),
                anchors={"island": anchor} if stance == "island" else {},
            )
        )
    return units
