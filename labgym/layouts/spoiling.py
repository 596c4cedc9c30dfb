"""Thirty-nine ways to spoil a layout that is in order, for tests of metrics and judges.

Each must lower a headline figure of touchstone-v2 (docs/metrics.md). Deterministic; any floor. The damage that repairs
are evaluated with, drawn at random, is in `labgym.layouts.damage`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

from labgym.assets import Asset
from labgym.layouts.model import FLOOR, WALL, Layout, Placement
from labgym.layouts.moves import Move, Place, Rotate, Settle, apply, descendants, lifted, replaced
from labgym.layouts.rules.building import building_of
from labgym.layouts.rules.presence import resolved
from labgym.layouts.rules.separation import HEAT_CLASSES, hazard_between
from labgym.layouts.rules.storage import STORAGE_CLASSES
from labgym.layouts.rules.thresholds import MOVABLE
from labgym.navigation import goal_poses
from labgym.protocols import Protocol
from labgym.protocols.places import is_ventilated

Spoil = Callable[[Layout, Protocol], Layout]


@dataclass(frozen=True)
class Spoiling:
    """A way to spoil a layout.

    Attributes:
        title: what is done, in words.
        figures: headline figures of touchstone-v2, each of which it worsens if it changes the layout.
        spoil: returns the spoilt layout, or the same object if there is nothing of the kind to spoil.
    """

    title: str
    figures: tuple[str, ...]
    spoil: Spoil


def _of(layout: Layout, test: Callable[[Placement, Asset], bool]) -> list[str]:
    return [placement.id for placement in layout.placements if test(placement, layout.asset(placement.id))]


def _furniture(layout: Layout) -> list[str]:
    return _of(layout, lambda p, a: p.support == FLOOR and a.clearance > 0.0 and a.subtype not in MOVABLE)


def _benches(layout: Layout) -> list[str]:
    return _of(layout, lambda p, a: p.support == FLOOR and a.subtype == "workbench" and bool(a.surfaces))


def _hoods(layout: Layout) -> list[str]:
    return _of(layout, lambda _, a: a.fume_hood)


def _heats(_: Placement, asset: Asset) -> bool:
    return asset.heat_class in HEAT_CLASSES


def _instruments(layout: Layout) -> list[str]:
    """Instruments that stand directly on furniture."""
    return _of(
        layout,
        lambda p, a: (
            a.kind == "instrument" and p.support not in (FLOOR, WALL) and layout.asset(p.support).kind == "facility"
        ),
    )


def _reagents(layout: Layout) -> list[str]:
    return _of(layout, lambda p, a: a.kind == "reagent" and p.support not in (FLOOR, WALL))


def _required(layout: Layout, protocol: Protocol) -> set[str]:
    """Ids of the placements that fill the multiset of the protocol's assets."""
    needed = list(resolved(protocol.required_assets(), layout.catalog))
    kept = set()
    for placement in layout.placements:
        role = layout.asset(placement.id).role
        if role in needed:
            needed.remove(role)
            kept.add(placement.id)
    return kept


def _without(layout: Layout, ids: Iterable[str]) -> Layout:
    """Remove objects with what stands on them."""
    gone = {each for own in ids for each in (own, *descendants(layout, own))}
    if not gone:
        return layout
    return layout.replace(placements=tuple(placement for placement in layout.placements if placement.id not in gone))


def _on_floor(layout: Layout, each: str) -> Layout:
    """Let an object lie on the floor below its place, with what stands on it."""
    fallen = lifted(layout, each, 0.0)
    return replaced(fallen, {each: fallen.placement(each).model_copy(update={"support": FLOOR, "slot": None})})


def _settle_in_row(layout: Layout, ids: Iterable[str], carriers: Iterable[str], slot: int = 0) -> Layout:
    """Stand objects side by side on furniture, from the left end of each surface."""
    waiting = list(ids)
    for carrier in carriers:
        surface, along = layout.surface(carrier, slot), 0.0
        while waiting:
            size = layout.asset(waiting[0]).size
            reach = max(size.width, size.depth)
            if along + reach > surface.width or size.depth > surface.depth:
                break
            x = along + reach / 2.0 - surface.width / 2.0
            layout = apply(layout, Settle(waiting.pop(0), carrier, slot, x, 0.0))
            along += reach + 0.02
    return layout


def instruments_on_floor(layout: Layout, _: Protocol) -> Layout:
    """Lay every instrument on the floor."""
    for each in _instruments(layout):
        layout = _on_floor(layout, each)
    return layout


def one_flask_on_floor(layout: Layout, _: Protocol) -> Layout:
    """Lay one piece of glassware on the floor."""
    glass = [each for each in _instruments(layout) if layout.asset(each).hazards.glass_container]
    return _on_floor(layout, glass[0]) if glass else layout


def sink_in_door(layout: Layout, _: Protocol) -> Layout:
    """Put the sink, or else a bench, in every door that leads out."""
    pieces = _of(layout, lambda p, a: p.support == FLOOR and a.subtype == "sink") + _benches(layout)
    exits = [entrance for entrance in building_of(layout).entrances if entrance.exit]
    for piece, entrance in zip(pieces, exits, strict=False):
        x, y, yaw = entrance.pose
        depth = layout.asset(piece).size.depth / 2.0 + 0.02
        layout = apply(layout, Place(piece, x - depth * math.sin(yaw), y + depth * math.cos(yaw), yaw))
    return layout


def bare_necessities(layout: Layout, protocol: Protocol) -> Layout:
    """Keep only what the protocol requires, and what carries it."""
    kept = _required(layout, protocol)
    kept |= {layout.root(each).id for each in kept}
    for each in list(kept):
        while layout.placement(each).support not in (FLOOR, WALL):
            each = layout.placement(each).support
            kept.add(each)
    return _without(layout, [p.id for p in layout.placements if p.id not in kept])


def wrong_cabinets(layout: Layout, _: Protocol) -> Layout:
    """Make every reagent cabinet one of another class, by exchanging their contents in turn."""
    cabinets = _of(layout, lambda _, a: a.storage_class in STORAGE_CLASSES)
    stock = {cabinet: [p.id for p in layout.children(cabinet)] for cabinet in cabinets}
    used = [cabinet for cabinet in cabinets if stock[cabinet]]
    for cabinet, other in zip(used, used[1:] + used[:1], strict=True):
        if layout.asset(cabinet).storage_class == layout.asset(other).storage_class:
            other = next((each for each in cabinets if not stock[each]), other)
        layout = _settle_in_row(layout, stock[cabinet], [other])
    return layout


def one_reagent_in_wrong_cabinet(layout: Layout, _: Protocol) -> Layout:
    """Put one reagent in a cabinet of another class."""
    for reagent in _reagents(layout):
        own = layout.asset(layout.placement(reagent).support).storage_class
        for other in _of(layout, lambda _, a: a.storage_class in STORAGE_CLASSES):
            if layout.asset(other).storage_class != own:
                return _settle_in_row(layout, [reagent], [other])
    return layout


def furniture_faces_wall(layout: Layout, _: Protocol) -> Layout:
    """Turn all furniture about, so that it faces the wall behind it."""
    for each in _furniture(layout):
        layout = apply(layout, Rotate(each, layout.placement(each).yaw + math.pi))
    return layout


def cabinet_faces_wall(layout: Layout, _: Protocol) -> Layout:
    """Turn one reagent cabinet about."""
    cabinets = _of(layout, lambda p, a: p.support == FLOOR and a.storage_class in STORAGE_CLASSES)
    return apply(layout, Rotate(cabinets[0], layout.placement(cabinets[0]).yaw + math.pi)) if cabinets else layout


def hood_faces_wall(layout: Layout, _: Protocol) -> Layout:
    """Turn the first hood about."""
    hoods = _hoods(layout)
    return apply(layout, Rotate(hoods[0], layout.placement(hoods[0]).yaw + math.pi)) if hoods else layout


def hood_without_clearance(layout: Layout, _: Protocol) -> Layout:
    """Put a bench 0.4 m in front of a hood."""
    hoods, benches = _hoods(layout), _benches(layout)
    return _in_front(layout, benches[0], hoods[0], 0.4) if hoods and benches else layout


def _in_front(layout: Layout, piece: str, target: str, gap: float) -> Layout:
    box, depth = layout.box(target), layout.asset(piece).size.depth
    out = box.depth / 2.0 + gap + depth / 2.0
    return apply(layout, Place(piece, box.x + out * box.front[0], box.y + out * box.front[1], box.yaw))


def glass_at_edge(layout: Layout, _: Protocol) -> Layout:
    """Push glassware to the front edge of its surface."""
    for each in _instruments(layout):
        item = layout.placement(each)
        if layout.asset(each).hazards.glass_container and layout.asset(item.support).storage_class is None:
            surface, size = layout.surface(item.support, item.slot or 0), layout.asset(each).size
            x = surface.to_local(*item.position[:2])[0]
            turn = item.yaw - surface.yaw
            reach = (abs(math.sin(turn)) * size.width + abs(math.cos(turn)) * size.depth) / 2.0
            layout = apply(layout, Settle(each, item.support, item.slot or 0, x, surface.depth / 2.0 - reach, turn))
    return layout


def reagents_on_bench(layout: Layout, _: Protocol) -> Layout:
    """Leave all reagents on benches."""
    return _settle_in_row(layout, _reagents(layout), _benches(layout))


def reagents_in_hood(layout: Layout, _: Protocol) -> Layout:
    """Leave all reagents in the hoods."""
    return _settle_in_row(layout, _reagents(layout), _hoods(layout))


def reagent_on_floor(layout: Layout, _: Protocol) -> Layout:
    """Leave one reagent on the floor."""
    reagents = _reagents(layout)
    return _on_floor(layout, reagents[0]) if reagents else layout


def _lacking(*roles: str) -> Spoil:
    def spoil(layout: Layout, _: Protocol) -> Layout:
        return _without(layout, _of(layout, lambda _, a: a.role in roles))

    return spoil


def shower_crowded(layout: Layout, _: Protocol) -> Layout:
    """Push the nearest furniture against the emergency shower."""
    showers = _of(layout, lambda _, a: a.subtype == "shower")
    if not showers:
        return layout
    box = layout.box(showers[0])
    others = [each for each in _furniture(layout) if each != showers[0]]
    nearest = min(others, key=lambda each: math.dist((box.x, box.y), layout.placement(each).position[:2]))
    return _in_front(layout, nearest, showers[0], 0.0)


def vessels_out_of_hood(layout: Layout, _: Protocol) -> Layout:
    """Take every instrument out of ventilated places."""
    inside = [each for each in _instruments(layout) if is_ventilated(layout.asset(layout.placement(each).support))]
    return _settle_in_row(layout, inside, reversed(_benches(layout)))


def apparatus_apart(layout: Layout, protocol: Protocol) -> Layout:
    """Put one piece of each apparatus on the bench that is farthest from the others."""
    moved = set()
    for rule in protocol.spatial_constraints:
        pieces = [each for each in _instruments(layout) if layout.asset(each).role == rule.subject]
        if rule.kind != "near" or not pieces or rule.subject in moved:
            continue
        moved.add(rule.subject)
        for piece in pieces:
            x, y, _ = layout.placement(piece).position
            far = max(_benches(layout), key=lambda each: math.dist((x, y), layout.placement(each).position[:2]))
            layout = _settle_in_row(layout, [piece], [far])
    return layout


def put_away(layout: Layout, protocol: Protocol) -> Layout:
    """Put the protocol's instruments away on benches other than those where they are used."""
    homes = {rule.subject: rule.object for rule in protocol.spatial_constraints if rule.kind == "on"}
    used = [each for each in _instruments(layout) if layout.asset(each).role in homes]
    other = [bench for bench in _benches(layout) if layout.asset(bench).role not in protocol.locations]
    away = [each for each in used if layout.placement(each).support not in other]
    return _settle_in_row(layout, away, other or _benches(layout))


def heat_by_flammables(layout: Layout, _: Protocol) -> Layout:
    """Put what carries a heat source next to the flammables."""
    heat = _of(layout, _heats)
    stores = {layout.root(each).id for each in _reagents(layout) if layout.asset(each).hazards.flammable}
    carriers = [layout.root(each).id for each in heat if layout.root(each).id not in stores]
    if not carriers or not stores:
        return layout
    return _in_front(layout, carriers[0], min(stores), 0.05)


def burner_in_hood(layout: Layout, protocol: Protocol) -> Layout:
    """Put a heat source that the protocol uses elsewhere where flammable reagents are handled."""
    flammable = {use.name for use in protocol.reagents if layout.catalog.find(use.name).hazards.flammable}
    places = [step.location for step in protocol.steps if not flammable.isdisjoint(step.uses)]
    for location in places:
        own = {name for step in protocol.steps if step.location == location for name in step.uses}
        heat = [each for each in _of(layout, _heats) if layout.asset(each).role not in own]
        target = layout.find(location)
        heat = [each for each in heat if layout.placement(each).support in layout.by_id]
        if heat and target is not None and layout.asset(target.id).surfaces:
            return apply(layout, Settle(heat[0], target.id, 0, 0.0, 0.0))
    return layout


def incompatibles_together(layout: Layout, _: Protocol) -> Layout:
    """Put two incompatible reagents side by side."""
    reagents = _reagents(layout)
    for k, first in enumerate(reagents):
        for second in reagents[k + 1 :]:
            if hazard_between(layout.asset(first), layout.asset(second), "segregation") is not None:
                return _settle_in_row(layout, [second, first], [layout.placement(first).support])
    return layout


def goal_pose_blocked(layout: Layout, protocol: Protocol) -> Layout:
    """Put a bench where the robot works."""
    poses, benches = list(goal_poses(layout, protocol).values()), _benches(layout)
    places = {found.id for name in protocol.locations if (found := layout.find(name)) is not None}
    free = [bench for bench in benches if bench not in places] or _furniture(layout)
    return apply(layout, Place(free[0], poses[0][0], poses[0][1], poses[0][2] + math.pi / 2.0))


def stools_in_doors(layout: Layout, _: Protocol) -> Layout:
    """Leave movable objects, or else furniture, just inside each door."""
    loose = _of(layout, lambda p, a: p.support == FLOOR and a.subtype in MOVABLE) + _benches(layout)
    for piece, entrance in zip(loose, building_of(layout).entrances, strict=False):
        x, y, yaw = entrance.pose
        layout = apply(layout, Place(piece, x - 0.35 * math.sin(yaw), y + 0.35 * math.cos(yaw), yaw))
    return layout


def narrow_way(layout: Layout, _: Protocol) -> Layout:
    """Put furniture before every exit so that the way on is 0.65 m wide."""
    pieces = sorted(_furniture(layout), key=lambda each: -layout.asset(each).size.width)
    for piece, entrance in zip(pieces, (one for one in building_of(layout).entrances if one.exit), strict=False):
        (x, y, yaw), out = entrance.pose, 0.65 + layout.asset(piece).size.depth / 2.0
        layout = apply(layout, Place(piece, x - out * math.sin(yaw), y + out * math.cos(yaw), yaw))
    return layout


def items_float(layout: Layout, _: Protocol) -> Layout:
    """Lift all instruments by 5 cm."""
    for each in _instruments(layout):
        layout = lifted(layout, each, layout.placement(each).position[2] + 0.05)
    return layout


def items_over_edge(layout: Layout, _: Protocol) -> Layout:
    """Push instruments half over the front edge of their bench."""
    for each in _instruments(layout):
        item = layout.placement(each)
        if layout.asset(item.support).cavity is None:
            surface = layout.surface(item.support, item.slot or 0)
            x = surface.to_local(*item.position[:2])[0]
            turn = item.yaw - surface.yaw
            layout = apply(layout, Settle(each, item.support, item.slot or 0, x, surface.depth / 2.0, turn))
    return layout


def furniture_stacked(layout: Layout, _: Protocol) -> Layout:
    """Put one piece of furniture into another."""
    first, second = _furniture(layout)[:2]
    return apply(layout, Place(second, *layout.placement(first).position[:2], layout.placement(first).yaw))


def bench_on_bench(layout: Layout, _: Protocol) -> Layout:
    """Stand a piece of furniture on top of a bench."""
    top = _benches(layout)[0]
    piece = min((each for each in _furniture(layout) if each != top), key=lambda each: layout.asset(each).size.width)
    return apply(layout, Settle(piece, top, 0, 0.0, 0.0))


def furniture_in_wall(layout: Layout, _: Protocol) -> Layout:
    """Push furniture 0.1 m into the wall behind it."""
    for each in _furniture(layout):
        fx, fy = layout.box(each).front
        layout = apply(layout, Move(each, round(-0.1 * fx, 6), round(-0.1 * fy, 6)))
    return layout


def instrument_missing(layout: Layout, protocol: Protocol) -> Layout:
    """Remove all placements of one instrument that the protocol requires."""
    name = layout.catalog.find(protocol.instruments[0]).role
    return _without(layout, _of(layout, lambda _, a: a.role == name))


def hood_missing(layout: Layout, _: Protocol) -> Layout:
    """Remove the hoods, with what is in them."""
    return _without(layout, _hoods(layout))


def far_on_benches(layout: Layout, protocol: Protocol) -> Layout:
    """Push the protocol's instruments to the far corner of their surface, out of an arm's reach."""
    needed = _required(layout, protocol)
    for each in _instruments(layout):
        item = layout.placement(each)
        surface, size = layout.surface(item.support, item.slot or 0), layout.asset(each).size
        if each in needed and layout.asset(item.support).cavity is None:
            x, y = surface.width / 2.0 - size.width / 2.0, -surface.depth / 2.0 + size.depth / 2.0
            layout = apply(layout, Settle(each, item.support, item.slot or 0, x, y))
    return layout


def wall_units_on_floor(layout: Layout, _: Protocol) -> Layout:
    """Take what hangs on walls down to the floor."""
    for each in _of(layout, lambda p, _: p.support == WALL):
        layout = _on_floor(layout, each)
    return layout


def hood_at_door(layout: Layout, _: Protocol) -> Layout:
    """Put a hood next to a door, with its back to the wall."""
    hoods, entrances = _hoods(layout), building_of(layout).entrances
    if not hoods or not entrances:
        return layout
    (x, y, yaw), size = entrances[0].pose, layout.asset(hoods[0]).size
    along, out = entrances[0].width / 2.0 + 0.1 + size.width / 2.0, size.depth / 2.0
    across = (math.cos(yaw), math.sin(yaw))
    place = (x + along * across[0] - out * math.sin(yaw), y + along * across[1] + out * math.cos(yaw))
    return apply(layout, Place(hoods[0], *place, yaw))


SPOILINGS: Mapping[str, Spoiling] = {
    "instruments_on_floor": Spoiling("all instruments on the floor", ("ob", "glass", "v"), instruments_on_floor),
    "sink_in_door": Spoiling("the sink in the only door", ("door_nav", "facility", "v"), sink_in_door),
    "bare_necessities": Spoiling("only what the protocol requires", ("asset", "safety", "v"), bare_necessities),
    "wrong_cabinets": Spoiling("every reagent in a cabinet of a wrong class", ("store", "v"), wrong_cabinets),
    "furniture_faces_wall": Spoiling("all furniture faces the wall", ("fronts", "v"), furniture_faces_wall),
    "one_flask_on_floor": Spoiling("one flask on the floor", ("ob", "glass", "v"), one_flask_on_floor),
    "one_reagent_in_wrong_cabinet": Spoiling(
        "one reagent in a wrong cabinet", ("store", "v"), one_reagent_in_wrong_cabinet
    ),
    "reagents_on_bench": Spoiling("reagents left on benches", ("store", "v"), reagents_on_bench),
    "reagents_in_hood": Spoiling("reagents left in hoods", ("store", "v"), reagents_in_hood),
    "reagent_on_floor": Spoiling("a reagent on the floor", ("ob", "store", "v"), reagent_on_floor),
    "cabinet_faces_wall": Spoiling("one cabinet faces the wall", ("fronts", "v"), cabinet_faces_wall),
    "hood_faces_wall": Spoiling("a hood faces the wall", ("fronts", "v"), hood_faces_wall),
    "hood_without_clearance": Spoiling("a bench 0.4 m before a hood", ("fronts", "v"), hood_without_clearance),
    "glass_at_edge": Spoiling("glassware at the edge", ("glass", "fitness"), glass_at_edge),
    "no_shower": Spoiling("no emergency shower", ("asset", "safety"), _lacking("EmergencyShower")),
    "no_eyewash": Spoiling("no eyewash", ("asset", "safety", "v"), _lacking("EyewashStation")),
    "no_extinguisher": Spoiling(
        "no fire extinguisher",
        ("asset", "safety", "v"),
        _lacking("FireExtinguisher", "CO2Extinguisher", "ClassDExtinguisher"),
    ),
    "no_spill_kit": Spoiling("no spill kit", ("asset", "safety", "v"), _lacking("SpillKit")),
    "no_waste": Spoiling(
        "nothing for waste",
        ("asset", "safety", "v"),
        _lacking("SolventWasteContainer", "SolidWasteBin", "WasteStation"),
    ),
    "shower_crowded": Spoiling("furniture under the emergency shower", ("facility", "v"), shower_crowded),
    "vessels_out_of_hood": Spoiling("vessels out of the hood", ("ventilate", "v"), vessels_out_of_hood),
    "apparatus_apart": Spoiling("the pieces of an apparatus apart", ("near", "fitness"), apparatus_apart),
    "put_away": Spoiling("instruments away from where they are used", ("reach",), put_away),
    "heat_by_flammables": Spoiling("heat next to the flammables", ("flam", "v"), heat_by_flammables),
    "burner_in_hood": Spoiling("heat where flammables are handled", ("flam", "v"), burner_in_hood),
    "incompatibles_together": Spoiling("incompatible reagents together", ("incomp", "v"), incompatibles_together),
    "goal_pose_blocked": Spoiling("a bench where the robot works", ("prot_nav", "v"), goal_pose_blocked),
    "stools_in_doors": Spoiling("stools inside the doors", ("facility", "v"), stools_in_doors),
    "narrow_way": Spoiling("a way of 0.65 m from the exits", ("facility", "v"), narrow_way),
    "items_float": Spoiling("instruments float", ("ob", "v"), items_float),
    "items_over_edge": Spoiling("instruments over the edge", ("ob", "v"), items_over_edge),
    "furniture_stacked": Spoiling("furniture in furniture", ("cn", "v"), furniture_stacked),
    "bench_on_bench": Spoiling("furniture on a bench", ("ob", "v"), bench_on_bench),
    "furniture_in_wall": Spoiling("furniture in the wall", ("ob", "v"), furniture_in_wall),
    "instrument_missing": Spoiling("a required instrument is missing", ("asset", "v"), instrument_missing),
    "hood_missing": Spoiling("the hoods are missing", ("asset", "v"), hood_missing),
    "far_on_benches": Spoiling("instruments in the far corners", ("reach",), far_on_benches),
    "wall_units_on_floor": Spoiling("wall units on the floor", ("ob", "v"), wall_units_on_floor),
    "hood_at_door": Spoiling("a hood next to a door", ("facility",), hood_at_door),
}
"""Ways to spoil a layout by name; the first five passed touchstone-v1 at full score."""
