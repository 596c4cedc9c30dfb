"""The social-force model: what each of several discs would do if others and walls pushed it away.

Helbing and Molnar, "Social force model for pedestrian dynamics", Physical Review E 51, 1995: relaxation to the
preferred velocity. Moussaid et al., "Experimental study of the behavioural mechanisms underlying self-organization in
human crowds", Proceedings of the Royal Society B 276, 2009: interaction of two people. Constants of `pysocialforce`.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

from labgym.envs.checks import positive
from labgym.envs.conditions.orca import Disc, Vector


@dataclass(frozen=True)
class SocialForce:
    """The parameters of the social-force model.

    Attributes:
        relaxation: time in which the preferred velocity is taken up, seconds.
        social: greatest acceleration by a person, m/s2.
        lambda_, gamma, n, n_side: weight of the relative velocity, range of the interaction as a multiple of the
            interaction vector, and angular falloffs of slowing down and of stepping aside (n' and n of the paper).
        wall: acceleration at the surface of a wall, m/s2. wall_range: distance in which it falls to 1/e, meters.
        reach: people farther than this are ignored, meters. dt: duration of a step, seconds.
    """

    relaxation: float = 0.5
    social: float = 5.1
    lambda_: float = 2.0
    gamma: float = 0.35
    n: float = 3.0
    n_side: float = 2.0
    wall: float = 10.0
    wall_range: float = 0.2
    reach: float = 5.0
    dt: float = 0.1

    def __post_init__(self) -> None:
        positive(self, "relaxation", "social", "lambda_", "gamma", "n", "n_side", "wall", "wall_range", "reach", "dt")

    def velocity(
        self, disc: Disc, preferred: Vector, fastest: float, others: Iterable[Disc], walls: Iterable[Vector] = ()
    ) -> Vector:
        """Return the next velocity of a disc, m/s.

        Args:
            disc: the disc. preferred: the velocity that it would have alone, m/s. fastest: greatest speed, m/s.
            others: the discs that push it away.
            walls: from its center to the nearest point of each obstacle, meters; the nearest one counts.
        """
        ax, ay = (preferred[0] - disc.vx) / self.relaxation, (preferred[1] - disc.vy) / self.relaxation
        for other in others:
            fx, fy = self.interaction(disc, other)
            ax, ay = ax + fx, ay + fy
        for wx, wy in sorted(walls, key=lambda wall: wall[0] * wall[0] + wall[1] * wall[1])[:1]:
            distance = math.sqrt(wx * wx + wy * wy)
            if distance > 0.0:
                push = self.wall * math.exp(-max(distance - disc.radius, 0.0) / self.wall_range) / distance
                ax, ay = ax - push * wx, ay - push * wy
        vx, vy = disc.vx + ax * self.dt, disc.vy + ay * self.dt
        speed = math.sqrt(vx * vx + vy * vy)
        return (vx, vy) if speed <= fastest else (vx * fastest / speed, vy * fastest / speed)

    def interaction(self, disc: Disc, other: Disc) -> Vector:
        """Return the acceleration of a disc by another one, m/s2 (Moussaid et al., section 3)."""
        dx, dy = other.x - disc.x, other.y - disc.y
        distance = math.sqrt(dx * dx + dy * dy)
        if not 0.0 < distance < self.reach:
            return 0.0, 0.0
        ex, ey = dx / distance, dy / distance
        ix, iy = self.lambda_ * (disc.vx - other.vx) + ex, self.lambda_ * (disc.vy - other.vy) + ey
        size = math.sqrt(ix * ix + iy * iy)
        if size == 0.0:
            return 0.0, 0.0
        tx, ty = ix / size, iy / size
        spread = self.gamma * size
        angle = math.atan2(tx * ey - ty * ex, tx * ex + ty * ey)
        slow = self.social * math.exp(-distance / spread - (self.n * spread * angle) ** 2)
        aside = self.social * math.exp(-distance / spread - (self.n_side * spread * angle) ** 2)
        side = math.copysign(aside, angle) if angle else 0.0
        return -slow * tx + side * ty, -slow * ty - side * tx
