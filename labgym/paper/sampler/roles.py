"""Which role each wall of a space plays: the wall of the door, the one opposite, storage and work at the sides."""

from __future__ import annotations

import math
from dataclasses import dataclass

from labgym.geometry import wrap_angle
from labgym.layouts.ground import Ground, Segment
from labgym.layouts.habits import Habit, Side, Span

FRONT, BACK = math.pi / 4.0, 3.0 * math.pi / 4.0
"""Angles between a wall and that of the door up to which it counts as front, and from which it counts as back."""


@dataclass(frozen=True)
class Roles:
    """The roles of the walls of a space.

    Attributes:
        ground: the space.
        entrance: middle of its first door, and the yaw whose front is toward the space.
        storage_left: whether storage is on the left of someone who enters.
    """

    ground: Ground
    entrance: tuple[float, float, float]
    storage_left: bool

    @classmethod
    def of(cls, ground: Ground, storage_left: bool) -> Roles:
        """Return the roles of the walls of a space; without a door, as if one were in the middle of its front edge."""
        gates = [(gate.x, gate.y, gate.yaw) for gate in ground.gates]
        return cls(ground, gates[0] if gates else (ground.width / 2.0, 0.0, 0.0), storage_left)

    def side(self, segment: Segment) -> Side:
        """Return the role of a wall."""
        turn = wrap_angle(segment.yaw - self.entrance[2])
        if abs(turn) <= FRONT:
            return "front"
        if abs(turn) >= BACK:
            return "back"
        # An object on the left wall faces to the right: its yaw is a quarter turn clockwise from the entrance's.
        return "store" if (turn < 0.0) == self.storage_left else "work"

    def anchor(self, segment: Segment, habit: Habit, place: float) -> float:
        """Return where along a wall a habit puts the middle of a piece, meters from the segment's start.

        Args:
            place: position within the habit's span, 0 to 1.
        """
        side = self.side(segment)
        span: Span | None = {"front": habit.front, "back": habit.back}.get(side, habit.side)
        share = place if span is None else span[0] + place * (span[1] - span[0])
        x, y, yaw = self.entrance
        along = (math.cos(segment.yaw), math.sin(segment.yaw))
        inward, right = (-math.sin(yaw), math.cos(yaw)), (math.cos(yaw), math.sin(yaw))
        if side == "front":
            forward = (segment.x - x) * along[0] + (segment.y - y) * along[1] + segment.length / 2.0 > 0.0
        else:
            axis = (right if self.storage_left else (-right[0], -right[1])) if side == "back" else inward
            forward = along[0] * axis[0] + along[1] * axis[1] > 0.0
        return segment.length * (share if forward else 1.0 - share)
