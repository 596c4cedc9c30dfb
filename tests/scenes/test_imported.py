"""Imported assets in scenes: compiled models, contacts, pictures and rays."""

from __future__ import annotations

import math

import mujoco
import numpy as np
import pytest
import trimesh

from labgym import scenes
from labgym.assets import Catalog
from labgym.assets.forge import Options, OwnAssets
from labgym.layouts import Layout, Placement, Room

CENTRE = (4.0, 4.0)


@pytest.fixture
def ring_layout(tmp_path, monkeypatch):
    """A room with a standing L of 2 x 2 m outline: legs 0.4 m wide along its left and its back, 1 m high."""
    arm, back = trimesh.creation.box(extents=(0.4, 2.0, 1.0)), trimesh.creation.box(extents=(1.6, 0.4, 1.0))
    arm.apply_translation((-0.8, 0.0, 0.5))
    back.apply_translation((0.2, -0.8, 0.5))
    scene = trimesh.Scene({"arm": arm, "back": back})
    (tmp_path / "angle_bench.obj").write_text(scene.export(file_type="obj"))
    own = OwnAssets(tmp_path / "own")
    own.add(tmp_path / "angle_bench.obj", Options(unit="m", up="Z", name="AngleBench"))
    monkeypatch.setenv("LABGYM_CATALOG", str(own.folder))

    def layout(*others: Placement, yaw: float = 0.0) -> Layout:
        bench = Placement(id="bench", asset="AngleBench", position=(*CENTRE, 0.0), yaw=yaw, support="floor")
        return Layout(id="corner", floor=Room(width=8.0, depth=8.0).floor, placements=(bench, *others))

    return layout


def cast_down(layout: Layout, x: float, y: float, what: str) -> float:
    """Height of what a ray from 2.5 m above a point of the room meets."""
    ray = scenes.RayScene(layout, what)
    distances, _ = ray.cast(np.array([[x, y, 2.5]]), np.array([[0.0, 0.0, -1.0]]), 10.0)
    return 2.5 - float(distances[0])


@pytest.mark.parametrize("what", ["visual", "solid"])
@pytest.mark.parametrize("yaw", [0.0, math.pi / 2.0])
def test_rays_meet_the_mesh_and_pass_where_it_is_hollow(ring_layout, what, yaw):
    layout = ring_layout(yaw=yaw)
    for local, height in [((-0.8, 0.5), 1.0), ((0.5, -0.8), 1.0), ((0.4, 0.4), 0.0)]:
        x = CENTRE[0] + local[0] * math.cos(yaw) - local[1] * math.sin(yaw)
        y = CENTRE[1] + local[0] * math.sin(yaw) + local[1] * math.cos(yaw)
        assert cast_down(layout, x, y, what) == pytest.approx(height, abs=1e-4)


def test_contacts_are_with_the_convex_bodies_and_not_with_the_bounding_box(ring_layout):
    def stool(x: float, y: float) -> Placement:
        position = (CENTRE[0] + x, CENTRE[1] + y, 0.0)
        return Placement(id="stool", asset="LabStool", position=position, yaw=0.0, support="floor")

    assert scenes.contacts(ring_layout(stool(0.4, 0.4))) == ()
    (contact,) = scenes.contacts(ring_layout(stool(-0.8, 0.4)))
    assert {contact.a, contact.b} == {"bench", "stool"}


def test_the_layout_takes_its_bounding_box(ring_layout):
    box = ring_layout().box("bench")
    assert (box.width, box.depth, box.z1) == pytest.approx((2.0, 2.0, 1.0))


def test_written_scenes_are_self_contained(ring_layout, tmp_path, monkeypatch):
    layout = ring_layout()
    path = scenes.write_mjcf(layout, tmp_path / "scene")
    glb = trimesh.load(scenes.write_glb(layout, tmp_path / "scene.glb"))
    monkeypatch.delenv("LABGYM_CATALOG")
    model = mujoco.MjModel.from_xml_path(str(path))
    solids = [k for k in range(model.ngeom) if model.geom(k).name.startswith("bench/solid/")]
    assert len(solids) == 2
    assert any(name.startswith("AngleBench/") for name in glb.geometry)


def test_usd_of_an_imported_asset_has_convex_colliders(ring_layout, tmp_path):
    pytest.importorskip("pxr")
    from pxr import Usd, UsdPhysics

    from labgym.assets.usd import asset_layer, findings

    ring_layout()
    asset_layer(Catalog.load().get("AngleBench")).Export(str(tmp_path / "bench.usda"))
    stage = Usd.Stage.Open(str(tmp_path / "bench.usda"))
    bodies = [UsdPhysics.MeshCollisionAPI(p) for p in stage.Traverse() if p.HasAPI(UsdPhysics.MeshCollisionAPI)]
    assert [body.GetApproximationAttr().Get() for body in bodies] == ["convexHull"] * 2
    assert not findings(stage)


def test_a_picture_shows_the_mesh(ring_layout):
    layout = ring_layout()
    empty = layout.replace(placements=())
    furnished, bare = (scenes.render(room, 96, 64, "topdown").astype(int) for room in (layout, empty))
    changed = np.abs(furnished - bare).sum(axis=2) > 12
    assert 20 < changed.sum() < 0.5 * changed.size
