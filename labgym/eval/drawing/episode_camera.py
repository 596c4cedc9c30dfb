"""The camera of an episode's picture: it sees the robot, its goal, and what makes the episode hard."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from labgym.layouts import Layout
from labgym.scenes.camera import View, fitted
from labgym.scenes.cutaway import across, uppers
from labgym.scenes.mesh import ROOM, SceneMesh, joined, scene_mesh
from labgym.scenes.overview import Eyes
from labgym.scenes.surfaces import looks

SHOWN = ("robot", "goal", "subject")
"""Parts of a picture that must be seen."""
LEAST_PIXELS, PLENTY_PIXELS = 400, 1500
"""Pixels from which on a part is seen, and is seen well, in a picture of `STANDARD` size."""
STANDARD = (900, 560)
"""Width and height, pixels."""
FOVY, NEAREST = 38.0, 4.4
"""Vertical field of view of the camera, degrees, and its least distance from its target, meters."""
ASIDE = tuple(math.radians(angle) for angle in (30, -30, 55, -55, 5, 85, -85, 110, -110, 135, -135, 165))
PITCHES = tuple(math.radians(angle) for angle in (30, 40, 52, 66, 80))
"""Candidate directions of the camera, best first: angle from straight behind the robot, and above the horizontal."""
STEEP, OUTSIDE, ROUTE, MARGIN = 0.1, 4.0, 0.5, 1.3
"""What a step of pitch and a camera below the ceilings but outside of all spaces cost, what a route that is seen well
is worth, relative to a part that is seen well, and by how much pixels must exceed the least in a coarse picture."""
COARSE = 80
"""Height of the pictures in which candidates are compared, pixels."""
HALF = 0.4
"""Half of the width of what the camera takes in around a place, meters."""

Array = NDArray[np.float64]
Size = tuple[int, int]


@dataclass(frozen=True, eq=False)
class Stage:
    """A floor and what a picture adds to it.

    Attributes:
        layout: the floor. subject: id of the placement that is the subject, None if it is one of the parts.
        parts: added meshes by name: those of `SHOWN`, "route", and others.
        places: (n, 3), the middle and the height of what the camera takes in, meters.
        yaw: heading of the robot, radians.
    """

    layout: Layout
    parts: Mapping[str, SceneMesh]
    subject: str | None
    places: Array
    yaw: float

    def best_view(self, size: Size = STANDARD) -> View:
        """Return the view of a picture of a size, (width, height), in which most is seen of the parts."""
        floor, aspect = self.layout.floor, size[0] / size[1]
        ceiling, coarse = max(space.ceiling for space in floor.spaces), (round(COARSE * aspect), COARSE)
        eyes = self._eyes(uppers(floor))
        best, view = -math.inf, None
        for steep, pitch in enumerate(PITCHES):
            if best >= 2.0 * (len(self._due) + ROUTE) - STEEP * steep:
                break  # no steeper one is better
            for aside in ASIDE:
                candidate = _away(fitted(self._corners, self.yaw + math.pi + aside, pitch, FOVY, aspect))
                pixels = self._pixels(eyes, candidate, coarse)
                x, y, z = candidate.position
                value = sum(_worth(pixels[name]) for name in SHOWN) + ROUTE * _worth(pixels["route"]) - STEEP * steep
                value -= OUTSIDE * (z < ceiling and floor.space_at(x, y) is None)
                if value > best + 1e-9:
                    best, view = value, candidate
        assert view is not None
        return view

    def hidden(self, view: View) -> tuple[str, ...]:
        """Return the upper parts of walls and columns between a camera and the places."""
        return across(self.layout.floor, view.position, self._corners[:, :2])

    def pixels(self, view: View, size: Size = STANDARD) -> dict[str, int]:
        """Return how many pixels of a `STANDARD` picture show each part of `SHOWN` it has, counted in one of a size."""
        counted = self._pixels(self._eyes(self.hidden(view)), view, size)
        return {name: round(counted[name]) for name in self._due}

    @property
    def _due(self) -> list[str]:
        """The parts of `SHOWN` that the picture has."""
        return [name for name in SHOWN if name in self.parts or (name == "subject" and self.subject)]

    @property
    def _corners(self) -> Array:
        """Corners (8 n, 3) of the boxes that the camera takes in."""
        box = np.array([(i, j, z) for i in (-HALF, HALF) for j in (-HALF, HALF) for z in (0.0, 1.0)])
        low, scale = self.places * (1.0, 1.0, 0.0), np.column_stack([np.ones((len(self.places), 2)), self.places[:, 2]])
        return np.asarray((low[:, None] + box * scale[:, None]).reshape(-1, 3))

    def _eyes(self, hidden: Collection[str]) -> Eyes:
        """Return eyes for what is opaque and for the subject; the owner of a part is its place among `_names`."""
        base = scene_mesh(self.layout, hidden)
        index = [placement.id for placement in self.layout.placements].index(self.subject) if self.subject else ROOM - 1
        meshes = [_owned(base, np.where(base.owner == index, SHOWN.index("subject"), ROOM))]
        names = (*SHOWN, "route")
        for name, mesh in self.parts.items():
            owner = names.index(name) if name in names else ROOM
            meshes.append(_owned(mesh, np.full(len(mesh.faces), owner)))
        mesh = joined(*meshes)
        kept = np.flatnonzero((looks().opacity[mesh.material] > 0.85) | (mesh.owner == SHOWN.index("subject")))
        return Eyes(SceneMesh(mesh.vertices, mesh.faces[kept], mesh.material[kept], mesh.owner[kept]))

    def _pixels(self, eyes: Eyes, view: View, size: Size) -> dict[str, float]:
        """Return the pixels of the parts, in pixels of a `STANDARD` picture."""
        names = (*SHOWN, "route")
        counts = eyes.pixels(view, size, len(names)) * (STANDARD[1] / size[1]) ** 2
        return dict(zip(names, counts.tolist(), strict=True))


def _worth(pixels: float) -> float:
    return min(pixels / PLENTY_PIXELS, 1.0) + (pixels > MARGIN * LEAST_PIXELS)


def _away(view: View) -> View:
    """Return a view from at least `NEAREST` meters from its target."""
    eye, target = np.array(view.position), np.array(view.target)
    distance = float(np.linalg.norm(eye - target))
    x, y, z = (target + (eye - target) * max(1.0, NEAREST / distance)).tolist()
    return replace(view, position=(x, y, z))


def _owned(mesh: SceneMesh, owner: NDArray[np.int64]) -> SceneMesh:
    return replace(mesh, owner=owner)
