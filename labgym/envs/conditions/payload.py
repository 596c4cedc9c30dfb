"""Conditions "payload" and "leg_payload": a beaker of liquid on the robot's deck, whose surface moves with the base."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, field, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from labgym.envs.checks import positive
from labgym.envs.conditions.beaker import Beaker, beaker_shape
from labgym.envs.conditions.bodies import Body
from labgym.envs.parts.protocols import Condition, Motion, Presence
from labgym.envs.parts.registry import registered
from labgym.envs.state import State
from labgym.envs.tasks import Task
from labgym.errors import OptionError

Array = NDArray[np.float64]


@registered("condition", "payload")
class Payload(Condition):
    """A beaker on the deck, above the robot's axis.

    Its data is the beaker's measures. The outcome has `highest`, the greatest rise of the liquid at the wall so far in
    meters, and `spilt`, whether it exceeded the freeboard.

    Attributes:
        beaker: the beaker, or a mapping of its measures.
    """

    beaker: Beaker | Mapping[str, float] = field(default_factory=Beaker)
    name: str = "payload"

    def __post_init__(self) -> None:
        object.__setattr__(self, "beaker", beaker_of(self.beaker))

    def draw(self, task: Task, rng: np.random.Generator) -> dict[str, float]:  # noqa: ARG002
        """Return the beaker's measures."""
        return asdict(beaker_of(self.beaker))

    def begin(self, state: State, data: Any, rng: np.random.Generator) -> Slosh:  # noqa: ARG002
        """Return the liquid at rest."""
        return Slosh(beaker_of(data), state.pose, state.velocity, state.sideways)


class Slosh(Presence):
    """The first mode of the liquid's surface: q'' + 2 z w q' + w^2 q = -a for each horizontal axis of the room.

    The acceleration a of the base is constant within a physics step; the oscillator is integrated exactly.
    """

    visible = False

    def __init__(
        self, beaker: Beaker, pose: tuple[float, float, float], velocity: tuple[float, float], sideways: float
    ) -> None:
        self._beaker = beaker
        self._pose, self._last = pose, _in_room(pose, velocity, sideways)
        self._state = (0.0, 0.0, 0.0, 0.0)
        self._step: tuple[float, tuple[float, ...]] | None = None
        self._highest = 0.0

    def substep(self, motion: Motion) -> str:
        """Advance the liquid by one physics step."""
        self._pose = motion.pose
        now = _in_room(motion.pose, motion.velocity, motion.sideways)
        if self._step is None or self._step[0] != motion.dt:
            transition, response = propagator(self._beaker.frequency, self._beaker.damping, motion.dt)
            self._step = motion.dt, (*transition.ravel().tolist(), *response.tolist())
        a, b, c, d, e, f = self._step[1]
        (x, y), (last_x, last_y) = now, self._last
        ax, ay = (x - last_x) / motion.dt, (y - last_y) / motion.dt
        self._last = now
        # Written out: products of matrices may be rounded differently on another processor.
        qx, qy, rate_x, rate_y = self._state
        self._state = (
            a * qx + b * rate_x - e * ax,
            a * qy + b * rate_y - e * ay,
            c * qx + d * rate_x - f * ax,
            c * qy + d * rate_y - f * ay,
        )
        self._highest = max(self._highest, self.rise)
        return ""

    @property
    def bodies(self) -> Sequence[Body]:
        """The beaker on the robot."""
        return (Body("beaker", beaker_shape(self._beaker), self._pose),)

    @property
    def rise(self) -> float:
        """The rise of the liquid at the wall, meters."""
        qx, qy, _, _ = self._state
        return self._beaker.rise(math.sqrt(qx * qx + qy * qy))

    @property
    def outcome(self) -> dict[str, Any]:
        """The greatest rise so far, meters, and whether the liquid was spilt."""
        return {"highest": self._highest, "spilt": self._highest > self._beaker.freeboard}


def propagator(frequency: float, damping: float, dt: float) -> tuple[Array, Array]:
    """Return the exact step of a damped oscillator: its transition matrix (2, 2) and its response (2,).

    The state (q, q') becomes `transition @ state + response * f` under a constant force f over a time dt.

    Args:
        frequency: angular frequency without damping, rad/s. damping: ratio, below 1. dt: seconds.
    """
    if not 0.0 <= damping < 1.0:
        raise OptionError(f"damping is {damping}, expected at least 0 and below 1")
    rate, decay = frequency * math.sqrt(1.0 - damping * damping), frequency * damping
    fall, cosine, sine = math.exp(-decay * dt), math.cos(rate * dt), math.sin(rate * dt)
    transition = fall * np.array(
        [
            [cosine + decay / rate * sine, sine / rate],
            [-(frequency**2) / rate * sine, cosine - decay / rate * sine],
        ]
    )
    response = np.array([(1.0 - transition[0, 0]) / frequency**2, transition[0, 1]])
    return transition, response


def beaker_of(value: Any) -> Beaker:
    """Return a beaker: itself, or from a mapping of its measures.

    Raises:
        OptionError: the value is something else, or a measure is out of range.
    """
    if isinstance(value, Beaker):
        return value
    names = {each.name for each in fields(Beaker)}
    if not isinstance(value, Mapping) or not set(value) <= names:
        raise OptionError(f"beaker is {str(value)[:60]!r}, expected a mapping of {', '.join(sorted(names))}")
    return Beaker(**value)


def _in_room(pose: tuple[float, float, float], velocity: tuple[float, float], sideways: float) -> tuple[float, float]:
    """Return the velocity of the base in the room frame, m/s."""
    cosine, sine = math.cos(pose[2]), math.sin(pose[2])
    return cosine * velocity[0] - sine * sideways, sine * velocity[0] + cosine * sideways


MOST_LEGS = 32
"""Greatest number of drives of an episode."""


@registered("condition", "leg_payload")
class LegPayload(Condition):
    """A beaker on the deck in some drives of an episode of several; at the start of each it is full and at rest.

    Its data has the measures of the `beaker`, and the `legs` in which the robot carries it, from 0. The outcome is that
    of `Payload` for the drive in progress.

    Attributes:
        beaker: the beaker, or a mapping of its measures. share: share of the drives; at least one has the beaker.
    """

    beaker: Beaker | Mapping[str, float] = field(default_factory=Beaker)
    share: float = 0.5
    name: str = "payload"

    def __post_init__(self) -> None:
        object.__setattr__(self, "beaker", beaker_of(self.beaker))
        positive(self, "share")
        if self.share > 1.0:
            raise OptionError(f"LegPayload: share is {self.share}, expected at most 1")

    def draw(self, task: Task, rng: np.random.Generator) -> dict[str, Any]:
        """Return the measures of the beaker and the drives in which it is carried."""
        count = 1 + len(task.following)
        legs = rng.permutation(count)[: max(1, round(self.share * count))]
        return {"beaker": asdict(beaker_of(self.beaker)), "legs": sorted(legs.tolist())}

    def begin(self, state: State, data: Any, rng: np.random.Generator) -> LegSlosh:  # noqa: ARG002
        """Return the liquid at rest."""
        return LegSlosh(state, *leg_payload_of(data))


class LegSlosh(Presence):
    """The liquid in the drive in progress; nothing in a drive without it."""

    visible = False

    def __init__(self, state: State, beaker: Beaker, legs: tuple[int, ...]) -> None:
        self._state, self._beaker, self._legs = state, beaker, frozenset(legs)
        self._leg = -1
        self._slosh: Slosh | None = None
        self._current()

    def substep(self, motion: Motion) -> str:
        """Advance the liquid by one physics step."""
        slosh = self._current()
        return "" if slosh is None else slosh.substep(motion)

    @property
    def bodies(self) -> Sequence[Body]:
        """The beaker on the robot, in a drive with it."""
        slosh = self._current()
        return () if slosh is None else slosh.bodies

    @property
    def outcome(self) -> dict[str, Any]:
        """Of the drive in progress: the greatest rise so far, meters, and whether the liquid was spilt."""
        slosh = self._current()
        return {"highest": 0.0, "spilt": False} if slosh is None else slosh.outcome

    def _current(self) -> Slosh | None:
        """Return the liquid of the drive in progress, at rest if the drive has just begun."""
        state = self._state
        if state.leg != self._leg:
            self._leg, carries = state.leg, state.leg in self._legs
            self._slosh = Slosh(self._beaker, state.pose, state.velocity, state.sideways) if carries else None
        return self._slosh


def leg_payload_of(data: Any) -> tuple[Beaker, tuple[int, ...]]:
    """Return the beaker and the drives in which it is carried.

    Raises:
        OptionError: the data is something else.
    """
    if not isinstance(data, Mapping) or set(data) != {"beaker", "legs"}:
        raise OptionError(f"payload is {str(data)[:60]!r}, expected a mapping of beaker and legs")
    legs = data["legs"]
    whole = isinstance(legs, list | tuple) and len(legs) <= MOST_LEGS
    if not whole or not all(type(leg) is int and 0 <= leg < MOST_LEGS for leg in legs):
        raise OptionError(f"legs are {str(legs)[:60]!r}, expected at most {MOST_LEGS} whole numbers below {MOST_LEGS}")
    return beaker_of(data["beaker"]), tuple(legs)


def carried(state: State) -> Beaker | None:
    """Return the beaker that the robot carries in the drive in progress, None without one."""
    data = state.conditions.get("payload")
    if data is None:
        return None
    if "legs" not in data:
        return beaker_of(data)
    beaker, legs = leg_payload_of(data)
    return beaker if state.leg in legs else None
