"""The vector environment equals single planar environments on the tasks of LabNav, to the bit: all that both return."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from gymnasium.vector import AutoresetMode, SyncVectorEnv
from gymnasium.wrappers import TimeLimit
from laboratories import island_laboratory
from same_results import assert_same

from labgym.envs import LabPointNavEnv
from labgym.envs.conditions.changes import Changes
from labgym.envs.conditions.glass import Glass
from labgym.envs.conditions.parked import Parked, ParkedThing
from labgym.envs.conditions.people import People
from labgym.envs.conditions.station import Station
from labgym.envs.labnav.curriculum import Curriculum
from labgym.envs.labnav.tasks import HEADLINE, config_of, task_of
from labgym.envs.vector import vector_env
from labgym.errors import OptionError

pytest.importorskip("numba")

COUNT, LIMIT = 3, 30


def config(task: str, **fields):
    """Return the configuration of a task at the headline level, in a small laboratory whose drives are goal pairs."""
    level = task_of(task).level(HEADLINE)
    conditions = {
        "aisle": ({"kind": "contacts"}, Parked((ParkedThing("Carton", 4.6, 0.8, 0.4),))),
        "moved": ({"kind": "contacts"}, Changes(pushable=False, spacing=2.0)),
    }
    made = config_of(task, HEADLINE, layout=island_laboratory(), physics="planar", **fields)
    return replace(made, conditions=conditions.get(task, ({"kind": "contacts"}, *level.conditions)))


CASES = {
    "aisle": {},
    "people": {"delay": 1},
    "odometry": {"delay": 2},
    "dock": {},
    "glass": {"endings": ["contact", {"kind": "limit", "duration": 1.4}]},
    "moved": {"rewards": ["progress", "success", "failure", "clearance"]},
}


def distance(state):
    """A term of a user's own."""
    return -state.distance


def both(case: str, mode: AutoresetMode):
    from labgym.envs.vector.env import VectorPointNavEnv

    fields = dict(CASES[case])
    if case == "odometry":
        fields["rewards"] = ["progress", "failure", {"kind": "function", "name": "near", "function": distance}]
    made = config(case, **fields)
    one = SyncVectorEnv([partial(lambda: TimeLimit(LabPointNavEnv(config=made), LIMIT))] * COUNT, autoreset_mode=mode)
    return one, VectorPointNavEnv(COUNT, config=made, autoreset_mode=mode, max_episode_steps=LIMIT, threads=1)


@pytest.mark.parametrize(
    ("case", "mode"), [*((case, AutoresetMode.SAME_STEP) for case in CASES), ("people", AutoresetMode.NEXT_STEP)]
)
def test_a_task_on_the_kernel_equals_single_environments_to_the_bit(case, mode):
    one, many = both(case, mode)
    assert many.single_observation_space == one.single_observation_space
    assert many.action_space == one.action_space
    assert_same(many.reset(seed=5), one.reset(seed=5))
    rng, ends = np.random.default_rng(3), 0
    for _ in range(70):
        action = rng.uniform(-1.0, 1.0, one.action_space.shape).astype(np.float32)
        action[:, 0] = np.abs(action[:, 0])
        action[:, 2:] -= 0.9  # seldom STOP
        expected = one.step(action)
        assert_same(many.step(action), expected)
        ends += int((expected[2] | expected[3]).sum())
    assert ends >= 2 * COUNT
    one.close()
    many.close()


# In processes, what renders does not run on the kernel.
@pytest.mark.parametrize(
    ("task", "rule", "how", "fields"),
    [
        ("glass", "mixed", {"threads": 1}, {}),
        ("odometry", "rising", {"threads": 1}, {}),
        ("odometry", "rising", {"processes": 2}, {}),
        ("odometry", "rising", {"processes": 2}, {"render_mode": "rgb_array"}),
    ],
)
def test_a_curriculum_equals_single_environments_to_the_bit(task, rule, how, fields):
    easy = {"endings": ["contact", "rest", {"kind": "limit", "duration": 0.9}], "weights": {"failure": -1.0}}
    last = config(task, **easy)
    rungs = tuple(
        replace(config_of(task, level, layout=island_laboratory(), physics="planar", **easy), sensors=last.sensors)
        for level in (0, 1)
    )
    made = replace(last, curriculum=Curriculum(rule, (*rungs, last)), **fields)
    singles = [TimeLimit(LabPointNavEnv(config=made), LIMIT) for _ in range(COUNT)]
    one = SyncVectorEnv([partial(lambda env: env, env) for env in singles], autoreset_mode=AutoresetMode.SAME_STEP)
    many = vector_env(COUNT, config=made, autoreset_mode=AutoresetMode.SAME_STEP, max_episode_steps=LIMIT, **how)
    states = [[1, *[1] * 7], [0], [2, *[0] * 9]]
    for row, (env, state) in enumerate(zip(singles, states, strict=True)):
        env.unwrapped.resume_climb(state)
        many.resume_climb(row, state)
    assert_same(many.reset(seed=5), one.reset(seed=5))
    rng, seen = np.random.default_rng(3), [set(), set(), set()]
    for _ in range(60):
        action = rng.uniform(-1.0, 1.0, one.action_space.shape).astype(np.float32)
        assert_same(many.step(action), one.step(action))
        assert many.climb == [env.unwrapped.climb for env in singles]
        for state, rungs_seen in zip(many.climb, seen, strict=True):
            rungs_seen.add(state[0])
    assert any(len(rungs_seen) > 1 for rungs_seen in seen)
    one.close()
    many.close()


def test_what_moves_by_pushing_is_refused_in_one_line():
    from labgym.envs.vector.env import VectorPointNavEnv

    for task, message in (
        ("moved", "pushable=False"),
        ("carry", "no condition 'payload'"),
        ("shift", "one drive only"),
    ):
        with pytest.raises(OptionError, match=message) as caught:
            VectorPointNavEnv(config=config_of(task, HEADLINE, layout=island_laboratory(), physics="planar"))
        assert "\n" not in str(caught.value)
    with pytest.raises(OptionError, match=r"control_dt=0\.1"):
        VectorPointNavEnv(config=replace(config("people"), control_dt=0.05))


def test_kinds_of_conditions_of_the_cases_are_those_of_the_tasks():
    kinds = {type(condition) for case in CASES for condition in config(case).conditions}
    assert {Glass, Parked, People, Station, Changes} <= kinds


@pytest.mark.parametrize(
    ("task", "lacks"),
    [
        *((task, None) for task in ("Aisle", "People", "Odometry", "Dock", "Glass")),
        ("Moved", "moves no things"),
        ("Carry", "no condition 'payload'"),
        ("Shift", "one drive only"),
    ],
)
def test_the_kernel_takes_the_ids_of_labnav_but_for_pushing_beaker_and_shift(task, lacks):
    from labgym.envs.presets import configured
    from labgym.envs.vector.env import check_kernel

    made = configured(f"LabNav{task}-v0", {"physics": "planar"})
    if lacks is None:
        check_kernel(made)
        return
    with pytest.raises(OptionError, match=lacks):
        check_kernel(made)
