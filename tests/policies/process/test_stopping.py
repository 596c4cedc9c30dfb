"""Stop, the next goal and the declared latency reach the evaluator from the policy's process, or a clear refusal."""

from __future__ import annotations

import os
import time
from pathlib import Path

import numpy as np
import pytest

from labgym.envs.conditions.beaker import Beaker
from labgym.envs.labnav.tasks import task_of
from labgym.errors import LabgymError, UnknownNameError
from labgym.policies import EpisodeStart, Policy
from labgym.policies.policy import PolicyError
from labgym.policies.process import PolicyProcess, PolicySource, ProcessLimits


def start(x: float = 1.0, **fields: object) -> EpisodeStart:
    return EpisodeStart(goal=(x, 0.0), rng=np.random.default_rng(0), **fields)  # type: ignore[arg-type]


class Counting(Policy):
    """Stops at the third decision of a drive; its actions tell what it has received."""

    latency = 0.25

    def reset(self, episode):
        self.goals = [episode.goal[0]]
        self.beaker, self.heading, self.task = episode.beaker, episode.heading, episode.task
        self.steps = 0

    def next_goal(self, episode):
        self.goals.append(episode.goal[0])
        self.steps = 0

    def stop(self, observation):
        return self.steps == 2

    def act(self, observation):
        self.steps += 1
        return [sum(self.goals), observation["goal"][0]]


class Plain(Policy):
    def reset(self, episode):
        self.beaker, self.heading, self.task = episode.beaker, episode.heading, episode.task

    def act(self, observation):
        return (
            [self.beaker.freeboard, self.heading]
            if self.task.people and self.task.weights.people == 0.0
            else [0.0, 0.0]
        )


class Broken(Plain):
    def __init__(self, way: str) -> None:
        self.way = way

    def stop(self, observation):
        if self.way == "none":
            return
        if self.way == "sleeps":
            time.sleep(60)
        if self.way == "nan":
            for entry in Path("/proc/self/fd").iterdir():
                if entry.is_symlink() and str(entry.readlink()).startswith("socket:"):
                    os.write(int(entry.name), b"D\x09\x00\x00\x00\x00" + np.array([np.nan, 0.0], "<f4").tobytes())
            time.sleep(60)
        raise RuntimeError("lost")


@pytest.fixture
def processes():
    opened = []

    def process(policy, **arguments):
        opened.append(PolicyProcess(PolicySource.copied(policy), **arguments))
        return opened[-1]

    yield process
    for each in opened:
        each.close()


def test_decisions_are_actions_until_the_policy_stops(processes):
    process = processes(Counting())
    assert (process.stops, process.latency) == (True, 0.25)
    process.reset(start())
    observation = {"goal": np.array([0.5])}
    assert [None if one is None else one.tolist() for one in (process.decide(observation) for _ in range(3))] == [
        [1.0, 0.5],
        [1.0, 0.5],
        None,
    ]


def test_the_next_goal_finds_what_the_policy_remembers_and_reset_does_not(processes):
    process = processes(Counting())
    process.reset(start(0.25))
    process.next_goal(start(0.5))
    assert process.decide({"goal": np.array([0.0])}).tolist() == [0.75, 0.0]
    process.reset(start(0.125))
    assert process.decide({"goal": np.array([0.0])}).tolist() == [0.125, 0.0]


def test_task_heading_and_beaker_reach_the_policy(processes):
    process = processes(Plain())
    assert (process.stops, process.latency) == (False, 0.0)
    process.reset(start(task=task_of("carry").announced(2), heading=0.5, beaker=Beaker(freeboard=0.25)))
    assert process.decide({}).tolist() == [0.25, 0.5]


@pytest.mark.parametrize(
    ("way", "reason"),
    [
        ("none", "stop returned a NoneType, expected True or False"),
        ("raises", "RuntimeError: lost"),
        ("nan", "act returned numbers that are not finite"),
        ("sleeps", "stop and act took longer than 1 s"),
    ],
)
def test_a_policy_that_stops_wrongly_fails_with_a_reason(processes, way, reason):
    process = processes(Broken(way), limits=ProcessLimits(call_seconds=1.0 if way == "sleeps" else 120.0))
    process.reset(start())
    with pytest.raises(PolicyError, match=reason):
        process.decide({})


def test_the_next_goal_of_an_episode_that_has_ended_is_refused(processes):
    process = processes(Broken("raises"))
    process.reset(start())
    with pytest.raises(PolicyError):
        process.decide({})
    with pytest.raises(PolicyError, match="ended"):
        process.next_goal(start())


@pytest.mark.cases(3)
@pytest.mark.parametrize("latency", [-0.1, float("nan"), float("inf"), 11.0, "fast", True])
def test_a_latency_that_is_none_is_refused(latency):
    policy = Plain()
    policy.latency = latency
    with pytest.raises(LabgymError, match="expected seconds from 0 to 10"):
        PolicyProcess(PolicySource.copied(policy)).close()


@pytest.mark.parametrize("observation", ["radar", None, ["lidar"]])
def test_an_observation_that_does_not_exist_is_refused_with_those_that_do(observation):
    policy = Plain()
    policy.observation = observation
    with pytest.raises(UnknownNameError, match="available: depth, lidar, rgbd"):
        PolicyProcess(PolicySource.copied(policy)).close()
