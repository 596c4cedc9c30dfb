"""The ways to spoil a layout, each with the figures that it must worsen."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from labgym.layouts.model import Layout
from labgym.layouts.moves import without
from labgym.layouts.placement import FLOOR, WALL
from labgym.protocols import Protocol
from spoiling import furniture, hazards, instruments
from spoiling.objects import hoods_of, ids_where, required_of


def bare_necessities(layout: Layout, protocol: Protocol) -> Layout:
    """Keep only what the protocol requires, and what carries it."""
    kept = required_of(layout, protocol)
    kept |= {layout.root(each).id for each in kept}
    for each in list(kept):
        while layout.placement(each).support not in (FLOOR, WALL):
            each = layout.placement(each).support
            kept.add(each)
    return without(layout, [p.id for p in layout.placements if p.id not in kept])


def lacking(*roles: str) -> Callable[[Layout, Protocol], Layout]:
    """Return the way to spoil a layout that removes all objects of some roles."""

    def spoil(layout: Layout, _: Protocol) -> Layout:
        return without(layout, ids_where(layout, lambda _, a: a.role in roles))

    return spoil


def instrument_missing(layout: Layout, protocol: Protocol) -> Layout:
    """Remove all placements of one instrument that the protocol requires."""
    name = layout.catalog.find(protocol.instruments[0]).role
    return without(layout, ids_where(layout, lambda _, a: a.role == name))


def hood_missing(layout: Layout, _: Protocol) -> Layout:
    """Remove the hoods, with what is in them."""
    return without(layout, hoods_of(layout))


Spoil = Callable[[Layout, Protocol], Layout]


@dataclass(frozen=True)
class Spoiling:
    """A way to spoil a layout.

    Attributes:
        title: what is done, in words.
        figures: headline figures of the rule set `touchstone`, each of which it worsens if it changes the layout.
        spoil: returns the spoilt layout, or the same object if there is nothing of the kind to spoil.
    """

    title: str
    figures: tuple[str, ...]
    spoil: Spoil


SPOILINGS: Mapping[str, Spoiling] = {
    "instruments_on_floor": Spoiling(
        "all instruments on the floor", ("ob", "glass", "v"), instruments.instruments_on_floor
    ),
    "sink_in_door": Spoiling("the sink in the only door", ("door_nav", "facility", "v"), furniture.sink_in_door),
    "bare_necessities": Spoiling("only what the protocol requires", ("asset", "safety", "v"), bare_necessities),
    "wrong_cabinets": Spoiling("every reagent in a cabinet of a wrong class", ("store", "v"), hazards.wrong_cabinets),
    "furniture_faces_wall": Spoiling("all furniture faces the wall", ("fronts", "v"), furniture.furniture_faces_wall),
    "one_flask_on_floor": Spoiling("one flask on the floor", ("ob", "glass", "v"), instruments.one_flask_on_floor),
    "one_reagent_in_wrong_cabinet": Spoiling(
        "one reagent in a wrong cabinet", ("store", "v"), hazards.one_reagent_in_wrong_cabinet
    ),
    "reagents_on_bench": Spoiling("reagents left on benches", ("store", "v"), hazards.reagents_on_bench),
    "reagents_in_hood": Spoiling("reagents left in hoods", ("store", "v"), hazards.reagents_in_hood),
    "reagent_on_floor": Spoiling("a reagent on the floor", ("ob", "store", "v"), hazards.reagent_on_floor),
    "cabinet_faces_wall": Spoiling("one cabinet faces the wall", ("fronts", "v"), furniture.cabinet_faces_wall),
    "hood_faces_wall": Spoiling("a hood faces the wall", ("fronts", "v"), furniture.hood_faces_wall),
    "hood_without_clearance": Spoiling(
        "a bench 0.4 m before a hood", ("fronts", "v"), furniture.hood_without_clearance
    ),
    "glass_at_edge": Spoiling("glassware at the edge", ("glass", "fitness"), instruments.glass_at_edge),
    "no_shower": Spoiling("no emergency shower", ("asset", "safety"), lacking("EmergencyShower")),
    "no_eyewash": Spoiling("no eyewash", ("asset", "safety", "v"), lacking("EyewashStation")),
    "no_extinguisher": Spoiling(
        "no fire extinguisher",
        ("asset", "safety", "v"),
        lacking("FireExtinguisher", "CO2Extinguisher", "ClassDExtinguisher"),
    ),
    "no_spill_kit": Spoiling("no spill kit", ("asset", "safety", "v"), lacking("SpillKit")),
    "no_waste": Spoiling(
        "nothing for waste",
        ("asset", "safety", "v"),
        lacking("SolventWasteContainer", "SolidWasteBin", "WasteStation"),
    ),
    "shower_crowded": Spoiling("furniture under the emergency shower", ("facility", "v"), furniture.shower_crowded),
    "vessels_out_of_hood": Spoiling("vessels out of the hood", ("ventilate", "v"), instruments.vessels_out_of_hood),
    "apparatus_apart": Spoiling("the pieces of an apparatus apart", ("near", "fitness"), instruments.apparatus_apart),
    "put_away": Spoiling("instruments away from where they are used", ("reach",), instruments.put_away),
    "heat_by_flammables": Spoiling("heat next to the flammables", ("flam", "v"), hazards.heat_by_flammables),
    "burner_in_hood": Spoiling("heat where flammables are handled", ("flam", "v"), hazards.burner_in_hood),
    "incompatibles_together": Spoiling(
        "incompatible reagents together", ("incomp", "v"), hazards.incompatibles_together
    ),
    "goal_pose_blocked": Spoiling("a bench where the robot works", ("prot_nav", "v"), furniture.goal_pose_blocked),
    "stools_in_doors": Spoiling("stools inside the doors", ("facility", "v"), furniture.stools_in_doors),
    "narrow_way": Spoiling("a way of 0.65 m from the exits", ("facility", "v"), furniture.narrow_way),
    "items_float": Spoiling("instruments float", ("ob", "v"), instruments.items_float),
    "items_over_edge": Spoiling("instruments over the edge", ("ob", "v"), instruments.items_over_edge),
    "furniture_stacked": Spoiling("furniture in furniture", ("cn", "v"), furniture.furniture_stacked),
    "bench_on_bench": Spoiling("furniture on a bench", ("ob", "v"), furniture.bench_on_bench),
    "furniture_in_wall": Spoiling("furniture in the wall", ("ob", "v"), furniture.furniture_in_wall),
    "instrument_missing": Spoiling("a required instrument is missing", ("asset", "v"), instrument_missing),
    "hood_missing": Spoiling("the hoods are missing", ("asset", "v"), hood_missing),
    "far_on_benches": Spoiling("instruments in the far corners", ("reach",), instruments.far_on_benches),
    "wall_units_on_floor": Spoiling("wall units on the floor", ("ob", "v"), furniture.wall_units_on_floor),
    "hood_at_door": Spoiling("a hood next to a door", ("facility",), furniture.hood_at_door),
}
"""Ways to spoil a layout by name; the first five passed the rule set `paper` at full score."""
