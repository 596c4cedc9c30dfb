"""Rays hit what MuJoCo's ray caster hits, and walls at the distance that geometry gives."""

from __future__ import annotations

import math

import mujoco
import numpy as np
import pytest

from labgym.errors import OptionError
from labgym.layouts import Layout, Room
from labgym.scenes import RayScene, scene_mesh, to_mjcf
from labgym.scenes.mesh import MATERIAL_NAMES, ROOM
from labgym.scenes.mjcf import COLLISION_GROUP, VISUAL_GROUP
from labgym.scenes.rays import SKY

EMPTY = Layout(id="empty", floor=Room(width=6.0, depth=5.0, doors=()).floor, placements=())


def fan(count: int, height: float, centre: tuple[float, float]) -> tuple[np.ndarray, np.ndarray]:
    angles = np.linspace(-math.pi, math.pi, count, endpoint=False)
    directions = np.stack([np.cos(angles), np.sin(angles), np.zeros(count)], axis=1)
    return np.tile([centre[0], centre[1], height], (count, 1)), directions


def by_mujoco(layout: Layout, origins: np.ndarray, directions: np.ndarray, group: int) -> tuple[np.ndarray, list[str]]:
    """Distances (10 m where nothing is hit) and body names by mj_ray."""
    model = to_mjcf(layout).compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    groups = np.array([index == group for index in range(6)], dtype=np.uint8)
    distances, names, hit = [], [], np.zeros(1, dtype=np.int32)
    for origin, direction in zip(origins, directions, strict=True):
        distance = mujoco.mj_ray(model, data, origin, direction, groups, 1, -1, hit)
        distances.append(10.0 if distance < 0.0 else min(distance, 10.0))
        names.append("" if distance < 0.0 else model.body(model.geom_bodyid[hit[0]]).name)
    return np.array(distances), names


def scattered(seed: int, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Rays from free places at the height of a robot's sensors."""
    rng = np.random.default_rng(seed)
    origins = np.column_stack(
        [rng.uniform(1.0, 5.0, count), rng.uniform(2.9, 3.6, count), rng.uniform(0.2, 1.4, count)]
    )
    directions = rng.normal(size=(count, 3)) * [1.0, 1.0, 0.4]
    return origins, directions / np.linalg.norm(directions, axis=1, keepdims=True)


@pytest.mark.parametrize("geometry", ["visual", "solid"])
@pytest.mark.parametrize("height", [0.25, 0.5, 2.0])
def test_in_an_empty_room_rays_end_at_the_walls(geometry: str, height: float) -> None:
    x, y = 2.0, 1.5
    origins, directions = fan(360, height, (x, y))
    distances, faces = RayScene(EMPTY, geometry).cast(origins, directions)  # type: ignore[arg-type]
    with np.errstate(divide="ignore"):
        to_x = np.where(directions[:, 0] > 0.0, 6.0 - x, x) / np.abs(directions[:, 0])
        to_y = np.where(directions[:, 1] > 0.0, 5.0 - y, y) / np.abs(directions[:, 1])
    assert distances == pytest.approx(np.minimum(to_x, to_y), abs=1e-4)
    assert (faces >= 0).all()


def test_rays_end_at_the_floor_or_at_their_range() -> None:
    scene = RayScene(EMPTY)
    origins = np.array([[3.0, 2.0, 1.2], [3.0, 2.0, 1.2], [3.0, 2.0, 1.2]])
    directions = np.array([[0.0, 0.0, -1.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
    distances, faces = scene.cast(origins, directions, max_range=2.5)
    assert distances == pytest.approx([1.2, 2.5, 2.5], abs=1e-6)
    assert faces[0] >= 0
    assert (faces[1:] == -1).all()
    assert distances.dtype == np.float32
    assert faces.dtype == np.int32


def test_rays_hit_the_solids_that_mujoco_hits(laboratory: Layout) -> None:
    origins, directions = scattered(3, 400)
    scene = RayScene(laboratory, "solid")
    distances, faces = scene.cast(origins, directions)
    expected, names = by_mujoco(laboratory, origins, directions, COLLISION_GROUP)
    assert distances == pytest.approx(expected, abs=2e-4)
    owners = scene.mesh.owner[faces]
    for owner, name, face in zip(owners, names, faces, strict=True):
        if face >= 0:
            assert name == ("world" if owner == ROOM else laboratory.placements[owner].id)


def test_rays_hit_the_visible_parts_that_mujoco_hits(laboratory: Layout) -> None:
    """Round parts have sides here and are round there: a few rays pass their rims differently."""
    origins, directions = scattered(4, 600)
    distances, _ = RayScene(laboratory).cast(origins, directions)
    expected, _ = by_mujoco(laboratory, origins, directions, VISUAL_GROUP)
    assert np.mean(np.abs(distances - expected) < 3e-3) > 0.99


def test_colors_are_bytes_of_the_face_or_the_sky(laboratory: Layout) -> None:
    scene = RayScene(laboratory)
    yellow = np.flatnonzero(scene.mesh.material == MATERIAL_NAMES.index("safety_yellow"))[:50]
    towards = np.tile([0.0, 0.0, -1.0], (len(yellow) + 1, 1))
    colors = scene.color(np.append(yellow, -1), towards)
    assert colors.dtype == np.uint8
    assert (colors[:-1, 0] > colors[:-1, 2] + 60).all()
    assert (colors[-1] == SKY).all()


def test_the_scene_mesh_accounts_for_every_placement(laboratory: Layout) -> None:
    mesh = scene_mesh(laboratory)
    assert set(mesh.owner) == {ROOM, *range(len(laboratory.placements))}
    for index, placement in enumerate(laboratory.placements):
        vertices = mesh.vertices[mesh.faces[mesh.owner == index]].reshape(-1, 3)
        box = laboratory.box(placement.id)
        local = np.array([box.to_local(x, y) for x, y, _ in vertices])
        assert (np.abs(local) <= np.array([box.width, box.depth]) / 2.0 + 1e-6).all()
        assert vertices[:, 2].min() >= box.z0 - 1e-9
        assert vertices[:, 2].max() <= box.z1 + 1e-9


def test_the_scene_mesh_as_trimesh_keeps_owners_and_colors(laboratory: Layout) -> None:
    mesh = scene_mesh(laboratory)
    copy = mesh.trimesh()
    assert len(copy.faces) == len(mesh.faces)
    assert (copy.face_attributes["owner"] == mesh.owner).all()
    assert np.abs(copy.visual.face_colors / 255.0 - mesh.rgba).max() < 0.003


def test_hidden_walls_hide_the_placements_mounted_on_them(laboratory: Layout) -> None:
    clock = [placement.id for placement in laboratory.placements].index("clock")
    assert clock not in scene_mesh(laboratory, hidden=("wall_3/upper",)).owner
    assert clock in scene_mesh(laboratory, hidden=("wall_2/upper",)).owner
    assert len(scene_mesh(laboratory, hidden=("wall_2/upper",)).faces) < len(scene_mesh(laboratory).faces)


def test_an_unknown_geometry_is_refused() -> None:
    with pytest.raises(OptionError, match="'visual' or 'solid'"):
        RayScene(EMPTY, "solids")  # type: ignore[arg-type]
