"""The loop of a drive, the same for all tasks: ask the policy, step the environment, until a rule ends the drive."""

from __future__ import annotations

import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any

import numpy as np
from numpy.typing import NDArray

from labgym.envs.point_nav import LabPointNavEnv
from labgym.envs.state import State
from labgym.eval.driving.actions import ActionTape
from labgym.policies import EpisodeStart
from labgym.policies.policy import PolicyError
from labgym.policies.process.episode import InvalidActionError

Observation = Mapping[str, Any]
Info = dict[str, Any]


class PolicyLoop(ABC):
    """A drive to one goal, from where the robot is. A task says when it ends and what the policy receives.

    Args:
        env: in an episode whose state has been noted.
        times: receives the wall-clock time of each action, seconds. tape: receives the policy's decisions.

    Attributes:
        parked: whether the robot came to rest by STOP or by the evaluator. error: of the policy.
        seconds: wall-clock time of the policy, its reset included.
    """

    def __init__(self, env: LabPointNavEnv, times: list[float], tape: ActionTape) -> None:
        self._env, self._times, self._tape = env, times, tape
        self.parked = False
        self.error: str | None = None
        self.seconds = 0.0

    @abstractmethod
    def over(self, observation: Observation, state: State) -> bool:
        """Return whether a rule or the time ends the drive now."""

    @abstractmethod
    def start(self, state: State) -> EpisodeStart:
        """Return what the policy receives at the start."""

    @abstractmethod
    def action(self, observation: Observation, state: State) -> NDArray[np.floating] | None:
        """Return the next action, None once the robot has been parked."""

    @abstractmethod
    def note(self, observation: Observation, info: Info) -> None:
        """Record the state after an action."""

    def run(self, begin: Callable[[EpisodeStart], None], observation: Observation) -> Observation:
        """Drive to the end and return the last observation.

        Args:
            begin: tells the policy its goal. observation: at the start.
        """
        state = self._env.state
        self._tape.begin()
        try:
            self.timed(begin, self.start(state))
            while not self.over(observation, state):
                action = self.action(observation, state)
                if action is None:
                    self.parked = True
                    break
                observation = self.step(action)
        except PolicyError as failure:
            self.error = str(failure)
            self._tape.fail()
        return observation

    def step(self, action: NDArray[np.floating]) -> Observation:
        """Carry out an action, note the state, and return the observation."""
        observation, _, _, _, info = self._env.step(action)
        self.note(observation, info)
        return observation

    def decided(self, decide: Callable[[Any], Any], observation: Observation) -> Any:
        """Return the policy's decision on an observation, None for STOP, and record it and its time."""
        self._times.append(0.0)
        decision = self.timed(decide, observation)
        self._tape.add(decision)
        return decision

    def timed(self, call: Callable[[Any], Any], argument: object) -> Any:
        """Call the policy and add the elapsed time to that of its last action."""
        begin = time.perf_counter()
        try:
            with policy_errors():
                return call(argument)
        finally:
            elapsed = time.perf_counter() - begin
            self.seconds += elapsed
            if self._times:
                self._times[-1] += elapsed


@contextmanager
def policy_errors() -> Iterator[None]:
    """Turn whatever a policy raises into a `PolicyError` of one line."""
    try:
        yield
    except PolicyError:
        raise
    except InvalidActionError as error:
        raise PolicyError(str(error)) from error
    except (Exception, SystemExit) as error:
        reason = " ".join(f"{type(error).__name__}: {error}".split())
        raise PolicyError(reason[:500]) from error


def episode_rng(seed: int, goal: tuple[float, float], repeat: int = 0) -> np.random.Generator:
    """Return the random generator that a policy receives for an episode.

    It depends on nothing that the policy does not know: layouts and goal pairs do not follow from its state.

    Args:
        seed: random seed of the evaluation.
        goal: (x, y) of the goal in the start frame, meters, rounded to float32.
        repeat: number of earlier episodes of the same goal pair.
    """
    bits = np.array(goal, np.float32).view(np.uint32).tolist()
    return np.random.default_rng(np.random.SeedSequence([seed, repeat, *bits]))
