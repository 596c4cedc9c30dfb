"""The whole report recomputed by plain loops over shapely polygons, on generated laboratories shaken at random."""

from __future__ import annotations

import math
from itertools import combinations

import numpy as np
import pytest
from shapely.affinity import rotate as turn
from shapely.affinity import translate
from shapely.geometry import MultiPoint, Point, Polygon, box

from labgym.assets import Catalog, incompatible
from labgym.eval import score
from labgym.geometry import OrientedBox
from labgym.layouts import Layout, Placement, Room
from labgym.layouts.generate import resolve_request
from labgym.layouts.interiors import FloorProposer
from labgym.protocols import protocols

CATALOG = Catalog.load()


@pytest.fixture(scope="module", params=["sub_01", "alk_02", pytest.param("red_03", marks=pytest.mark.slow)])
def shaken(request: pytest.FixtureRequest) -> Layout:
    """A generated laboratory with a third of its objects moved by centimetres to decimetres."""
    # The solver's plan, before apparatus are assembled: pieces of one apparatus touch, and that is no collision.
    layout = FloorProposer().plan(resolve_request(protocols()[request.param], seed=1)).layout()
    rng = np.random.default_rng(7)
    return layout.replace(placements=tuple(jolted(placement, rng) for placement in layout.placements))


def jolted(placement: Placement, rng: np.random.Generator) -> Placement:
    if rng.random() > 1 / 3:
        return placement
    x, y, z = placement.position
    dx, dy = rng.normal(0.0, 0.1, 2)
    dz = rng.choice([0.0, 0.0, 0.004, 0.02])
    return placement.model_copy(
        update={"position": (x + dx, y + dy, z + dz), "yaw": placement.yaw + rng.choice([0.0, 0.3])}
    )


def footprint(part: OrientedBox) -> Polygon:
    flat = box(-part.width / 2, -part.depth / 2, part.width / 2, part.depth / 2)
    return translate(turn(flat, part.yaw, origin=(0, 0), use_radians=True), part.x, part.y)


def depth(a: OrientedBox, b: OrientedBox) -> float:
    vertical = min(a.z1, b.z1) - max(a.z0, b.z0)
    if vertical <= 0.0 or not footprint(a).intersects(footprint(b)):
        return 0.0
    corners_a, corners_b = (np.array(footprint(part).exterior.coords) for part in (a, b))
    hull = MultiPoint([p - q for p in corners_a for q in corners_b]).convex_hull
    return min(vertical, hull.exterior.distance(Point(0, 0)))


def gap(a: OrientedBox, b: OrientedBox) -> float:
    return math.hypot(footprint(a).distance(footprint(b)), max(0.0, a.z0 - b.z1, b.z0 - a.z1))


def objects(layout: Layout) -> list[Placement]:
    return [p for p in layout.placements if CATALOG.get(p.asset).category not in ("opening", "robot")]


def out_of_bounds(layout: Layout) -> set[str]:
    room = layout.room
    interior = box(0, 0, room.width, room.depth)
    found = set()
    for placement in objects(layout):
        own = layout.box(placement.id)
        base = footprint(own)
        if not interior.buffer(0.010, join_style="mitre").contains(base) or own.z1 > room.height + 0.010:
            found.add(placement.id)
        if placement.support == "floor":
            wrong = abs(own.z0) > 0.005
        elif placement.support == "wall":
            sides = zip(base.exterior.coords, base.exterior.coords[1:], strict=False)
            wrong = min(farthest(room, side) for side in sides) > 0.020
        else:
            assert placement.slot is not None
            top = layout.surface(placement.support, placement.slot)
            inside = footprint(top).buffer(0.005, join_style="mitre").contains(base)
            wrong = not inside or abs(own.z0 - top.z0) > 0.005
        if wrong:
            found.add(placement.id)
    return found


def farthest(room: Room, side: tuple[tuple[float, float], ...]) -> float:
    walls = ([x for x, _ in side], [y for _, y in side])
    return min(max(walls[0]), max(walls[1]), room.width - min(walls[0]), room.depth - min(walls[1]))


def colliding(layout: Layout) -> set[frozenset[str]]:
    solids = {placement.id: layout.solids(placement.id) for placement in objects(layout)}
    return {
        frozenset((a, b))
        for a, b in combinations(solids, 2)
        if depth(layout.box(a), layout.box(b)) > 0.0
        and any(depth(one, other) > 0.001 for one in solids[a] for other in solids[b])
    }


def banded(distance: float, d_min: float, d_low: float) -> float:
    return 1.0 if distance >= d_min else distance / d_min if distance >= d_low else 0.0


def test_a_shaken_laboratory_scores_what_plain_loops_over_polygons_find(shaken: Layout) -> None:
    report = score(shaken, rules="paper")
    wrong, pairs = out_of_bounds(shaken), colliding(shaken)
    faulty = wrong.union(*pairs)
    assert {v.ids[0] for v in report.violations if v.kind == "bounds"} == wrong
    assert {frozenset(v.ids) for v in report.violations if v.kind == "collision"} == pairs
    assert (report.ob, report.cn) == (len(wrong), len(pairs))
    assert min(report.ob, report.cn) > 0
    assert report.cn_mj == len(pairs)

    boxes = {placement.id: shaken.box(placement.id) for placement in objects(shaken)}
    assets = {placement.id: CATALOG.get(placement.asset) for placement in objects(shaken)}
    reagents = [name for name, asset in assets.items() if asset.kind == "reagent"]

    def kept(value: float, *ids: str) -> float:
        return 0.0 if faulty.intersection(ids) else value

    flam = [
        kept(banded(gap(boxes[a], boxes[b]), *((3.0, 0.6) if assets[b].heat_class == "flame" else (1.0, 0.3))), a, b)
        for a in reagents
        for b in assets
        if assets[a].hazards.flammable and assets[b].heat_class in ("flame", "hot_surface", "bath", "oven")
    ]
    incomp = [
        kept(banded(gap(boxes[a], boxes[b]), 1.0, 0.3), a, b)
        for a, b in combinations(reagents, 2)
        if incompatible(assets[a], assets[b]) is not None
    ]
    glass = []
    for placement in objects(shaken):
        asset = assets[placement.id]
        on_furniture = placement.support in assets and assets[placement.support].storage_class is None
        if asset.kind == "instrument" and asset.hazards.glass_container and on_furniture:
            assert placement.slot is not None
            top, base = footprint(shaken.surface(placement.support, placement.slot)), footprint(boxes[placement.id])
            distance = top.exterior.distance(base) if top.contains(base) else 0.0
            glass.append(kept(min(1.0, distance / 0.15), placement.id))
    store = [kept(float(stored(shaken, name)), name) for name in reagents]
    for name, values, worst in (
        ("flam", flam, 3),
        ("incomp", incomp, 3),
        ("glass", glass, None),
        ("store", store, None),
    ):
        chosen = sorted(values)[:worst]
        expected = pytest.approx(sum(chosen) / len(chosen), abs=1e-9) if chosen else None
        assert getattr(report, name) == expected, name
        assert report.instances[name] == len(values)
    assert report.fitness == pytest.approx(
        0.5 * (1 - len(faulty) / report.obj) + 0.5 * np.mean([*flam, *incomp, *glass, *store])
    )


def stored(layout: Layout, reagent: str) -> bool:
    placement = layout.placement(reagent)
    if placement.support not in layout.by_id:
        return False
    cabinet, item = layout.asset(placement.support), layout.box(reagent)
    cavity = cabinet.cavity
    if cavity is None or cabinet.storage_class in (None, "Glassware", "Waste"):
        return False
    where = layout.placement(placement.support)
    hollow = box(
        cavity.x - cavity.width / 2,
        cavity.y - cavity.depth / 2,
        cavity.x + cavity.width / 2,
        cavity.y + cavity.depth / 2,
    ).buffer(0.001, join_style="mitre")
    hollow = translate(turn(hollow, where.yaw, origin=(0, 0), use_radians=True), where.position[0], where.position[1])
    floor = where.position[2]
    upright = item.z0 >= floor + cavity.z0 - 0.001 and item.z1 <= floor + cavity.z1 + 0.001
    on_shelf = any(abs(item.z0 - floor - surface.z) <= 0.005 for surface in cabinet.surfaces)
    return hollow.contains(footprint(item)) and upright and on_shelf
