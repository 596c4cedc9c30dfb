"""Optimal reciprocal collision avoidance (ORCA): what each of several discs may do so that none touches another.

Van den Berg, Guy, Lin and Manocha, "Reciprocal n-body collision avoidance", Robotics Research 2011, sections 4 and 5.
Each disc names the neighbors that it avoids: half of the people in a laboratory do not see the robot. `pyrvo` has no
visibility by agent, computes in single precision, and requires `ir-sim`; the tests compare trajectories with it.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple

from labgym.envs.conditions.half_planes import HalfPlane, Vector, permitted_velocity
from labgym.envs.parts.kinds import positive


class Disc(NamedTuple):
    """A disc that moves.

    Attributes:
        x, y: center, meters. vx, vy: velocity, m/s. radius: meters.
    """

    x: float
    y: float
    vx: float
    vy: float
    radius: float


class Neighbor(NamedTuple):
    """A disc that is to be avoided.

    Attributes:
        disc: the disc.
        share: part of the avoidance that the first disc takes over: 1/2 if the other one does the same, 1 if it does
            nothing.
    """

    disc: Disc
    share: float = 0.5


@dataclass(frozen=True)
class Orca:
    """The parameters of ORCA.

    Attributes:
        horizon: time for which velocities keep discs apart, seconds.
        horizon_walls: time for which they keep discs off obstacles, seconds.
        reach: neighbors farther than this are ignored, meters. neighbors: the nearest ones that count.
        dt: duration of a step, seconds; discs that overlap separate within it.
    """

    horizon: float = 2.0
    horizon_walls: float = 0.5
    reach: float = 5.0
    neighbors: int = 10
    dt: float = 0.1

    def __post_init__(self) -> None:
        positive(self, "horizon", "horizon_walls", "reach", "neighbors", "dt")

    def planes(self, disc: Disc, neighbors: Iterable[Neighbor]) -> list[HalfPlane]:
        """Return the half-planes of a disc's neighbors, the nearest one first."""
        near = []
        for number, neighbor in enumerate(neighbors):
            dx, dy = neighbor.disc.x - disc.x, neighbor.disc.y - disc.y
            square = dx * dx + dy * dy
            if square < self.reach * self.reach:
                near.append((square, number, neighbor))
        near.sort(key=lambda one: one[:2])
        return [reciprocal(disc, neighbor, self.horizon, self.dt) for _, _, neighbor in near[: self.neighbors]]

    def velocity(
        self,
        disc: Disc,
        preferred: Vector,
        fastest: float,
        neighbors: Iterable[Neighbor],
        walls: Iterable[Vector] = (),
        blocks: Iterable[HalfPlane] = (),
    ) -> Vector:
        """Return the next velocity of a disc, m/s.

        Args:
            disc: the disc. preferred: the velocity that it would have alone, m/s. fastest: greatest speed, m/s.
            neighbors: the discs that it avoids.
            walls: from its center to the nearest point of each obstacle, meters.
            blocks: further half-planes that hold in any case; they permit rest.
        """
        hard = [away_from(wall, disc.radius, self.horizon_walls) for wall in walls]
        return permitted_velocity(preferred, fastest, [*hard, *blocks], self.planes(disc, neighbors))


def reciprocal(disc: Disc, neighbor: Neighbor, horizon: float, dt: float) -> HalfPlane:
    """Return the velocities of a disc by which it does its share to stay clear of a neighbor.

    Let u be the smallest change of the relative velocity that takes it to the boundary of the velocity obstacle, a cone
    cut off by a disc, and n the outward normal there. The half-plane is n . (v - (v_disc + share u)) >= 0.

    Args:
        disc: the disc. neighbor: the other one. horizon: time without contact, seconds.
        dt: time in which discs that overlap separate, seconds.
    """
    other, share = neighbor
    px, py, vx, vy = other.x - disc.x, other.y - disc.y, disc.vx - other.vx, disc.vy - other.vy
    radius, square = disc.radius + other.radius, px * px + py * py
    apart = square > radius * radius
    time = horizon if apart else dt
    wx, wy = vx - px / time, vy - py / time
    ahead = wx * px + wy * py
    size = wx * wx + wy * wy
    if not apart or (ahead < 0.0 and ahead * ahead > radius * radius * size):
        length = math.sqrt(size)
        if length > 0.0:
            nx, ny = wx / length, wy / length
        else:
            distance = math.sqrt(square)
            nx, ny = (-px / distance, -py / distance) if distance > 0.0 else (1.0, 0.0)
        return HalfPlane(nx, ny, nx * disc.vx + ny * disc.vy + share * (radius / time - length))
    # The legs of the cone are the tangents of the disc around the relative position.
    leg = math.sqrt(square - radius * radius)
    if px * wy - py * wx > 0.0:
        nx, ny = -(px * radius + py * leg) / square, (px * leg - py * radius) / square
    else:
        nx, ny = (-px * radius + py * leg) / square, -(px * leg + py * radius) / square
    return HalfPlane(nx, ny, nx * disc.vx + ny * disc.vy - share * (nx * vx + ny * vy))


def away_from(wall: Vector, radius: float, horizon: float) -> HalfPlane:
    """Return the velocities that keep a disc off a convex obstacle for a time; rest is among them (section 5.4).

    The half-plane touches the velocity obstacle where it is nearest to rest: the speed towards the obstacle's nearest
    point is at most the gap over the horizon. No velocity of the half-plane reaches the obstacle, since the line
    through that point separates all of it from the disc.

    Args:
        wall: from the disc's center to the nearest point of the obstacle, meters.
        radius: of the disc, meters. horizon: seconds.
    """
    distance = math.sqrt(wall[0] * wall[0] + wall[1] * wall[1])
    if distance == 0.0:
        return HalfPlane(1.0, 0.0, -math.inf)
    return HalfPlane(-wall[0] / distance, -wall[1] / distance, -max(distance - radius, 0.0) / horizon)
