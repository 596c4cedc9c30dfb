"""Layouts prepared in the background: equal to those made on the spot, whatever happens to the pool."""

from __future__ import annotations

import gc
import multiprocessing
import os
import pickle
import signal
import time
from copy import deepcopy
from pathlib import Path

import furnished_floors
import mujoco
import numpy as np
import pytest
import training_sources

from labgym.envs import LabPointNavEnv, LayoutPool, world
from labgym.envs import pool as pool_module
from labgym.envs.pool import PoolAddress, PoolClient
from labgym.envs.robot import attach_robot
from labgym.envs.stage import LayoutSenses
from labgym.envs.world import World, layout_of, physics_model, world_of
from labgym.errors import InfeasibleError, OptionError
from labgym.layouts import load_published, published
from labgym.scenes import to_mjcf
from runs.processes import Marked

PATIENCE = 300.0
"""Longest wait for a worker, seconds."""

PROGRAM = """
import multiprocessing, os, time
from pathlib import Path
from labgym.envs import LabPointNavEnv, LayoutPool
from training_sources import shifted

def drive(pool, parent):
    env = LabPointNavEnv(split="train", training=shifted, episodes_per_layout=1, pool=pool)
    env.reset(seed=0)
    while os.getppid() == parent:
        env.reset()
        Path("driving").touch()
    env.reset()  # the pool is gone
    Path("alone").touch()

if __name__ == "__main__":
    with LayoutPool(1) as pool:
        for method in ("fork", "spawn"):
            context = multiprocessing.get_context(method)
            context.Process(target=drive, args=(pool, os.getpid()), daemon=True).start()
        time.sleep(600)
"""


@pytest.fixture(scope="module")
def pool():
    with LayoutPool(1) as pool:
        yield pool


def environment(pool, **arguments) -> LabPointNavEnv:
    defaults = {"split": "train", "training": training_sources.shifted, "episodes_per_layout": 1}
    return LabPointNavEnv(**{**defaults, **arguments}, pool=pool)


def drive(env: LabPointNavEnv, episodes: int) -> list:
    """Observations, rewards and infos of a few steps of some episodes, as bytes."""
    records = []
    for k in range(episodes):
        observation, info = env.reset(seed=5 if k == 0 else None)
        for action in ((1.0, 0.2), (0.5, -1.0)):
            records.append((sorted((name, np.asarray(value).tobytes()) for name, value in observation.items()), info))
            observation, reward, *_, info = env.step(np.array(action, np.float32))
            records.append(reward)
    return [pickle.dumps(record) for record in records]


def take(client: PoolClient, source, number: int):
    """Ask for a layout until the pool has it ready."""
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:
        stage = client.take(source, [0, number], LayoutSenses())
        stage = client.take(source, [number], LayoutSenses())
        if stage is not None:
            return stage
    raise AssertionError("the pool made no layout")


@pytest.mark.parametrize("arguments", [{}, {"observation": "rgbd"}, {"exact": True, "distance_to_go": "exact"}])
def test_episodes_with_a_pool_are_bit_for_bit_those_without(pool, arguments):
    world._recent.clear()
    with_pool = drive(environment(pool, **arguments), 3)
    world._recent.clear()
    gc.collect()
    assert with_pool == drive(environment(None, **arguments), 3)


@pytest.mark.parametrize("senses", [LayoutSenses(), LayoutSenses("visual", "exact")], ids=["lidar", "camera"])
def test_a_world_made_of_a_stage_equals_one_made_of_the_layout(senses):
    layout = load_published("val", published("val")[0])
    fresh = World(layout)
    stage = pickle.loads(pickle.dumps(fresh.stage(senses)))
    staged = World(stage.layout, stage)
    assert stage.layout.hash == layout.hash
    assert binary(staged.model) == binary(physics_model(layout))
    assert len(stage.to_go) > 0
    for (method, x, y), field in stage.to_go.items():
        point = (x + 0.7, y - 0.4)
        assert field.at(*point) == World(layout).to_go((x, y, 0.0), method).at(*point)
    rays = [(w.solid if senses.geometry == "solid" else w.visible) for w in (fresh, staged)]
    angles = np.linspace(0.0, 6.0, 500)
    directions = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(500)])
    origins = np.tile((1.5, 1.2, 0.25), (500, 1))
    for one, other in zip(*(scene.cast(origins, directions) for scene in rays), strict=True):
        assert one.tobytes() == other.tobytes()


@pytest.mark.parametrize("name", ["val", *sorted(furnished_floors.FLOORS)])
def test_visible_parts_leave_no_trace_in_the_physics(name):
    layout = load_published("val", published("val")[3]) if name == "val" else furnished_floors.furnished(name)
    scene = to_mjcf(layout, cameras=False)
    attach_robot(scene)
    scene.compiler.discardvisual = scene.compiler.fusestatic = True
    assert binary(scene.compile()) == binary(physics_model(layout))


def binary(model: mujoco.MjModel) -> bytes:
    buffer = np.empty(mujoco.mj_sizeModel(model), np.uint8)
    mujoco.mj_saveModel(model, None, buffer)
    return buffer.tobytes()


def test_the_pool_prepares_what_comes_next_and_this_process_takes_it_over(pool):
    client = pool.connect()
    stage = take(client, training_sources.shifted, 12)
    assert stage.layout.id == "shifted-12"
    world._recent.clear()
    gc.collect()
    assert world_of(layout_of(stage)).model is stage.model


def test_each_environment_has_a_connection_and_copies_make_their_own(pool):
    env = environment(pool)
    expected = drive(env, 3)
    twin, sent = deepcopy(env), pickle.loads(pickle.dumps(env))
    assert drive(twin, 3) == drive(sent, 3) == drive(env, 3) == expected
    env.close()
    assert drive(env, 1) == expected[:4]
    assert isinstance(pickle.loads(pickle.dumps(pool)), PoolAddress)


def test_a_layout_that_no_worker_can_make_raises_its_error_in_the_environment(pool):
    env = environment(pool, training=training_sources.refused)
    for _ in range(2):
        with pytest.raises(InfeasibleError, match="nothing fits"):
            env.reset(seed=0)


def test_an_environment_goes_on_when_workers_die_and_when_the_pool_is_closed(monkeypatch):
    monkeypatch.setattr(pool_module, "LOSSES", 1)
    expected = drive(environment(None), 4)
    with LayoutPool(1) as pool:
        env = environment(pool, training=training_sources.deadly)
        assert drive(env, 4) == expected
    assert drive(env, 4) == drive(environment(pool), 4) == expected


def test_a_pool_ends_at_once_with_its_block_although_a_worker_is_busy():
    before = set(multiprocessing.active_children())
    with LayoutPool(1) as pool:
        client = pool.connect()
        assert client.take(training_sources.slow, [1, 2], LayoutSenses()) is None
        end = time.monotonic() + PATIENCE
        while set(multiprocessing.active_children()) == before and time.monotonic() < end:
            time.sleep(0.01)
    pool.close()
    assert client.take(training_sources.slow, [2], LayoutSenses()) is None
    assert set(multiprocessing.active_children()) <= before


def test_no_worker_outlives_the_program_and_its_environments_go_on(tmp_path):
    (tmp_path / "program.py").write_text(PROGRAM)
    run = Marked(["program.py"], tmp_path)
    run.wait_for(lambda: (tmp_path / "driving").exists())
    os.kill(run.process.pid, signal.SIGKILL)
    assert run.remaining(PATIENCE) == []
    run.end()
    assert {path.name for path in tmp_path.iterdir()} <= {"program.py", "driving", "alone", "__pycache__"}


def test_layouts_that_are_taken_or_no_longer_needed_leave_no_open_file(pool):
    folder = Path("/proc/self/fd")
    client = pool.connect()
    take(client, training_sources.shifted, 1)
    before = len(list(folder.iterdir()))
    for number in range(2, 8):
        client.take(training_sources.shifted, [0, number, number + 100], LayoutSenses())
        take(client, training_sources.shifted, number)
    client.close()
    end = time.monotonic() + PATIENCE
    while len(list(folder.iterdir())) > before and time.monotonic() < end:
        time.sleep(0.01)
    assert len(list(folder.iterdir())) <= before


@pytest.mark.parametrize("workers", [0, 1.5, True])
def test_a_number_of_workers_that_is_not_positive_is_refused(workers):
    with pytest.raises(OptionError, match="from 1 to"):
        LayoutPool(workers)


def test_a_source_that_cannot_be_sent_is_refused(pool):
    with pytest.raises(OptionError, match="pass a function of a module"):
        environment(pool, training=lambda number: None)
