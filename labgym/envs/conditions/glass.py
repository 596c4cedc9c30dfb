"""Condition "glass": panes that are on no map, and glass and polished steel as sensors see them.

A depth camera that looks at glass reads what is behind it, nothing, or the glass; a lidar sees glass only near its
normal. At which places is drawn once: for each surface, patch of 0.2 m and viewing cell of 0.25 m. The shares are
assumptions: that both happen is reported (arXiv 2604.18336, doi 10.3390/s22197378), how often is not.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from labgym.counts import is_real, is_whole
from labgym.envs.checks import count, positive
from labgym.envs.conditions.panes import FRAMED, FRAMELESS, GlassPane, panes_of, plain, with_panes
from labgym.envs.parts.protocols import Condition, Presence
from labgym.envs.parts.registry import registered
from labgym.envs.tasks import Task
from labgym.envs.world import World, world_of
from labgym.errors import OptionError
from labgym.navigation import PLANNING_RADIUS, ShortestPaths
from labgym.scenes import RayScene
from labgym.scenes.exact_rays import ExactRayScene
from labgym.scenes.mesh import MATERIAL_NAMES, ROOM, SceneMesh
from labgym.scenes.rays import Geometry, RaySource

if TYPE_CHECKING:
    from labgym.envs.state import State

PATCH, CELL = 0.2, 0.25
"""Sides of a patch of a surface and of a cell of viewing places, meters."""
NORMAL = math.cos(math.radians(10.0))
"""Cosine of the angle to the normal up to which a lidar sees glass."""
GLASS = ("window_glass", "sash_glass")
STEEL = ("stainless",)
NARROWEST = 0.9
"""Least width of a pane that is drawn, meters."""
DRAWS = 60
"""Number of places that are tried for a pane."""
LONGER = 1.05
"""Least ratio of the shortest path with a pane to that without it."""

Array = NDArray[np.float64]


@registered("condition", "glass")
class Glass(Condition):
    """Panes across the route, and the errors of depth cameras and lidars at glass and polished steel.

    Attributes:
        panes: number of panes that are drawn. framed: whether they have a frame.
        void, true: shares of the places on glass at which a depth camera reads 0 and the glass; at the others it reads
            the scene behind it. steel: share of the places on polished steel at which it reads 0.
        width: greatest width of the panes that are drawn, meters.
    """

    panes: int = 1
    framed: bool = True
    void: float = 0.4
    true: float = 0.1
    steel: float = 0.3
    width: float = 2.6
    name: str = "glass"

    def __post_init__(self) -> None:
        if self.panes != 0:
            count(self, "panes")
        positive(self, "void", "true", "steel", zero=True)
        positive(self, "width")
        if self.width < NARROWEST:
            raise OptionError(f"Glass: width is {self.width:g} m, expected at least {NARROWEST:g} m")
        if self.void + self.true > 1.0 or self.steel > 1.0:
            raise OptionError(f"Glass: void + true is {self.void + self.true:g} and steel {self.steel:g}, at most 1")
        GlassPane(0.0, 0.0, 0.0, self.width, framed=self.framed)

    def draw(self, task: Task, rng: np.random.Generator) -> dict[str, Any]:
        """Return panes, each across the shortest route past those before it, and the seed of the outcomes."""
        panes: list[GlassPane] = []
        for _ in range(self.panes):
            pane = self._across(with_panes(task.layout, panes), task, rng)
            if pane is None:
                break
            panes.append(pane)
        shares = {"void": self.void, "true": self.true, "steel": self.steel}
        return {"panes": plain(panes), "seed": int(rng.integers(2**53)), **shares}

    def prepare(self, task: Task, data: Any) -> Task:
        """Return the task with the panes in its layout; the old map has none."""
        panes = panes_of(_checked(data)["panes"])
        if not panes:
            return task
        return replace(task, layout=with_panes(task.layout, panes), old_map=task.old_map or task.layout)

    def begin(self, state: State, data: Any, rng: np.random.Generator) -> Presence:  # noqa: ARG002
        """Return the glass of an episode."""
        return GlassPresence(state.fixtures, _checked(data))

    def _across(self, layout: Any, task: Task, rng: np.random.Generator) -> GlassPane | None:
        """Return a pane across the shortest route, round which a longer way leads; None if no place was found."""
        paths = ShortestPaths(layout, PLANNING_RADIUS)
        route = paths.path(task.pair.start, task.pair.goal)
        if route is None or len(route.points) < 2:
            return None
        for _ in range(DRAWS):
            pane = self._at(route.points, float(rng.uniform(0.15, 0.85)), float(rng.uniform(NARROWEST, self.width)))
            shift, tilt = rng.uniform(-0.4, 0.4), rng.uniform(-0.3, 0.3)
            pane = replace(
                pane,
                x=round(pane.x + float(shift) * math.cos(pane.yaw), 3),
                y=round(pane.y + float(shift) * math.sin(pane.yaw), 3),
                yaw=round(pane.yaw + float(tilt), 4),
            )
            if not _stands_free(world_of(layout), pane):
                continue
            longer = ShortestPaths(with_panes(layout, [pane]), PLANNING_RADIUS).path(task.pair.start, task.pair.goal)
            if longer is not None and longer.length >= LONGER * route.length:
                return pane
        return None

    def _at(self, points: Array, share: float, width: float) -> GlassPane:
        """Return the pane of a width, meters, that stands across a route at a share of its length."""
        steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
        along = np.concatenate([[0.0], np.cumsum(steps)])
        place = share * along[-1]
        leg = min(int(np.searchsorted(along, place, side="right")) - 1, len(steps) - 1)
        (x0, y0), (x1, y1) = points[leg], points[leg + 1]
        part = (place - along[leg]) / max(float(steps[leg]), 1e-9)
        across = math.atan2(y1 - y0, x1 - x0) + math.pi / 2.0
        x, y = x0 + part * (x1 - x0), y0 + part * (y1 - y0)
        return GlassPane(float(x), float(y), across, round(width, 2), framed=self.framed)


class GlassPresence(Presence):
    """Glass and polished steel in an episode."""

    planar = True

    def __init__(self, world: World, data: Mapping[str, Any]) -> None:
        self._data = data
        self._panes = frozenset(
            index for index, one in enumerate(world.layout.placements) if one.asset in (FRAMED, FRAMELESS)
        )
        self._world = world

    def rays(self, source: RaySource, geometry: Geometry, state: State) -> RaySource:
        """Return the scene as a lidar ("solid") or a depth camera ("visual") sees it."""
        mesh = self._world.mesh(geometry)
        glass, steel, behind = self._world.derived(
            ("glass", geometry, state.exact), lambda _: _parts(mesh, geometry, self._panes, state.exact)
        )
        return GlassRays(source, behind, mesh, glass, steel, geometry, self._data)


class GlassRays:
    """A scene in which glass and polished steel deceive sensors.

    Args:
        source: the scene. behind: the scene without glass. mesh: of the scene.
        glass, steel: which faces of the mesh are of these materials, (m,).
        geometry: "solid" for a lidar, "visual" for a camera. data: shares and seed.
    """

    def __init__(
        self,
        source: RaySource,
        behind: RayScene,
        mesh: SceneMesh,
        glass: NDArray[np.bool_],
        steel: NDArray[np.bool_],
        geometry: Geometry,
        data: Mapping[str, Any],
    ) -> None:
        self._source, self._behind, self._mesh = source, behind, mesh
        self._glass, self._steel, self._lidar, self._data = glass, steel, geometry == "solid", data

    def cast(
        self, origins: NDArray[np.floating], directions: NDArray[np.floating], max_range: float = 10.0
    ) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
        """Return the distances that the sensor reads, 0 for nothing read, and the faces that are there."""
        distances, faces = self._source.cast(origins, directions, max_range)
        of_scene = (faces >= 0) & (faces < len(self._glass))
        index = np.where(of_scene, faces, 0)
        glass = np.flatnonzero(of_scene & self._glass[index])
        steel = np.flatnonzero(of_scene & self._steel[index]) if not self._lidar else np.zeros(0, dtype=np.int64)
        if not len(glass) and not len(steel):
            return distances, faces
        distances = distances.copy()
        starts, along = np.asarray(origins, dtype=np.float64), np.asarray(directions, dtype=np.float64)
        if len(steel):
            share = self._shares(faces[steel], starts[steel], along[steel], distances[steel])
            distances[steel[share < self._data["steel"]]] = 0.0
        if len(glass):
            if self._lidar:
                near_normal = np.abs(self._cosines(faces[glass], along[glass])) >= NORMAL
                through, void = glass[~near_normal], glass[:0]
            else:
                share = self._shares(faces[glass], starts[glass], along[glass], distances[glass])
                void = glass[share < self._data["void"]]
                through = glass[share >= self._data["void"] + self._data["true"]]
            if len(through):
                distances[through], _ = self._behind.cast(starts[through], along[through], max_range)
            distances[void] = 0.0
        return distances, faces

    def color(self, faces: NDArray[np.integer], directions: NDArray[np.floating]) -> NDArray[np.uint8]:
        """Return the color seen along rays, shape (n, 3)."""
        return self._source.color(faces, directions)

    def owners(self, faces: NDArray[np.integer]) -> NDArray[np.int64]:
        """Return the index of the placement of each face."""
        return self._source.owners(faces)

    def _cosines(self, faces: NDArray[np.integer], along: Array) -> Array:
        """Return the cosine between rays and the normals of faces, (n,)."""
        a, b, c = np.moveaxis(self._mesh.vertices[self._mesh.faces[faces]], 1, 0)
        normal = np.cross(b - a, c - a)
        cosines: Array = np.einsum("ij,ij->i", normal, along) / np.maximum(np.linalg.norm(normal, axis=1), 1e-12)
        return cosines

    def _shares(self, faces: NDArray[np.integer], starts: Array, along: Array, distances: NDArray[np.float32]) -> Array:
        """Return a number in [0, 1) for each ray, equal for one surface, patch and viewing cell."""
        patches = np.floor((starts + distances[:, None] * along) / PATCH).astype(np.int64)
        cells = np.floor(starts[:, :2] / CELL).astype(np.int64)
        owners = np.asarray(self._mesh.owner[faces], dtype=np.int64)
        return shares(np.column_stack([owners, patches, cells]), int(self._data["seed"]))


def shares(keys: NDArray[np.int64], seed: int) -> Array:
    """Return a number in [0, 1) for each row of whole numbers (n, k), by the mixing function of SplitMix64."""
    state = np.full(len(keys), seed, dtype=np.uint64)
    with np.errstate(over="ignore"):
        for column in keys.T:
            state = _mixed(state ^ column.astype(np.uint64)) + np.uint64(0x9E3779B97F4A7C15)
    return (_mixed(state) >> np.uint64(11)).astype(np.float64) / 2.0**53


def _mixed(state: NDArray[np.uint64]) -> NDArray[np.uint64]:
    state = (state ^ (state >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    state = (state ^ (state >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    mixed: NDArray[np.uint64] = state ^ (state >> np.uint64(31))
    return mixed


def _parts(
    mesh: SceneMesh, geometry: Geometry, panes: frozenset[int], exact: bool
) -> tuple[NDArray[np.bool_], NDArray[np.bool_], RayScene]:
    """Return which faces are glass and which polished steel, and the scene without glass."""
    of_pane = np.isin(mesh.owner, sorted(panes)) & (mesh.owner != ROOM)
    if geometry == "solid":
        glass, steel = of_pane, np.zeros(len(mesh.faces), dtype=bool)
    else:
        glass = np.isin(mesh.material, [MATERIAL_NAMES.index(name) for name in GLASS])
        steel = np.isin(mesh.material, [MATERIAL_NAMES.index(name) for name in STEEL])
    left = ~glass
    bare = SceneMesh(mesh.vertices, mesh.faces[left], mesh.material[left], mesh.owner[left])
    return glass, steel, (ExactRayScene if exact else RayScene)(None, geometry, bare)


def _stands_free(world: World, pane: GlassPane) -> bool:
    """Whether no solid is near the middle line of a pane; a pane may end at a wall or a bench."""
    half = pane.width / 2.0
    offsets = np.linspace(-half, half, max(3, math.ceil(pane.width / 0.05)))
    points = np.column_stack([pane.x + offsets * math.cos(pane.yaw), pane.y + offsets * math.sin(pane.yaw)])
    return bool((world.clearances(points, 0.03) > 0.0).all())


def _checked(data: Any) -> dict[str, Any]:
    """Return data of the condition.

    Raises:
        OptionError: it is something else.
    """
    expected = {"panes", "seed", "void", "true", "steel"}
    if not isinstance(data, Mapping) or set(data) != expected:
        raise OptionError(f"glass is {str(data)[:60]!r}, expected a mapping of {', '.join(sorted(expected))}")
    seed = data["seed"]
    if not is_whole(seed) or not 0 <= seed < 2**63:
        raise OptionError(f"glass: seed is {str(seed)[:40]!r}, expected a whole number")
    for name in ("void", "true", "steel"):
        share = data[name]
        if not is_real(share) or not 0.0 <= share <= 1.0:
            raise OptionError(f"glass: {name} is {str(share)[:40]!r}, expected a number in [0, 1]")
    return {**data, "panes": panes_of(data["panes"])}
