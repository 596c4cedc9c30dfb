"""Cheats that worked while policies shared the evaluator's process gain nothing in a separate process."""

from __future__ import annotations

import itertools
import os
import subprocess
import sys
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from laboratories import small_laboratory

from labgym.confinement import linux
from labgym.eval.driving.drive import TransitionDrive, drive_layout
from labgym.eval.driving.loop import episode_rng
from labgym.eval.evaluator import evaluate
from labgym.geometry import rotate
from labgym.layouts import load_published, published
from labgym.navigation import goal_pairs
from labgym.policies import make_policy
from labgym.policies.process import PolicyProcess, PolicySource
from labgym.suites import Suite, suite_of

HERE = Path(__file__).parent
MARK = "labgym-test-mark"
BRIEF = Suite(name="brief", max_steps=6)
LAYOUT = small_laboratory("cheated")
CHEATS = ("Searching", "Climbing", "Recognizing", "Patching", "Teleporting", "Reading", "Remembering")


@pytest.fixture(autouse=True)
def users_module(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(HERE)
    monkeypatch.setenv("LABGYM_TEST_EVALUATOR", str(os.getpid()))


def driven(name: str) -> list[dict[str, object]]:
    process = PolicyProcess(PolicySource.named(f"cheats:{name}"))
    try:
        return [measured(drive) for drive in drive_layout(process, LAYOUT, BRIEF, "policy", seed=0)]
    finally:
        process.close()


def measured(drive: TransitionDrive) -> dict[str, object]:
    return drive.row.model_dump(exclude={"planning_ms"})


@cache
def honest() -> list[dict[str, object]]:
    return driven("Honest")


@pytest.mark.parametrize("cheat", CHEATS)
def test_a_cheat_gains_nothing(cheat):
    expected = honest()
    assert driven(cheat) == expected


@pytest.mark.parametrize("cheat", ["Searching", "Climbing", "Remembering"])
def test_the_cheat_finds_its_loot_in_the_evaluators_process(cheat):
    drives = drive_layout(make_policy(f"cheats:{cheat}"), LAYOUT, BRIEF, "policy", seed=0)
    assert any("LootError" in (drive.row.error or "") for drive in drives)


def test_a_teleported_robot_is_an_error(monkeypatch):
    drives = drive_layout(make_policy("cheats:Teleporting"), LAYOUT, BRIEF, "policy", seed=0)
    assert all("farther than the robot can drive" in drive.row.error for drive in drives)
    assert not any(drive.row.success for drive in drives)


@pytest.mark.parametrize("guarded", [True, False])
def test_an_ordinary_user_cannot_read_the_evaluators_memory_while_it_drives(guarded, tmp_path):
    script = tmp_path / "script.py"
    script.write_text(
        f"import contextlib, ctypes, os, sys; sys.path[:0] = [{str(HERE)!r}, {str(HERE.parents[1])!r}]\n"
        "from labgym.confinement import linux\n"
        "from test_cheats import driven\n"
        "header, nothing = (ctypes.c_uint32 * 2)(linux.CAPABILITY_VERSION, 0), (ctypes.c_uint32 * 6)()\n"
        "assert ctypes.CDLL(None).capset(header, nothing) == 0\n"
        "os.environ['LABGYM_TEST_EVALUATOR'] = str(os.getpid())\n"
        "from labgym.policies.process import PolicySource\n"
        "PolicySource.foreign = False  # without a box\n"
        f"if not {guarded}:\n"
        "    linux.unreadable_memory = contextlib.nullcontext\n"
        "print([row['error'] for row in driven('Reading')][0])\n"
    )
    result = subprocess.run([sys.executable, script], capture_output=True, text=True, timeout=600)
    if guarded:
        assert result.stdout == "None\n", result.stderr
    else:
        assert "LootError: mem of" in result.stdout, result.stderr


def test_the_evaluators_memory_is_readable_again_afterwards():
    with linux.unreadable_memory(), linux.unreadable_memory():
        assert linux._prctl(linux.PR_GET_DUMPABLE, 0) == 0
    assert linux._prctl(linux.PR_GET_DUMPABLE, 0) == 1


def test_the_generator_of_an_episode_depends_on_what_the_policy_knows_alone():
    state = episode_rng(3, (1.25, -2.0), 1).bit_generator.state
    assert state == episode_rng(3, (1.25, -2.0), 1).bit_generator.state
    assert state == episode_rng(3, (1.25 + 1e-9, -2.0), 1).bit_generator.state
    others = [episode_rng(4, (1.25, -2.0), 1), episode_rng(3, (1.26, -2.0), 1), episode_rng(3, (1.25, -2.0), 0)]
    assert all(state != other.bit_generator.state for other in others)


def test_layouts_with_one_goal_have_one_generator():
    layouts = [load_published("test", name) for name in published("test")[:4]]
    goals: dict[object, object] = {}
    for layout, seed in itertools.product(layouts, (0, 1)):
        for pair in goal_pairs(layout):
            (x, y, yaw), goal = pair.start, pair.goal
            seen = rotate(goal[0] - x, goal[1] - y, -yaw)
            key = seed, tuple(np.float32(seen).tolist())
            state = str(episode_rng(seed, seen).bit_generator.state)
            assert goals.setdefault(key, state) == state
            assert episode_rng(seed, seen).bit_generator.seed_seq.entropy[:2] == [seed, 0]


def test_the_evaluation_afterwards_is_untouched_by_a_policy_that_patches_labgym():
    short = {"suite": suite_of([LAYOUT]).model_copy(update={"max_steps": 40}), "layouts": [LAYOUT], "progress": False}
    before = evaluate("straight", **short)
    evaluate("cheats:Patching", **short)
    after = evaluate("straight", **short)
    rows = [[row.model_dump(exclude={"planning_ms"}) for row in report.rows] for report in (before, after)]
    assert rows[0] == rows[1]


def test_results_do_not_depend_on_the_order_of_episodes(monkeypatch):
    """Even for a policy that remembers: alone, each pair gives the row that it gives among others."""
    rows = driven("Remembering")
    process = PolicyProcess(PolicySource.named("cheats:Remembering"))
    try:
        again = [measured(drive) for drive in drive_layout(process, LAYOUT, BRIEF, "policy", seed=0)]
        twice = [measured(drive) for drive in drive_layout(process, LAYOUT, BRIEF, "policy", seed=0)]
    finally:
        process.close()
    assert again == twice == rows
    assert {row["error"] for row in rows} == {None}


def test_no_layout_is_in_the_arguments_or_the_environment(monkeypatch):
    monkeypatch.setattr(sys, "argv", ["labgym", MARK])
    assert {row["error"] for row in driven("Reading")} == {None}
