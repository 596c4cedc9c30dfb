"""Environments in worker processes equal single environments to the bit, with any part and any physics."""

from __future__ import annotations

import os
import signal
from functools import partial

import gymnasium as gym
import numpy as np
import pytest
from gymnasium import spaces
from gymnasium.vector import AutoresetMode, SyncVectorEnv, VectorEnv
from laboratories import island_laboratory
from same_results import assert_same

import labgym  # noqa: F401 -- registers the ids
from labgym.envs.parcels import SHARED
from labgym.envs.vector.board import shared_board
from labgym.envs.vector.processes import ProcessPointNavEnv, WorkersLostError, joined
from labgym.errors import OptionError

COUNT = 5


def same_as_single(name: str, steps: int, mode: AutoresetMode, seeds, **options) -> ProcessPointNavEnv:
    """Compare two processes with five environments with single ones, step by step."""
    arguments = {"layout": island_laboratory(), **options}
    one = SyncVectorEnv([partial(gym.make, name, disable_env_checker=True, **arguments)] * COUNT, autoreset_mode=mode)
    many = gym.make_vec(
        name, COUNT, vectorization_mode="vector_entry_point", processes=2, autoreset_mode=mode, **arguments
    )
    assert isinstance(many, ProcessPointNavEnv)
    assert many.metadata["autoreset_mode"] == mode
    assert many.observation_space == one.observation_space
    assert many.action_space == one.action_space
    assert_same(many.reset(seed=seeds), one.reset(seed=seeds))
    many.action_space.seed(3)
    ends = 0
    for _ in range(steps):
        action = many.action_space.sample()
        expected = one.step(action)
        assert_same(many.step(action), expected)
        done = expected[2] | expected[3]
        ends += int(done.sum())
        if mode == AutoresetMode.DISABLED and done.any():
            with pytest.raises(OptionError, match="reset_mask"):
                many.step(action)
            masks = ({"reset_mask": done.copy()} for _ in range(2))
            assert_same(many.reset(options=next(masks)), one.reset(options=next(masks)))
    assert ends >= COUNT
    assert_same(many.reset(), one.reset())
    if options.get("render_mode"):
        assert_same(dict(enumerate(many.render())), dict(enumerate(one.render())))
    one.close()
    return many


# Each of these starts two processes, which import labgym: 3 s.
def test_depth_and_color_with_mujoco_equal_those_of_single_environments_to_the_bit() -> None:
    many = same_as_single(
        "LabFloorNavRGBD-v0", 12, AutoresetMode.NEXT_STEP, 7,
        physics="mujoco", max_episode_steps=5, distance_to_go="grid", render_mode="depth_array",
    )  # fmt: skip
    with pytest.raises(OptionError, match="must be 5 actions"):
        many.step(np.zeros((4, 2), np.float32))
    with pytest.raises(OptionError, match="2 seeds for 5 environments"):
        many.reset(seed=[1, 2])
    with pytest.raises(OptionError, match="finite"):
        many.step(np.full((5, 2), np.nan, np.float32))
    many.reset(seed=1)
    children = [pool.submit(os.getpid).result() for pool in many._pools]
    os.kill(children[1], signal.SIGKILL)
    with pytest.raises(WorkersLostError, match="make the environment again") as caught:
        many.step(np.zeros((5, 2), np.float32))
    assert "\n" not in str(caught.value)
    many.close()
    many.close()
    for child in children:
        with pytest.raises(ProcessLookupError):
            os.kill(child, 0)


@pytest.mark.slow
def test_without_autoreset_a_mask_resets_environments_of_both_processes() -> None:
    many = same_as_single(
        "LabFloorNavDiscrete-v0", 14, AutoresetMode.DISABLED, 5,
        physics="planar", max_episode_steps=4, endings=["contact", "stop"],
    )  # fmt: skip
    # A process that was lost before the call has been replaced by one without environments.
    many.reset(seed=1)
    assert many._pools[1].submit(os._exit, 1).exception() is not None
    with pytest.raises(WorkersLostError, match="make the environment again"):
        many.step(np.zeros(COUNT, np.int64))
    many.close()


@pytest.mark.slow
def test_parts_that_the_kernel_lacks_run_in_processes_on_the_planar_physics() -> None:
    pytest.importorskip("numba")
    many = same_as_single(
        "LabFloorNavDiscrete-v0", 8, AutoresetMode.SAME_STEP, [3, 1, 4, 1, 5],
        physics="planar", max_episode_steps=3, distance_to_go="grid",
        sensors=["goal", {"kind": "lidar", "rays": 30, "noise": [{"kind": "gaussian", "sigma": 0.02}]}, "odometry"],
    )  # fmt: skip
    many.close()


def test_joined_infos_are_those_that_gymnasium_collects() -> None:
    every = [{"a": k, "b": np.full(2, k / 2.0), "name": f"n{k}", "in": {"c": bool(k % 2)}} for k in range(COUNT)]
    every[4]["final_info"] = {"a": 1.5, "deep": {"x": 3}}
    every[4]["final_obs"] = {"lidar": np.ones(3)}

    def collected(infos: list[dict]) -> dict:
        vector, result = VectorEnv(), {}
        vector.num_envs = len(infos)
        for row, info in enumerate(infos):
            result = vector._add_info(result, info, row)
        return result

    assert_same(joined([collected(every[:3]), collected(every[3:])], [3, 2]), collected(every))
    assert_same(joined([collected(every[3:]), collected(every[:3])], [2, 3]), collected(every[3:] + every[:3]))


@pytest.mark.skipif(not SHARED, reason="needs anonymous files in memory")
def test_a_board_holds_every_row_once() -> None:
    space = spaces.Dict(
        {
            "image": spaces.Box(0, 255, (3, 5, 3), np.uint8),
            "ranges": spaces.Box(0.0, 9.0, (7,), np.float32),
            "inside": spaces.Dict({"count": spaces.Discrete(9), "place": spaces.Box(-1.0, 1.0, (2,), np.float64)}),
        }
    )
    rows = [space.sample() for _ in range(6)]
    board = shared_board(space, 6)
    assert board is not None
    other = board.address.open(space, 6)
    other.close()
    for first, last in ((0, 4), (4, 6)):
        other.write(first, _batched(rows[first:last]))
    board.close()
    board.close()
    assert_same(board.read(), _batched(rows))
    assert shared_board(spaces.Dict({"text": spaces.Text(5)}), 2) is None


def _batched(rows: list[dict]) -> dict:
    columns = {name: [row[name] for row in rows] for name in rows[0]}
    return {
        name: _batched(column) if isinstance(column[0], dict) else np.array(column) for name, column in columns.items()
    }


def test_threads_and_processes_exclude_each_other(layout) -> None:
    pytest.importorskip("numba")
    with pytest.raises(OptionError, match="not both"):
        gym.make_vec(
            "LabFloorNav-v0", 2, vectorization_mode="vector_entry_point", layout=layout, threads=1, processes=1
        )
