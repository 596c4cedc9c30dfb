"""Rays to bodies: against the ranges of a box and of a cylinder in closed form, and against trimesh."""

from __future__ import annotations

import math

import numpy as np
import pytest
import trimesh
from laboratories import island_laboratory

from labgym.envs.conditions.bodies import Body, BodyRays, BodyShape, _towards, _within
from labgym.scenes import RayScene
from labgym.scenes.mesh import ROOM, SceneMesh

LAYOUT = island_laboratory()
SCENE = RayScene(LAYOUT, "solid")
FACES = len(SCENE.mesh.faces)


def shape(mesh):
    count = len(mesh.faces)
    return BodyShape(SceneMesh(mesh.vertices, mesh.faces, np.zeros(count, int), np.full(count, ROOM)))


BOX = shape(trimesh.creation.box((0.4, 0.2, 1.0), transform=trimesh.transformations.translation_matrix((0, 0, 0.5))))


def ring(count=180):
    angles = 2.0 * math.pi * np.arange(count) / count
    return np.column_stack([np.cos(angles), np.sin(angles), np.zeros(count)])


def test_a_box_ahead_is_at_its_face():
    rays = BodyRays(SCENE, FACES, [Body("box", BOX, (2.0, 4.0, math.pi / 2.0))])
    distances, faces = rays.cast(np.array([[1.0, 4.0, 0.25]]), np.array([[1.0, 0.0, 0.0]]))
    assert distances[0] == pytest.approx(0.9, abs=1e-6)
    assert faces[0] >= FACES


def test_rays_equal_those_of_one_mesh_with_scene_and_bodies():
    poses = [(2.0, 4.1, 0.3), (3.0, 3.0, 2.0), (1.0, 5.0, -1.0)]
    rays = BodyRays(SCENE, FACES, [Body(f"box {k}", BOX, pose) for k, pose in enumerate(poses)])
    meshes = [trimesh.Trimesh(SCENE.mesh.vertices, SCENE.mesh.faces, process=False)]
    for x, y, yaw in poses:
        turn = trimesh.transformations.rotation_matrix(yaw, (0, 0, 1))
        turn[:2, 3] = x, y
        meshes.append(trimesh.Trimesh(BOX.mesh.vertices, BOX.mesh.faces, process=False).apply_transform(turn))
    joined = trimesh.util.concatenate(meshes)
    other = RayScene(None, mesh=SceneMesh(joined.vertices, joined.faces, np.zeros(len(joined.faces), int), None))
    for x, y, z in ((2.4, 4.9, 0.25), (1.5, 4.5, 0.6), (3.5, 3.4, 0.25)):
        directions = ring() @ trimesh.transformations.rotation_matrix(0.2, (0, 1, 0))[:3, :3].T
        origins = np.broadcast_to((x, y, z), directions.shape)
        mine, faces = rays.cast(origins, directions)
        theirs, others = other.cast(origins, directions)
        np.testing.assert_allclose(mine, theirs, atol=1e-4)
        assert (faces >= FACES).any()
        assert ((faces >= FACES) == (others >= FACES)).mean() > 0.99


def test_colors_and_owners_are_those_of_the_body_and_of_the_scene():
    rays = BodyRays(SCENE, FACES, [Body("box", BOX, (2.0, 4.0, 0.0), owner=5)])
    directions = ring(90)
    origins = np.broadcast_to((1.0, 4.0, 0.25), directions.shape)
    _, faces = rays.cast(origins, directions)
    body = faces >= FACES
    assert 0 < body.sum() < 90
    owners = rays.owners(faces)
    assert (owners[body] == 5).all()
    np.testing.assert_array_equal(owners[~body], SCENE.owners(faces[~body]))
    np.testing.assert_array_equal(rays.color(faces, directions)[~body], SCENE.color(faces[~body], directions[~body]))
    assert not np.array_equal(
        rays.color(faces, directions)[body], SCENE.color(np.full(body.sum(), -1), directions[body])
    )


def test_a_scene_without_bodies_is_the_scene():
    rays = BodyRays(SCENE, FACES, [])
    directions = ring()
    origins = np.broadcast_to((1.0, 4.0, 0.25), directions.shape)
    for mine, theirs in zip(rays.cast(origins, directions), SCENE.cast(origins, directions), strict=True):
        np.testing.assert_array_equal(mine, theirs)


def test_bodies_out_of_reach_and_off_the_level_are_left_out_and_nothing_else():
    rng = np.random.default_rng(3)
    bodies = [Body("box", BOX, tuple(pose)) for pose in rng.uniform((-9.0, -9.0, -3.0), (9.0, 9.0, 3.0), (200, 3))]
    for height, tilt in ((0.25, 0.0), (1.2, 0.0), (1.2, 0.3)):
        along = ring() @ trimesh.transformations.rotation_matrix(tilt, (0, 1, 0))[:3, :3].T
        starts = np.broadcast_to((0.5, -0.3, height), along.shape)
        passed = _towards(starts, along, bodies, np.full(len(along), 5.0))
        within = set(_within(starts, along, bodies, 5.0))
        assert {number for number, rays in enumerate(passed) if len(rays)} <= within
        assert len(within) < len(bodies)
