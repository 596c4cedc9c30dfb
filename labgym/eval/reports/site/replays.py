"""Replays in 3D: what stands on an episode's floor and what moves there, as scripts that the page loads when needed.

The page also works from a file, where it cannot fetch data: each script calls `labgymReplay(name, data)`. Shapes are
separate scripts, which episodes share. Lengths are in meters in the room frame, angles in radians.
"""

from __future__ import annotations

import base64
import hashlib
import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from labgym.assets import Asset
from labgym.assets.articulation import State as AssetState
from labgym.assets.shapes import MATERIALS
from labgym.documents import write_bytes
from labgym.envs.conditions.beaker import beaker_shape
from labgym.envs.conditions.figures import figure
from labgym.envs.conditions.payload import beaker_of, leg_payload_of
from labgym.envs.robot_mesh import robot_mesh
from labgym.envs.tasks import Task
from labgym.eval.reports.report import PACKAGE
from labgym.layouts import Layout
from labgym.layouts.floor import Finishes
from labgym.scenes.building import building_patches, floor_patches
from labgym.scenes.finishes import finishes_at
from labgym.scenes.fittings import drawn_asset, installations
from labgym.scenes.folders import whole_folder
from labgym.scenes.mesh import MATERIAL_NAMES, SceneMesh, asset_mesh, joined
from labgym.scenes.patches import join

FOLDER = "replays"
"""Folder of the scripts next to the page."""
EPISODES, SHAPES = "episodes", "shapes"
THREE = ("three.min.js", "three.LICENSE.txt")
"""The renderer and its license."""
STEPS = 65_535
"""Number of steps between the least and the greatest coordinate of a shape along an axis."""

Faces = tuple[NDArray[np.float64], NDArray[np.int64], NDArray[np.int64]]
"""Vertices (n, 3), faces (m, 3) and the material of each face (m,)."""


@dataclass(frozen=True, eq=False)
class Replay:
    """An episode to replay.

    Attributes:
        task: after its conditions. moves: what each policy's drive moved, by the policy's number on the page.
    """

    task: Task
    moves: Mapping[int, Mapping[str, Any]] = field(default_factory=dict)


class Shapes:
    """Writes shapes, each once.

    Args:
        folder: of the scripts.
    """

    def __init__(self, folder: Path) -> None:
        self._folder, self._names, self._written = folder, dict[Any, str](), set[str]()

    def name(self, key: object, part: Callable[[], Faces]) -> str:
        """Return the name of the script of a shape, which equal keys share."""
        if key not in self._names:
            content = _json(shape_data(*part()))
            name = self._names[key] = f"{SHAPES}/{hashlib.sha256(content).hexdigest()[:16]}"
            if name not in self._written:
                self._written.add(name)
                write_bytes(self._folder / f"{name}.js", _script(name, content))
        return self._names[key]

    def placed(self, layout: Layout, chosen: Callable[[str], bool]) -> list[list[Any]]:
        """Return the placements of some ids, each [shape, x, y, z, yaw, id]."""
        placed = []
        for placement in layout.placements:
            if chosen(placement.id):
                finishes = finishes_at(layout.floor, *placement.position[:2])
                look = drawn_asset(layout, placement.id), finishes, placement.state
                name = self.name(look, partial(_asset, *look))
                placed.append([name, *_rounded((*placement.position, placement.yaw)), placement.id])
        return placed


def write_replays(replays: Sequence[Replay], folder: Path) -> Path:
    """Write the scripts of replays and the renderer into a folder, which they replace, and return it.

    Raises:
        LabgymError: the folder exists and holds something else.
    """
    with whole_folder(folder, (EPISODES, SHAPES, *THREE), "folder of replays") as fresh:
        shapes = Shapes(fresh)
        for number, replay in enumerate(replays):
            name = f"{EPISODES}/{number}"
            data = {**scene_data(replay.task, shapes), "moves": replay.moves}
            write_bytes(fresh / f"{name}.js", _script(name, _json(data)))
        for name in THREE:
            write_bytes(fresh / name, files(PACKAGE).joinpath("templates", name).read_bytes())
    return folder


def scene_data(task: Task, shapes: Shapes) -> dict[str, Any]:
    """Return what stands on an episode's floor.

    Args:
        task: after its conditions. shapes: receives the shapes.

    Returns:
        `building`, a shape; `placed`, each [shape, x, y, z, yaw, id]; `things` that can be pushed, likewise, where
        they are at the start; `people` and `robot`, shapes; `payload`, None or the `shape` of the beaker on
        the robot and the `legs` of a shift in which it is there, None for all.
    """
    fixed, names = task.fixed, frozenset(task.pushable)
    people = task.conditions.get("people", {}).get("people", ())
    return {
        "building": shapes.name(fixed.hash, lambda: _building(fixed)),
        "placed": shapes.placed(task.layout, lambda name: name not in names),
        "things": shapes.placed(task.layout, lambda name: name in names),
        "people": [shapes.name(("person", number), partial(_person, number)) for number in range(len(people))],
        "robot": shapes.name("robot", lambda: _faces(robot_mesh())),
        "payload": _payload(task.conditions.get("payload"), shapes),
    }


def shape_data(vertices: NDArray[np.float64], faces: NDArray[np.int64], material: NDArray[np.int64]) -> dict[str, Any]:
    """Return the triangles of a shape by their look.

    Returns:
        `low` and `step`, (3,) meters; `parts`, each [color, opacity, vertices, faces], with the vertices as whole
        steps above `low` and the faces as indices of the part's vertices, both little-endian in base64: uint16, and
        uint32 for faces if there are more than 65,536 vertices.
    """
    used = vertices[np.unique(faces)]
    low, high = used.min(axis=0), used.max(axis=0)
    step = np.maximum(high - low, 1e-6) / STEPS
    looks = [_look(index) for index in range(len(MATERIAL_NAMES))]
    parts = []
    for look in dict.fromkeys(looks[index] for index in np.unique(material).tolist()):
        own = faces[np.isin(material, [index for index, each in enumerate(looks) if each == look])]
        corners, indices = np.unique(own, return_inverse=True)
        places = np.rint((vertices[corners] - low) / step).astype("<u2")
        kind = "<u2" if len(corners) <= STEPS + 1 else "<u4"
        parts.append([*look, _base64(places), _base64(indices.reshape(-1, 3).astype(kind))])
    return {"low": _rounded(low), "step": [float(f"{value:.9g}") for value in step], "parts": parts}


def _building(layout: Layout) -> Faces:
    """Return floor, walls, and the installations of what stands there."""
    added = (patch for installation in installations(layout) for patch in installation.patches)
    patches = [*floor_patches(layout.floor), *building_patches(layout.floor), *added]
    vertices, faces = join([(patch.vertices, patch.faces) for patch in patches])
    materials = [np.full(len(patch.faces), MATERIAL_NAMES.index(patch.material)) for patch in patches]
    return vertices, faces, np.concatenate(materials)


def _asset(asset: Asset, finishes: Finishes, state: AssetState) -> Faces:
    local = asset_mesh(asset, finishes, state)
    return local.vertices, local.faces, local.material


def _person(number: int) -> Faces:
    """Return a standing person at the origin, who faces along +x."""
    meshes = []
    for body in figure(number, 0.0, 0.0, 0.0, 0.0, moving=False):
        mesh = body.shape.mesh
        meshes.append(replace(mesh, vertices=mesh.vertices + np.array([*body.pose[:2], 0.0])))
    return _faces(joined(*meshes))


def _payload(data: Any, shapes: Shapes) -> dict[str, Any] | None:
    if data is None:
        return None
    beaker, legs = leg_payload_of(data) if "legs" in data else (beaker_of(data), None)
    return {"shape": shapes.name(beaker, lambda: _faces(beaker_shape(beaker).mesh)), "legs": legs}


def _faces(mesh: SceneMesh) -> Faces:
    return mesh.vertices, mesh.faces, mesh.material


def _look(material: int) -> tuple[str, float]:
    """Return color and opacity of a material."""
    *color, opacity = MATERIALS[MATERIAL_NAMES[material]].rgba
    return "#" + "".join(f"{round(255.0 * channel):02x}" for channel in color), round(opacity, 2)


def _rounded(values: Iterable[float]) -> list[float]:
    return [round(float(value), 4) for value in values]


def _base64(values: NDArray[Any]) -> str:
    return base64.b64encode(values.tobytes()).decode()


def _json(data: Any) -> bytes:
    return json.dumps(data, separators=(",", ":"), allow_nan=False).encode()


def _script(name: str, content: bytes) -> bytes:
    return b"labgymReplay(" + _json(name) + b"," + content + b");\n"
