"""Visible faces of a building, grouped by wall and material."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Faces = NDArray[np.int64]
Corners = tuple[
    tuple[float, float, float], tuple[float, float, float], tuple[float, float, float], tuple[float, float, float]
]
"""Corners of a rectangle, counter-clockwise seen from its front."""


@dataclass(frozen=True)
class Patch:
    """Faces of one material of a wall, or of the floor, in the floor's frame: vertices (n, 3) and faces (m, 3).

    Attributes:
        wall: name of the wall or of its upper part; pictures hide walls by this name.
    """

    wall: str
    name: str
    material: str
    vertices: Array
    faces: Faces


def join(meshes: list[tuple[Array, Faces]]) -> tuple[Array, Faces]:
    """Concatenate meshes, each (vertices, faces)."""
    offsets = np.cumsum([0, *[len(vertices) for vertices, _ in meshes[:-1]]])
    return (
        np.concatenate([vertices for vertices, _ in meshes]),
        np.concatenate([faces + offset for (_, faces), offset in zip(meshes, offsets, strict=True)]),
    )


def welded(rectangles: Collection[Corners]) -> tuple[Array, Faces]:
    """Return a mesh of rectangles whose common corners are one vertex."""
    corners = np.array(list(rectangles), dtype=np.float64).reshape(-1, 3)
    _, first, index = np.unique(np.round(corners, 7), axis=0, return_index=True, return_inverse=True)
    a, b, c, d = index.reshape(-1, 4).T
    faces = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    return corners[first], faces


def visible(patches: Iterable[Patch], hidden: Collection[str]) -> Iterator[Patch]:
    """Yield the patches of the walls that are not hidden."""
    return (patch for patch in patches if patch.wall not in hidden)
