"""The privileged track: the world as the simulation knows it, for built-in policies, in the process that simulates."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from labgym.envs.conditions.walking import Walking
from labgym.envs.parts.actions import SlippingActions
from labgym.envs.parts.protocols import Actions
from labgym.envs.state import Pose, State
from labgym.errors import OptionError
from labgym.eval.driving.episode_row import Track
from labgym.layouts import Layout
from labgym.policies import Policy
from labgym.policies.policy import Foreknowledge, PeopleForecast, RobotPath
from labgym.policies.process import PolicyProcess, PolicySource
from labgym.runs import ExecutorOptions


class TrueWorld(Foreknowledge):
    """The world of a state.

    Args:
        state: of the episode in progress. actions: of its environment. radius: of the success disc, meters.
    """

    def __init__(self, state: State, actions: Actions, radius: float) -> None:
        self._state, self._radius = state, radius
        self._wheels = actions.errors if isinstance(actions, SlippingActions) else (1.0, 1.0, 0.0)

    @property
    def time(self) -> float:
        """Time of the episode, seconds."""
        return self._state.time

    @property
    def pose(self) -> Pose:
        """The pose of the robot."""
        return self._state.pose

    @property
    def velocity(self) -> tuple[float, float]:
        """The forward velocity, m/s, and the turn rate, rad/s."""
        return self._state.velocity

    @property
    def goal(self) -> Pose:
        """The goal pose."""
        return self._state.goal

    @property
    def radius(self) -> float:
        """Radius of the success disc, meters."""
        return self._radius

    @property
    def wheels(self) -> tuple[float, float, float]:
        """The errors of the wheels."""
        return self._wheels

    def solids(self) -> Layout:
        """Return the true floor."""
        return self._state.task.layout

    @property
    def yields(self) -> NDArray[np.bool_]:
        """Which of the people avoid the robot while it moves, (n,)."""
        walking = self._state.presences.get("people")
        return walking.yields if isinstance(walking, Walking) else np.zeros(0, dtype=bool)

    def forecast(self) -> PeopleForecast | None:
        """Return the people from now on; None without people."""
        walking = self._state.presences.get("people")
        return walking.forecast() if isinstance(walking, Walking) else None

    def people(self, times: Sequence[float], path: RobotPath | None = None) -> NDArray[np.float64]:
        """Return where people will be, (t, n, 2) meters."""
        walking = self._state.presences.get("people")
        if not isinstance(walking, Walking):
            return np.zeros((len(times), 0, 2))
        return walking.futures(times, path)


def handed_track(truth: object | None, world: object | None) -> Track:
    """Return the track of a drive by what the policy received: the map, the world, or None for neither."""
    if world is not None:
        return "privileged"
    return "mapless" if truth is None else "deployed"


def track_of(driver: PolicyProcess | Policy) -> Track:
    """Return the track of a policy by what is handed to it: the world, the old map, or no map."""
    return handed_track(driver.privileged or None, driver.foresees or None)


def in_place(driver: PolicyProcess | Policy, source: PolicySource) -> PolicyProcess | Policy:
    """Return the driver of a policy: its process or, if it foresees the world, a new one in this process.

    Args:
        driver: the policy in its process. source: the policy.

    Raises:
        OptionError: it foresees the world and is not built in.
    """
    if not driver.foresees:
        return driver
    check_foresight(source)
    return source.make()


def executor_for(executor: ExecutorOptions, foresees: bool) -> ExecutorOptions:
    """Return where a policy drives: one that foresees the world in a worker with one thread, never in this process.

    With all cores, numerical libraries spend their time waiting in its tiny problems.

    Args:
        executor: that was asked for. foresees: whether the policy does.
    """
    return replace(executor, apart=True) if foresees and executor == ExecutorOptions() else executor


def check_foresight(source: PolicySource) -> None:
    """Refuse a policy that foresees the world and is not built in: it would run in the evaluator's process.

    Raises:
        OptionError: the policy is an object, or a class or file of somebody else.
    """
    if not source.built_in:
        raise OptionError(
            f"policy {source.name!r} declares `foresees`: the privileged track runs in the evaluator's process and is "
            "open to built-in policies by name only, such as 'clairvoyant'; remove the declaration"
        )
