"""What a learner can rely on: the brake is the evaluator's, a success returns more than a failure, and the ladder."""

from __future__ import annotations

import math

import gymnasium as gym
import numpy as np
import pytest
from laboratories import hall_laboratory

import labgym  # noqa: F401 -- registers the ids
from labgym.envs.labnav.curriculum import WINDOW, Climb, Curriculum
from labgym.envs.labnav.episodes import EpisodeTasks, published_episodes
from labgym.envs.labnav.task import SECONDS, STOP_HOLD
from labgym.envs.labnav.tasks import FIGURE_TASKS, TASKS, config_of
from labgym.envs.parts.braking import BrakingActions
from labgym.envs.point_nav import LabPointNavEnv
from labgym.envs.presets import configured, labnav_id
from labgym.envs.world import world_of
from labgym.errors import OptionError, UnknownNameError
from labgym.eval.labnav.drive import drive_floor
from labgym.eval.labnav.results import DriveTerms
from labgym.policies import EpisodeStart, GroundTruth, Policy
from labgym.policies.tracking import PathTracker

HALL = hall_laboratory()
SINGLE = tuple(name for name in FIGURE_TASKS if not TASKS[name].chain)


class Routed(Policy):
    """Follows the shortest path of the published floor, and never says STOP."""

    name = "routed"
    privileged = True
    observation = "lidar"

    def reset(self, episode: EpisodeStart) -> None:
        truth = episode.truth
        path = world_of(truth.layout).paths.path(truth.pair.start, truth.pair.goal)
        x, y, yaw = truth.start
        points = np.array([point[:2] for point in path.points]) - (x, y)
        turn = np.array([[math.cos(yaw), -math.sin(yaw)], [math.sin(yaw), math.cos(yaw)]])
        self.tracker = PathTracker(points @ turn)

    def act(self, observation: dict) -> np.ndarray:
        return self.tracker.action(tuple(observation["odometry"]), float(observation["velocity"][0]))


def braked(task: str):
    """Return the floor, an episode of level 2 on floors-val that the evaluator brakes, and its row."""
    suite = published_episodes(task, 2, development=True)
    for episode in sorted(suite.episodes[:60], key=lambda each: each.length):
        layout = suite.layout(episode.floor)
        (result,) = drive_floor(Routed(), layout, (episode,), DriveTerms(task, 2, "routed", "suite", 0))
        if result.row.stopped == "evaluator":
            return layout, episode, result.row
    raise AssertionError(f"the evaluator brakes in no episode of {task}")


def drive(env: LabPointNavEnv, episode, policy: Policy, steps: int = 1200):
    """Drive an episode by a policy and return its return, and the last info."""
    observation, info = env.reset(seed=episode.seed, options={"episode": episode.number})
    state, total = env.state, 0.0
    truth = GroundTruth(state.task.old_map or state.task.layout, state.task.announced or state.task.pair, state.pose)
    policy.reset(EpisodeStart(goal=(0.0, 0.0), rng=np.random.default_rng(0), truth=truth))
    for _ in range(steps):
        x, y, cosine, sine = observation["odometry"].tolist()
        action = policy.act({**observation, "odometry": (x, y, math.atan2(sine, cosine))})
        observation, reward, terminated, _, info = env.step(action)
        total += reward
        if terminated:
            break
    return total, info


@pytest.mark.parametrize("task", ["odometry", "dock", "carry"])
def test_the_brake_ends_a_drive_as_the_evaluator_does(task):
    layout, episode, row = braked(task)
    env = LabPointNavEnv(config=config_of(task, tasks=EpisodeTasks(layout, (episode,)), exact=True))
    _, info = drive(env, episode, Routed())
    assert info["ending"] == "stop"
    assert info["is_success"] == (row.final_distance <= TASKS[task].radius)
    assert info["path_length"] == pytest.approx(row.path_length, abs=2e-3)
    # A step of STOP follows the parked robot.
    assert info["time"] == pytest.approx(row.time + 0.1, abs=1e-6)
    assert env.state.distance == pytest.approx(row.final_distance, abs=2e-3)


def test_the_brake_needs_the_odometry_and_no_stop():
    env = gym.make("LabNavGlass-v0", layout=HALL, sensors=["goal", "velocity"])
    env.reset(seed=0)
    with pytest.raises(OptionError, match="odometry"):
        env.step(np.zeros(2))
    with pytest.raises(OptionError, match="brake"):
        BrakingActions(stop=True)


def test_stop_counts_when_it_is_held():
    env = gym.make("LabNavGlass-v0", layout=HALL, stop="action")
    assert env.action_space.shape == (3,)
    env.reset(seed=0)
    says = [1.0] * (STOP_HOLD - 1) + [0.4] + [1.0] * STOP_HOLD
    ended = [env.step(np.array([0.0, 0.0, value], np.float32))[2] for value in says]
    assert ended == [False] * (len(says) - 1) + [True]
    with pytest.raises(UnknownNameError, match="action, brake"):
        gym.make("LabNavGlass-v0", stop="never")
    with pytest.raises(OptionError, match="stop has no effect with actions"):
        gym.make("LabNavGlass-v0", stop="action", actions="velocity")


def test_an_untrained_policy_hardly_ever_says_stop():
    rng = np.random.default_rng(0)
    for values in (np.clip(rng.normal(size=200_000), -1.0, 1.0), rng.uniform(-1.0, 1.0, 200_000)):
        actions, held, stops = config_of("aisle", stop="action").actions, 0, 0
        for value in values:
            held = held + 1 if value > actions.threshold else 0
            stops, held = (stops + 1, 0) if held == actions.hold else (stops, held)
        assert len(values) / stops > 300


@pytest.mark.parametrize("task", FIGURE_TASKS)
def test_the_weights_let_no_failure_return_as_much_as_a_success(task):
    """Progress is a difference of lengths, so of one drive a success and a failure differ by at least the bound."""
    config = configured(labnav_id(task), {})
    weights = {term.name: term.weight for term in config.reward_terms}
    limit = gym.spec(labnav_id(task)).max_episode_steps / (TASKS[task].seconds / SECONDS)
    assert limit == pytest.approx(SECONDS / config.control_dt)
    slowest, radius = weights["time"] * limit, 2.0 * TASKS[task].radius
    failure, truncated = weights["failure"] + weights["time"], slowest
    success = weights["success"] + slowest - weights["progress"] * radius
    assert success > max(failure, truncated) + 3.0
    assert weights["collision"] == 0.0
    assert config.reward_terms[0].method == "exact"


@pytest.mark.parametrize("task", SINGLE)
def test_standing_still_and_stopping_early_return_less_than_a_success(task):
    """A success at walking pace against standing still to the end, and STOP at once; in the same episode."""
    options = {"pair": 1} if task == "dock" else {"start": (9.0, 6.5, math.pi), "goal": (7.0, 6.5)}
    returns = {}
    for name, stop in (("success", "brake"), ("still", "brake"), ("stopped", "action")):
        env = gym.make(labnav_id(task), layout=HALL, level=1, stop=stop, physics="mujoco")
        env.reset(seed=3, options=options)
        state, total, over = env.unwrapped.state, 0.0, False
        path = state.world.paths.path(state.pair.start, state.pair.goal)
        tracker = PathTracker(np.array([point[:2] for point in path.points]))
        while not over:
            action = tracker.action(state.pose, state.velocity[0]) if name == "success" else np.zeros(2)
            command = [*action, *([1.0] if stop == "action" else [])]
            _, reward, terminated, truncated, info = env.step(np.array(command, np.float32))
            total, over = total + reward, terminated or truncated
        returns[name] = total
        assert info["is_success"] == (name == "success")
    assert returns["success"] > max(returns["still"], returns["stopped"]) + 10.0


def test_ending_a_shift_early_costs_the_drives_that_are_not_begun():
    env = gym.make("LabNavShift-v0", layout=HALL, level=0, endings=["contact"], rewards=None).unwrapped
    env.reset(seed=1)
    drives = 1 + len(env.state.task.following)
    terminated = False
    while not terminated:
        _, _, terminated, _, info = env.step(np.array([1.0, 0.0], np.float32))
    assert drives > 1
    assert info["reward_terms"]["failure"] == -5.0 * drives


@pytest.mark.parametrize("task", FIGURE_TASKS)
def test_a_random_policy_drives_a_hundred_steps_at_level_0(task):
    env, rng, episodes, steps = gym.make(labnav_id(task), layout=HALL, level=0), np.random.default_rng(0), 6, 0
    for seed in range(episodes):
        env.reset(seed=seed)
        over = False
        while not over and steps < 100 * episodes:
            action = np.clip(rng.normal(size=2), -1.0, 1.0).astype(np.float32)
            _, _, terminated, truncated, _ = env.step(action)
            steps, over = steps + 1, terminated or truncated
    assert steps >= 100 * episodes


@pytest.mark.parametrize("task", FIGURE_TASKS)
def test_level_0_has_the_sensors_and_conditions_of_its_task_with_less_of_each(task):
    easy, first = TASKS[task].level(0), TASKS[task].level(1)
    kinds = {each["kind"] for each in first.conditions}
    assert {each["kind"] for each in easy.conditions} == kinds
    assert bool(easy.odometry) == bool(first.odometry)
    assert all(abs(value) <= abs(first.odometry[name]) for name, value in easy.odometry.items())
    assert easy.lengths[0] <= first.lengths[0]
    assert (easy.lidar, easy.mounting, easy.slip) <= (first.lidar, first.mounting, first.slip)
    spaces = [gym.make(labnav_id(task), level=level).observation_space for level in (0, 1)]
    assert spaces[0] == spaces[1]


def test_a_mixed_curriculum_draws_rooms_and_all_levels_up_to_its_own():
    env = gym.make("LabNavGlass-v0", layout=HALL, level=1, curriculum="mixed").unwrapped
    drives = set()
    for seed in range(24):
        env.reset(seed=seed)
        drives.add((env.config.split, env.config.drives))
    assert drives == {
        ("train", "labnav-glass-0"), ("floors-train", "labnav-glass-0"), ("floors-train", "labnav-glass-1"),
    }  # fmt: skip
    first = env.reset(seed=5)[0]
    for name, reading in env.reset(seed=5)[0].items():
        np.testing.assert_array_equal(reading, first[name])
    env.close()


def test_a_rising_curriculum_climbs_by_success_and_falls_by_failure():
    climb = Climb(Curriculum("rising", ("a", "b", "c")))
    for _ in range(WINDOW - 1):
        climb.record(True)
    assert climb.rung == 0
    climb.record(True)
    assert climb.state == [1]
    for success in (True, False) * WINDOW:
        climb.record(success)
    assert climb.rung == 1
    other = Climb(Curriculum("rising", ("a", "b", "c")))
    other.restore(climb.state)
    for _ in range(WINDOW):
        other.record(False)
    assert other.rung == 0
    with pytest.raises(OptionError, match="curriculum"):
        other.restore([3])


def test_a_curriculum_is_one_of_a_labnav_id():
    with pytest.raises(UnknownNameError, match="mixed, rising"):
        gym.make("LabNavGlass-v0", curriculum="steep")
    with pytest.raises(OptionError, match="LabNav id"):
        gym.make("LabPointNav-v0", curriculum="mixed")
