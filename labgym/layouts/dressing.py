"""Makes a laboratory look lived in: safety gear on walls, stools, bins, screens, racks, stocked glassware.

Nothing here is required by a protocol. A thing is added only where it is free of everything, of doors, of the
places where the robot stands, and where it breaks no rule and no way.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from labgym.assets import Catalog
from labgym.geometry import OrientedBox, distance
from labgym.layouts.fitting import Keepouts, along_walls, on_floor, on_surface, on_wall
from labgym.layouts.model import FLOOR, Layout, Placement
from labgym.layouts.objective import evaluate_layout
from labgym.layouts.thresholds import Profile
from labgym.layouts.zones import door_pose
from labgym.protocols import Protocol

WALL_THINGS = (
    ("FireExtinguisher", "door"),
    ("SafetySign", "door"),
    ("CoatHooks", "door"),
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
RACK_THINGS = ("WashBottle", "TestTubeRack", "WashBottle", "FilterPaper", "BottleRack", "GloveDispenser", "PHPaper")
GLASSWARE = (
    "LargeBeaker",
    "ErlenmeyerFlask",
    "Beaker",
    "VolumetricFlask",
    "CrystallizingDish",
    "GlassFunnel",
    "ReagentBottle",
)
STOOLS = 4


def dress(layout: Layout, protocol: Protocol, profile: Profile, seed: int) -> Layout:
    """Return the layout with more in it. Nothing that was there moves; no violation is added. Deterministic."""
    generator = np.random.default_rng([seed, len(layout.placements)])
    before = evaluate_layout(layout, protocol, profile, navigation=True)
    for stage in (_dress_surfaces, _dress_walls, _dress_floor):
        candidate = stage(layout, Keepouts.of(layout, protocol), profile, generator)
        after = evaluate_layout(candidate, protocol, profile, navigation=True)
        if after.v <= before.v and after.fitness >= before.fitness - 1e-9:
            layout = candidate
    return layout


def _added(layout: Layout, placement: Placement | None) -> Layout:
    return layout if placement is None else layout.replace(placements=(*layout.placements, placement))


def _dress_surfaces(layout: Layout, keepouts: Keepouts, profile: Profile, generator: np.random.Generator) -> Layout:
    catalog = Catalog.load()
    for furniture in layout.placements:
        things = list(SURFACE_THINGS.get(furniture.asset, ()))
        if furniture.asset.startswith(("IslandBench", "Peninsula")):
            layout = _dress_island(layout, furniture, profile, generator)
            continue
        if furniture.asset == "GlasswareCabinet":
            layout = _stock_glassware(layout, furniture, profile, generator)
            continue
        for name in things:
            if generator.random() < 0.85:
                layout = _added(layout, on_surface(layout, catalog.get(name), furniture.id, 0, profile, generator))
    return layout


def _dress_island(layout: Layout, island: Placement, profile: Profile, generator: np.random.Generator) -> Layout:
    """A reagent shelf along the middle, filled, and a few devices on each side of it."""
    catalog = Catalog.load()
    shelf = catalog.get("ReagentShelf")
    top = layout.surface(island.id, 0)
    rack = Placement(
        id=f"ReagentShelf_{1 + sum(p.asset == 'ReagentShelf' for p in layout.placements)}",
        asset=shelf.name,
        position=(round(top.x, 6), round(top.y, 6), round(top.z0, 6)),
        yaw=top.yaw,
        support=island.id,
        slot=0,
    )
    if not layout.children(island.id):
        layout = _added(layout, rack)
        for slot in range(len(shelf.surfaces)):
            for name in generator.permutation(RACK_THINGS)[: int(generator.integers(3, 6))]:
                layout = _added(layout, on_surface(layout, catalog.get(str(name)), rack.id, slot, profile, generator))
    for name in generator.permutation(ISLAND_THINGS)[: int(generator.integers(4, 8))]:
        layout = _added(layout, on_surface(layout, catalog.get(str(name)), island.id, 0, profile, generator))
    return layout


def _stock_glassware(layout: Layout, cabinet: Placement, profile: Profile, generator: np.random.Generator) -> Layout:
    catalog = Catalog.load()
    for slot in range(len(catalog.get(cabinet.asset).surfaces)):
        for name in generator.permutation(GLASSWARE)[: int(generator.integers(2, 5))]:
            layout = _added(layout, on_surface(layout, catalog.get(str(name)), cabinet.id, slot, profile, generator))
    return layout


def _dress_walls(layout: Layout, keepouts: Keepouts, profile: Profile, generator: np.random.Generator) -> Layout:
    catalog = Catalog.load()
    for name, neighbour in WALL_THINGS:
        near = _point(layout, neighbour)
        if near is not None:
            layout = _added(layout, on_wall(layout, catalog.get(name), keepouts, near))
    return layout


def _point(layout: Layout, neighbour: str) -> tuple[float, float] | None:
    if neighbour == "door":
        x, y, _ = door_pose(layout.room, layout.room.doors[0]) if layout.room.doors else (0.0, 0.0, 0.0)
        return x, y
    placed = layout.find(neighbour)
    return None if placed is None else (placed.position[0], placed.position[1])


def _dress_floor(layout: Layout, keepouts: Keepouts, profile: Profile, generator: np.random.Generator) -> Layout:
    catalog = Catalog.load()
    for name, neighbour in (
        ("WasteBin", "HandWashSink"),
        ("SolidWasteBin", "WasteStation"),
        ("BrokenGlassBin", "SinkBench"),
    ):
        near, asset = _point(layout, neighbour), catalog.get(name)
        if near is not None:
            layout = _added(
                layout, on_floor(layout, asset, keepouts, along_walls(layout, asset, near)[:80], in_front=False)
            )
    stool = catalog.get("LabStool")
    seats = list(_seats(layout))
    for index in generator.permutation(len(seats))[: 3 * STOOLS]:
        if sum(placement.asset == stool.name for placement in layout.placements) >= STOOLS:
            break
        x, y, yaw, owner = seats[index]
        box = OrientedBox(x, y, stool.size.width, stool.size.depth, yaw, 0.0, stool.size.height)
        if _roomy(layout, box, owner):
            layout = _added(layout, on_floor(layout, stool, keepouts, [(x, y, yaw)], in_front=True))
    return layout


def _seats(layout: Layout) -> Iterator[tuple[float, float, float, str]]:
    """Poses of stools pulled up to islands and desks, with the furniture that they belong to."""
    reach = 0.06 + Catalog.load().get("LabStool").size.depth / 2.0
    for placement in layout.placements:
        box = layout.box(placement.id)
        if placement.asset == "WritingDesk":
            yield (*box.to_world(0.0, box.depth / 2.0 + reach), box.yaw + math.pi, placement.id)
        elif placement.asset.startswith(("IslandBench", "Peninsula")):
            for side in (1.0, -1.0):
                for place in np.linspace(-0.35, 0.35, 4) * box.width:
                    x, y = box.to_world(float(place), side * (box.depth / 2.0 + reach))
                    yield x, y, box.yaw + (math.pi if side > 0.0 else 0.0), placement.id


def _roomy(layout: Layout, stool: OrientedBox, owner: str) -> bool:
    """Whether a passage of 0.9 m stays between a stool and everything on the floor but its own furniture."""
    return all(
        distance(stool, layout.box(placement.id)) >= 0.9
        for placement in layout.placements
        if placement.support == FLOOR and placement.id != owner and placement.asset != "LabStool"
    )
