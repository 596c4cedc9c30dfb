"""Holodeck's constraints against cases that are computed by hand."""

import numpy as np
import pytest

from labgym.paper.rivals.holodeck.vocabulary import Spots, expanded, far, gap, near, satisfied, scores
from labgym.paper.rivals.household import Relation
from labgym.paper.rivals.plan import Constraint

GRID = 0.4


def spots(*rows: tuple[float, float, int], half: tuple[float, float] = (0.5, 0.25), score: float = 1.0) -> Spots:
    """Spots at (x, y) after a number of quarter turns, all with the same half extents along x and y."""
    count = len(rows)
    return Spots(
        np.array([row[:2] for row in rows], dtype=float),
        np.tile(half, (count, 1)),
        np.array([row[2] for row in rows]),
        np.full(count, score),
    )


TARGET = spots((3.0, 3.0, 0), half=(1.0, 0.5))
"""A table of 2 x 1 m at (3, 3) that looks along +y."""


def test_the_gap_is_the_distance_between_footprints() -> None:
    candidates = spots((5.5, 3.0, 0), (3.0, 4.0, 0), (5.5, 4.75, 0), (3.2, 3.1, 0))
    assert gap(candidates, TARGET).tolist() == pytest.approx([1.0, 0.25, np.hypot(1.0, 1.0), 0.0])


def test_near_falls_from_the_least_gap_to_0_8_m() -> None:
    assert near(np.array([0.2, 0.5, 0.8, 2.0])).tolist() == pytest.approx([1.0, 0.5, 0.0, 0.0])
    assert near(np.array([0.9, 2.0])).tolist() == [0.0, 0.0]
    assert near(np.array([0.2, 0.6])).tolist() == pytest.approx([1.0, 0.0])


def test_far_rises_from_the_least_gap_to_the_greatest() -> None:
    assert far(np.array([1.0, 2.0, 5.0])).tolist() == pytest.approx([0.0, 0.25, 1.0])
    assert far(np.array([2.0, 2.0])).tolist() == [0.0, 0.0]


@pytest.mark.parametrize(
    ("relation", "turn", "x", "y", "expected"),
    [
        ("in front of", 0, 3.3, 4.0, True),
        ("in front of", 0, 3.45, 4.0, False),  # a grid step off the middle
        ("in front of", 0, 3.0, 3.4, False),  # not beyond its edge
        ("in front of", 1, 1.5, 3.0, True),  # a quarter turn counter-clockwise: the front looks along -x
        ("in front of", 3, 4.5, 3.0, True),
        ("behind", 0, 3.9, 2.0, True),
        ("behind", 0, 4.1, 2.0, False),
        ("behind", 2, 3.0, 4.0, True),
        ("left of", 0, 1.5, 3.4, True),  # its own left: someone who looks along +y has -x on the left
        ("left of", 0, 4.5, 3.4, False),
        ("left of", 2, 4.5, 3.4, True),
        ("right of", 0, 4.5, 2.6, True),
        ("right of", 1, 3.0, 4.0, True),
        ("right of", 1, 3.0, 2.0, False),
        ("side of", 0, 6.0, 3.4, True),
        ("side of", 0, 6.0, 3.6, False),
    ],
)
def test_positions_are_in_the_frame_of_the_target(
    relation: Relation, turn: int, x: float, y: float, expected: bool
) -> None:
    target = spots((3.0, 3.0, turn), half=(1.0, 0.5))
    assert bool(satisfied(spots((x, y, 0)), Constraint(relation, "table"), target, GRID)[0]) is expected


@pytest.mark.parametrize(
    ("x", "y", "turn", "expected"),
    [
        (3.0, 1.0, 0, True),  # below the table, looking up
        (3.9, 1.0, 0, True),
        (4.1, 1.0, 0, False),
        (3.0, 1.0, 2, False),
        (6.0, 3.4, 1, True),  # to the right of it, looking along -x
        (6.0, 3.6, 1, False),
        (0.5, 3.0, 3, True),
        (0.5, 3.0, 1, False),
    ],
)
def test_face_to_is_a_half_line_along_the_front(x: float, y: float, turn: int, expected: bool) -> None:
    assert bool(satisfied(spots((x, y, turn)), Constraint("face to", "table"), TARGET, GRID)[0]) is expected


def test_centers_are_aligned_within_5_cm_along_one_axis() -> None:
    candidates = spots((3.04, 6.0, 0), (3.06, 6.0, 0), (7.0, 2.96, 0))
    aligned = satisfied(candidates, Constraint("center aligned", "table"), TARGET, GRID)
    assert aligned.tolist() == [1.0, 0.0, 1.0]


def test_around_and_in_front_of_stand_for_two_constraints() -> None:
    assert expanded(Constraint("around", "desk")) == (Constraint("near", "desk"), Constraint("face to", "desk"))
    front = Constraint("in front of", "desk")
    assert expanded(front) == (front, Constraint("center aligned", "desk"))
    assert expanded(Constraint("edge")) == (Constraint("edge"),)


def test_the_score_is_the_weighted_sum_divided_by_the_number_of_constraints() -> None:
    # Gaps 0.25 and 1.25 m: near is 1 and 0. The first faces the table and is aligned with it, the second is aligned.
    candidates = spots((3.0, 2.0, 0), (3.0, 1.0, 2), score=2.0)
    constraints = [
        Constraint("edge"),
        Constraint("near", "table"),
        Constraint("face to", "table"),
        Constraint("center aligned", "table"),
        Constraint("near", "absent"),
    ]
    result = scores(candidates, constraints, {"table": TARGET}, GRID)
    assert result.tolist() == pytest.approx([(2.0 + 1.8 + 0.5 + 0.5) / 4.0, (2.0 + 0.5) / 4.0])


def test_an_object_without_constraints_keeps_its_base_score() -> None:
    assert scores(spots((1.0, 1.0, 0)), [], {}, GRID).tolist() == [1.0]
