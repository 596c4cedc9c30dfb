"""The social-force model: what each of several discs would do if others and walls pushed it away.

Helbing and Molnar, "Social force model for pedestrian dynamics", Physical Review E 51, 1995: relaxation to the
preferred velocity. Moussaid et al., "Experimental study of the behavioural mechanisms underlying self-organization in
human crowds", Proceedings of the Royal Society B 276, 2009: interaction of two people. Constants of `pysocialforce`.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from labgym.machine_code import entry, inner

Array = NDArray[np.float64]


class SocialForce(NamedTuple):
    """The parameters of the social-force model.

    Attributes:
        radius: of a person, meters.
        relaxation: time in which the preferred velocity is taken up, seconds.
        social: greatest acceleration by a person, m/s2.
        weight, gamma, n, n_side: weight of the relative velocity (lambda), range of the interaction as a multiple of
            the interaction vector, and angular falloffs of slowing down and of stepping aside (n' and n of the paper).
        wall: acceleration at the surface of a wall, m/s2. wall_range: distance in which it falls to 1/e, meters.
        reach: people farther than this are ignored, meters. dt: duration of a step, seconds.
        two: the number 2: a power whose exponent the compiler knows is a product, which rounds otherwise.
    """

    radius: float
    relaxation: float = 0.5
    social: float = 5.1
    weight: float = 2.0
    gamma: float = 0.35
    n: float = 3.0
    n_side: float = 2.0
    wall: float = 10.0
    wall_range: float = 0.2
    reach: float = 5.0
    dt: float = 0.1
    two: float = 2.0


@inner
def interaction(disc: Array, other: Array, force: SocialForce) -> tuple[float, float]:
    """Return the acceleration of a disc by another one, m/s2 (Moussaid et al., section 3).

    Args:
        disc, other: (4,) x, y, vx, vy, m and m/s. force: the parameters.
    """
    dx, dy = other[0] - disc[0], other[1] - disc[1]
    distance = math.sqrt(dx * dx + dy * dy)
    if not 0.0 < distance < force.reach:
        return 0.0, 0.0
    ex, ey = dx / distance, dy / distance
    ix, iy = force.weight * (disc[2] - other[2]) + ex, force.weight * (disc[3] - other[3]) + ey
    size = math.sqrt(ix * ix + iy * iy)
    if size == 0.0:
        return 0.0, 0.0
    tx, ty = ix / size, iy / size
    spread = force.gamma * size
    angle = math.atan2(tx * ey - ty * ex, tx * ex + ty * ey)
    slow = force.social * math.exp(-distance / spread - math.pow(force.n * spread * angle, force.two))
    aside = force.social * math.exp(-distance / spread - math.pow(force.n_side * spread * angle, force.two))
    side = math.copysign(aside, angle) if angle != 0.0 else 0.0
    return -slow * tx + side * ty, -slow * ty - side * tx


@entry
def pushed(
    discs: Array,
    preferred: Array,
    avoids: NDArray[np.bool_],
    robot: Array,
    walls: Array,
    fastest: float,
    force: SocialForce,
) -> Array:
    """Return the next velocities of people (n, 2), m/s.

    Args:
        discs: (n, 4) x, y, vx, vy, m and m/s. preferred: (n, 2) velocities alone, m/s.
        avoids: (n,) whom the robot pushes away. robot: (4,) x, y, vx, vy.
        walls: (n, 2) from each center to the nearest point of the nearest obstacle, meters; inf without one.
        fastest: greatest speed, m/s. force: the parameters.
    """
    people = len(discs)
    result = np.empty((people, 2))
    for one in range(people):
        disc, wx, wy = discs[one], walls[one, 0], walls[one, 1]
        ax, ay = (preferred[one, 0] - disc[2]) / force.relaxation, (preferred[one, 1] - disc[3]) / force.relaxation
        for k in range(people + 1):
            if k == one or (k == people and not avoids[one]):
                continue
            fx, fy = interaction(disc, robot if k == people else discs[k], force)
            ax, ay = ax + fx, ay + fy
        distance = math.sqrt(wx * wx + wy * wy)
        if 0.0 < distance < math.inf:
            push = force.wall * math.exp(-max(distance - force.radius, 0.0) / force.wall_range) / distance
            ax, ay = ax - push * wx, ay - push * wy
        vx, vy = disc[2] + ax * force.dt, disc[3] + ay * force.dt
        speed = math.sqrt(vx * vx + vy * vy)
        if speed > fastest:
            vx, vy = vx * fastest / speed, vy * fastest / speed
        result[one, 0], result[one, 1] = vx, vy
    return result
