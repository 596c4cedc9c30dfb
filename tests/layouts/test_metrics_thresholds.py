"""The thresholds and the map from distance to satisfaction."""

from __future__ import annotations

import pytest

from labgym.errors import UnknownNameError
from labgym.layouts.rules import thresholds
from labgym.layouts.rules.rule import Instance, mean, penalised, worst_mean
from labgym.layouts.rules.thresholds import Band


@pytest.mark.parametrize(
    ("distance", "expected"),
    [(0.0, 0.0), (0.3 - 1e-9, 0.0), (0.3, 0.3), (0.5, 0.5), (0.999, 0.999), (1.0, 1.0), (7.0, 1.0)],
)
def test_satisfaction_is_nothing_under_d_low_then_proportional_to_d_min_then_one(
    distance: float, expected: float
) -> None:
    assert Band(d_min=1.0, d_low=0.3).satisfaction(distance) == pytest.approx(expected)


def test_satisfaction_jumps_at_d_low_to_its_share_of_d_min() -> None:
    band = Band(d_min=3.0, d_low=0.6)
    assert band.satisfaction(0.6 - 1e-9) == 0.0
    assert band.satisfaction(0.6) == pytest.approx(0.2)


def test_profiles_differ_where_they_are_said_to() -> None:
    default, strict, paper = (thresholds.profile(name) for name in ("default", "strict", "paper"))
    assert (default.heat, default.flame) == (Band(1.0, 0.3), Band(3.0, 0.6))
    assert (default.incompatible, default.glass, default.pairs) == (Band(1.0, 0.3), 0.15, "segregation")
    assert (strict.heat, strict.glass) == (Band(3.0, 1.0), 0.20)
    assert (paper.incompatible, paper.glass, paper.pairs) == (Band(0.5, 0.15), 0.30, "boolean")


def test_an_unknown_profile_names_what_exists() -> None:
    with pytest.raises(UnknownNameError, match=r"'lenient' not found; .*default, paper, strict"):
        thresholds.profile("lenient")


def instances(*satisfactions: float) -> list[Instance]:
    return [Instance("test", (f"a{k}", f"b{k}"), 1.0, 0.0, value, False) for k, value in enumerate(satisfactions)]


@pytest.mark.parametrize(
    ("satisfactions", "worst", "average"),
    [
        ((), None, None),
        ((0.4,), 0.4, 0.4),
        ((1.0, 0.0), 0.5, 0.5),
        ((1.0, 0.2, 1.0, 0.4, 0.6), 0.4, 0.64),
    ],
)
def test_scores_average_the_worst_three_or_all_and_are_null_without_instances(
    satisfactions: tuple[float, ...], worst: float | None, average: float | None
) -> None:
    found = instances(*satisfactions)
    assert worst_mean(found) == (None if worst is None else pytest.approx(worst))
    assert mean(found) == (None if average is None else pytest.approx(average))


def test_the_geometry_penalty_zeroes_exactly_the_instances_with_a_faulty_participant() -> None:
    found = penalised(instances(1.0, 0.8, 0.6), frozenset({"b1", "somebody_else"}))
    assert [instance.satisfaction for instance in found] == [1.0, 0.0, 0.6]
