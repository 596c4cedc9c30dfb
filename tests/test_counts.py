"""Counts of users are whole numbers within a range, and what they ask for fits into memory."""

from __future__ import annotations

import math

import numpy as np
import pytest

from labgym.cli import main
from labgym.counts import check_memory, check_switch, is_finite, is_real, is_whole, physical_memory, whole_number
from labgym.envs import LabPointNavEnv, LayoutPool
from labgym.errors import OptionError
from labgym.eval import evaluate
from labgym.runs import ExecutorOptions


@pytest.mark.parametrize("value", [0, -1, 10**9, True, 1.0, "3", None, np.float64(2.0), float("nan")])
def test_other_values_are_refused_with_the_range(value):
    with pytest.raises(OptionError, match=r"count is .*, expected a whole number from 1 to 100"):
        whole_number("count", value, most=100)


def test_whole_numbers_of_numpy_are_accepted():
    assert [whole_number("count", each) for each in (1, np.int64(7), np.uint8(3))] == [1, 7, 3]


def test_a_memory_error_names_count_limit_and_the_largest_count():
    half = physical_memory() / 2
    check_memory("n", 2, half)
    with pytest.raises(OptionError, match=r"n is 3: .* GB .* at most 2 fit"):
        check_memory("n", 3, half)


@pytest.mark.parametrize(
    ("line", "name"),
    [
        ("train navdp --epochs 1000000000", "epochs"),
        ("train navdp --threads 2000", "threads"),
        ("train iplanner --seed -1", "seed"),
        ("train ppo-imitation --steps 0", "steps"),
        ("train local-practice --floors 0", "floors"),
        ("train floors --count 0", "count"),
        ("train floors --per-level 0", "per_level"),
        ("data --seed 10000000000000000", "seed"),
        ("generate sub_01 --seed 10000000000000000", "seed"),
    ],
)
def test_counts_of_commands_are_refused_with_their_range(line, name, capsys):
    assert main(line.split()) == 2
    error = capsys.readouterr().err
    assert error.startswith(f"labgym: error: {name} is ")
    assert "expected a whole number from" in error


@pytest.mark.parametrize(
    "make",
    [
        lambda: LayoutPool(workers=10**9),
        lambda: ExecutorOptions(workers=10**9),
        lambda: LabPointNavEnv(split="train", episodes_per_layout=10**12),
        lambda: LabPointNavEnv(render_mode="rgb_array", width=10**9),
        lambda: LabPointNavEnv(sensors=[{"kind": "depth", "rows": 10**5, "columns": 10**5}]),
        lambda: evaluate("straight", repeats=10**9),
        lambda: evaluate("straight", workers=2, executor=ExecutorOptions(workers=3)),
    ],
)
def test_huge_counts_and_idle_ones_are_refused(make):
    with pytest.raises(OptionError):
        make()


@pytest.mark.parametrize(
    ("value", "whole", "real", "finite"),
    [
        (1, True, True, True),
        (np.int64(7), True, False, False),
        (-0.5, False, True, True),
        (np.float64(2.5), False, True, True),
        (math.inf, False, True, False),
        (10**400, True, True, False),
        (math.nan, False, False, False),
        (True, False, False, False),
        (np.True_, False, False, False),
        ("1", False, False, False),
        (None, False, False, False),
    ],
)
def test_truth_values_texts_and_nan_are_no_numbers(value, whole, real, finite):
    assert (is_whole(value), is_real(value), is_finite(value)) == (whole, real, finite)


@pytest.mark.parametrize("value", [0, 1, "true", None])
def test_a_switch_is_a_truth_value(value):
    check_switch("stop", True)
    with pytest.raises(OptionError, match=r"stop is .*, expected True or False"):
        check_switch("stop", value)
