"""Condition "wet_floor": zones in which wheels slip, so that odometry errs more, and which a robot should not cross."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from labgym.counts import is_real
from labgym.envs.checks import count, finite, positive
from labgym.envs.parts.protocols import Condition, Presence
from labgym.envs.parts.registry import registered
from labgym.envs.state import State
from labgym.envs.tasks import Task
from labgym.envs.world import world_of
from labgym.errors import OptionError
from labgym.navigation import PLANNING_RADIUS, ShortestPaths

MOST = 64
"""Greatest number of zones of an episode."""
DRAWS = 200
"""Number of places that are tried for a zone."""


@dataclass(frozen=True)
class WetZone:
    """A round puddle.

    Attributes:
        x, y: its middle in the room frame, meters. radius: meters.
    """

    x: float
    y: float
    radius: float

    def __post_init__(self) -> None:
        finite(self, "x", "y")
        positive(self, "radius")

    def holds(self, x: float, y: float) -> bool:
        """Whether a point is in the zone."""
        return math.hypot(x - self.x, y - self.y) <= self.radius


@registered("condition", "wet_floor")
class WetFloor(Condition):
    """Puddles near the shortest route. The errors of odometry are larger in them (the factor is an assumption).

    The outcome has `seconds`, the time in puddles so far, and `entries`, how often the robot drove into one.

    Attributes:
        zones: number of puddles that are drawn. radius: their greatest radius, meters.
        slip: factor on the errors of the sensor "odometry" in a puddle.
    """

    zones: int = 2
    radius: float = 0.6
    slip: float = 4.0
    name: str = "wet_floor"

    def __post_init__(self) -> None:
        if self.zones != 0:
            count(self, "zones")
        if self.zones > MOST:
            raise OptionError(f"WetFloor: zones is {self.zones}, at most {MOST}")
        positive(self, "radius", "slip")

    def draw(self, task: Task, rng: np.random.Generator) -> dict[str, Any]:
        """Return puddles whose middle is within a meter of the shortest route."""
        route = ShortestPaths(task.layout, PLANNING_RADIUS).path(task.pair.start, task.pair.goal)
        points = np.array([task.pair.start[:2], task.pair.goal[:2]]) if route is None else route.points
        world = world_of(task.layout)
        zones: list[dict[str, float]] = []
        for _ in range(DRAWS):
            if len(zones) == self.zones:
                break
            leg = int(rng.integers(len(points) - 1))
            part, dx, dy, share = rng.uniform((0.0, -1.0, -1.0, 0.4), (1.0, 1.0, 1.0, 1.0)).tolist()
            x, y = (points[leg] + part * (points[leg + 1] - points[leg]) + (dx, dy)).tolist()
            if world.clearance(x, y, 0.1) > 0.0:
                zones.append({"x": round(x, 3), "y": round(y, 3), "radius": round(share * self.radius, 3)})
        return {"zones": zones, "slip": self.slip}

    def begin(self, state: State, data: Any, rng: np.random.Generator) -> Presence:  # noqa: ARG002
        """Return the puddles of an episode."""
        zones, slip = _checked(data)
        return Puddles(state, zones, slip)


class Puddles(Presence):
    """The puddles of an episode in progress."""

    visible = False

    def __init__(self, state: State, zones: Sequence[WetZone], slip: float) -> None:
        self._zones, self._slip = tuple(zones), slip
        self._steps = self._entries = 0
        self._dt = state.control_dt
        self._inside = False
        self._look(state)

    def step(self, state: State) -> None:
        """Count the time in puddles and set the slip of the place."""
        self._look(state)
        self._steps += self._inside

    @property
    def outcome(self) -> dict[str, Any]:
        """The seconds in puddles and the number of entries so far."""
        return {"seconds": self._steps * self._dt, "entries": self._entries}

    def _look(self, state: State) -> None:
        before, (x, y) = self._inside, state.pose[:2]
        self._inside = any(zone.holds(x, y) for zone in self._zones)
        self._entries += self._inside and not before
        state.slip = self._slip if self._inside else 1.0


def _checked(data: Any) -> tuple[tuple[WetZone, ...], float]:
    """Return the zones and the slip in data of the condition.

    Raises:
        OptionError: it is something else.
    """
    if not isinstance(data, Mapping) or set(data) != {"zones", "slip"}:
        raise OptionError(f"wet floor is {str(data)[:60]!r}, expected a mapping of zones and slip")
    zones, slip = data["zones"], data["slip"]
    if isinstance(zones, str | Mapping) or not isinstance(zones, Sequence) or len(zones) > MOST:
        raise OptionError(f"wet floor: zones are {str(zones)[:60]!r}, expected a list of at most {MOST} mappings")
    if not is_real(slip) or not 0.0 < slip <= 1000.0:
        raise OptionError(f"wet floor: slip is {str(slip)[:40]!r}, expected a number above 0")
    for zone in zones:
        if not isinstance(zone, Mapping) or set(zone) != {"x", "y", "radius"}:
            raise OptionError(f"wet floor: zone is {str(zone)[:60]!r}, expected a mapping of x, y and radius")
    return tuple(WetZone(**zone) for zone in zones), float(slip)
