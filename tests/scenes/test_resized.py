"""A placement's `size` is its size in every kind of scene."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest
import trimesh

from labgym.assets import Catalog
from labgym.assets.forge import Options, OwnAssets
from labgym.assets.model import Size
from labgym.layouts import Layout, Placement, Room
from labgym.scenes import scene_mesh, to_mjcf, write_glb, write_usd
from labgym.scenes.mjcf import COLLISION_GROUP

SIZES = {"plain": (1.0, 0.5, 0.8), "wide": (1.3, 0.5, 0.8), "tall": (1.0, 0.5, 1.0)}


@pytest.fixture
def layout(tmp_path: Path) -> Layout:
    """Three tables, imported from a mesh of 1.0 x 0.5 x 0.8 m and resized."""
    top, foot = trimesh.creation.box(extents=(1.0, 0.5, 0.1)), trimesh.creation.box(extents=(0.2, 0.2, 0.7))
    top.apply_translation((0.0, 0.0, 0.75))
    foot.apply_translation((0.0, 0.0, 0.35))
    (tmp_path / "side_table.obj").write_text(trimesh.Scene({"top": top, "foot": foot}).export(file_type="obj"))
    own = OwnAssets(tmp_path / "own")
    own.add(tmp_path / "side_table.obj", Options(unit="m", up="Z", name="SideTable"))
    placements = tuple(
        Placement(
            id=name,
            asset="SideTable",
            position=(2.0 + 2.0 * k, 3.0, 0.0),
            size=None if name == "plain" else Size(width=size[0], depth=size[1], height=size[2]),
        )
        for k, (name, size) in enumerate(SIZES.items())
    )
    room = Room(width=8.0, depth=6.0)
    return Layout(id="tables", floor=room.floor, placements=placements, catalog=Catalog.load(own.folder))


def extents(points: np.ndarray) -> list[float]:
    return [float(value) for value in np.ptp(points, axis=0)]


def test_visible_and_solid_parts_have_the_size_of_the_placement(layout: Layout) -> None:
    mesh = scene_mesh(layout)
    model = to_mjcf(layout).compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    for k, (name, size) in enumerate(SIZES.items()):
        assert extents(mesh.vertices[mesh.faces[mesh.owner == k]].reshape(-1, 3)) == pytest.approx(size, abs=1e-5)
        body = model.body(name).id
        solids = np.flatnonzero((model.geom_bodyid == body) & (model.geom_group == COLLISION_GROUP))
        corners = []
        for geom in solids:
            first = model.mesh_vertadr[model.geom_dataid[geom]]
            vertices = model.mesh_vert[first : first + model.mesh_vertnum[model.geom_dataid[geom]]]
            corners.append(vertices @ data.geom_xmat[geom].reshape(3, 3).T + data.geom_xpos[geom])
        assert extents(np.concatenate(corners)) == pytest.approx(size, abs=1e-5)


def test_exported_files_have_the_size_of_the_placement(layout: Layout, tmp_path: Path) -> None:
    scene = trimesh.load(write_glb(layout, tmp_path / "scene.glb"))
    assert isinstance(scene, trimesh.Scene)
    for name, (width, depth, height) in SIZES.items():
        nodes = [node for node in scene.graph.nodes_geometry if node.startswith(f"{name}/")]
        points = []
        for node in nodes:
            pose, geometry = scene.graph[node]
            points.append(trimesh.transform_points(scene.geometry[geometry].vertices, pose))
        assert extents(np.concatenate(points)) == pytest.approx([width, height, depth], abs=1e-5)
    pytest.importorskip("pxr")
    from pxr import Usd, UsdGeom

    stage = Usd.Stage.Open(str(write_usd(layout, tmp_path / "usd")))
    cache = UsdGeom.BBoxCache(Usd.TimeCode.Default(), [UsdGeom.Tokens.default_])
    for name, size in SIZES.items():
        box = cache.ComputeWorldBound(stage.GetPrimAtPath(f"/Laboratory/Placements/{name}")).ComputeAlignedRange()
        assert list(box.GetSize()) == pytest.approx(size, abs=1e-4)
