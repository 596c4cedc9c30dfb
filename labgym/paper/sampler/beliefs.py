"""The sampler's knowledge of a space: the role of each wall, and the pieces as it remembers them."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field, replace

from labgym.geometry import OrientedBox, wrap_angle
from labgym.layouts.brief import Unit
from labgym.layouts.ground import Ground, Segment
from labgym.layouts.habits import Habit, Side, Span
from labgym.layouts.interiors.standing import OBLIQUE_GAP, WALL_GAP, Distances, Intervals, Standing

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


@dataclass(frozen=True)
class Foot:
    """A piece as it is believed to stand: footprint in the ground's frame, free depth in front, and space around."""

    box: OrientedBox
    front: float
    clear: float


@dataclass(frozen=True)
class Attention:
    """The things that the sampler consults when it places a piece."""

    neighbors: bool = True
    fixed: bool = True
    doors: bool = True
    fronts: bool = True


@dataclass
class Belief:
    """The furniture of a space as the sampler remembers it.

    Attributes:
        feet: pieces in the order in which they were placed, by id.
        fixed: footprints of fixed objects, in the ground's frame, by id.
    """

    ground: Ground
    fixed: dict[str, OrientedBox] = field(default_factory=dict)
    feet: dict[str, Foot] = field(default_factory=dict)

    def places(
        self, unit: Unit, attention: Attention, apart: Iterable[tuple[OrientedBox, float]] = ()
    ) -> list[tuple[Segment, Intervals]]:
        """Return the stretches of wall where a unit would fit, as far as the sampler pays attention.

        Args:
            unit: the unit with the size that it is believed to have.
            apart: boxes, and the distance in meters to keep from each.
        """
        standing = self._standing(attention)
        searched = unit if attention.fronts else replace(unit, front=0.0)
        distances: Distances = tuple(apart)
        segments = self.ground.segments if attention.doors else _uncut(self.ground)
        found = ((segment, standing.places(segment, searched, distances)) for segment in segments)
        return [(segment, intervals) for segment, intervals in found if intervals]

    def _standing(self, attention: Attention) -> Standing:
        ground = self.ground
        if not attention.doors:
            ground = replace(ground, gates=(), segments=_uncut(ground))
        if not attention.fixed:
            ground = replace(ground, solid=())
        standing = Standing(ground)
        for box in self.fixed.values() if attention.fixed else ():
            standing.add(box)
        noticed = [foot for each, foot in self.feet.items() if attention.fixed or each not in self.fixed]
        for foot in noticed if attention.neighbors else ():
            standing.add(foot.box, foot.front if attention.fronts else 0.0, foot.clear)
        return standing


def _uncut(ground: Ground) -> tuple[Segment, ...]:
    """The stretches of wall of a ground as if nothing opened in them."""
    return tuple(replace(segment, cuts=()) for segment in ground.segments)


def wall_gap(segment: Segment) -> float:
    """Return the gap that the sampler leaves behind a piece, meters."""
    return WALL_GAP if segment.straight else OBLIQUE_GAP
