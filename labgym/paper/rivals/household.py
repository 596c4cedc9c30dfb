"""The contents of "a chemistry laboratory" as a layperson sees it: the seeded table in a language model's place.

Holodeck and SceneWeaver ask a language model which objects a room has, how many, and what stands on them. This table
answers instead. It knows laboratories as a layperson does and no protocol; what the description names is added to it
(`reading.assets_in`). All numbers are assumptions, apart from `IN_CABINET`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Relation = Literal[
    "edge", "middle", "near", "far", "in front of", "behind", "left of", "right of", "side of", "around",
    "center aligned", "face to",
]  # fmt: skip
"""Holodeck's constraint vocabulary (section 3 of the paper and its prompt for constraints)."""

IN_CABINET = 0.583
"""Probability that a reagent that the description names goes into the chemical cabinet and not onto a bench: the share
of stored reagents of Holodeck in LabBuilder's Table 2."""


@dataclass(frozen=True)
class Top:
    """Small objects on each piece of a kind: the model lists `asset` with a probability, `least` to `most` of it."""

    asset: str
    chance: float
    least: int = 1
    most: int = 1


@dataclass(frozen=True)
class Choice:
    """A kind of large object that the model may list.

    Attributes:
        asset: catalog entry. chance: probability that it is listed. least, most: how many.
        relations: constraints in Holodeck's words, each with a kind of object that is listed earlier ("" for none);
            the first one is global.
        aligned: whether further pieces of the kind are aligned with the first ("objects of the same type are usually
            aligned", Holodeck's prompt).
        tops: what stands on each piece.
    """

    asset: str
    chance: float
    least: int = 1
    most: int = 1
    relations: tuple[tuple[Relation, str], ...] = (("edge", ""),)
    aligned: bool = False
    tops: tuple[Top, ...] = ()


@dataclass(frozen=True)
class Hanging:
    """A kind of wall object: probability, what it hangs above ("" for anywhere), height of its bottom in meters."""

    asset: str
    chance: float
    above: str
    height: float


BENCH_TOPS = (
    Top("Beaker", 0.9, 1, 3),
    Top("ErlenmeyerFlask", 0.7, 1, 2),
    Top("GraduatedCylinder", 0.5, 1, 2),
    Top("TestTubeRack", 0.6),
    Top("BunsenBurner", 0.4),
    Top("Microscope", 0.4),
    Top("MagneticHotplateStirrer", 0.4),
    Top("ElectronicScale", 0.4),
    Top("PipetteStand", 0.3),
    Top("PHMeter", 0.2),
    Top("Centrifuge", 0.2),
)
HOOD_TOPS = (
    Top("RoundBottomFlask", 0.7, 1, 2),
    Top("ReagentBottle", 0.6, 1, 3),
    Top("MagneticHotplateStirrer", 0.5),
    Top("RefluxCondenser", 0.3),
    Top("SeparatoryFunnel", 0.3),
)

FLOOR: tuple[Choice, ...] = (
    Choice("IslandBench2400", 0.9, 1, 2, (("middle", ""),), True, BENCH_TOPS),
    Choice("LabBench1800", 1.0, 2, 4, (("edge", ""),), True, BENCH_TOPS),
    Choice("FumeHood", 1.0, 1, 2, (("edge", ""),), True, HOOD_TOPS),
    Choice("SinkBench", 0.8, 1, 1, (("edge", ""), ("near", "LabBench1800")), tops=(Top("WashBottle", 0.7, 1, 2),)),
    Choice(
        "WritingDesk",
        0.6,
        1,
        1,
        (("edge", ""), ("far", "FumeHood")),
        tops=(Top("Monitor", 0.7), Top("Keyboard", 0.6), Top("Laptop", 0.4)),
    ),
    Choice(
        "GeneralCabinet",
        0.9,
        1,
        2,
        (("edge", ""),),
        True,
        (Top("ReagentBottle", 0.9, 2, 4), Top("SolventBottle", 0.5, 1, 2)),
    ),
    Choice("FlammableCabinet", 0.5, 1, 1, (("edge", ""), ("far", "FumeHood")), tops=(Top("SolventBottle", 0.8, 1, 3),)),
    Choice(
        "GlasswareCabinet",
        0.6,
        1,
        1,
        (("edge", ""), ("near", "SinkBench")),
        tops=(Top("Beaker", 0.8, 2, 4), Top("ErlenmeyerFlask", 0.8, 2, 3), Top("VolumetricFlask", 0.6, 1, 3)),
    ),
    Choice("EquipmentRack", 0.5, 1, 2, (("edge", ""),), True, (Top("BottleRack", 0.5), Top("DewarFlask", 0.4))),
    Choice("LabRefrigerator", 0.5, 1, 1),
    Choice("EmergencyShower", 0.5, 1, 1),
    Choice("EyewashStation", 0.6, 1, 1, (("edge", ""), ("near", "SinkBench"))),
    Choice("WasteBin", 0.6, 1, 2, (("edge", ""), ("near", "LabBench1800"))),
    Choice("NitrogenCylinder", 0.4, 1, 2, (("edge", ""), ("near", "FumeHood"))),
    Choice("ServiceTrolley", 0.3, 1, 1, (("middle", ""), ("near", "LabBench1800"))),
    Choice("LabStool", 0.9, 2, 6, (("middle", ""), ("around", "IslandBench2400"))),
)
"""Large objects, in the order in which the model lists them: anchors first, and the larger ones before the smaller."""

WALL: tuple[Hanging, ...] = (
    Hanging("Whiteboard", 0.6, "WritingDesk", 1.0),
    Hanging("FireExtinguisher", 0.7, "", 0.9),
    Hanging("FirstAidKit", 0.4, "", 1.4),
    Hanging("Clock", 0.5, "", 2.0),
    Hanging("SafetySign", 0.4, "", 1.6),
    Hanging("WallShelf", 0.3, "LabBench1800", 1.5),
)
"""Objects on walls."""

REAGENT_HOMES = ("LabBench1800", "FumeHood")
"""Where a named reagent stands that is not in the cabinet."""
CABINET, BENCH = "GeneralCabinet", "LabBench1800"
"""The chemical cabinet, and where a named instrument stands."""
