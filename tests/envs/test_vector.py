"""The vector environment equals single environments on the planar kernel to the bit, in all that Gymnasium returns."""

from __future__ import annotations

from functools import partial

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode, SyncVectorEnv
from laboratories import island_laboratory
from same_results import assert_same

import labgym  # noqa: F401 -- registers the ids
from labgym.errors import OptionError

pytest.importorskip("numba")

ID, VERSION_1 = "LabPointNav-v0", "LabFloorNav-v0"
COUNT = 5
KEPT = {"NEXT_STEP": AutoresetMode.NEXT_STEP, "SAME_STEP": AutoresetMode.SAME_STEP}


def single(**options) -> SyncVectorEnv:
    mode, name = options.pop("autoreset_mode"), options.pop("id", ID)
    return SyncVectorEnv(
        [partial(gym.make, name, physics="planar", disable_env_checker=True, **options)] * COUNT, autoreset_mode=mode
    )


def vector(**options):
    return gym.make_vec(options.pop("id", ID), num_envs=COUNT, vectorization_mode="vector_entry_point", **options)


def actions(rng: np.random.Generator, infos: dict) -> np.ndarray:
    """Random actions that mostly head for the goal, so that episodes end by success, by contact and by time."""
    values = rng.uniform(-1.2, 1.2, (COUNT, 2))
    values[:, 0] = np.abs(values[:, 0])
    return values.astype(np.float32)


CASES = {
    "standard": {"split": "val", "max_episode_steps": 40},
    "one layout": {"layout": island_laboratory(), "max_episode_steps": 60},
    "exact": {"split": "test", "distance_to_go": "exact", "max_episode_steps": 15},
    "version 1": {"id": VERSION_1, "layout": island_laboratory(), "max_episode_steps": 15},
    "depth": {"id": "LabFloorNavDepth-v0", "layout": island_laboratory(), "max_episode_steps": 15},
    "parts": {
        "layout": island_laboratory(),
        "max_episode_steps": 50,
        "control_dt": 0.05,
        "sensors": [
            "velocity",
            {"kind": "depth", "rows": 9, "columns": 15, "reach": 4.0},
            {"kind": "lidar", "rays": 91, "reach": 6.0, "height": 0.4},
        ],
        "rewards": ["progress", "success", "failure", "time", "clearance", {"kind": "collision", "weight": -0.3}],
        "endings": ["contact", {"kind": "rest", "radius": 1.5, "duration": 0.2}, {"kind": "touch", "radius": 1.0}],
        "measures": ["is_success", "cost", "ending", "reward_terms", "achieved_goal", "desired_goal"],
    },
}


@pytest.mark.cases(5)
@pytest.mark.parametrize("mode", KEPT)
@pytest.mark.parametrize("case", CASES)
def test_the_vector_equals_the_single_environments_to_the_bit(case, mode):
    options = {**CASES[case], "autoreset_mode": KEPT[mode]}
    one, many = single(**dict(options)), vector(**dict(options))
    assert many.metadata["autoreset_mode"] == KEPT[mode]
    assert many.single_observation_space == one.single_observation_space
    assert many.action_space == one.action_space
    assert_same(many.reset(seed=7), one.reset(seed=7))
    rng = np.random.default_rng(11)
    ends = np.zeros(2, dtype=int)
    for _ in range(40 if case in ("exact", "version 1", "depth") else 160):
        action = actions(rng, {})
        expected, actual = one.step(action), many.step(action)
        assert_same(actual, expected)
        ends += expected[2].sum(), expected[3].sum()
    assert ends[1] + ends[0] > COUNT
    assert_same(many.reset(), one.reset())
    one.close()
    many.close()
    many.close()


def step_and_reset(one, many, action):
    """Step both without autoreset, reset those that ended by a mask, and compare all that both return."""
    expected = one.step(action)
    assert_same(many.step(action), expected)
    done = expected[2] | expected[3]
    if done.any():
        with pytest.raises(OptionError, match="reset_mask"):
            many.step(action)
        seeds = [100 + row for row in range(COUNT)]
        masked = one.reset(seed=seeds, options={"reset_mask": done})
        assert_same(many.reset(seed=seeds, options={"reset_mask": done}), masked)
    return int(done.sum())


@pytest.mark.parametrize("case", ["one layout", "version 1", "parts"])
def test_without_autoreset_a_mask_resets_those_that_ended_as_in_gymnasium(case):
    options = {**CASES[case], "autoreset_mode": AutoresetMode.DISABLED}
    one, many = single(**dict(options)), vector(**dict(options))
    assert many.metadata["autoreset_mode"] == AutoresetMode.DISABLED
    assert_same(many.reset(seed=7), one.reset(seed=7))
    rng = np.random.default_rng(12)
    assert sum(step_and_reset(one, many, actions(rng, {})) for _ in range(130)) > COUNT


@pytest.mark.parametrize("mode", AutoresetMode)
def test_a_mask_resets_running_environments_in_every_mode(mode):
    options = {"layout": island_laboratory(), "max_episode_steps": 9, "autoreset_mode": mode}
    one, many = single(**dict(options)), vector(**dict(options))
    with pytest.raises(OptionError, match="first reset"):
        many.reset(options={"reset_mask": np.arange(COUNT) == 1})
    assert_same(many.reset(seed=3), one.reset(seed=3))
    rng = np.random.default_rng(13)
    for _ in range(8):
        action = actions(rng, {})
        assert_same(many.step(action), one.step(action))
        mask = rng.random(COUNT) < 0.4
        if mask.any():
            expected = one.reset(options={"reset_mask": mask.copy()})
            assert_same(many.reset(options={"reset_mask": mask}), expected)


@pytest.mark.parametrize(
    "mask", [[True] * COUNT, np.ones(COUNT), np.ones(COUNT - 1, bool), np.zeros(COUNT, bool), np.ones((COUNT, 1), bool)]
)
def test_a_mask_of_another_shape_or_type_is_refused(mask):
    many = vector(layout=island_laboratory())
    many.reset(seed=0)
    with pytest.raises(OptionError, match="reset_mask"):
        many.reset(options={"reset_mask": mask})


def test_episodes_that_succeed_end_in_both():
    """Every start is within reach of the goal: success, a new episode, and the reward of 10."""
    lab = island_laboratory()
    options = {"layout": lab, "autoreset_mode": AutoresetMode.SAME_STEP}
    one, many = single(**dict(options)), vector(**dict(options))
    ends = {"start": (4.0, 4.2, 0.0), "goal": (5.0, 4.2)}
    assert_same(many.reset(seed=1, options=ends), one.reset(seed=1, options=ends))
    ahead = np.tile(np.array([1.0, 0.0], np.float32), (COUNT, 1))
    succeeded = 0
    for _ in range(12):
        expected, actual = one.step(ahead), many.step(ahead)
        assert_same(actual, expected)
        succeeded += actual[2].sum()
    assert succeeded == COUNT


@pytest.mark.parametrize("threads", [1, 3])
def test_the_number_of_threads_changes_nothing(threads):
    lab = island_laboratory()
    envs = [
        gym.make_vec(ID, num_envs=24, vectorization_mode="vector_entry_point", layout=lab, threads=count)
        for count in (2, threads)
    ]
    results = [each.reset(seed=3) for each in envs]
    assert_same(*results)
    rng = np.random.default_rng(0)
    for _ in range(30):
        action = rng.uniform(-1.0, 1.0, (24, 2)).astype(np.float32)
        assert_same(*(each.step(action) for each in envs))


def test_what_the_kernel_lacks_is_refused_in_one_line():
    from labgym.envs.vector.env import VectorPointNavEnv

    for options, message in (
        ({"observation": "rgbd"}, "no sensor ColorSensor"),
        ({"sensors": ["depth"], "conditions": ["people"]}, "depth cameras only, on the robot's axis, without people"),
        ({"physics": "mujoco"}, "physics='planar' only"),
        ({"render_mode": "rgb_array"}, "does not render"),
        ({"config": VERSION_1, "layout": island_laboratory(), "drives": "protocol"}, "episodes of one drive only"),
        ({"actions": "discrete"}, "no actions DiscreteActions"),
        ({"conditions": ["payload"]}, "no condition 'payload'"),
        ({"num_envs": 0}, "num_envs is 0"),
    ):
        with pytest.raises(OptionError, match=message) as caught:
            VectorPointNavEnv(**options)
        assert "\n" not in str(caught.value)
    with pytest.raises(OptionError, match="no sensor ColorSensor"):
        vector(observation="rgbd", threads=2)
    many = vector(layout=island_laboratory())
    assert isinstance(many, VectorPointNavEnv)
    many.reset(seed=0)
    with pytest.raises(OptionError, match=r"must be 5 x 2 finite numbers"):
        many.step(np.zeros((COUNT, 3)))
    with pytest.raises(OptionError, match=r"2 seeds for 5 environments"):
        many.reset(seed=[1, 2])


def test_stable_baselines_gets_the_same_episodes_and_the_last_observation():
    pytest.importorskip("stable_baselines3")
    from stable_baselines3.common.vec_env import DummyVecEnv, VecMonitor

    from labgym.envs.vector.stable_baselines import LabVecEnv

    options = {"layout": island_laboratory()}
    many = VecMonitor(LabVecEnv(3, max_episode_steps=25, **options))
    dummy = DummyVecEnv([partial(gym.make, ID, physics="planar", max_episode_steps=25, **options)] * 3)
    for each in (many, dummy):
        each.seed(5)
    assert_same(many.reset(), dict(dummy.reset()))
    rng = np.random.default_rng(2)
    ended = 0
    for _ in range(60):
        action = rng.uniform(-1.0, 1.0, (3, 2)).astype(np.float32)
        observations, rewards, dones, infos = many.step(action)
        expected = dummy.step(action)
        assert_same(observations, dict(expected[0]))
        np.testing.assert_array_equal(rewards, expected[1])
        np.testing.assert_array_equal(dones, expected[2])
        for info, other in zip(infos, expected[3], strict=True):
            if "terminal_observation" in other:
                ended += 1
                assert_same(info["terminal_observation"], other["terminal_observation"])
                assert info["TimeLimit.truncated"] == other["TimeLimit.truncated"]
                assert info["pose"] == pytest.approx(other["pose"], abs=0.0)
                assert info["episode"]["l"] == 25
    assert ended >= 6
    assert many.env_is_wrapped(gym.Wrapper) == [False] * 3
    assert len(many.get_attr("num_envs")) == 3
