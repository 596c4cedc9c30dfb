"""Placements and laboratories by hand that several test files share."""

from __future__ import annotations

import math

from labgym.layouts import Door, Layout, Placement, Room, load_published
from labgym.protocols import Protocol, ReagentUse, Step, get
from labgym.protocols.constraints import derive

PROTOCOL = "alk_03"
"""Its four locations are in both laboratories."""


def put(
    name: str,
    asset: str,
    x: float,
    y: float,
    z: float = 0.0,
    yaw: float = 0.0,
    on: str = "floor",
    slot: int | None = None,
) -> Placement:
    """Return a placement; `on` is its support."""
    return Placement(id=name, asset=asset, position=(x, y, z), yaw=yaw, support=on, slot=slot)


def published_in_order() -> Layout:
    """Return a published layout without a violation under the rule set `touchstone`.

    Generator 1 hung its extinguisher behind the sink bench, which `extinguisher_front` forbids.
    """
    layout = load_published("test", "test-cyc_02")
    moved = put("FireExtinguisher_1", "FireExtinguisher", 6.9, 7.5, 0.6, yaw=math.pi / 2, on="wall")
    return layout.replace(placements=tuple(moved if one.id == moved.id else one for one in layout.placements))


def island_laboratory() -> Layout:
    """Return an 8 m x 6 m room with the four locations of the protocol along its walls and an island in the middle."""
    width, depth = 8.0, 6.0
    return Layout(
        id="by-hand",
        protocols=(get(PROTOCOL),),
        floor=Room(width=width, depth=depth, doors=(Door(wall="front", offset=1.2),)).floor,
        placements=(
            put("PreparationBench_1", "PreparationBench", 0.38, 2.5, yaw=-math.pi / 2),
            put("FumeHood_1", "FumeHood", 2.0, depth - 0.43, yaw=math.pi),
            put("SinkBench_1", "SinkBench", 5.5, depth - 0.38, yaw=math.pi),
            put("ValidationPlatform_1", "ValidationPlatform", width - 0.41, 2.5, yaw=math.pi / 2),
            put("IslandBench1800_1", "IslandBench1800", 4.0, 2.5),
        ),
    )


def hall_laboratory() -> Layout:
    """Return a 12 m x 8 m room with the four locations along its walls and a row of three islands across.

    Most tasks of LabNav find a drive in it at once.
    """
    width, depth = 12.0, 8.0
    return Layout(
        id="hall",
        protocols=(get(PROTOCOL),),
        floor=Room(width=width, depth=depth, doors=(Door(wall="front", offset=1.2),)).floor,
        placements=(
            put("PreparationBench_1", "PreparationBench", 0.38, 2.5, yaw=-math.pi / 2),
            put("FumeHood_1", "FumeHood", 2.0, depth - 0.43, yaw=math.pi),
            put("SinkBench_1", "SinkBench", width - 2.5, depth - 0.38, yaw=math.pi),
            put("ValidationPlatform_1", "ValidationPlatform", width - 0.41, 2.5, yaw=math.pi / 2),
            *(
                put(f"IslandBench1800_{row}", "IslandBench1800", width / 2, 1.8 * row - 0.9, yaw=math.pi / 2)
                for row in (1, 2, 3)
            ),
        ),
    )


def small_laboratory(name: str, shift: float = 0.0) -> Layout:
    """Return a 6.5 m square room with the four locations of the protocol and a bench in the middle.

    Args:
        shift: displacement of three of the locations along their walls, metres.
    """
    return Layout(
        id=name,
        protocols=(get(PROTOCOL),),
        floor=Room(width=6.5, depth=6.5).floor,
        placements=(
            put("PreparationBench", "PreparationBench", 0.40, 2.5 + shift, yaw=-math.pi / 2),
            put("FumeHood", "FumeHood", 2.5 + shift, 6.05, yaw=math.pi),
            put("ValidationPlatform", "ValidationPlatform", 6.05, 4.0 - shift, yaw=math.pi / 2),
            put("SinkBench", "SinkBench", 4.6, 0.45),
            put("IslandBench", "IslandBench", 3.2, 3.3),
        ),
    )


BY_HAND = derive(
    Protocol(
        id="by-hand",
        name="By hand",
        reaction_type="substitution",
        reagents=(ReagentUse(name="DiethylEther", role="solvent"), ReagentUse(name="SodiumChloride", role="salt")),
        instruments=("RoundBottomFlask", "MagneticHotplateStirrer", "ElectronicScale"),
        steps=(
            Step(
                index=1, location="PreparationBench", action="Weigh", text="Weigh.",
                uses=("SodiumChloride", "ElectronicScale"),
            ),
            Step(
                index=2, location="FumeHood", action="Stir", text="Stir.",
                uses=("DiethylEther", "RoundBottomFlask", "MagneticHotplateStirrer"),
            ),
        ),
    )
)  # fmt: skip
"""Ether is flammable and volatile: it is handled in the hood, in the flask, next to the hotplate of the protocol."""

ORDERLY = (
    put("hood", "FumeHood", 4.0, 7.575, yaw=math.pi),
    put("bench", "PreparationBench", 7.625, 4.0, yaw=math.pi / 2),
    put("flammables", "FlammableCabinet", 0.23, 3.5, yaw=-math.pi / 2),
    put("general", "GeneralCabinet", 0.23, 5.5, yaw=-math.pi / 2),
    put("ether", "DiethylEther", 0.23, 3.5, 0.1, on="flammables", slot=0),
    put("salt", "SodiumChloride", 0.23, 5.5, 0.1, on="general", slot=0),
    put("flask", "RoundBottomFlask", 4.0, 7.55, 0.9, on="hood", slot=0),
    put("plate", "MagneticHotplateStirrer", 4.4, 7.55, 0.9, on="hood", slot=0),
    put("scale", "ElectronicScale", 7.6, 4.0, 0.9, on="bench", slot=0),
    put("extinguisher", "FireExtinguisher", 0.1, 2.0, 0.9, yaw=-math.pi / 2, on="wall"),
    put("first-aid", "FirstAidKit", 0.06, 1.0, 1.4, yaw=-math.pi / 2, on="wall"),
    put("spills", "SpillKit", 0.6, 7.75, yaw=math.pi),
    put("waste", "SolventWasteContainer", 1.4, 7.75, yaw=math.pi),
    put("shower", "EmergencyShower", 6.9, 7.6, yaw=math.pi),
    put("eyewash", "EyewashStation", 5.6, 7.8, yaw=math.pi),
    put("hands", "HandWashSink", 7.75, 2.0, yaw=math.pi / 2),
    put("detector", "GasDetector", 0.04, 7.0, 2.0, yaw=-math.pi / 2, on="wall"),
)


def orderly_laboratory(*changed: Placement, without: tuple[str, ...] = ()) -> Layout:
    """Return a laboratory for `BY_HAND`, with placements replaced or added by id and some left out."""
    by_id = {placement.id: placement for placement in (*ORDERLY, *changed) if placement.id not in without}
    floor = Room(width=8.0, depth=8.0, doors=(Door(wall="front", offset=1.2), Door(wall="front", offset=6.0))).floor
    layout = Layout(id="by-hand", floor=floor, protocols=(BY_HAND,), placements=tuple(by_id.values()))
    on_shelf = {
        each.id: each.model_copy(update={"position": (*each.position[:2], layout.surface(each.support, each.slot).z0)})
        for each in layout.placements
        if each.slot is not None and each.position[2] == 0.1
    }
    return layout.replace(placements=tuple(on_shelf.get(each.id, each) for each in layout.placements))
