"""Holodeck's candidates and depth-first search against shapely and brute force."""

import itertools

import numpy as np
import pytest
from shapely import LineString, Point, box

from labgym.assets import Catalog
from labgym.layouts.floor import Door, Room
from labgym.layouts.generate import resolve_request
from labgym.paper.rivals.chamber import Chamber, chambers
from labgym.paper.rivals.holodeck.proposer import select
from labgym.paper.rivals.holodeck.search import SearchLimits, candidates, grid_step, search
from labgym.paper.rivals.holodeck.vocabulary import Spots
from labgym.paper.rivals.plan import Constraint, DesignPlan, Large

COARSE = 5
EVERYTHING = SearchLimits(first=10**6, later=10**6, expansions=10**6, density=COARSE)


@pytest.fixture(scope="module")
def catalog() -> Catalog:
    return Catalog.load()


def chamber_of(width: float, depth: float, *doors: Door) -> Chamber:
    room = Room(name="room", width=width, depth=depth, doors=doors or (Door(wall="front", offset=1.0),))
    return chambers(resolve_request("sub_01", 0, room, "default", None, ()))[0]


@pytest.fixture(scope="module")
def small() -> Chamber:
    return chamber_of(3.0, 2.0)


def test_the_grid_has_20_steps_on_the_longer_side() -> None:
    assert grid_step(chamber_of(8.0, 6.0), 20) == pytest.approx(0.40)
    assert grid_step(chamber_of(6.6, 7.2), 20) == pytest.approx(0.35)  # whole meters count


def test_candidates_are_those_that_shapely_finds() -> None:
    chamber = chamber_of(4.0, 3.0, Door(wall="front", offset=1.0, width=1.0))
    room, door, step = box(0, 0, 4, 3), box(0.5, 0.0, 1.5, 1.0), 0.2
    expected = set()
    for i, j, turn in itertools.product(range(1, 20), range(1, 15), range(4)):
        x, y = i * step, j * step
        half = (0.65, 0.45) if turn % 2 == 0 else (0.45, 0.65)  # 1.2 x 0.8 m with 10 cm of padding
        foot = box(x - half[0], y - half[1], x + half[0], y + half[1])
        front = [(0, 1), (-1, 0), (0, -1), (1, 0)][turn]
        clear = room.boundary.distance(Point(x + 0.45 * front[0], y + 0.45 * front[1])) >= 0.3 - 1e-9
        if room.buffer(1e-7, join_style="mitre").contains(foot) and foot.intersection(door).area < 1e-6 and clear:
            expected.add((round(x, 6), round(y, 6), turn))
    free, edge = candidates(chamber, 1.2, 0.8, step)
    assert {(round(x, 6), round(y, 6), turn) for (x, y), turn in zip(free.center, free.turn, strict=True)} == expected
    assert len(edge) > 0
    for (x, y), turn in zip(edge.center, edge.turn, strict=True):
        back = [(0, -1), (1, 0), (0, 1), (-1, 0)][turn]
        assert room.boundary.distance(Point(x + 0.4 * back[0], y + 0.4 * back[1])) == pytest.approx(0.005, abs=1e-9)


def brute_force(objects: list[Large], chamber: Chamber) -> float:
    """The greatest sum of scores over all assignments, scored with shapely."""
    options = []
    for one in objects:
        free, edge = candidates(chamber, one.asset.size.width, one.asset.size.depth, grid_step(chamber, COARSE))
        kinds = {c.relation for c in one.constraints}
        rows = [(edge, 2.0)] if "middle" not in kinds else [(free, 1.0), (edge, 2.0)]
        if kinds == {"middle"}:
            rows = [(free, 1.0)]
        options.append([(*_shape(part, k), base) for part, base in rows for k in range(len(part))])
    return _best(objects, options, {})


def _shape(spots: Spots, k: int) -> tuple:
    (x, y), (hx, hy) = spots.center[k], spots.half[k]
    return box(x - hx, y - hy, x + hx, y + hy), (x, y), int(spots.turn[k])


def _best(objects: list[Large], options: list, placed: dict) -> float:
    if not objects:
        return 0.0
    one, rest = objects[0], objects[1:]
    free = [spot for spot in options[0] if not any(spot[0].intersects(other[0]) for other in placed.values())]
    if not free:
        return _best(rest, options[1:], placed)
    return max(
        score + _best(rest, options[1:], {**placed, one.name: spot})
        for spot, score in zip(free, _scores(one, free, placed), strict=True)
    )


def _scores(one: Large, free: list, placed: dict) -> list[float]:
    totals = [spot[3] for spot in free]
    known = [c for c in one.constraints if not c.target or c.target in placed]
    for constraint in known:
        if constraint.relation == "near":
            gaps = [spot[0].distance(placed[constraint.target][0]) for spot in free]
            low, high = min(gaps), max(min(0.8, max(gaps)), min(gaps) + 1e-12)
            totals = [
                t + 1.8 * max(0.0, (high - g) / (high - low)) * (low < 0.8) for t, g in zip(totals, gaps, strict=True)
            ]
        if constraint.relation == "face to":
            for k, (_, (x, y), turn, _) in enumerate(free):
                dx, dy = [(0, 1), (-1, 0), (0, -1), (1, 0)][turn]
                ray = LineString([(x, y), (x + 100 * dx, y + 100 * dy)])
                totals[k] += 0.5 * ray.intersects(placed[constraint.target][0])
    return [total / max(len(known), 1) for total in totals]


def test_the_search_without_limits_finds_the_best_assignment(small: Chamber, catalog: Catalog) -> None:
    bench, stool, bin_ = (catalog.get(name) for name in ("WritingDesk", "LabStool", "WasteBin"))
    objects = [
        Large("desk", bench, (Constraint("edge"),)),
        Large("stool", stool, (Constraint("middle"), Constraint("near", "desk"), Constraint("face to", "desk"))),
        Large("bin", bin_, (Constraint("edge"), Constraint("near", "desk"))),
    ]
    solution = search(objects, small, np.random.default_rng(0), EVERYTHING)
    assert solution.score == pytest.approx(brute_force(objects, small))


def test_an_object_without_a_place_is_left_out_and_the_rest_is_placed(small: Chamber, catalog: Catalog) -> None:
    objects = [
        Large("island", catalog.get("IslandBench"), (Constraint("edge"),)),
        Large("stool", catalog.get("LabStool"), (Constraint("middle"),)),
    ]
    assert set(search(objects, small, np.random.default_rng(0)).spots) == {"stool"}


def test_the_search_stops_at_its_limit_with_what_it_has(small: Chamber, catalog: Catalog) -> None:
    objects = [Large(f"stool-{k}", catalog.get("LabStool"), (Constraint("middle"),)) for k in range(4)]
    solution = search(objects, small, np.random.default_rng(0), SearchLimits(expansions=3))
    assert solution.expansions == 3
    assert set(solution.spots) == {"stool-0", "stool-1", "stool-2"}


def test_the_selection_takes_one_of_each_kind_in_turn_up_to_40_percent_of_the_floor(catalog: Catalog) -> None:
    chamber = chamber_of(5.0, 4.0, Door(wall="front", offset=1.0, width=1.0))
    bench, sink = catalog.get("LabBench1800"), catalog.get("SinkBench")
    large = [Large(f"bench-{k}", bench, (Constraint("edge"),)) for k in range(6)]
    large.append(Large("sink", sink, (Constraint("edge"), Constraint("near", "bench-5"))))
    taken = select(DesignPlan(tuple(large)), chamber).large
    # 0.4 * 20 m² less 0.6 m² for the door: 7.4 m², of which the sink takes 0.9 and each bench 1.35.
    assert [one.name for one in taken] == ["bench-0", "bench-1", "bench-2", "bench-3", "sink"]
    assert taken[-1].constraints == (Constraint("edge"),)


def test_the_second_request_counts_only_if_the_first_leaves_the_floor_empty(catalog: Catalog) -> None:
    chamber, bench = chamber_of(5.0, 4.0), catalog.get("LabBench1800")
    first = [Large(f"bench-{k}", bench, (Constraint("edge"),)) for k in range(5)]
    second = Large("stool", catalog.get("LabStool"), (Constraint("middle"),), wish=2)
    assert second not in select(DesignPlan((*first, second)), chamber).large
    assert second in select(DesignPlan((*first[:2], second)), chamber).large
