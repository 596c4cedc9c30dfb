"""A pack of training floors: its bytes depend on its numbers alone, it resumes, and environments draw from it."""

from __future__ import annotations

import gzip
import json

import gymnasium as gym
import numpy as np
import pytest
from laboratories import hall_laboratory
from same_results import assert_same

import labgym  # noqa: F401 -- registers the ids
from labgym.envs import presets
from labgym.envs.labnav import pack as module
from labgym.envs.labnav.pack import FOLDER, INDEX, make_pack, read_pack
from labgym.envs.labnav.tasks import TASKS
from labgym.envs.presets import configured
from labgym.errors import DocumentError, LabgymError, OptionError, UnknownNameError

HALL = hall_laboratory()
NAMES = ("odometry", "glass")


@pytest.fixture
def packed(tmp_path, monkeypatch):
    """Return a function that makes a pack of two floors, in which two tasks at levels 0 and 1 are drawn."""
    monkeypatch.setattr(module, "training_floor", lambda number: HALL.replace(id=f"hall-{number}"))
    monkeypatch.setattr(module, "TASKS", {name: TASKS[name] for name in NAMES})
    monkeypatch.setattr(module, "LEVELS", (0, 1))
    module._floor.cache_clear()

    def make(name: str = "pack", count: int = 2):
        return tmp_path / name, make_pack(tmp_path / name, count, 2)

    return make


def contents(folder):
    return {path.name: path.read_bytes() for path in sorted((folder / FOLDER).iterdir())}


def test_a_pack_that_is_interrupted_resumes_to_the_same_bytes(packed, monkeypatch):
    folder, pack = packed()
    assert pack.episodes["odometry-0"] == (2, 2)
    assert pack.floors == (f"{FOLDER}/00000.json.gz", f"{FOLDER}/00001.json.gz")
    drawn = module.draw_pack_floor

    def fails(number, per_level):
        if number == 1:
            raise KeyboardInterrupt
        return drawn(number, per_level)

    monkeypatch.setattr(module, "draw_pack_floor", fails)
    with pytest.raises(KeyboardInterrupt):
        packed("other")
    with pytest.raises(LabgymError, match="labgym train floors"):
        read_pack(folder.parent / "other")
    monkeypatch.setattr(module, "draw_pack_floor", drawn)
    other, again = packed("other")
    assert contents(other) == contents(folder)
    assert (other / INDEX).read_bytes() == (folder / INDEX).read_bytes()
    assert again.digest == pack.digest


def test_environments_draw_the_episodes_of_a_pack(packed):
    folder, _ = packed()
    env = gym.make("LabNavGlass-v0", level=1, floors=str(folder)).unwrapped
    floors = set()
    for seed in range(12):
        env.reset(seed=seed)
        floors.add(env.state.task.layout.id.split("+")[0])
        assert env.state.shortest_path_length == pytest.approx(env.state.world.length_to_disc(env.state.pair, 0.36))
        assert env.state.conditions["glass"]["panes"]
    assert len(floors) == 2
    first = env.reset(seed=1, options={"floor": 0, "episode": 1})[0]
    for name, reading in env.reset(seed=1, options={"floor": 0, "episode": 1})[0].items():
        np.testing.assert_array_equal(reading, first[name])
    for options in ({"floor": 7}, {"episode": 9}, {"pair": 0}):
        with pytest.raises(UnknownNameError):
            env.reset(options=options)
    ladder = configured("LabNavGlass-v0", {"level": 1, "floors": str(folder), "curriculum": "mixed"}).curriculum
    assert [rung.floors for rung in ladder.rungs] == [str(folder), str(folder)]


@pytest.mark.parametrize(("task", "rule"), [("Odometry", None), ("Glass", None), ("Glass", "tasks")])
def test_the_kernel_drives_the_episodes_of_a_pack_as_single_environments_do(packed, task, rule, monkeypatch):
    pytest.importorskip("numba")
    monkeypatch.setattr(presets, "MIXED_TASKS", NAMES)
    folder, _ = packed()
    own = {"level": 1, "floors": str(folder), "physics": "planar", "curriculum": rule}
    mode = {"autoreset_mode": gym.vector.AutoresetMode.SAME_STEP}
    one = gym.make_vec(f"LabNav{task}-v0", 2, vectorization_mode="sync", vector_kwargs=mode, **own)
    many = gym.make_vec(f"LabNav{task}-v0", 2, vectorization_mode="vector_entry_point", **mode, **own)
    assert type(many).__name__ == "VectorPointNavEnv"
    assert_same(many.reset(seed=5)[0], one.reset(seed=5)[0])
    rng = np.random.default_rng(3)
    for _ in range(40):
        action = rng.uniform(-1.0, 1.0, one.action_space.shape).astype(np.float32)
        assert_same(many.step(action)[:4], one.step(action)[:4])
    one.close()
    many.close()


def test_a_pack_without_the_task_a_damaged_floor_and_idle_arguments_are_refused(packed):
    folder, _ = packed()
    with pytest.raises(OptionError, match="no episode of glass-2"):
        gym.make("LabNavGlass-v0", floors=str(folder))
    with pytest.raises(OptionError, match="no effect"):
        gym.make("LabPointNav-v0", floors=str(folder))
    with pytest.raises(OptionError, match="with floors"):
        gym.make("LabNavGlass-v0", level=1, floors=str(folder), layout=HALL)
    for damaged in (b"", b"{}", gzip.compress(b"[]"), gzip.compress(b'{"layout": {}, "episodes": {}}')):
        module._floor.cache_clear()
        for path in (folder / FOLDER).iterdir():
            path.write_bytes(damaged)
        with pytest.raises(DocumentError):
            gym.make("LabNavGlass-v0", level=1, floors=str(folder)).reset(seed=0)


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("floors", ["../floors/00000.json.gz", "floors/00001.json.gz"]),
        ("episodes", {"odometry-0": [2, 2, 2]}),
        ("episodes", {"odometry-0": [2, -1]}),
    ],
)
def test_an_index_that_does_not_fit_its_floors_is_refused(packed, field, value):
    folder, _ = packed()
    index = json.loads((folder / INDEX).read_text())
    (folder / INDEX).write_text(json.dumps({**index, field: value}))
    with pytest.raises(DocumentError):
        read_pack(folder)
