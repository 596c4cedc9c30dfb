"""The figure against closed forms, and its interval against the simulated spread."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from labgym.errors import OptionError
from labgym.eval.driving.episode_row import LabNavLegRow, LabNavRow
from labgym.eval.driving.intervals import Estimate
from labgym.eval.labnav import figure
from labgym.eval.labnav.summary import LabNavSummary, TaskSummary, class_order, summary_table


def test_all_perfect_is_100_and_all_failed_is_0():
    assert figure.geometric([1.0] * 8) == pytest.approx(100.0)
    assert figure.geometric([0.0] * 8) == pytest.approx(0.0, abs=1e-12)
    assert figure.geometric([0.3] * 8) == pytest.approx(30.0)
    assert figure.geometric([0.2, 0.8]) == pytest.approx(100.0 * (math.sqrt(0.25 * 0.85) - 0.05))


def test_one_failed_task_costs_more_than_in_the_arithmetic_mean():
    scores = [0.8] * 7 + [0.0]
    assert figure.arithmetic(scores) == pytest.approx(70.0)
    assert figure.geometric(scores) == pytest.approx(100.0 * (0.85 ** (7 / 8) * 0.05 ** (1 / 8) - 0.05))


def test_no_scores_are_refused():
    with pytest.raises(OptionError, match="no scores"):
        figure.geometric([])


def test_the_interval_has_the_width_of_the_simulated_spread():
    rng = np.random.default_rng(0)
    tasks, floors, each = 8, 60, 5
    means = np.linspace(0.2, 0.8, tasks)
    values, widths = [], []
    for _ in range(60):
        rows = {}
        for task, mean in enumerate(means):
            shares = np.clip(mean + 0.15 * rng.standard_normal(floors), 0.02, 0.98)
            rows[str(task)] = [(str(j), float(rng.random() < shares[j])) for j in range(floors) for _ in range(each)]
        estimate = figure.figure(rows)
        values.append(estimate.value)
        widths.append((estimate.high - estimate.low) / 2.0 / 2.0)
    assert np.mean(widths) == pytest.approx(np.std(values), rel=0.25)


def test_the_value_of_the_interval_is_that_of_the_task_means():
    rows = {"aisle": [("a", 1.0), ("a", 0.0), ("b", 0.5)], "carry": [("a", 0.2), ("b", 0.2)]}
    assert figure.figure(rows).value == pytest.approx(figure.geometric([0.5, 0.2]))


def test_nines_follow_from_the_upper_bound_of_the_failure_rate():
    assert figure.nines(Estimate(value=0.999, low=0.99, high=1.0, count=300, nulls=0)) == pytest.approx(2.0)
    assert figure.nines(Estimate(value=0.94, low=0.9, high=0.97, count=300, nulls=0)) is None
    assert figure.nines(Estimate(value=1.0, low=None, high=None, count=3, nulls=0)) is None


def test_a_specialist_and_a_generalist_swap_between_the_means():
    tasks = {"generalist": [0.5] * 4, "specialist": [1.0, 1.0, 0.1, 0.0], "weak": [0.1] * 4}
    assert figure.swaps(tasks) == (("generalist", "specialist"),)
    assert figure.swaps({"a": [0.5, 0.5], "b": [0.4, 0.4], "same": [0.5, 0.5]}) == ()


def test_paired_differences_have_floors_as_their_unit():
    a = {f"aisle-2/{floor}/{number}": 0.8 for floor in "abcdefgh" for number in range(5)}
    b = {key: score - (0.3 if key.split("/")[1] in "abcd" else 0.1) for key, score in a.items()}
    one = figure.paired_difference(a, b)
    assert (one.a, one.b) == pytest.approx((0.8, 0.6))
    assert one.difference.value == pytest.approx(0.2)
    assert one.significant
    assert not figure.paired_difference(a, a).significant
    with pytest.raises(OptionError, match="share none"):
        figure.paired_difference(a, {"x/y/0": 1.0})


def driven(number: int = 0, **changes: Any) -> LabNavRow:
    """Return the row of a drive of 12 m that succeeds, with changes."""
    fields = {
        "suite": "made/1", "task": "aisle", "level": 2, "floor": f"f{number % 3}", "floor_hash": "0", "number": number,
        "policy": "p", "track": "deployed", "seed": 0, "score": 0.5, "success": True, "ending": "success",
        "shortest": 12.0, "straight": 10.0, "neck": 0.35, "path_length": 13.0, "time": 20.0, "final_distance": 0.1,
        "final_heading": 0.0, "odometry_error": 0.0, "steps": 200, "contacts": 0,
    }  # fmt: skip
    return LabNavRow(**{**fields, **changes})


def summed(rows: list[LabNavRow]) -> LabNavSummary:
    """Return the summary of rows of one task."""
    task = {"task": rows[0].task, "level": 2, "suite": "made/1", "draft": True, "expected": len(rows)}
    figures: dict[str, Any] = {
        "episodes": 0, "errors": 0, "endings": {}, "contact": {}, "parked": 0, "precise": None, "nines": None,
        "by_length": {}, "by_detour": {},
    }  # fmt: skip
    none = Estimate(value=None, low=None, high=None, count=0, nulls=0)
    empty = TaskSummary(**task, **figures, score=none, success=none, contacts=none)
    head: dict[str, Any] = {"hash": "0", "options": {}, "sensors": "lidar", "seed": 0, "latency": 0.0}
    whole = LabNavSummary(
        suite="made", policy="p", track="deployed", tasks=(empty,), labnav=None, arithmetic=None, **head
    )
    return whole.recomputed(rows)


@pytest.mark.parametrize(
    ("field", "changes", "name"),
    [
        ("by_length", {"shortest": 9.9}, "< 10 m"),
        ("by_length", {"shortest": 10.0}, "10 to 15 m"),
        ("by_length", {"shortest": 14.9}, "10 to 15 m"),
        ("by_length", {"shortest": 15.0}, ">= 15 m"),
        ("by_detour", {"shortest": 10.9}, "< 1.1"),
        ("by_detour", {"shortest": 11.1}, "1.1 to 1.3"),
        ("by_detour", {"shortest": 12.9}, "1.1 to 1.3"),
        ("by_detour", {"shortest": 13.1}, ">= 1.3"),
        ("by_neck", {"neck": 0.30}, "0.30 m"),
        ("by_neck", {"neck": 0.45}, "0.45 m and more"),
        ("by_met", {"outcomes": {"people": {"met": 0}}}, "0"),
        ("by_met", {"outcomes": {"people": {"met": 1}}}, "1 or 2"),
        ("by_met", {"outcomes": {"people": {"met": 2}}}, "1 or 2"),
        ("by_met", {"outcomes": {"people": {"met": 3}}}, "3 and more"),
    ],
)
def test_each_drive_counts_in_the_class_of_its_difficulty(field, changes, name):
    (task,) = summed([driven(0, score=0.25, **changes), driven(1, score=0.75, **changes)]).tasks
    assert getattr(task, field) == {name: (0.5, 2)}


def test_drives_without_a_property_are_in_no_class_and_classes_go_from_easy_to_hard():
    rows = [driven(k, shortest=length, straight=0.0, neck=None) for k, length in enumerate((16.0, 12.0, 8.0))]
    (task,) = summed(rows).tasks
    assert list(task.by_length) == ["< 10 m", "10 to 15 m", ">= 15 m"]
    assert task.by_detour == task.by_neck == task.by_met == {}


def test_a_summary_counts_endings_contacts_and_what_the_evaluator_did():
    rows = [
        driven(0),
        driven(1, score=0.0, success=False, ending="contact", contact="person 3", contacts=1),
        driven(2, score=0.0, success=False, ending="contact", contact="person 12", contacts=2),
        driven(3, stopped="evaluator", error="ValueError: no"),
    ]
    summary = summed(rows)
    (task,) = summary.tasks
    assert (task.endings, task.contact) == ({"contact": 2, "success": 2}, {"person": 2})
    assert (task.episodes, task.errors, task.parked, task.precise) == (4, 1, 1, None)
    assert (task.score.value, task.success.value, task.contacts.value) == (0.25, 0.5, 0.5)
    assert (summary.errors, summary.draft, summary.labnav, summary.arithmetic) == (1, True, None, None)


@pytest.mark.parametrize(("distance", "heading", "precise"), [(0.049, -0.049, 1.0), (0.051, 0.0, 0.0), (0, 0.051, 0.0)])
def test_a_dock_is_precise_within_5_centimeters_and_50_milliradians(distance, heading, precise):
    rows = [driven(k, task="dock", final_distance=distance, final_heading=heading) for k in range(3)]
    assert summed(rows).tasks[0].precise.value == precise


def test_drives_of_a_shift_that_were_not_begun_are_counted():
    leg = {"shortest": 5.0, "path_length": 6.0, "time": 9.0, "final_distance": 0.1, "final_heading": 0.0}
    leg |= {"beaker": False, "rise": 0.0}
    legs = [LabNavLegRow(ending=ending, success=ending == "success", docked=ending == "success", **leg)
            for ending in ("success", "success", "stuck")]  # fmt: skip
    summary = summed([driven(0, task="shift", legs=tuple(legs), goals=5, success=False, ending="stuck")])
    assert summary.tasks[0].legs == {"not begun": 2, "stuck": 1, "success": 2}
    table = summary_table(summary)
    assert "shift-2: 5 drives: success 2, stuck 1, not begun 2." in table.notes
    assert table.rows[0][:2] == ("shift-2", "1")
    whole = summary.model_copy(update={"labnav": Estimate(value=41.27, low=None, high=None, count=8, nulls=0),
                                       "arithmetic": 50.04})  # fmt: skip
    assert summary_table(whole).notes[-1] == "LabNav 41.3, arithmetic mean 50.0"
    assert not any("perfect shifts" in note for note in summary_table(summed([driven()])).notes)


def test_a_summary_differs_from_its_rows_only_beyond_rounding():
    rows = [driven(k, score=0.1 * k) for k in range(4)]
    summary = summed(rows)
    assert summary.differences(summed(rows), exactly=True) == []
    close, other = ([*rows[:3], driven(3, score=0.3 + change)] for change in (1e-11, 1e-6))
    assert summary.differences(summed(close), exactly=True) == []
    assert summary.differences(summed(other), exactly=True) == ["score of aisle-2"]
    touched = [*rows[:3], driven(3, score=0.3, contacts=1)]
    assert summary.differences(summed(touched), exactly=True) == ["contacts of aisle-2"]


def test_classes_with_one_edge_are_below_at_and_above_it():
    names = [">= 10 m", "10 to 15 m", "< 10 m", "0", "3 and more"]
    assert sorted(names, key=class_order) == ["0", "3 and more", "< 10 m", "10 to 15 m", ">= 10 m"]


def test_strata_are_sorted_by_value():
    for names in (("< 10 m", "10 to 15 m", ">= 15 m"), ("0", "1 or 2", "3 and more"), ("< 1.1", "1.1 to 1.3", ">= 1.3"),
                  ("0.30 m", "0.40 m", "1.00 m and more")):  # fmt: skip
        assert tuple(sorted(sorted(names), key=class_order)) == names
