"""Datasets on training floors and of drives that a network leads, and training that begins with its weights."""

from __future__ import annotations

import itertools
import math
from pathlib import Path

import numpy as np
import pytest
import torch

from labgym.cli import main
from labgym.envs.sensors import Camera
from labgym.errors import OptionError
from labgym.geometry import to_local, to_world, wrap_angle
from labgym.layouts import Layout, generate
from labgym.layouts.places import layout_at
from labgym.policies.data import DataOptions, DatasetManifest, load_dataset, make_dataset
from labgym.policies.data.situations import LARGEST_TURN_RAD, STRIDES_M, DriveFrame, Situations
from labgym.policies.navdp.config import NavDPConfig, NavDPNetworkOptions, NavDPTrainOptions
from labgym.policies.navdp.leader import NavDPLeader
from labgym.policies.navdp.network import NavDPNetwork, frame, frame_shape, load_navdp, save_navdp
from labgym.policies.navdp.policy import NavDPPolicy
from labgym.policies.navdp.train import train
from labgym.runs import ExecutorOptions
from labgym.scenes import RayScene

SMALL = NavDPNetworkOptions(memory=2, channels=(8, 8, 16), queries=4, width=16, heads=2, layers=1)
TRAINING = NavDPTrainOptions(epochs=1, batch=8, warmup=2, held_out=0.0)
CONFIG = NavDPConfig(network=SMALL, training=TRAINING)


@pytest.fixture(scope="module")
def learner(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("learner")
    torch.manual_seed(3)
    save_navdp(folder, NavDPNetwork(CONFIG), CONFIG)
    return folder


@pytest.fixture(scope="module")
def room() -> Layout:
    return generate("sub_01", 3)


def test_a_drive_follows_its_guide_and_its_samples_keep_the_expert_s_way(room: Layout) -> None:
    def left(seen: DriveFrame) -> np.ndarray:
        return np.array([[0.0, 0.0], [0.6, 0.6]])

    frames = Situations(room).drive(np.random.default_rng(1), 40, left)
    # The way of every frame still leads to its goal, and the robot never leaves the free space.
    for one in frames:
        np.testing.assert_allclose(one.path[-1], one.goal, atol=1e-9)
    turns = [
        wrap_angle(after.pose[2] - before.pose[2])
        for before, after in itertools.pairwise(frames)
        if after.frame == before.frame + 1
    ]
    # 45 degrees to the left per frame, bounded and with noise; the expert's turns have no such side.
    assert np.mean(turns) > 0.5
    assert np.abs(turns).max() <= LARGEST_TURN_RAD + 1e-9


def test_a_guide_into_a_wall_leaves_the_robot_in_free_space(room: Layout) -> None:
    situations = Situations(room)
    frames = situations.drive(np.random.default_rng(2), 60, lambda seen: np.array([[0.0, 0.0], [30.0, 0.0]]))
    assert situations._space.holds(np.array([one.pose[:2] for one in frames])).all()
    steps = [math.dist(a.pose[:2], b.pose[:2]) for a, b in itertools.pairwise(frames) if b.frame > a.frame]
    assert max(steps) <= STRIDES_M[1] + 1e-9


def test_a_leader_goes_where_the_policy_s_best_trajectory_goes(learner: Path, room: Layout) -> None:
    guide = NavDPLeader.of(learner).guide(room, 7)
    seen = Situations(room).drive(np.random.default_rng(3), 1)[0]
    way = guide(seen)
    assert way.shape == (25, 2)
    np.testing.assert_array_equal(way[0], 0.0)
    # The policy draws the same trajectories from the same frame, goal and noise.
    policy = NavDPPolicy(learner, {"samples": 6, "shortest": 0.0})
    drawn = policy.drawn_from(*Camera().colour_and_depth(RayScene(room), seen.pose), seen.goal, seed=7)
    np.testing.assert_allclose(way[1:], drawn.trajectories[int(np.argmax(drawn.values))], atol=1e-6)
    # In the room, and back.
    np.testing.assert_allclose(to_local(to_world(way, seen.pose), seen.pose), way, atol=1e-9)


@pytest.mark.slow
def test_a_dataset_on_floors_with_a_learner_does_not_depend_on_the_workers(learner: Path, tmp_path: Path) -> None:
    leader = NavDPLeader.of(learner)
    options = DataOptions(samples=4, shard=2, layout=2, drive=2, floors=1.0, led=0.5, learner=leader.digest)
    for name, workers in (("one", 1), ("two", 2)):
        make_dataset(tmp_path / name, options, ExecutorOptions(workers=workers), progress=False, leader=leader)
    one, two = (DatasetManifest.load(tmp_path / name / "manifest.json") for name in ("one", "two"))
    assert one == two
    for shard in one.shards:
        for layout in shard.layouts:
            index = int(layout.id.removeprefix("floors-train-"))
            assert layout_at("floors-train", index).hash == layout.hash
    assert len(load_dataset(tmp_path / "one")) == 4


def test_the_learner_of_the_options_is_the_one_that_leads(learner: Path, tmp_path: Path) -> None:
    with pytest.raises(OptionError, match="another learner"):
        make_dataset(tmp_path, DataOptions(samples=1), progress=False, leader=NavDPLeader.of(learner))


def test_training_begins_with_the_weights_of_another_network(learner: Path, tmp_path: Path) -> None:
    make_dataset(tmp_path / "data", DataOptions(samples=8, shard=8, layout=8, drive=4), progress=False)
    still = CONFIG.model_copy(update={"training": TRAINING.model_copy(update={"rate": 1e-12, "decay": 0.0})})
    train(tmp_path / "data", tmp_path / "run", still, progress=False, start=learner)
    begun, ended = load_navdp(learner).state_dict(), load_navdp(tmp_path / "run").state_dict()
    for name, value in begun.items():
        torch.testing.assert_close(ended[name], value, atol=1e-6, rtol=0.0)
    with pytest.raises(OptionError, match="start"):
        train(tmp_path / "data", tmp_path / "run", still, progress=False)
    wider = CONFIG.model_copy(update={"network": SMALL.model_copy(update={"memory": 3})})
    with pytest.raises(OptionError, match="--memory"):
        train(tmp_path / "data", tmp_path / "other", wider, progress=False, start=learner)


@pytest.mark.parametrize(("shrink", "shape"), [(1, (72, 128)), (2, (36, 64)), (4, (18, 32))])
def test_frames_of_other_sizes(shrink: int, shape: tuple[int, int]) -> None:
    assert frame_shape(shrink) == shape
    rgb, depth = np.full((72, 128, 3), 9, np.uint8), np.full((72, 128), 2.0, np.float32)
    seen = frame(rgb, depth, shrink)
    assert seen.shape == (*shape, 4)
    assert (seen[..., :3] == 9).all()
    assert (seen[..., 3] == 102).all()  # 2 m in steps of 5 m / 255
    options = NavDPNetworkOptions.for_frames(4, shrink)  # type: ignore[arg-type]
    tokens = NavDPNetwork(NavDPConfig(network=options)).encode(torch.from_numpy(np.stack([seen] * 4))[None])
    assert tokens.shape == (1, options.queries, options.width)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--led", "0.5"], "--learner"),
        (["--floors", "1.5"], "floors is 1.5"),
        (["--format", "minari", "--floors", "0.5"], "--floors has no effect"),
        (["--learner", "nowhere"], "no such file"),
    ],
)
def test_bad_arguments_are_named(arguments: list[str], message: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["data", *arguments]) == 2
    assert message in capsys.readouterr().err
