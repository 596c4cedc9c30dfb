"""The worth of a drive among people: points for time, and points for distance from people."""

from __future__ import annotations

from dataclasses import dataclass, replace

NEAR_PEOPLE_M = 1.0
"""Distance from people within which time costs points, meters between centers."""


@dataclass(frozen=True)
class Worth:
    """The points of a drive: weighted shares of time, of distance from people, and of length.

    They are hurry OT / max(T, OT) + distance max(0, 1 - seconds near people / OT) + way L* / max(P, L*), with L* = OT.

    Attributes:
        ideal: OT, seconds. hurry, distance, way: the weights.
        spent: T so far, seconds. close: seconds near people so far. length: P, of the whole drive on the route, meters.
    """

    ideal: float
    hurry: float = 1.0
    distance: float = 0.0
    way: float = 0.0
    spent: float = 0.0
    close: float = 0.0
    length: float = 0.0

    def points(self, seconds: float, near: float = 0.0) -> float:
        """Return the points of a drive that takes so much longer and is so much longer near people, seconds."""
        late = self.hurry * self.ideal / max(self.spent + seconds, self.ideal)
        straight = self.way * self.ideal / max(self.length, self.ideal)
        return late + straight + self.distance * max(0.0, 1.0 - (self.close + near) / self.ideal)

    def price(self, seconds: float) -> float:
        """Return what a second near people is worth in seconds of a drive that takes so much longer."""
        if self.close >= self.ideal:
            return 0.0
        return self.distance / self.hurry * (max(self.spent + seconds, self.ideal) / self.ideal) ** 2

    def after(self, spent: float, close: float) -> Worth:
        """Return the worth with other seconds so far."""
        return replace(self, spent=spent, close=close)

    def along(self, length: float) -> Worth:
        """Return the worth on a route with which the whole drive is so long, meters."""
        return replace(self, length=length)
