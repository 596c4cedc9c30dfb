"""People who walk from place to place, in steps of 0.1 s."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from labgym.envs.conditions.cast import Cast, Model
from labgym.envs.conditions.half_planes import HalfPlane, Vector, permitted_velocity
from labgym.envs.conditions.orca import Disc, Neighbor, Orca, away_from
from labgym.envs.conditions.social_force import SocialForce
from labgym.envs.conditions.walls import Walls
from labgym.envs.world import World

RADIUS = 0.30
"""Radius of a person, meters."""
DT = 0.1
"""Duration of a step, seconds."""
REST = 0.5
"""Time after which everybody avoids a robot at rest, seconds."""
AVOIDANCE, FORCES = Orca(dt=DT), SocialForce(dt=DT)
GAP = 0.01
"""Least distance that people keep from a robot at rest, meters."""

# Assumptions; no source gives them.
LOOKAHEAD = 0.5
"""People walk towards the point of their path that is this far ahead, meters."""
ARRIVED = 0.12
"""A stop is reached within this distance, meters."""
TAKEN = 0.6
"""A stop is taken if somebody else stands this near, meters; others then wait within `QUEUE`."""
QUEUE = 1.0
TO_THE_RIGHT = 0.05
"""Tangent of the angle by which people prefer to walk to the right of their way: two that meet do not block."""
REPLAN, GIVE_UP = 1.5, 4.0
"""Seconds without progress after which a person plans anew, and goes on to the next stop."""
PROGRESS = 0.1
"""Least decrease of the way to go that counts as progress, meters."""
AHEAD = 1.0
"""A member of a group that is this far ahead of the last one walks at half speed, meters."""
PATIENCE = 10.0
"""Longest time for which a member of a group waits for the others at a stop, seconds."""

WAYS = 512
"""Number of ways that are remembered."""


@dataclass
class Walker:
    """A person in motion.

    Attributes:
        x, y, vx, vy: center and velocity in the room frame, m and m/s. yaw: heading, radians.
        walked: way so far, meters.
        stop: index of the stop to which the person walks, or at which they stand. standing: which of the two.
        waiting: time left to stand, seconds. group_wait: time waited for the group, seconds.
        path: the way to the stop; none before it is planned. passed: number of its points that are passed.
        beyond: length of the path after the next point, meters.
        to_go: way to go at the latest progress, meters. stalled: time since then, seconds.
    """

    x: float
    y: float
    vx: float = 0.0
    vy: float = 0.0
    yaw: float = 0.0
    walked: float = 0.0
    stop: int = 0
    standing: bool = False
    waiting: float = 0.0
    group_wait: float = 0.0
    path: tuple[Vector, ...] = ()
    passed: int = 0
    beyond: float = 0.0
    to_go: float = math.inf
    stalled: float = 0.0


class Crowd:
    """The people of an episode, who know the paths of its world.

    Args:
        world: the layout. cast: the people; stops that a person cannot reach are passed over.

    Attributes:
        world: the layout. speed: of the people, m/s. model: how they avoid each other. yields: who avoids the robot
            while it moves. groups: numbers of those who walk with each. stops: x, y, yaw and seconds of those of each.
        walkers: the people.
    """

    def __init__(self, world: World, cast: Cast) -> None:
        self.world, self.speed = world, cast.speed
        self.model: Model = cast.model
        self.yields = tuple(role.yields for role in cast.people)
        self.groups = tuple(
            tuple(k for k, other in enumerate(cast.people) if other.group == role.group) for role in cast.people
        )
        self.stops = tuple(role.stops for role in cast.people)
        # Shared by the copies that futures are made with, which plan the same ways again and again.
        self._ways: dict[tuple[Vector, Vector], tuple[Vector, ...]] = {}
        self.walkers = [Walker(*role.start, standing=not role.stops) for role in cast.people]

    def copy(self) -> Crowd:
        """Return a crowd that goes on from here separately."""
        other = object.__new__(Crowd)
        other.__dict__ |= self.__dict__
        other.walkers = [replace(walker) for walker in self.walkers]
        return other

    @property
    def places(self) -> list[Vector]:
        """The centers of the people, meters."""
        return [(walker.x, walker.y) for walker in self.walkers]

    def step(self, robot: Disc | None, rest: float) -> None:
        """Advance by `DT`.

        Args:
            robot: where the robot is now; None without one. rest: time for which it has been at rest, seconds.
        """
        walkers = self.walkers
        preferred = [self._preferred(number) for number in range(len(walkers))]
        velocities = self._velocities(preferred, robot, rest)
        for walker, (vx, vy) in zip(walkers, velocities, strict=True):
            walker.vx, walker.vy = vx, vy
            walker.x, walker.y = walker.x + vx * DT, walker.y + vy * DT
            speed = math.sqrt(vx * vx + vy * vy)
            walker.walked += speed * DT
            if speed > 0.2 * self.speed and not walker.standing:
                walker.yaw = math.atan2(vy, vx)

    def _velocities(self, preferred: Sequence[Vector], robot: Disc | None, rest: float) -> list[Vector]:
        """Return the next velocities of the people, m/s; the arguments of `step`, and the velocities alone."""
        discs = [Disc(each.x, each.y, each.vx, each.vy, RADIUS) for each in self.walkers]
        reach = RADIUS + self.speed * AVOIDANCE.horizon_walls
        points = np.array(self.places, dtype=np.float64).reshape(-1, 2)
        walls = self.world.derived("walls of people", Walls.of).near(points, reach)
        velocities = []
        for number, disc in enumerate(discs):
            others = [Neighbor(other) for k, other in enumerate(discs) if k != number]
            blocks = []
            if robot is not None:
                if rest >= REST:
                    others.append(Neighbor(robot, 1.0))
                elif self.yields[number]:
                    others.append(Neighbor(robot))
                if rest > 0.0:
                    blocks.append(_kept_off(disc, robot))
            velocities.append(self._velocity(disc, preferred[number], others, walls[number], blocks))
        return velocities

    def _velocity(
        self,
        disc: Disc,
        preferred: Vector,
        others: Sequence[Neighbor],
        walls: Sequence[Vector],
        blocks: Sequence[HalfPlane],
    ) -> Vector:
        if self.model == "orca":
            return AVOIDANCE.velocity(disc, preferred, self.speed, others, walls, blocks)
        pushed = FORCES.velocity(disc, preferred, self.speed, [other.disc for other in others], walls)
        hard = [away_from(wall, disc.radius, AVOIDANCE.horizon_walls) for wall in walls]
        return permitted_velocity(pushed, self.speed, [*hard, *blocks], ())

    def _preferred(self, number: int) -> Vector:
        """Return the velocity that a person would have alone, m/s, and change what they are about."""
        walker, stops = self.walkers[number], self.stops[number]
        if not stops:
            return 0.0, 0.0
        x, y, yaw, _ = stops[walker.stop]
        if walker.standing:
            walker.yaw = yaw
            self._wait(number)
            return 0.0, 0.0
        away = math.sqrt((x - walker.x) ** 2 + (y - walker.y) ** 2)
        if away < ARRIVED or (away < QUEUE and self._taken(number, x, y)):
            self._stand(number)
            return 0.0, 0.0
        if not walker.path:
            self._plan(number)
            if not walker.path:
                self._go_on(number)
                return 0.0, 0.0
        target, to_go = self._ahead(walker)
        self._watch(number, to_go)
        return self._towards(walker, target, to_go, self._pace(number, to_go))

    def _wait(self, number: int) -> None:
        walker = self.walkers[number]
        together = all(self.walkers[k].standing for k in self.groups[number])
        walker.group_wait += 0.0 if together else DT
        if together or walker.group_wait > PATIENCE:
            walker.waiting -= DT
        if walker.waiting <= 0.0:
            self._go_on(number)

    def _stand(self, number: int) -> None:
        walker = self.walkers[number]
        walker.standing, walker.group_wait = True, 0.0
        walker.waiting = self.stops[number][walker.stop][3]

    def _go_on(self, number: int) -> None:
        walker = self.walkers[number]
        walker.stop = (walker.stop + 1) % len(self.stops[number])
        walker.standing, walker.path = False, ()
        walker.to_go, walker.stalled = math.inf, 0.0

    def _plan(self, number: int) -> None:
        walker = self.walkers[number]
        walker.path, walker.passed = self.way((walker.x, walker.y), self.stops[number][walker.stop][:2]), 1
        walker.beyond = _length(walker.path, 1)

    def way(self, start: Vector, goal: Vector) -> tuple[Vector, ...]:
        """Return the points of the way from a place to another, meters; none if there is no way."""
        ends = start, goal
        if ends not in self._ways:
            path = self.world.paths.path(*ends)
            self._ways[ends] = () if path is None else tuple(map(tuple, path.points.tolist()))
            if len(self._ways) > WAYS:
                del self._ways[next(iter(self._ways))]
        return self._ways[ends]

    def _taken(self, number: int, x: float, y: float) -> bool:
        """Whether somebody else stands at a stop."""
        return any(
            other.standing and (other.x - x) ** 2 + (other.y - y) ** 2 < TAKEN * TAKEN
            for k, other in enumerate(self.walkers)
            if k != number
        )

    def _ahead(self, walker: Walker) -> tuple[Vector, float]:
        """Return the point of the path to walk to, and the way to go, meters; pass the points that lie behind."""
        path, last, place, x, y = walker.path, len(walker.path) - 1, walker.passed, walker.x, walker.y
        while place < last:
            (ax, ay), (bx, by) = path[place - 1], path[place]
            if (x - bx) * (bx - ax) + (y - by) * (by - ay) < 0.0:
                break
            place += 1
        if place != walker.passed:
            walker.passed, walker.beyond = place, _length(path, place)
        rest = math.dist((x, y), path[place]) + walker.beyond
        while place < last and (path[place][0] - x) ** 2 + (path[place][1] - y) ** 2 < LOOKAHEAD * LOOKAHEAD:
            place += 1
        return path[place], rest

    def _watch(self, number: int, to_go: float) -> None:
        """Plan anew, or give a stop up, after some time without progress."""
        walker = self.walkers[number]
        if to_go < walker.to_go - PROGRESS:
            walker.to_go, walker.stalled = to_go, 0.0
            return
        before, walker.stalled = walker.stalled, walker.stalled + DT
        if walker.stalled >= GIVE_UP:
            self._go_on(number)
        elif before < REPLAN <= walker.stalled:
            walker.path = ()

    def _pace(self, number: int, to_go: float) -> float:
        """Return the speed of a person, m/s: members of a group wait for the last one."""
        group = self.groups[number]
        if len(group) == 1:
            return self.speed
        walkers, stop = self.walkers, self.walkers[number].stop
        others = [walkers[k] for k in group if k != number]
        behind = [other.to_go for other in others if other.stop == stop and not other.standing]
        late = any(to_go + AHEAD < other < math.inf for other in behind)
        return self.speed * (0.5 if late else 1.0)

    @staticmethod
    def _towards(walker: Walker, target: Vector, to_go: float, speed: float) -> Vector:
        dx, dy = target[0] - walker.x, target[1] - walker.y
        length = math.sqrt(dx * dx + dy * dy)
        if length == 0.0:
            return 0.0, 0.0
        pace = min(speed, to_go / (2.0 * DT)) / length
        turn = TO_THE_RIGHT if to_go > LOOKAHEAD else 0.0
        return (dx + turn * dy) * pace, (dy - turn * dx) * pace


def _length(path: Sequence[Vector], first: int) -> float:
    """Return the length of a path from its point of a number on, meters."""
    return sum((math.dist(path[k], path[k + 1]) for k in range(first, len(path) - 1)), 0.0)


def _kept_off(disc: Disc, robot: Disc) -> HalfPlane:
    """Return the velocities by which a person comes no nearer to a robot at rest than `GAP`."""
    return away_from((robot.x - disc.x, robot.y - disc.y), disc.radius + robot.radius + GAP, DT)
