"""Curved walls of drawings as polylines: every chord lies within a centimeter of its arc."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from labgym.errors import OptionError
from labgym.exchange.strips import PAIRED, THICKNESS, Point, Stroke

SAGITTA = 0.01
"""Greatest distance of an arc from its chord, meters."""
MOST_CHORDS = 128
"""Most chords of an arc."""
CONCENTRIC = 0.02
"""Greatest distance between the centers of the two faces of a curved wall, meters."""
LEAST = 0.6
"""Length below which a single arc is the rounding of a corner and not the face of a wall, meters."""
SHARED = 0.5
"""Least share of the shorter arc before which the other one lies."""


@dataclass(frozen=True)
class Arc:
    """A counter-clockwise arc: center and radius in meters, start and span in radians."""

    center: Point
    radius: float
    start: float
    span: float

    @classmethod
    def of_bulge(cls, a: Point, b: Point, bulge: float) -> Arc:
        """Return the arc between two points; the bulge is the tangent of a quarter of its span, negative clockwise."""
        span = 4.0 * math.atan(abs(bulge))
        chord = math.dist(a, b)
        radius = chord / 2.0 / math.sin(span / 2.0)
        first, last = (a, b) if bulge > 0.0 else (b, a)
        rise = radius * math.cos(span / 2.0)
        x, y = (first[0] + last[0]) / 2.0, (first[1] + last[1]) / 2.0
        center = (x - (last[1] - first[1]) / chord * rise, y + (last[0] - first[0]) / chord * rise)
        return cls(center, radius, math.atan2(first[1] - center[1], first[0] - center[0]), span)

    def points(self, backward: bool = False, sagitta: float = SAGITTA) -> list[Point]:
        """Return the ends of the chords along the arc.

        Raises:
            OptionError: it takes too many chords.
        """
        if self.radius <= sagitta:
            count = 4
        else:
            count = max(1, math.ceil(self.span / (2.0 * math.acos(1.0 - sagitta / self.radius)) - 1e-9))
        if count > MOST_CHORDS:
            x, y = self.center
            raise OptionError(
                f"the arc around ({x:.2f}, {y:.2f}) m with a radius of {self.radius:.2f} m takes {count} chords; "
                f"at most {MOST_CHORDS} are read: draw it with straight segments"
            )
        angles = [self.start + self.span * k / count for k in range(count + 1)]
        points = [
            (self.center[0] + self.radius * math.cos(angle), self.center[1] + self.radius * math.sin(angle))
            for angle in angles
        ]
        return points[::-1] if backward else points


def flattened(points: Sequence[Point], bulges: Sequence[float], closed: bool, sagitta: float = SAGITTA) -> list[Point]:
    """Return the points of a polyline with its arcs replaced by chords.

    Raises:
        OptionError: an arc takes too many chords.
    """
    ends = [*points[1:], *(points[:1] if closed else ())]
    flat = [points[0]]
    for a, b, bulge in zip(points, ends, bulges, strict=False):
        if abs(bulge) > 1e-6 and math.dist(a, b) > 1e-6:
            flat += Arc.of_bulge(a, b, bulge).points(bulge < 0.0, sagitta)[1:-1]
        flat.append(b)
    return flat[:-1] if closed else flat


def curved_walls(arcs: Sequence[tuple[Arc, float]]) -> list[Stroke]:
    """Return the walls between concentric arcs as polylines with a width.

    Args:
        arcs: arcs with the height of their wall, meters.

    Raises:
        OptionError: an arc of at least 0.6 m has no partner within 0.6 m, or an arc takes too many chords.
    """
    left = sorted(arcs, key=lambda entry: (entry[0].radius, entry[0].center, entry[0].start))
    walls = []
    while left:
        arc, height = left.pop(0)
        partner = next((k for k, (other, _) in enumerate(left) if _shared(arc, other) is not None), None)
        if partner is None and arc.radius * arc.span < LEAST:
            continue
        if partner is None:
            x, y = arc.points()[0]
            raise OptionError(
                f"the arc of a wall at ({x:.2f}, {y:.2f}) m has no concentric arc within {PAIRED:g} m: draw both "
                "faces, or a polyline with the width of the wall"
            )
        other, other_height = left.pop(partner)
        start, span = _shared(arc, other) or (arc.start, arc.span)
        middle = Arc(arc.center, (arc.radius + other.radius) / 2.0, start, span)
        walls.append(Stroke(tuple(middle.points()), False, other.radius - arc.radius, max(height, other_height)))
    return walls


def _shared(inner: Arc, outer: Arc) -> tuple[float, float] | None:
    """Start and span of the angle that two faces of one wall share, None if they are none."""
    if math.dist(inner.center, outer.center) > CONCENTRIC:
        return None
    if not THICKNESS[0] <= outer.radius - inner.radius <= PAIRED:
        return None
    turn = math.remainder(outer.start - inner.start, 2.0 * math.pi)
    low, high = max(0.0, turn), min(inner.span, turn + outer.span)
    if high - low < SHARED * min(inner.span, outer.span):
        return None
    return inner.start + low, high - low
