"""The picture of a proposal: recognized rooms, walls and doors over the original."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from labgym.documents import write_bytes
from labgym.exchange.recognition.proposal import Proposal

LONGEST_SIDE = 1600
"""Longer side of the picture, pixels."""
COLORS = ((255, 225, 190), (200, 240, 200), (190, 215, 255), (235, 205, 245), (190, 245, 250), (220, 220, 190))
"""Colors of rooms, blue, green, red."""
SOLID, UNKNOWN, FREE = (60, 60, 60), (205, 205, 205), (255, 255, 255)
WALL, OPENING, TEXT = (0, 0, 200), (0, 140, 0), (120, 0, 0)


def write_overlay(proposal: Proposal, path: Path) -> Path:
    """Write the recognized rooms, walls (red) and openings (green) over the file's cells as PNG; return the path.

    The numbers are those of the rooms, for --merge; the lower left corner of the picture is at the given position of
    the file, and the frame is turned to the main direction.
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
    image = np.ascontiguousarray(image[::-1])  # y up
    for name, room in proposal.rooms.items():
        point = room.representative_point()
        x, y = pixels([(point.x, point.y)])[0].tolist()
        at = (x - 10, image.shape[0] - y + 6)
        cv2.putText(image, name.removeprefix("room_"), at, cv2.FONT_HERSHEY_SIMPLEX, 0.7, TEXT, 2, cv2.LINE_AA)
    return write_bytes(path, cv2.imencode(".png", image)[1].tobytes())
