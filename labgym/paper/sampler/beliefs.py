"""The sampler's memory of a space, which it consults when it places the next piece."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace

from labgym.geometry import OrientedBox
from labgym.layouts.brief import Unit
from labgym.layouts.ground import Ground, Segment
from labgym.layouts.interiors.standing import OBLIQUE_GAP, WALL_GAP, Distances, Intervals, Standing


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
