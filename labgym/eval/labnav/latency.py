"""Thinking is paid for: the time of a policy's actions is measured before it drives, and its actions come late by it.

The time of an action is the CPU time of the policy's processes divided by that of a fixed loop that runs right before
and after it, times the loop's time on the reference machine. A busy or slow machine changes both alike. A policy that
computes elsewhere, on a GPU or on a server, is measured in wall time.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field

from labgym.counts import is_real
from labgym.documents import Record
from labgym.envs.robot import ROBOT
from labgym.envs.state import State
from labgym.errors import OptionError
from labgym.eval.driving.episode_row import Length
from labgym.eval.labnav.drive import drive_floor
from labgym.eval.labnav.results import DriveTerms
from labgym.eval.labnav.rules import delay_of
from labgym.eval.labnav.suites import LabNavSuite
from labgym.policies.process import PolicyProcess, PolicySource
from labgym.policies.process.facts import MAX_LATENCY
from labgym.policies.registry import SERVERS

PERCENTILE = 90.0
"""Percentile of the times of a policy's actions that is charged."""
FREE_S = 0.010
"""Time of an action below which the policy is not charged, seconds."""
WARM_UP, STEPS = 5, 50
"""Control steps of each probed episode that do not count, and number of those that do."""
MAX_EPISODES = 10
"""Greatest number of episodes that a probe drives."""
HYSTERESIS = 1
"""Control steps by which a verifier's probe may exceed the delay of a result."""
REFERENCE_S = 0.0024
"""CPU time of `calibration_s` on the reference machine, seconds: the 10th percentile of 400 runs on an unshared core of
an AMD EPYC server with Python 3.11 and NumPy 2."""

Clock = Callable[[], float]


class Probe(Record):
    """The time of a policy's actions, measured before it drives.

    Attributes:
        seconds: 90th percentile of the time of an action on the reference machine; in wall time on this machine.
        basis: what was measured. steps: number of actions.
    """

    seconds: Length
    basis: Literal["CPU time", "wall time"]
    steps: Annotated[int, Field(ge=1)]

    @classmethod
    def of(cls, times: Iterable[float], basis: Literal["CPU time", "wall time"]) -> Self | None:
        """Return the probe of some times, seconds, or None for an empty series."""
        counted = list(times)[:STEPS]
        return cls(seconds=round(percentile(counted), 5), basis=basis, steps=len(counted)) if counted else None

    def latency(self, declared: float) -> float:
        """Return the latency that a policy is charged, which declares one, seconds."""
        return charged_latency(self.seconds, declared)

    def __str__(self) -> str:
        return f"{1e3 * self.seconds:.3g} ms of {self.basis} per action in {self.steps} actions"


def charged_latency(seconds: float, declared: float, control_dt: float = ROBOT.control_dt) -> float:
    """Return the latency of a policy whose actions take some time, seconds: the greater of both, in whole steps.

    Below 10 ms thinking is free; from then on each begun control step is charged.

    Args:
        seconds: 90th percentile of the time of an action. declared: latency that the policy declares.
    """
    steps = 0 if seconds < FREE_S else math.ceil(seconds / control_dt - 1e-9)
    if steps <= delay_of(declared, control_dt):
        return declared
    return min(round(steps * control_dt, 6), MAX_LATENCY)


def is_accepted(latency: float, frozen: float) -> bool:
    """Whether a verifier whose probe gives a latency accepts the one with which a policy drove, seconds."""
    return delay_of(latency) <= delay_of(frozen) + HYSTERESIS


def checked_latency(latency: float, declared: float) -> float:
    """Return a latency that the user passes, seconds.

    Raises:
        OptionError: it is less than the policy declares, or above the limit.
    """
    if not is_real(latency) or not max(declared, 0.0) <= latency <= MAX_LATENCY:
        raise OptionError(
            f"latency is {str(latency)[:40]}, expected seconds from {declared:g}, which the policy declares, to "
            f"{MAX_LATENCY:g}; one step is {ROBOT.control_dt:g} s"
        )
    return float(latency)


def percentile(values: Iterable[float]) -> float:
    """Return the 90th percentile of values: the least one that 90% of them do not exceed."""
    return float(np.percentile(list(values), PERCENTILE, method="inverted_cdf"))


def calibration_s() -> float:
    """Return the CPU time of a fixed piece of work in Python and NumPy in this thread, seconds."""
    begin = time.thread_time()
    table, total = {}, 0.0
    for k in range(5000):
        total += (k * 0.5) % 7.0
        table[k % 97] = total
    values = np.linspace(0.0, 1.0, 10000)
    for _ in range(8):
        values = np.sort(np.sin(values) + 0.5 * values[::-1])
    return time.thread_time() - begin


@dataclass
class LatencyMeter:
    """Measures the policy between two states of a drive, in which nothing else of its processes runs.

    Attributes:
        clock: CPU time of the policy's processes, seconds. calibrate: returns the present time of the calibration.
        times: of the actions on the reference machine, seconds, those of the warm-up first.
    """

    clock: Clock
    calibrate: Clock = calibration_s
    times: list[float] = field(default_factory=list)
    _last: tuple[float, float] | None = None

    def __call__(self, state: State) -> None:
        """Record the action that led to a state."""
        now, loop = self.clock(), self.calibrate()
        if self._last is not None and state.steps:
            spent, before = max(now - self._last[0], 0.0), self._last[1]
            self.times.append(REFERENCE_S * spent / (0.5 * (before + loop)))
        self._last = now, loop


def computes_elsewhere(driver: PolicyProcess, source: PolicySource) -> bool:
    """Whether a policy computes where the CPU time of its processes does not show it: on a server or a GPU."""
    return source.name.startswith(SERVERS) or "cuda" in driver.kernels


def probe(driver: PolicyProcess, source: PolicySource, suite: LabNavSuite, seed: int) -> Probe | None:
    """Measure the actions of a policy in the first episodes of a suite; None if it gives none.

    It drives 50 steps after 5 that do not count: in the first episode, and in those after it if that one is shorter.

    Args:
        driver: the policy. source: of it. suite: the suite. seed: of the evaluation.
    """
    part = suite.parts[0].first(MAX_EPISODES, 1, 1)
    terms = DriveTerms.of(part, "probe", seed, (WARM_UP + STEPS) * ROBOT.control_dt)
    wall, times = computes_elsewhere(driver, source), list[float]()
    for episode in part.episodes:
        meter = LatencyMeter(driver.cpu_seconds)
        (drive,) = drive_floor(driver, part.layout(episode.floor), [episode], terms, None if wall else meter)
        if wall:
            times += [] if drive.high_ms is None else [drive.high_ms / 1e3] * (drive.row.steps - WARM_UP)
        else:
            times += meter.times[WARM_UP:]
        if len(times) >= STEPS:
            break
    return Probe.of(times, "wall time" if wall else "CPU time")
