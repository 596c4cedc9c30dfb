"""Bodies that a condition adds to what sensors see: each a rigid mesh at a pose that changes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from labgym.envs.parts.protocols import Condition, Presence
from labgym.envs.parts.registry import registered
from labgym.envs.tasks import Task
from labgym.scenes.exact_rays import ExactRayScene
from labgym.scenes.mesh import ROOM, SceneMesh
from labgym.scenes.rays import RaySource

if TYPE_CHECKING:
    from labgym.envs.state import State

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class BodyShape:
    """A rigid mesh in its own frame, whose origin is on the floor; episodes share it.

    Attributes:
        mesh: the triangles; owners do not count.
    """

    mesh: SceneMesh

    @cached_property
    def rays(self) -> ExactRayScene:
        """The shape for ray casting."""
        return ExactRayScene(None, "visual", self.mesh)

    @cached_property
    def edges(self) -> tuple[NDArray[np.int64], ...]:
        """The edges (n, 2), vertices by number, of each part of the mesh that shares no vertex with another one."""
        faces, count = self.mesh.faces, len(self.mesh.vertices)
        edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]).astype(np.int64)
        _, part = connected_components(coo_array((np.ones(len(edges)), edges.T), (count, count)), directed=False)
        return tuple(edges[part[edges[:, 0]] == each] for each in np.unique(part[edges[:, 0]]))

    @cached_property
    def radius(self) -> float:
        """Radius of the vertical cylinder about the origin that holds the shape, meters."""
        return float(np.hypot(*self.mesh.vertices[:, :2].T).max())

    @cached_property
    def heights(self) -> tuple[float, float]:
        """Lowest and highest point, meters."""
        return float(self.mesh.vertices[:, 2].min()), float(self.mesh.vertices[:, 2].max())


@dataclass
class Body:
    """A shape in the room.

    Attributes:
        name: of the thing, such as "person 3". pose: (x, y, yaw) in the room frame, meters and radians.
        owner: index of the placement that sensors of segmentation name; `ROOM` for things that are no placement.
    """

    name: str
    shape: BodyShape
    pose: tuple[float, float, float]
    owner: int = ROOM


class BodyRays:
    """A scene and bodies before it.

    Faces of the scene keep their numbers; those of the bodies follow them.

    Args:
        source: the scene. faces: number of its faces. bodies: at their poses.
    """

    def __init__(self, source: RaySource, faces: int, bodies: Sequence[Body]) -> None:
        self._source, self._bodies = source, tuple(bodies)
        counts = [len(body.shape.mesh.faces) for body in self._bodies]
        self._first = faces + np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)

    def cast(
        self, origins: NDArray[np.floating], directions: NDArray[np.floating], max_range: float = 10.0
    ) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
        """Return the distance to the first hit of each ray, and the face that it hits, as `RayScene.cast`."""
        distances, faces = self._source.cast(origins, directions, max_range)
        distances, faces = distances.copy(), faces.copy()
        starts, along = np.asarray(origins, dtype=np.float64), np.asarray(directions, dtype=np.float64)
        within = _within(starts, along, self._bodies, max_range)
        if not within:
            return distances, faces
        pairs = dict(
            zip(
                within,
                _towards(starts, along, [self._bodies[k] for k in within], np.minimum(distances, max_range)),
                strict=True,
            )
        )
        # One cast for all bodies of a shape.
        shapes: dict[int, list[int]] = {}
        for number in within:
            if len(pairs[number]):
                shapes.setdefault(id(self._bodies[number].shape), []).append(number)
        for numbers in shapes.values():
            framed = [_in_frame(starts[pairs[k]], along[pairs[k]], self._bodies[k].pose) for k in numbers]
            there, hit = self._bodies[numbers[0]].shape.rays.cast(
                np.concatenate([start for start, _ in framed]), np.concatenate([ray for _, ray in framed]), max_range
            )
            ends = np.cumsum([len(pairs[k]) for k in numbers])[:-1]
            for k, own, face in zip(numbers, np.split(there, ends), np.split(hit, ends), strict=True):
                closer = (face >= 0) & (own < distances[pairs[k]])
                distances[pairs[k][closer]] = own[closer]
                faces[pairs[k][closer]] = face[closer] + self._first[k]
        return distances, faces

    def color(self, faces: NDArray[np.integer], directions: NDArray[np.floating]) -> NDArray[np.uint8]:
        """Return the color seen along rays, shape (n, 3)."""
        faces = np.asarray(faces)
        of_body = faces >= self._first[0]
        colors = self._source.color(np.where(of_body, -1, faces), directions)
        for body, faces_of, inside in self._shares(faces):
            colors[inside] = body.shape.rays.color(faces_of, np.asarray(directions)[inside], body.pose[2])
        return colors

    def owners(self, faces: NDArray[np.integer]) -> NDArray[np.int64]:
        """Return the index of the placement of each face, `ROOM` for what is none."""
        faces = np.asarray(faces)
        owners = np.full(len(faces), ROOM, dtype=np.int64)
        scene = faces < self._first[0]
        owners[scene] = self._source.owners(faces[scene])
        for body, _, inside in self._shares(faces):
            owners[inside] = body.owner
        return owners

    def _shares(self, faces: NDArray[np.integer]) -> list[tuple[Body, NDArray[Any], NDArray[np.bool_]]]:
        shares = []
        for body, first, last in zip(self._bodies, self._first, self._first[1:], strict=False):
            inside = (faces >= first) & (faces < last)
            if inside.any():
                shares.append((body, faces[inside] - first, inside))
        return shares


def _within(starts: Array, along: Array, bodies: Sequence[Body], max_range: float) -> list[int]:
    """Return the numbers of the bodies that rays may meet: within reach of their origins, and at their level.

    It leaves out only bodies that `_towards` leaves out, too.
    """
    if not len(starts):
        return []
    (x0, y0, z0), (x1, y1, z1) = starts.min(axis=0).tolist(), starts.max(axis=0).tolist()
    level = not along[:, 2].any()
    numbers = []
    for number, body in enumerate(bodies):
        x, y, _ = body.pose
        low, high = body.shape.heights
        reach = max_range + body.shape.radius + 1e-6
        if level and (z1 < low or z0 > high):
            continue
        if math.hypot(max(x0 - x, x - x1, 0.0), max(y0 - y, y - y1, 0.0)) <= reach:
            numbers.append(number)
    return numbers


def _towards(
    starts: Array, along: Array, bodies: Sequence[Body], reach: NDArray[np.floating]
) -> list[NDArray[np.int64]]:
    """Return which rays pass the upright cylinder that holds each body within their reach (m,), meters."""
    if not bodies:
        return []
    x, y, radius, low, high = np.array(
        [(*body.pose[:2], body.shape.radius, *body.shape.heights) for body in bodies], dtype=np.float64
    ).T[:, :, None]
    dx, dy = x - starts[:, 0], y - starts[:, 1]
    flat = np.hypot(along[:, 0], along[:, 1])
    ahead = dx * along[:, 0] + dy * along[:, 1]
    aside = np.abs(dx * along[:, 1] - dy * along[:, 0])
    away = np.hypot(dx, dy)
    passes = (away <= radius) | ((aside <= radius * flat) & (ahead >= 0.0) & (away <= reach + radius))
    level = along[:, 2] == 0.0
    passes &= ~level | ((starts[:, 2] >= low) & (starts[:, 2] <= high))
    return [np.flatnonzero(row) for row in passes]


def _in_frame(starts: Array, along: NDArray[np.floating], pose: tuple[float, float, float]) -> tuple[Array, Array]:
    """Return rays in the frame of a body."""
    x, y, yaw = pose
    cosine, sine = math.cos(yaw), math.sin(yaw)
    turn = np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
    return (starts - (x, y, 0.0)) @ turn, np.asarray(along, dtype=np.float64) @ turn


@registered("condition", "contacts")
class BodyContacts(Condition):
    """Checks contacts after every physics step, instead of every 0.025 s, and names them in `State.touched`.

    Its data is None. The outcome has the names of all that the robot has touched so far.
    """

    name: str = "contacts"

    def draw(self, task: Task, rng: np.random.Generator) -> None:
        """Return None: nothing is drawn."""

    def begin(self, state: State, data: Any, rng: np.random.Generator) -> Touches:  # noqa: ARG002
        """Return the record of an episode."""
        return Touches()


class Touches(Presence):
    """The names of what the robot has touched, in order."""

    visible = False

    def __init__(self) -> None:
        self._names: dict[str, None] = {}

    def step(self, state: State) -> None:
        """Add what the robot touched in a control step."""
        self._names |= dict.fromkeys(state.touched)

    @property
    def outcome(self) -> list[str]:
        """The names so far."""
        return list(self._names)
