"""Which of the walls that a map seems to show can stand together."""

from __future__ import annotations

import pytest
from shapely import box

from labgym.exchange.drawing import Mark
from labgym.exchange.inner_walls import InnerWall, standing
from labgym.exchange.strips import Strip

HALL = box(0.0, 0.0, 10.0, 8.0)
CELL = 0.05


def wall(start, end, *gaps, held=(True, True), thickness=0.1):
    marks = tuple(Mark(low, high, "passage") for low, high in gaps)
    strip = Strip(start, end, thickness)
    return InnerWall(strip, marks, strip.length - sum(mark.width for mark in marks), held)


ACROSS = wall((5.0, 0.0), (5.0, 8.0), ((5.0, 3.0), (5.0, 4.2)))


def stands(*walls, doors=()):
    return standing(walls, doors, HALL, CELL)


def test_walls_with_room_between_them_all_stand():
    others = wall((2.5, 0.0), (2.5, 8.0)), wall((5.0, 6.0), (10.0, 6.0))
    assert set(map(id, stands(*others, ACROSS))) == set(map(id, (*others, ACROSS)))


@pytest.mark.parametrize("off", [0.0, 0.3, 0.65])
def test_of_two_parallel_walls_with_no_room_between_the_longer_stands(off):
    row = wall((5.0 + off, 0.0), (5.0 + off, 5.0), held=(True, False))
    assert stands(row, ACROSS) == [ACROSS]
    assert len(stands(wall((5.75, 0.0), (5.75, 5.0), held=(True, False)), ACROSS)) == 2


def test_one_wall_found_twice_stands_once():
    assert stands(ACROSS, ACROSS) == [ACROSS]


def test_walls_on_one_line_both_stand():
    ends = wall((0.0, 3.0), (5.0, 3.0)), wall((5.0, 3.0), (10.0, 3.0))
    assert len(stands(*ends, wall((5.0, 0.0), (5.0, 8.0)))) == 3


def test_a_row_of_furniture_along_an_outer_wall_is_no_wall():
    assert stands(wall((0.0, 7.5), (6.0, 7.5))) == []
    assert len(stands(wall((3.0, 7.0), (3.0, 8.0), held=(False, True)))) == 1


def test_no_wall_stands_in_a_passage_or_in_an_outer_door():
    row = wall((5.0, 3.6), (10.0, 3.6), held=(False, True))
    assert stands(row, ACROSS) == [ACROSS]
    assert stands(row, doors=[Mark((10.0, 3.0), (10.0, 4.0), "door")]) == []
    assert stands(row, doors=[Mark((10.0, 1.0), (10.0, 2.0), "door")]) == [row]


def test_a_wall_falls_with_the_row_of_furniture_that_held_it():
    behind = wall((3.0, 4.0), (3.0, 7.5), held=(False, True))
    assert stands(wall((0.0, 7.5), (6.0, 7.5)), behind) == []
    near = wall((0.0, 7.0), (6.0, 7.0), held=(True, False))
    assert stands(near, wall((3.0, 4.0), (3.0, 7.0))) == [near]
    assert len(stands(wall((0.0, 7.0), (10.0, 7.0)), wall((3.0, 0.0), (3.0, 7.0)))) == 2
