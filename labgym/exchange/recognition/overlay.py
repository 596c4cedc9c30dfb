"""The picture of a proposal: recognized rooms, walls and doors over the original."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from labgym.exchange.recognition.picture import Picture
from labgym.exchange.recognition.proposal import Proposal

LONGEST_SIDE = 1600
"""Longer side of the picture, pixels."""
COLORS = ((255, 225, 190), (200, 240, 200), (190, 215, 255), (235, 205, 245), (190, 245, 250), (220, 220, 190))
"""Colors of rooms, blue, green, red."""
SOLID, UNKNOWN, FREE = (60, 60, 60), (205, 205, 205), (255, 255, 255)
WALL, OPENING, TEXT, MARK = (0, 0, 200), (0, 140, 0), (120, 0, 0), (150, 90, 150)
FONT = cv2.FONT_HERSHEY_SIMPLEX
MOST_MARKS = 150
"""Largest number of places that are marked."""


def overlay_png(proposal: Proposal) -> bytes:
    """Return a PNG of the recognized rooms, walls (red) and openings (green) over the cells of the file.

    The large numbers are those of the rooms. Crosses mark places in the frame of the file, meters.
    """
    picture = proposal.picture
    factor = max(1, LONGEST_SIDE // max(picture.free.shape))
    image = np.full((*picture.free.shape, 3), UNKNOWN, dtype=np.uint8)
    image[picture.free] = FREE
    image[picture.solid] = SOLID
    image = np.asarray(np.kron(image, np.ones((factor, factor, 1), np.uint8)), dtype=np.uint8)
    scale = factor / picture.cell

    def pixels(points: object) -> NDArray[np.int32]:
        at = (np.asarray(points, dtype=np.float64)[:, :2] - (picture.x, picture.y)) * scale
        return np.asarray(np.round(at), dtype=np.int32)

    tinted = image.copy()
    for index, room in enumerate(proposal.rooms.values()):
        rings = [pixels(ring.coords) for ring in (room.exterior, *room.interiors)]
        cv2.fillPoly(tinted, rings, COLORS[index % len(COLORS)])
    image = np.where((image == SOLID).all(axis=2, keepdims=True), image, tinted)
    for wall in proposal.walls:
        start, end = pixels([wall.start, wall.end]).tolist()
        cv2.line(image, start, end, WALL, max(1, factor // 2))
        for low, high in wall.openings:
            start, end = pixels([wall.point(low), wall.point(high)]).tolist()
            cv2.line(image, start, end, OPENING, max(3, 2 * factor))
    height = image.shape[0]
    image = np.ascontiguousarray(image[::-1])  # y up
    for x, y in _lattice(picture):
        column, row = pixels(picture.from_file(np.array([(x, y)])))[0].tolist()
        cv2.drawMarker(image, (column, height - row), MARK, cv2.MARKER_CROSS, 9, 1)
        cv2.putText(image, f"{x:g},{y:g}", (column + 4, height - row - 4), FONT, 0.35, MARK, 1, cv2.LINE_AA)
    for name, room in proposal.rooms.items():
        point = room.representative_point()
        x, y = pixels([(point.x, point.y)])[0].tolist()
        at = (x - 10, height - y + 6)
        cv2.putText(image, name.removeprefix("room_"), at, FONT, 0.7, TEXT, 2, cv2.LINE_AA)
    return cv2.imencode(".png", image)[1].tobytes()


def _lattice(picture: Picture) -> list[tuple[float, float]]:
    """Return places at round coordinates of the file that lie in a picture."""
    height, width = (extent * picture.cell for extent in picture.free.shape)
    x0, y0, x1, y1 = picture.x, picture.y, picture.x + width, picture.y + height
    corners = np.array([(x0, y0), (x1, y0), (x1, y1), (x0, y1)])
    low, high = picture.to_file(corners).min(axis=0), picture.to_file(corners).max(axis=0)
    for step in (1.0, 2.0, 5.0, 10.0, 20.0):
        xs, ys = (np.arange(np.ceil(a / step), np.floor(b / step) + 1) * step for a, b in zip(low, high, strict=True))
        if len(xs) * len(ys) <= MOST_MARKS:
            break
    return [(x, y) for x in xs.tolist() for y in ys.tolist()]
