"""Rules that end an episode.

`TouchEnding.holds` and `ContactEnding.holds` also take the columns of many episodes (`labgym.envs.vector.columns`).
"""

from __future__ import annotations

import math
from abc import abstractmethod
from typing import ClassVar

from labgym.envs.checks import positive
from labgym.envs.parts.protocols import Ending
from labgym.envs.parts.registry import registered
from labgym.envs.state import State, Verdict

TOUCH_DISTANCE = 0.5
"""Success distance of `LabPointNav-v0`, meters."""
REST_DISTANCE = 0.36
"""Success distance of `LabFloorNav-v0`, meters: that of the Habitat challenges."""


class RuleEnding(Ending):
    """An ending that gives one verdict while its rule holds.

    Attributes:
        outcome: the verdict.
    """

    outcome: ClassVar[Verdict] = "failure"

    @abstractmethod
    def holds(self, state: State) -> bool:
        """Whether the rule ends the drive in a state."""

    def verdict(self, state: State) -> Verdict | None:
        """Return the outcome if the rule holds."""
        return self.outcome if self.holds(state) else None


@registered("ending", "touch")
class TouchEnding(RuleEnding):
    """Success when the robot's center is within `radius` meters of the goal, at any speed."""

    outcome: ClassVar[Verdict] = "success"
    radius: float = TOUCH_DISTANCE
    name: str = "touch"

    def __post_init__(self) -> None:
        positive(self, "radius")

    def holds(self, state: State) -> bool:
        """Whether the robot is within the radius."""
        return state.distance <= self.radius


@registered("ending", "rest", frozen=False)
class RestEnding(RuleEnding):
    """Success when the robot rests within `radius` meters of the goal for `duration` seconds.

    Attributes:
        radius: meters. speed, turn_rate: the robot rests below these, m/s and rad/s.
        duration: seconds that it must rest; 0 for the end of one action.
    """

    outcome: ClassVar[Verdict] = "success"
    radius: float = REST_DISTANCE
    speed: float = 0.05
    turn_rate: float = 0.1
    duration: float = 0.0
    name: str = "rest"

    def __post_init__(self) -> None:
        positive(self, "radius", "speed", "turn_rate")
        positive(self, "duration", zero=True)

    def reset(self, state: State) -> None:  # noqa: ARG002
        """Begin a drive."""
        self._since: float | None = None

    def holds(self, state: State) -> bool:
        """Whether the robot has rested long enough."""
        (v, w), u = state.velocity, state.sideways
        if state.distance > self.radius or v * v + u * u > self.speed * self.speed or abs(w) > self.turn_rate:
            self._since = None
            return False
        if self._since is None:
            self._since = state.time
        return state.time - self._since >= self.duration - 1e-9


@registered("ending", "stop")
class StopEnding(Ending):
    """The action STOP ends the drive: success within `radius` meters of the goal, failure elsewhere."""

    radius: float = REST_DISTANCE
    name: str = "stop"

    def __post_init__(self) -> None:
        positive(self, "radius")

    def verdict(self, state: State) -> Verdict | None:
        """Return the verdict on a STOP."""
        if not state.stop:
            return None
        return "success" if state.distance <= self.radius else "failure"


@registered("ending", "contact")
class ContactEnding(RuleEnding):
    """Failure when the robot touches something."""

    name: str = "contact"

    def holds(self, state: State) -> bool:
        """Whether the robot touched something during the latest action."""
        return state.collision


@registered("ending", "touched")
class TouchedEnding(RuleEnding):
    """Failure when the robot touches some of the things that `State.touched` names; it needs a condition.

    Attributes:
        only: beginnings of the names that count, such as "person"; empty for all.
        pushable: whether things that the robot can push count.
    """

    only: tuple[str, ...] = ()
    pushable: bool = True
    name: str = "contact"

    def __post_init__(self) -> None:
        object.__setattr__(self, "only", tuple(self.only))

    def counted(self, state: State) -> tuple[str, ...]:
        """Return the names that count among what the robot touched during the latest action."""
        pushed = () if self.pushable else state.task.pushable
        return tuple(
            name for name in state.touched if name not in pushed and (not self.only or name.startswith(self.only))
        )

    def holds(self, state: State) -> bool:
        """Whether a contact of the latest action counts."""
        return bool(self.counted(state))


@registered("ending", "limit", frozen=False)
class LimitEnding(RuleEnding):
    """Failure when a drive has taken `duration` seconds."""

    duration: float = 120.0
    name: str = "time"

    def __post_init__(self) -> None:
        positive(self, "duration")

    def reset(self, state: State) -> None:
        """Begin a drive."""
        self._since = state.time

    def holds(self, state: State) -> bool:
        """Whether the time is over."""
        return state.time - self._since >= self.duration - 1e-9


@registered("ending", "spill")
class SpillEnding(RuleEnding):
    """Failure when liquid has been spilt; it needs the condition "payload"."""

    name: str = "spill"

    def holds(self, state: State) -> bool:
        """Whether the liquid has risen above the rim."""
        payload = state.presences.get("payload")
        return payload is not None and bool(payload.outcome["spilt"])


PERSON = "person"
"""Beginning of the names of people among the bodies of conditions."""


@registered("ending", "stuck", frozen=False)
class StuckEnding(RuleEnding):
    """Failure when the robot has not left a disc of `radius` meters for `duration` seconds.

    Attributes:
        people: the time does not count while a person is nearer than this, meters. goal: while the goal is nearer.
    """

    radius: float = 0.3
    duration: float = 30.0
    name: str = "stuck"
    people: float = 0.0
    goal: float = 0.0

    def __post_init__(self) -> None:
        positive(self, "radius", "duration")
        positive(self, "people", "goal", zero=True)

    def reset(self, state: State) -> None:
        """Begin a drive."""
        self._anchor, self._since, self._now = state.pose[:2], state.time, state.time

    def holds(self, state: State) -> bool:
        """Whether the robot is stuck."""
        x, y = state.pose[:2]
        if (x - self._anchor[0]) ** 2 + (y - self._anchor[1]) ** 2 > self.radius**2:
            self._anchor, self._since = (x, y), state.time
        elif state.distance < self.goal or (self.people and nearest_person(state) < self.people):
            self._since += state.time - self._now
        self._now = state.time
        return state.time - self._since >= self.duration - 1e-9


def nearest_person(state: State) -> float:
    """Return the distance from the robot's center to that of the nearest person, meters; inf without people."""
    x, y, _ = state.pose
    places = (body.pose for one in state.presences.values() for body in one.bodies if body.name.startswith(PERSON))
    return min((math.hypot(px - x, py - y) for px, py, _ in places), default=math.inf)
