"""The scene of fast pictures has the surfaces of the layout, in few geoms."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest
from floor_shapes import two_rooms

from labgym.assets.shapes import MATERIALS
from labgym.layouts import Layout
from labgym.scenes import MissingRendererError, RayScene, make_renderer, to_mjcf
from labgym.scenes.batches import batched_spec, batches
from labgym.scenes.mesh import ROOM
from labgym.scenes.mjcf import VISUAL_GROUP, looks_of


@pytest.fixture(scope="module", params=["plain room", "two rooms with textures"])
def layout(request: pytest.FixtureRequest, laboratory: Layout) -> Layout:
    if request.param == "plain room":
        return laboratory
    return Layout(id="textured", floor=two_rooms(), placements=laboratory.placements)


@pytest.fixture(scope="module")
def rays(layout: Layout) -> RayScene:
    return RayScene(layout, "visual")


@pytest.fixture(scope="module")
def model(layout: Layout, rays: RayScene) -> mujoco.MjModel:
    return batched_spec(layout, rays.mesh).compile()


def test_mujocos_rays_hit_the_batches_where_embrees_hit_the_layout(
    layout: Layout, rays: RayScene, model: mujoco.MjModel
) -> None:
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    rng = np.random.default_rng(0)
    middle = np.array([2.5, 2.5, 1.1])
    directions = rng.normal(size=(400, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    expected, faces = rays.cast(np.broadcast_to(middle, directions.shape), directions, 50.0)
    groups = np.array([group == VISUAL_GROUP for group in range(6)], dtype=np.uint8)
    geom = np.zeros(1, dtype=np.int32)
    distances = [mujoco.mj_ray(model, data, middle, ray, groups, 1, -1, geom, None) for ray in directions]
    furniture = (faces >= 0) & (rays.mesh.owner[faces] != ROOM)
    assert furniture.sum() > 40
    # A ray along the edge of a face may hit it in one of the two only.
    assert np.mean(np.abs(np.array(distances) - expected)[furniture] < 1e-4) > 0.99


def test_every_face_of_the_furniture_is_in_one_batch(layout: Layout, rays: RayScene) -> None:
    corners = np.concatenate([batch.vertices[batch.faces] for batch in batches(layout, rays.mesh)])
    furniture = rays.mesh.vertices[rays.mesh.faces[rays.mesh.owner != ROOM]]
    assert corners.shape == furniture.shape
    np.testing.assert_array_equal(np.sort(corners.ravel()), np.sort(furniture.ravel()))


def test_batches_are_far_fewer_than_the_geoms_of_the_scene(layout: Layout, model: mujoco.MjModel) -> None:
    scene = to_mjcf(layout).compile()
    visible = [int(np.sum(each.geom_group == VISUAL_GROUP)) for each in (model, scene)]
    assert visible[0] < 0.8 * visible[1]


def test_a_picture_of_batches_looks_like_one_of_the_scene(laboratory: Layout) -> None:
    pictures = []
    for spec in (batched_spec(laboratory, RayScene(laboratory, "visual").mesh), to_mjcf(laboratory)):
        model = spec.compile()
        # Textures lie otherwise on merged faces: their mean colors are compared.
        model.mat_rgba[:] = [MATERIALS[looks_of(model.material(k).name)].rgba for k in range(model.nmat)]
        model.mat_texid[:] = -1
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
        camera = mujoco.MjvCamera()
        camera.lookat, camera.distance, camera.azimuth, camera.elevation = (3.0, 3.0, 0.6), 3.5, 110.0, -38.0
        try:
            renderer = make_renderer(model, 320, 240, "fast")
        except MissingRendererError as error:
            pytest.skip(str(error))
        with renderer:
            renderer.update_scene(data, camera)
            pictures.append(renderer.render().astype(float))
    assert np.mean(np.abs(pictures[0] - pictures[1]) > 12.0) < 0.03
    assert pictures[0].std() > 20.0
