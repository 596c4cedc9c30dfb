from __future__ import annotations

import math
import os
import pickle
import subprocess
import sys

import numpy as np
import pytest

from labgym.envs.sensors import IMAGE_SHAPE, Camera, Lidar
from labgym.envs.tasks import Task
from labgym.errors import DocumentError, OptionError
from labgym.geometry import rotate
from labgym.layouts import load_published
from labgym.layouts.splits import published
from labgym.navigation import goal_pairs, shortest_path
from labgym.policies import EpisodeStart, make_policy
from labgym.policies.learned.expert import Atlas, Atlases, Expert
from labgym.policies.ppo.drives import ANYWHERE, TrainingDrives
from labgym.policies.ppo.inputs import SIZES, SPEED, STATE, TRAIL_STEPS, DriveMemory, RememberedObstacles
from labgym.policies.ppo.practice import REWARD_SCALE, PracticeEnv
from labgym.scenes import RayScene
from runs import killing

torch = pytest.importorskip("torch")
pytest.importorskip("stable_baselines3")

from safetensors.torch import load_file  # noqa: E402

from labgym.policies.learned.weights import WEIGHTS, load_weights, save_weights  # noqa: E402
from labgym.policies.ppo.network import Actor  # noqa: E402
from labgym.policies.ppo.options import PPOOptions, TrainingProgress  # noqa: E402
from labgym.policies.ppo.policy import DRIVERS  # noqa: E402
from labgym.policies.ppo.training import train  # noqa: E402

TINY = PPOOptions(
    steps=192, layouts=1, environments=2, horizon=40, cloning_rounds=1, cloning_steps=64, cloning_epochs=1,
    rollout=32, leg=1, epochs=1, batch=32, evaluate_every=1,
)  # fmt: skip


@pytest.fixture(scope="module")
def layout():
    return load_published("val", published("val")[0])


@pytest.fixture(scope="module")
def practice(layout):
    return PracticeEnv(TrainingDrives([layout], points=3), "lidar", horizon=30)


def observation_of(lidar=5.0, goal=(2.0, 1.0, 0.0), velocity=(0.0, 0.0)):
    return {
        "lidar": np.full(180, lidar, np.float32),
        "goal": np.array(goal, np.float32),
        "velocity": np.array(velocity, np.float32),
    }


def weights(folder):
    return load_file(folder / WEIGHTS)


def test_past_positions_are_in_the_robots_present_frame():
    memory, rng = DriveMemory("lidar"), np.random.default_rng(0)
    poses = np.cumsum(rng.normal(0.0, 0.1, (200, 3)), axis=0)
    for pose in poses:
        vector = memory.vector(observation_of(), pose)
    for k, steps in enumerate(TRAIL_STEPS):
        expected = rotate(*(poses[-1 - steps, :2] - poses[-1, :2]), -poses[-1, 2])
        assert vector[5 + 2 * k : 7 + 2 * k] == pytest.approx(expected, abs=1e-5)
    memory.reset()
    assert not memory.vector(observation_of(), poses[0])[5:STATE].any()


def test_the_vector_does_not_depend_on_the_frame_that_poses_are_given_in():
    poses = np.cumsum(np.random.default_rng(1).normal(0.0, 0.1, (50, 3)), axis=0)
    here, there = DriveMemory("lidar"), DriveMemory("lidar")
    for x, y, yaw in poses:
        a = here.vector(observation_of(), (x, y, yaw))
        b = there.vector(observation_of(), (*np.add(rotate(x, y, 1.0), (3.0, -2.0)), yaw + 1.0))
    assert a.shape == (SIZES["lidar"],)
    np.testing.assert_allclose(a, b, atol=1e-5)


def test_after_a_turn_in_place_the_camera_has_seen_what_the_lidar_sees(layout):
    rays, camera = RayScene(layout), Camera()
    x, y, yaw = goal_pairs(layout)[0].start
    surroundings = RememberedObstacles()
    for turned in np.linspace(0.0, 2.0 * math.pi, 60):
        picture = camera.depth(rays, (x, y, yaw + turned))
        seen_by_camera = surroundings.ranges(picture, (0.0, 0.0, turned))
    scan = Lidar().scan(rays, (x, y, yaw))
    # It sees higher and lower things too, so it may see nearer ones; nothing may be missing, a cell's size aside.
    assert (seen_by_camera <= scan + 0.1).mean() > 0.95
    assert (np.abs(seen_by_camera - scan) < 0.1).mean() > 0.4


def test_remembered_obstacles_do_not_depend_on_the_frame_of_the_poses(layout):
    rays, camera = RayScene(layout), Camera()
    x, y, yaw = goal_pairs(layout)[0].start
    here, there = DriveMemory("depth"), DriveMemory("depth")
    for turned in (0.0, 0.4, 0.8):
        observation = {**observation_of(), "depth": camera.depth(rays, (x, y, yaw + turned)).ravel()}
        a = here.vector(observation, (x, y, yaw + turned))
        b = there.vector(observation, (*np.add(rotate(x, y, 1.0), (3.0, -2.0)), yaw + turned + 1.0))
    assert a.shape == (SIZES["depth"],)
    np.testing.assert_allclose(a, b, atol=1e-4)


def test_the_depth_image_is_reduced_to_the_nearest_depth_of_each_square():
    picture = np.random.default_rng(4).uniform(0.5, 9.0, IMAGE_SHAPE).astype(np.float32)
    vector = DriveMemory("depth").vector({**observation_of(), "depth": picture.ravel()}, (0, 0, 0))
    small = vector[-18 * 32 :].reshape(18, 32)
    assert small[3, 7] == picture[12:16, 28:32].min()


def test_the_network_distinguishes_ahead_from_behind():
    actor = Actor("lidar").eval()
    ranges = np.random.default_rng(2).uniform(0.3, 10.0, 180).astype(np.float32)
    vectors = torch.from_numpy(
        np.stack(
            [
                DriveMemory("lidar").vector({**observation_of(), "lidar": scan}, (0, 0, 0))
                for scan in (ranges, np.roll(ranges, 90))
            ]
        )
    )
    with torch.no_grad():
        first, second = actor(vectors)
    assert not torch.allclose(first, second)


def test_training_drives_lie_on_free_floor_and_are_drawn_from_the_generator_alone(layout):
    drives, again = TrainingDrives([layout], seed=3), TrainingDrives([layout], seed=3)
    drawn = [drives.draw(np.random.default_rng(k), {}, True).pair for k in range(20)]
    assert drawn == [again.draw(np.random.default_rng(k), {}, True).pair for k in range(20)]
    assert {pair.start_location == ANYWHERE for pair in drawn} == {True, False}
    for pair in drawn[:6]:
        assert shortest_path(layout, pair.start[:2], pair.goal[:2]) is not None


def test_a_limit_leaves_out_goals_that_are_farther_away(layout):
    drives = TrainingDrives([layout])
    drives.farthest = 3.0
    for k in range(30):
        pair = drives.draw(np.random.default_rng(k), {}, True).pair
        assert math.dist(pair.start[:2], pair.goal[:2]) <= 3.0


def test_the_training_reward_is_the_environments_scaled_and_episodes_end_at_the_horizon(practice):
    practice.reset(seed=1)
    before = practice.task
    total, steps, truncated, terminated = 0.0, 0, False, False
    while not (truncated or terminated):
        vector, reward, terminated, truncated, _ = practice.step(np.array([0.0, 1.0], np.float32))
        assert vector in practice.observation_space
        total += reward
        steps += 1
    assert (steps, truncated) == (30, True)
    assert practice.task is before
    assert total == pytest.approx(30 * REWARD_SCALE * -0.01, abs=0.05)


def test_the_expert_reaches_every_goal_of_a_layout(layout):
    expert, env = Expert(Atlases()), PracticeEnv(TrainingDrives([layout]), "lidar", horizon=600)
    for index in range(4):
        _, info = env.reset(seed=index)
        speed, done = 0.0, False
        for _ in range(600):
            vector, _, done, _, info = env.step(expert.action(env.task, info["pose"], speed).astype(np.float32))
            speed = float(vector[SPEED])
            if done:
                break
        assert done


def test_the_experts_paths_are_at_most_a_quarter_longer_than_the_shortest(layout):
    atlas = Atlas(layout)
    for pair in goal_pairs(layout):
        path = atlas.path(pair.start[:2], pair.goal[:2])
        length = np.linalg.norm(np.diff(path, axis=0), axis=1).sum()
        assert length <= 1.25 * shortest_path(layout, pair.start[:2], pair.goal[:2]).length + 0.2


def test_a_run_without_the_warm_start_begins_with_ppo(layout, tmp_path):
    cold = TINY.model_copy(update={"cloning_rounds": 0, "observation": "depth", "steps": 64})
    best = train(cold, tmp_path, layouts=(layout,))
    assert [record["kind"] for record in TrainingProgress.load(tmp_path / "progress.json").records] == [
        "leg",
        "validation",
    ]
    assert load_weights(Actor("depth"), best).encoder.picture is not None


def interrupted(policy):
    raise KeyboardInterrupt


def test_an_interrupted_training_resumes_to_the_same_weights(layout, tmp_path):
    def stop(policy):
        judged.append(policy)
        if len(judged) == 3:
            raise KeyboardInterrupt
        return 0.5

    judged = []
    train(TINY, tmp_path / "straight", lambda policy: 0.5, layouts=(layout,))
    with pytest.raises(KeyboardInterrupt):
        train(TINY, tmp_path / "stopped", stop, layouts=(layout,))
    halfway = weights(tmp_path / "stopped" / "last")
    train(TINY, tmp_path / "stopped", lambda policy: 0.5, layouts=(layout,))
    expected, resumed = weights(tmp_path / "straight" / "last"), weights(tmp_path / "stopped" / "last")
    assert all(torch.equal(expected[name], resumed[name]) for name in expected)
    assert any(not torch.equal(halfway[name], resumed[name]) for name in expected)
    assert killing.tree(tmp_path / "straight") == killing.tree(tmp_path / "stopped")
    assert not (tmp_path / "stopped/checkpoint").exists()


def test_a_run_is_not_mixed_with_one_of_other_options(layout, tmp_path):
    with pytest.raises(KeyboardInterrupt):
        train(TINY, tmp_path, interrupted, layouts=(layout,))
    with pytest.raises(OptionError, match=r"seed \(0 there, 1 requested\)"):
        train(TINY.model_copy(update={"seed": 1}), tmp_path, layouts=(layout,))


def test_the_best_on_validation_is_kept(layout, tmp_path):
    scores = iter([0.2, 0.9, 0.5, 0.1, 0.1])
    actors = []

    def judge(policy):
        actors.append(policy)
        return next(scores)

    train(TINY, tmp_path, judge, layouts=(layout,))
    best, last = weights(tmp_path / "best"), weights(tmp_path / "last")
    assert len(actors) == 4
    assert torch.equal(best["action.bias"], actors[1]._actor.state_dict()["action.bias"])
    assert not torch.equal(best["action.bias"], last["action.bias"])


@pytest.mark.parametrize("sensor", DRIVERS)
def test_saved_weights_drive_as_the_network_did(sensor, tmp_path):
    torch.manual_seed(0)
    actor = Actor(sensor).eval()
    save_weights(actor, tmp_path)
    policies = DRIVERS[sensor](actor=actor), DRIVERS[sensor](weights=str(tmp_path))
    actions = []
    for policy in policies:
        policy.reset(EpisodeStart(goal=(2.0, 0.0), rng=np.random.default_rng(0)))
        picture = np.full(IMAGE_SHAPE, 3.0, np.float32).ravel()
        actions.append(policy.act({**observation_of(), "depth": picture, "odometry": np.zeros(3)}))
    np.testing.assert_array_equal(*actions)
    assert np.abs(actions[0]).max() <= 1.0
    assert policies[1].files() == (tmp_path / WEIGHTS,)


def test_resuming_never_unpickles_code(layout, tmp_path):
    """A checkpoint of stable-baselines3 with a pickle in it, as labgym 0.1 loaded it, is neither run nor read."""
    with pytest.raises(KeyboardInterrupt):
        train(TINY, tmp_path, interrupted, layouts=(layout,))
    marker = tmp_path / "executed"
    (checkpoint,) = (tmp_path / "checkpoint").iterdir()
    checkpoint.write_bytes(pickle.dumps(Payload(marker)))
    with pytest.raises(DocumentError, match="checkpoint"):
        train(TINY, tmp_path, lambda policy: 0.5, layouts=(layout,))
    torch.save({"parts": {}, "record": Payload(marker)}, checkpoint)
    with pytest.raises(DocumentError, match="checkpoint"):
        train(TINY, tmp_path, lambda policy: 0.5, layouts=(layout,))
    assert not marker.exists()


class Payload:
    """Creates a folder when it is unpickled."""

    def __init__(self, folder):
        self.folder = folder

    def __reduce__(self):
        return os.mkdir, (str(self.folder),)


@pytest.mark.parametrize("content", [b"", b"torn"])
def test_a_damaged_or_missing_checkpoint_is_named(layout, tmp_path, content):
    with pytest.raises(KeyboardInterrupt):
        train(TINY, tmp_path, interrupted, layouts=(layout,))
    (checkpoint,) = (tmp_path / "checkpoint").iterdir()
    checkpoint.write_bytes(content) if content else checkpoint.unlink()
    with pytest.raises(DocumentError, match=checkpoint.name):
        train(TINY, tmp_path, lambda policy: 0.5, layouts=(layout,))


def test_the_policy_loads_without_the_learning_library():
    code = "import sys; import labgym.policies.ppo.policy; sys.exit('stable_baselines3' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


@pytest.mark.cases(1)
@pytest.mark.parametrize("name", ["ppo", "ppo-depth"])
def test_the_published_policy_arrives(name, layout):
    from labgym.eval import evaluate

    report = evaluate(make_policy(name), [layout], progress=False)
    assert report.summary.errors == 0
    assert report["success"] >= 0.5


def test_a_drive_of_another_task_begins_a_new_path(layout):
    expert = Expert(Atlases())
    first, second = goal_pairs(layout)[:2]
    drives = TrainingDrives([layout])
    task = drives.draw(np.random.default_rng(0), {}, True)
    a = expert.action(Task(layout, task.protocol, first), first.start, 0.0)
    b = expert.action(Task(layout, task.protocol, second), second.start, 0.0)
    fresh = Expert(Atlases()).action(Task(layout, task.protocol, second), second.start, 0.0)
    assert a.shape == (2,)
    np.testing.assert_array_equal(b, fresh)
