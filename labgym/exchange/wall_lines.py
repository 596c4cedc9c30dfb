"""Walls from strips and marks: strips on one line become walls, marks become openings of the walls they lie in."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from labgym.errors import OptionError
from labgym.exchange.drawing import Mark
from labgym.exchange.strips import PARALLEL, Point, Strip, tidy_point
from labgym.layouts.floor import Opening, Wall

HEIGHT, DOOR_HEIGHT = 3.0, 2.1
"""Heights of walls and doors if the drawing is flat, meters."""
ALIGNED = 5e-3
"""Largest distance of a strip from the line of a wall that it continues, meters."""
TOUCHING = 5e-3
"""Longest gap between strips that are one wall, meters."""
FRAME = 0.12
"""Longest gap between an opening and the wall next to it, the space of a frame, meters."""


@dataclass
class WallLine:
    """A straight wall in the making: a frame along its middle line, solid intervals, and openings."""

    origin: Point
    yaw: float
    thickness: float
    height: float
    solid: list[tuple[float, float]]
    marks: list[tuple[float, float, Mark]] = field(default_factory=list)

    def local(self, point: Point) -> Point:
        """Return the distance of a point along the line, and to the left of it."""
        dx, dy = point[0] - self.origin[0], point[1] - self.origin[1]
        cosine, sine = math.cos(self.yaw), math.sin(self.yaw)
        return dx * cosine + dy * sine, dy * cosine - dx * sine

    def world(self, along: float) -> Point:
        """Return the point at a distance along the line."""
        x, y = self.origin
        return x + along * math.cos(self.yaw), y + along * math.sin(self.yaw)


def wall_lines(strips: Sequence[Strip]) -> list[WallLine]:
    """Return the lines on which strips lie; strips of one thickness on one line share it."""
    lines: list[WallLine] = []
    for strip in sorted(strips, key=lambda each: -each.length):
        height = strip.height or HEIGHT
        for line in lines:
            if abs(line.thickness - strip.thickness) > ALIGNED or abs(line.height - height) > ALIGNED:
                continue
            if abs(math.sin(line.yaw - strip.yaw)) > PARALLEL:
                continue
            (a, across), (b, across_end) = line.local(strip.start), line.local(strip.end)
            if max(abs(across), abs(across_end)) <= ALIGNED:
                line.solid.append((min(a, b), max(a, b)))
                break
        else:
            lines.append(WallLine(strip.start, strip.yaw, strip.thickness, height, [(0.0, strip.length)]))
    return lines


def add_opening(lines: Sequence[WallLine], alternatives: Sequence[Mark]) -> None:
    """Add an opening to the wall in which it lies.

    Raises:
        OptionError: it lies in no wall.
    """
    best: tuple[float, WallLine, float, float, Mark] | None = None
    for mark in alternatives:
        for line in lines:
            (a, across), (b, across_end) = line.local(mark.start), line.local(mark.end)
            off = max(abs(across), abs(across_end)) - line.thickness / 2.0
            if off > FRAME or abs(across - across_end) > 0.05 * mark.width:
                continue
            low, high = min(a, b), max(a, b)
            if any(start - FRAME <= high and low <= end + FRAME for start, end in line.solid):
                low, high = _snapped(line, low, high)
                if best is None or off < best[0] - 1e-9:
                    best = (off, line, low, high, mark)
    if best is None:
        x, y = alternatives[0].start
        kind = alternatives[0].kind
        raise OptionError(f"the {kind} at ({x:.2f}, {y:.2f}) m lies in no wall: move it onto one, or draw the wall")
    _, line, low, high, mark = best
    line.marks.append((low, high, mark))


def _snapped(line: WallLine, low: float, high: float) -> tuple[float, float]:
    """Return an interval extended to the gap between the solid parts around it, if that is as wide as a frame."""
    before = [end for _, end in line.solid if end <= low + FRAME]
    after = [start for start, _ in line.solid if start >= high - FRAME]
    if before and abs(max(before) - low) <= FRAME:
        low = max(before)
    if after and abs(min(after) - high) <= FRAME:
        high = min(after)
    return low, high


def walls_on(line: WallLine) -> list[Wall]:
    """Return the walls on a line: solid parts and openings without gaps between them."""
    spans = sorted([*line.solid, *((low, high) for low, high, _ in line.marks)])
    chains: list[tuple[float, float]] = []
    for low, high in spans:
        if chains and low <= chains[-1][1] + TOUCHING:
            chains[-1] = (chains[-1][0], max(chains[-1][1], high))
        else:
            chains.append((low, high))
    return [
        Wall(
            start=tidy_point(line.world(low)),
            end=tidy_point(line.world(high)),
            thickness=round(line.thickness, 6),
            height=round(line.height, 6),
            openings=tuple(
                _opening(line, mark, a - low, b - low) for a, b, mark in line.marks if low <= (a + b) / 2.0 <= high
            ),
        )
        for low, high in chains
    ]


def _opening(line: WallLine, mark: Mark, low: float, high: float) -> Opening:
    fields: dict[str, Any] = {"kind": mark.kind, "position": round((low + high) / 2.0, 6)}
    fields |= {"width": round(high - low, 6), "height": DOOR_HEIGHT, **mark.fields}
    if mark.hinge is not None:
        ends = line.local(mark.start)[0], line.local(mark.end)[0]
        fields["hinge"] = "start" if abs(line.local(mark.hinge)[0] - min(ends)) < mark.width / 2.0 else "end"
    if mark.toward is not None:
        fields["swing"] = "left" if line.local(mark.toward)[1] > 0.0 else "right"
    return Opening(**fields)
