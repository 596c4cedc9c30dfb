"""Ids of furniture in a plan: inside the footprint if they fit, otherwise a number that a key explains."""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Iterator
from dataclasses import dataclass

from labgym.geometry import OrientedBox, wrap_angle

SIZES = (6.5, 5.5, 4.8, 4.2)
"""Font sizes in points."""
WIDTH, LINE = 0.62, 1.2
"""Mean width of a character and height of a line, relative to the font size."""
MARGIN = 1.0
"""Distance of a label from the outline, points."""
_PARTS = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+|[0-9]+|[_.-]")


@dataclass(frozen=True)
class IdLabel:
    """A label in a footprint.

    Attributes:
        rotation: radians; labels read from below or from the right.
    """

    text: str
    size: float
    rotation: float


def id_label(placement_id: str, box: OrientedBox, points_per_meter: float) -> IdLabel | None:
    """Return the label of a placement that fits into its footprint, None if none does."""
    along = _readable(box.yaw)
    across = _readable(box.yaw + math.pi / 2.0)
    width, depth = box.width * points_per_meter, box.depth * points_per_meter
    for size, text in itertools.product(SIZES, _wrappings(placement_id)):
        lines = text.split("\n")
        wide = WIDTH * size * max(map(len, lines)) + 2.0 * MARGIN
        high = LINE * size * len(lines) + 2.0 * MARGIN
        for rotation, room in ((along, (width, depth)), (across, (depth, width))):
            if wide <= room[0] and high <= room[1]:
                return IdLabel(text, size, rotation)
    return None


def _wrappings(text: str) -> Iterator[str]:
    """Yield a name in one to four lines, broken between its words."""
    words = _PARTS.findall(text) if "".join(_PARTS.findall(text)) == text else [text]
    yield text
    for count in (2, 3, 4):
        target = len(text) / count
        lines = [""]
        for word in words:
            if lines[-1] and len(lines[-1]) + len(word) / 2.0 > target and len(lines) < count and word not in "_.-":
                lines.append("")
            lines[-1] += word
        yield "\n".join(lines)


def _readable(yaw: float) -> float:
    """Return a direction turned by half a turn if text along it would be upside down."""
    angle = wrap_angle(yaw)
    return angle if -math.pi / 2.0 + 1e-6 < angle <= math.pi / 2.0 + 1e-6 else wrap_angle(angle + math.pi)
