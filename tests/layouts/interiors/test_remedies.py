"""Changes that make an infeasible floor feasible: each is applied and generated; floors grow and gain rooms."""

import math

import pytest
from furnished_floors import FLOORS
from shapely import Polygon, unary_union

from labgym.errors import InfeasibleError, SearchLimitError
from labgym.layouts import Placement, generate
from labgym.layouts.floor import Door, Floor, KeepOut, Room, Service
from labgym.layouts.floor.changes import extended, stretched
from labgym.layouts.generate import resolve_request
from labgym.layouts.remedies import LONGEST, TRIALS, _least, remedies, with_remedies

HALL = Room(width=10.0, depth=8.0, doors=(Door(wall="front", offset=1.5), Door(wall="right", offset=6.5))).floor


def request(floor: Floor, protocol="sub_01", fixed=()):
    return resolve_request(protocol, 1, None, "default", None, fixed, floor=floor)


def region(space) -> Polygon:
    return unary_union([Polygon(box.corners()) for box in space.boxes])


def check_all(asked, only="", trials=TRIALS):
    """Return the texts of the changes, having applied and generated those that contain a word."""
    found = remedies(asked, trials)
    for remedy in (remedy for remedy in found if only in remedy.text):
        changed = remedy.request
        names = [protocol.id for protocol in changed.protocols]
        layout = generate(names, 1, floor=changed.floor, fixed=changed.fixed)
        assert layout.floor == changed.floor
    return [remedy.text for remedy in found]


def refused(floor, protocol="sub_01", fixed=()) -> InfeasibleError:
    with pytest.raises(InfeasibleError) as caught:
        generate(protocol, 1, floor=floor, fixed=fixed)
    assert "\n" not in str(caught.value)
    assert not isinstance(caught.value, SearchLimitError)
    return caught.value


def test_a_requirement_and_a_keep_out_that_exclude_each_other_are_named():
    exhaust = Service(kind="exhaust", x=5.0, y=7.9, z=2.9, reach=0.5, required=True)
    hatch = KeepOut(id="hatch", x=5.0, y=7.0, width=5.0, depth=2.0)
    floor = HALL.model_copy(update={"services": (exhaust,), "keep_outs": (hatch,)})
    error = refused(floor)
    assert "FumeHood_1 (1.50 m wide" in str(error)
    assert "within reach of exhaust nothing is free" in str(error)
    texts = check_all(request(floor))
    assert texts[:2] == ["drop the requirement of exhaust", "remove the keep-out 'hatch'"]


def test_a_fixed_piece_that_cuts_a_door_off_is_named():
    floor = FLOORS["ell"]()
    pieces = tuple(
        Placement(id=name, asset=asset, position=(x, y, 0.0))
        for name, asset, x, y in (("old_island", "IslandBench", 2.0, 6.2), ("old_rack", "EquipmentRack", 7.0, 0.3))
    )
    error = refused(floor, fixed=pieces)
    assert "old_island leaves no way" in str(error)
    told = with_remedies(error, request(floor, fixed=pieces))
    assert (type(told), "\n" in str(told)) == (type(error), False)
    assert "this change makes it feasible: remove the fixed piece 'old_island'" in str(told)
    generate("sub_01", 1, floor=floor, fixed=pieces[1:])


@pytest.mark.parametrize("lacking", [0.1, 0.3, 0.7, 1.9, 3.2, 3.3])
def test_the_least_length_that_helps_is_found_in_few_trials(lacking):
    tried = []

    def attempt(by):
        tried.append(by)
        return f"longer by {by}" if by >= lacking - 1e-9 else None

    found = _least(attempt)
    assert found == ((pytest.approx(lacking), f"longer by {found[0]}") if lacking <= LONGEST else None)
    assert len(tried) <= 6


@pytest.mark.slow
def test_the_least_length_that_a_narrow_room_lacks_is_found():
    narrow = Room(width=14.0, depth=2.3, doors=(Door(wall="left", offset=1.1), Door(wall="right", offset=1.1))).floor
    error = refused(narrow)
    assert "in front of it must be free" in str(error)
    texts = check_all(request(narrow), "deeper", trials=7)
    (deeper,) = [text for text in texts if "deeper" in text]
    depth = float(deeper.split(" x ")[1].split(" ")[0])
    assert depth == pytest.approx(2.4)  # the hood of 0.85 m stands 0.01 m from the wall, with 1.50 m in front of it


@pytest.mark.parametrize("name", FLOORS)
def test_a_longer_floor_has_the_same_doors_and_a_larger_space(name):
    floor = FLOORS[name]()
    grown = 0
    for space in floor.spaces:
        for axis in (0, 1):
            stretch = stretched(floor, space.id, axis, 0.7)
            if stretch is None:
                continue
            grown += 1
            after = stretch.floor
            assert region(after.space(space.id)).area > region(space).area + 0.5
            ways = [[(w.opening.kind, w.width, w.spaces) for w in each.doorways] for each in (floor, after)]
            assert ways[0] == ways[1]
            old, new = (unary_union([Polygon(box.corners()) for box in each.wall_boxes]) for each in (floor, after))
            assert new.area == pytest.approx(old.area, rel=0.2)
            assert new.area > old.area
            for one, other in zip(floor.walls, after.walls, strict=True):
                assert stretch.moved(*one.start) == pytest.approx(other.start, abs=1e-6)
                assert math.sin(one.yaw - other.yaw) == pytest.approx(0.0, abs=1e-6)
    assert grown


@pytest.mark.parametrize("name", FLOORS)
def test_a_room_added_at_an_exit_is_reached_through_it_and_has_an_exit(name):
    floor = FLOORS[name]()
    floors = list(extended(floor, 4.0, 5.0))
    assert floors
    for number, after in floors:
        (added,) = [space for space in after.spaces if space.id not in {one.id for one in floor.spaces}]
        assert region(added).area == pytest.approx(20.0)
        joined = [way for way in after.doorways if added.id in way.spaces]
        assert sorted(way.exit for way in joined) == [False, True]
        assert number in {way.wall for way in joined}
