"""Makes a laboratory look lived in: safety gear on walls, stools, bins, screens, racks, stocked glassware.

Nothing here is required by a protocol. A thing is added only where it is free of everything, of doors, of the
places where the robot stands, and where it breaks no rule and no way.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence

import numpy as np

from labgym.assets import Catalog
from labgym.geometry import BoxArray, OrientedBox, pairwise_distance
from labgym.layouts.fitting import Keepouts, along_walls, on_floor, on_surface, on_wall
from labgym.layouts.model import FLOOR, Layout, Placement
from labgym.layouts.rules.objective import evaluate_layout
from labgym.layouts.rules.thresholds import Profile
from labgym.layouts.rules.zones import door_pose
from labgym.protocols import Protocol

WALL_THINGS = (
    ("FireExtinguisher", "door"),
    ("SafetySign", "door"),
    ("CoatHooks", "door"),
    ("WallCabinet", "PreparationBench"),
    ("WallCabinet", "LabBench1800"),
    ("WallShelf", "LabBench"),
    ("FirstAidKit", "SinkBench"),
    ("FireBlanket", "FumeHood"),
    ("CO2Extinguisher", "FumeHood"),
    ("Clock", "ValidationPlatform"),
    ("NoticeBoard", "WritingDesk"),
    ("Whiteboard", "ValidationPlatform"),
    ("DryingRack", "SinkBench"),
    ("PaperTowelDispenser", "HandWashSink"),
    ("GasDetector", "FumeHood"),
)
"""What hangs on walls, and what it likes to be near."""
SURFACE_THINGS: dict[str, tuple[str, ...]] = {
    "ValidationPlatform": ("Monitor", "Keyboard", "SampleVial", "TestTubeRack", "Micropipette", "FilterPaper"),
    "PreparationBench": ("WeighingBoat", "GloveDispenser", "Spatula", "PipetteStand", "WeighingBoat"),
    "WritingDesk": ("Laptop", "Monitor"),
    "SinkBench": ("WashBottle", "WashBottle"),
    "RotaryEvaporatorStation": ("VacuumPump", "CorkRing"),
    "FumeHood1200": ("IronStand", "LabJack", "IceBath"),
    "MainWorkbench": ("VortexMixer", "GloveDispenser", "TestTubeRack"),
    "PurificationBench": ("TestTubeRack", "IronStand"),
    "DryingStation": ("CrucibleTongs", "GloveDispenser"),
    "WasteStation": ("SolventWasteContainer", "SolventWasteContainer"),
    "LabBench1800": ("UVVisSpectrophotometer", "Monitor", "Centrifuge", "VortexMixer", "GloveDispenser"),
    "LabBench": ("WaterPurifier", "OrbitalShaker", "PHMeter", "BottleRack", "WashBottle"),
}
"""What stands on furniture beside the protocol's own instruments; none of it gives heat."""
ISLAND_THINGS = (
    "Centrifuge",
    "VortexMixer",
    "BottleRack",
    "Microscope",
    "PipetteStand",
    "OrbitalShaker",
    "GloveDispenser",
    "TestTubeRack",
    "PHMeter",
    "Laptop",
    "SyringePump",
    "LabJack",
)
SHELF_THINGS: dict[str, tuple[str, ...]] = {
    "ReagentShelf": (
        "WashBottle",
        "TestTubeRack",
        "WashBottle",
        "FilterPaper",
        "BottleRack",
        "GloveDispenser",
        "PHPaper",
    ),
    "EquipmentRack": (
        "SyringePump",
        "PeristalticPump",
        "LabJack",
        "TestTubeRack",
        "BottleRack",
        "Laptop",
        "FilterPaper",
    ),
    "GlasswareCabinet": (
        "LargeBeaker",
        "ErlenmeyerFlask",
        "Beaker",
        "VolumetricFlask",
        "CrystallizingDish",
        "GlassFunnel",
        "ReagentBottle",
    ),
}
"""What is drawn for every shelf of some furniture."""
BINS = (("WasteBin", "HandWashSink"), ("SolidWasteBin", "WasteStation"), ("BrokenGlassBin", "SinkBench"))
STOOLS = 4
PASSAGE = 0.9
"""Free width that stays beside a stool, metres."""


def dress(layout: Layout, protocol: Protocol, profile: Profile, seed: int) -> Layout:
    """Return the layout with more in it. Nothing that was there moves; no violation is added. Deterministic."""
    dresser = _Dresser(layout, protocol, profile, np.random.default_rng([seed, len(layout.placements)]))
    before = evaluate_layout(layout, protocol, profile, navigation=True)
    stages: tuple[Callable[[], None], ...] = (dresser.dress_surfaces, dresser.dress_walls, dresser.dress_floor)
    for stage in stages:
        kept = dresser.layout
        stage()
        after = evaluate_layout(dresser.layout, protocol, profile, navigation=True)
        if after.v > before.v or after.fitness < before.fitness - 1e-9:
            dresser.layout = kept
    return dresser.layout


class _Dresser:
    """A layout that things are added to, one by one."""

    def __init__(self, layout: Layout, protocol: Protocol, profile: Profile, generator: np.random.Generator) -> None:
        self.layout = layout
        self.keepouts = Keepouts.of(layout, protocol)
        self.profile = profile
        self.generator = generator
        self.catalog = Catalog.load()

    def dress_surfaces(self) -> None:
        for furniture in self.layout.placements:
            if _is_island(furniture):
                self._dress_island(furniture)
            for index, name in enumerate(SURFACE_THINGS.get(furniture.asset, ())):
                if self.generator.random() < 0.85 or index == 0:
                    self._put_on(name, furniture.id, 0)
            self._fill_shelves(furniture)

    def dress_walls(self) -> None:
        for name, neighbour in WALL_THINGS:
            near = self._point(neighbour)
            if near is not None:
                self._add(on_wall(self.layout, self.catalog.get(name), self.keepouts, near))

    def dress_floor(self) -> None:
        for name, neighbour in BINS:
            near, asset = self._point(neighbour), self.catalog.get(name)
            if near is not None:
                poses = along_walls(self.layout, asset, near)[:80]
                self._add(on_floor(self.layout, asset, self.keepouts, poses, in_front=False))
        self._pull_up_stools()

    def _add(self, placement: Placement | None) -> None:
        if placement is not None:
            self.layout = self.layout.replace(placements=(*self.layout.placements, placement))

    def _put_on(self, name: str, support: str, slot: int) -> None:
        asset = self.catalog.get(name)
        self._add(on_surface(self.layout, asset, support, slot, self.profile, self.generator))

    def _drawn(self, names: Sequence[str], least: int, most: int) -> list[str]:
        count = int(self.generator.integers(least, most + 1))
        return [str(name) for name in self.generator.permutation(names)[:count]]

    def _dress_island(self, island: Placement) -> None:
        """A reagent shelf along the middle where nothing stands yet, and devices on both sides of it."""
        if not self.layout.children(island.id):
            top, number = (
                self.layout.surface(island.id, 0),
                sum(p.asset == "ReagentShelf" for p in self.layout.placements),
            )
            rack = Placement(
                id=f"ReagentShelf_{number + 1}",
                asset="ReagentShelf",
                position=(round(top.x, 6), round(top.y, 6), round(top.z0, 6)),
                yaw=top.yaw,
                support=island.id,
                slot=0,
            )
            self._add(rack)
            self._fill_shelves(rack)
        for name in self._drawn(ISLAND_THINGS, 4, 7):
            self._put_on(name, island.id, 0)

    def _fill_shelves(self, furniture: Placement) -> None:
        names = SHELF_THINGS.get(furniture.asset)
        if names is not None:
            for slot in range(len(self.catalog.get(furniture.asset).surfaces)):
                for name in self._drawn(names, 2, 5):
                    self._put_on(name, furniture.id, slot)

    def _pull_up_stools(self) -> None:
        size = self.catalog.get("LabStool").size
        seats = list(_seats(self.layout, 0.06 + size.depth / 2.0))
        pulled = 0
        for index in self.generator.permutation(len(seats)):
            x, y, yaw, owner = seats[index]
            box = OrientedBox(x, y, size.width, size.depth, yaw, 0.0, size.height)
            if pulled < STOOLS and _roomy(self.layout, box, owner):
                before = self.layout
                asset = self.catalog.get("LabStool")
                self._add(on_floor(self.layout, asset, self.keepouts, [(x, y, yaw)], in_front=True))
                pulled += self.layout is not before

    def _point(self, neighbour: str) -> tuple[float, float] | None:
        room = self.layout.room
        if neighbour == "door" and room.doors:
            x, y, _ = door_pose(room, room.doors[0])
            return x, y
        placed = self.layout.find(neighbour)
        return None if placed is None else (placed.position[0], placed.position[1])


def _is_island(placement: Placement) -> bool:
    return placement.asset.startswith(("IslandBench", "Peninsula"))


def _seats(layout: Layout, reach: float) -> Iterator[tuple[float, float, float, str]]:
    """Poses of stools pulled up to islands and desks, with the furniture that they belong to."""
    for placement in layout.placements:
        box = layout.box(placement.id)
        if placement.asset == "WritingDesk":
            yield (*box.to_world(0.0, box.depth / 2.0 + reach), box.yaw + math.pi, placement.id)
        elif _is_island(placement):
            for side in (1.0, -1.0):
                for place in np.linspace(-0.35, 0.35, 4) * box.width:
                    x, y = box.to_world(float(place), side * (box.depth / 2.0 + reach))
                    yield x, y, box.yaw + (math.pi if side > 0.0 else 0.0), placement.id


def _roomy(layout: Layout, stool: OrientedBox, owner: str) -> bool:
    """Whether a passage stays between a stool and everything on the floor but its own furniture."""
    others = [
        layout.box(placement.id)
        for placement in layout.placements
        if placement.support == FLOOR and placement.id != owner and placement.asset != "LabStool"
    ]
    gaps = pairwise_distance(BoxArray.of([stool]), BoxArray.of(others))
    return bool((gaps >= PASSAGE).all())
