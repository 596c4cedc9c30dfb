"""The people of an episode in progress, and of its futures."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from labgym.envs.conditions.bodies import Body, BodyRays
from labgym.envs.conditions.cast import RADIUS, PeopleCast
from labgym.envs.conditions.crowd import REST, Crowd
from labgym.envs.conditions.figures import figure
from labgym.envs.conditions.intentions import DT
from labgym.envs.conditions.orca import Disc
from labgym.envs.conditions.passing import BESIDE_S, CLOSE_S, LEAST, SHARE, TICK, Company, moves, new_sums, pass_by
from labgym.envs.parts.protocols import Motion, Presence
from labgym.envs.state import State
from labgym.errors import OptionError
from labgym.layouts import Layout
from labgym.navigation.clearance import Obstacles
from labgym.scenes.rays import Geometry, RaySource

RobotPath = Callable[[float], tuple[float, float, float, float, float]]
"""Returns x, y, vx, vy (room frame, m and m/s) and the turn rate (rad/s) of the robot at a time of the episode."""

MET = 3.0
"""Distance between centers within which a person counts as met, meters."""
FIRST_FACE = 1 << 28
"""Number of the first face of people in what sensors see: after those of any scene."""
EPSILON = 1e-9


class Walking(Presence):
    """The people of an episode in progress.

    Their places are exact every 0.1 s and interpolated in between. They depend on the data and on the motion of the
    robot alone.
    """

    planar = True

    def __init__(self, state: State, cast: PeopleCast) -> None:
        self._world, self._radius = state.world, state.robot.size.chassis_radius
        self._crowd = Crowd(state.world, cast)
        self._time, self._rest, self._sums = 0.0, REST, new_sums()
        self._met: set[int] = set()
        self._robot = _disc(state.pose, state.velocity, state.sideways, self._radius)
        # The kernel holds these arrays: they are written in place.
        self._before, self._after = self._crowd.centers, self._crowd.centers
        self._now: NDArray[np.float64] | None = self._before.copy()
        self._shown: tuple[NDArray[np.float64], Sequence[Body]] | None = None
        self._advance()
        pass_by(*state.pose[:2], 0.0, 0.0, self._before, self._after, self._sums)

    def __getstate__(self) -> dict[str, Any]:
        # Shapes hold ray scenes, which cannot be pickled; the bodies follow from the rest.
        return self.__dict__ | {"_shown": None}

    @property
    def visible(self) -> bool:  # type: ignore[override]
        """Whether there is anybody."""
        return len(self._before) > 0

    def attend(self, company: Company) -> Company:
        """Return a company with the people."""
        return company._replace(before=self._before, after=self._after, sums=self._sums)

    def substep(self, motion: Motion) -> str:
        """Advance by one physics step; return "person K" if the moving robot touches person K."""
        x, y, _ = motion.pose
        share = min((motion.time - self._tick * DT) / DT, 1.0)
        number, distance = pass_by(x, y, share, motion.dt, self._before, self._after, self._sums)
        touches = distance < self._radius + RADIUS and moves(motion.velocity[0], motion.sideways)
        self.follow(motion)
        return f"person {number + 1}" if touches else ""

    def follow(self, motion: Motion) -> None:
        """Follow the robot after physics steps, each of which `pass_by` has measured; begin the next 0.1 s in time."""
        self._robot = _disc(motion.pose, motion.velocity, motion.sideways, self._radius)
        self._time, self._now = motion.time, None
        if motion.time >= (self._tick + 1) * DT - EPSILON:
            moving = moves(motion.velocity[0], motion.sideways)
            self._now = self._places
            self._sums[TICK], self._rest = self._tick + 1, 0.0 if moving else self._rest + DT
            self._advance()

    @property
    def _tick(self) -> int:
        return int(self._sums[TICK])

    @property
    def _places(self) -> NDArray[np.float64]:
        if self._now is None:
            self._now = self._before + (self._after - self._before) * self._sums[SHARE]
        return self._now

    def rays(self, source: RaySource, geometry: Geometry, state: State) -> RaySource:  # noqa: ARG002
        """Return what sensors see, with the people before it."""
        return BodyRays(source, FIRST_FACE, self.bodies) if self.visible else source

    @property
    def bodies(self) -> Sequence[Body]:
        """A torso and two legs for each person."""
        now = self._places
        if self._shown is not None and self._shown[0] is now:
            return self._shown[1]
        bodies: list[Body] = []
        crowd, following = self._crowd, self._after.tolist()
        people = zip(now.tolist(), crowd.velocities.tolist(), crowd.yaws.tolist(), crowd.walked.tolist(), strict=True)
        for number, ((x, y), (vx, vy), yaw, walked) in enumerate(people):
            left = math.dist((x, y), following[number])
            bodies += figure(number, x, y, yaw, walked - left, vx * vx + vy * vy > 0.01)
        self._shown = now, bodies
        return bodies

    @property
    def positions(self) -> NDArray[np.float64]:
        """The centers of the people, (n, 2) meters. Privileged."""
        return self._places.copy()

    @property
    def velocities(self) -> NDArray[np.float64]:
        """Their velocities in the room frame, (n, 2) m/s. Privileged."""
        return self._crowd.velocities

    @property
    def yields(self) -> NDArray[np.bool_]:
        """Whether each person avoids the robot while it moves, (n,). Privileged."""
        return np.array(self._crowd.yields, dtype=bool)

    def futures(self, times: Sequence[float], path: RobotPath | None = None) -> NDArray[np.float64]:
        """Return where people will be, (t, n, 2) meters: exact if the robot moves as assumed. Privileged.

        Args:
            times: of the episode, ascending, not before now, seconds.
            path: the motion of the robot; None for one that stands where it is from now on.

        Raises:
            OptionError: a time is before now, or before the one ahead of it.
        """
        forecast = self.forecast()
        places, before = [], self._time
        for time in times:
            if not before - EPSILON <= time < math.inf:
                raise OptionError(f"time {time} s is before {before} s: pass ascending times from now on")
            before = time
            while time >= (forecast.tick + 1) * DT - EPSILON and self.visible:
                forecast.step(*(self._standing() if path is None else path((forecast.tick + 1) * DT)))
            share = (time - forecast.tick * DT) / DT
            places.append(forecast.places + (forecast.following - forecast.places) * share)
        return np.array(places, dtype=np.float64).reshape(len(places), len(self._before), 2)

    def forecast(self) -> Forecast:
        """Return the people from now on, to be advanced with any motion of the robot. Privileged."""
        return Forecast(
            self._crowd.copy(), self._before.copy(), self._after.copy(), self._tick, self._rest, self._radius
        )

    @property
    def outcome(self) -> dict[str, Any]:
        """The results so far; distances are between centers.

        `close_seconds`: time with somebody nearer than 1 m. `least_distance`: meters; None without people.
        `met`: number of people seen within 3 m, walls considered. `nearest`: distance to the nearest person now,
        meters. `beside_seconds`: time for which somebody has been within 1.5 m until now, 0 if nobody is.
        """
        x, y = self._robot.x, self._robot.y
        sums, squares = self._sums.tolist(), ((self._places - (x, y)) ** 2).sum(axis=1)
        anybody = len(squares) > 0
        return {
            "people": len(squares),
            "close_seconds": sums[CLOSE_S],
            "least_distance": sums[LEAST] if anybody else None,
            "met": len(self._met),
            "nearest": math.sqrt(squares.min()) if anybody else None,
            "beside_seconds": sums[BESIDE_S],
        }

    def _advance(self) -> None:
        """Begin the next 0.1 s."""
        self._sums[SHARE] = 0.0
        self._before[:] = self._crowd.centers
        self._crowd.step(self._robot, self._rest)
        self._after[:] = self._crowd.centers
        x, y = self._robot.x, self._robot.y
        for number, place in enumerate(self._before.tolist()):
            near = number not in self._met and math.dist((x, y), place) < MET
            if near and self._sees((x, y), place):
                self._met.add(number)

    def _sees(self, here: tuple[float, float], there: tuple[float, float]) -> bool:
        walls: Obstacles = self._world.derived("walls that hide people", _hiding)
        return bool(walls.segments_clear(np.array([here]), np.array([there]), 1e-6)[0])

    def _standing(self) -> tuple[float, float, float, float, float]:
        return self._robot.x, self._robot.y, 0.0, 0.0, 0.0


class Forecast:
    """The people from a time on, apart from the episode.

    Attributes:
        tick: number of 0.1 s since the start of the episode.
        places: the centers then, (n, 2) meters. following: 0.1 s later, which is already certain.
    """

    def __init__(
        self,
        crowd: Crowd,
        places: NDArray[np.float64],
        following: NDArray[np.float64],
        tick: int,
        rest: float,
        radius: float,
    ) -> None:
        self.places, self.following, self.tick = places, following, tick
        self._crowd, self._rest, self._radius = crowd, rest, radius

    def step(self, x: float, y: float, vx: float, vy: float, turn: float) -> None:  # noqa: ARG002
        """Advance by 0.1 s.

        Args:
            x, y, vx, vy: of the robot after that time, in the room frame, m and m/s. turn: its turn rate, rad/s.
        """
        self.tick += 1
        self._rest = 0.0 if moves(math.sqrt(vx * vx + vy * vy), 0.0) else self._rest + DT
        self.places = self.following
        self._crowd.step(Disc(x, y, vx, vy, self._radius), self._rest)
        self.following = self._crowd.centers


def _disc(pose: tuple[float, float, float], velocity: tuple[float, float], sideways: float, radius: float) -> Disc:
    cosine, sine = math.cos(pose[2]), math.sin(pose[2])
    forward = velocity[0]
    return Disc(pose[0], pose[1], cosine * forward - sine * sideways, sine * forward + cosine * sideways, radius)


def _hiding(layout: Layout) -> Obstacles:
    """Return the walls."""
    return Obstacles(layout.floor.solids)
