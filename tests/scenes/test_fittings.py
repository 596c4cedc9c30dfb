"""Installations: ducts end at the ceiling, cables in sockets, chains hold cylinders, and all formats show the same."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import mujoco
import numpy as np
import pytest
import trimesh

from labgym.layouts import Layout, Placement
from labgym.layouts.floor import Floor, Opening, Rectangle, Service, Space, Wall
from labgym.scenes import ExactRayScene, to_mjcf, write_glb, write_mjcf, write_usd
from labgym.scenes.fittings import Installation, drawn_asset, installations
from labgym.scenes.fittings.sweep import curve, hose, rounded_path
from labgym.scenes.mesh import asset_mesh, scene_mesh

HALF = math.pi / 2.0
CEILING = 3.2


def room(windows: Sequence[Opening] = ()) -> Floor:
    """One rectangle of 8 x 6 m with service points, and windows in the back wall."""
    walls = (
        Wall(start=(0.0, -0.1), end=(8.0, -0.1), height=CEILING, openings=(Opening(position=1.5),)),
        Wall(start=(0.0, 6.1), end=(8.0, 6.1), height=CEILING, openings=tuple(windows)),
        Wall(start=(-0.1, 0.0), end=(-0.1, 6.0), height=CEILING),
        Wall(start=(8.1, 0.0), end=(8.1, 6.0), height=CEILING),
    )
    space = Space(region=(Rectangle(x1=8.0, y1=6.0),), ceiling=CEILING)
    return Floor(walls=walls, spaces=(space,), services=(Service(kind="exhaust", x=2.0, y=5.9, z=CEILING),))


def furnished(floor: Floor) -> Layout:
    def on(placement_id: str, asset: str, x: float, y: float, z: float, support: str, slot: int = 0, yaw: float = 0.0):
        return Placement(id=placement_id, asset=asset, position=(x, y, z), yaw=yaw, support=support, slot=slot)

    back = math.pi
    placements = (
        Placement(id="hood", asset="FumeHood", position=(2.0, 5.565, 0.0), yaw=back),
        on("stirrer", "MagneticHotplateStirrer", 2.1, 5.6, 0.9, "hood", yaw=back),
        on("beaker", "Beaker", 1.8, 5.5, 0.9, "hood"),
        Placement(id="bench", asset="PreparationBench", position=(4.0, 5.615, 0.0), yaw=back),
        on("balance", "ElectronicScale", 4.1, 5.7, 0.9, "bench", yaw=back),
        Placement(id="station", asset="RotaryEvaporatorStation", position=(6.0, 5.615, 0.0), yaw=back),
        on("rotavap", "RotaryEvaporator", 6.2, 5.7, 0.9, "station", yaw=back),
        on("pump", "VacuumPump", 5.6, 5.7, 0.9, "station", yaw=back),
        Placement(id="island", asset="IslandBench2400", position=(4.0, 2.6, 0.0)),
        on("laptop", "Laptop", 4.3, 3.0, 0.9, "island", yaw=0.0),
        on("rack", "TestTubeRack", 3.4, 2.6, 0.9, "island"),
        Placement(id="cylinder", asset="NitrogenCylinder", position=(7.875, 4.0, 0.0), yaw=HALF),
        Placement(id="cabinet", asset="GlasswareCabinet", position=(0.235, 3.5, 0.0), yaw=-HALF),
        on("stored", "LargeBeaker", 0.235, 3.5, 0.08, "cabinet"),
    )
    return Layout(id="fitted", floor=floor, placements=placements)


@pytest.fixture(scope="module")
def layout() -> Layout:
    return furnished(room())


def only(layout: Layout, kind: str, owner: str) -> Installation:
    (found,) = (each for each in installations(layout) if each.kind == kind and each.owner == owner)
    return found


def vertices(installation: Installation, *materials: str) -> np.ndarray:
    chosen = [p.vertices for p in installation.patches if not materials or p.material in materials]
    return np.concatenate(chosen)


def surface(installation: Installation, material: str) -> trimesh.Trimesh:
    (patch,) = (patch for patch in installation.patches if patch.material == material)
    return trimesh.Trimesh(patch.vertices, patch.faces, process=False)


def distance(mesh: trimesh.Trimesh, points: np.ndarray) -> float:
    """Return the least distance between points (n, 3) and the faces of a mesh, meters."""
    low, high = points.min(axis=0) - 0.05, points.max(axis=0) + 0.05
    near = (mesh.triangles.max(axis=1) > low).all(axis=1) & (mesh.triangles.min(axis=1) < high).all(axis=1)
    triangles = mesh.triangles[near]
    if not len(triangles):
        return math.inf
    pairs = np.repeat(triangles, len(points), axis=0), np.tile(points, (len(triangles), 1))
    return float(np.linalg.norm(trimesh.triangles.closest_point(*pairs) - pairs[1], axis=1).min())


def test_a_duct_joins_the_top_of_its_hood_and_the_ceiling(layout: Layout) -> None:
    duct = vertices(only(layout, "duct", "hood"))
    assert duct[:, 2].min() == pytest.approx(layout.box("hood").z1, abs=1e-6)
    assert duct[:, 2].max() == pytest.approx(CEILING, abs=1e-6)
    stub = asset_mesh(layout.asset("hood"))
    round_stub = stub.vertices[stub.vertices[:, 2] > 2.349]
    middle = layout.box("hood").to_world(*round_stub[:, :2].mean(axis=0))
    assert np.allclose(duct[:, :2].mean(axis=0), middle, atol=0.005)


def test_mujoco_and_the_ray_caster_see_a_duct_at_the_same_distance(layout: Layout) -> None:
    model = to_mjcf(layout).compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    start, along = np.array([2.013, 3.0, 2.71]), np.array([0.0, 1.0, 0.0])
    hit = np.zeros(1, dtype=np.int32)
    groups = np.array([0, 0, 1, 0, 0, 0], dtype=np.uint8)
    by_mujoco = mujoco.mj_ray(model, data, start, along, groups, 1, -1, hit)
    by_rays, _ = ExactRayScene(layout).cast(start[None], along[None])
    assert model.geom(int(hit[0])).name == "hood/duct/duct_steel"
    assert by_rays[0] == pytest.approx(by_mujoco, abs=1e-5)


def test_visible_installations_touch_nothing_in_the_physics(layout: Layout) -> None:
    model = to_mjcf(layout).compile()
    added = {patch.name for each in installations(layout) for patch in each.patches}
    for name in added:
        geom = model.geom(name)
        assert (int(geom.contype[0]), int(geom.conaffinity[0]), int(geom.group[0])) == (0, 0, 2)
    assert len(added) < 60


def test_every_cable_leads_from_its_device_into_a_socket(layout: Layout) -> None:
    cables = {each.owner: each for each in installations(layout) if each.kind == "cable"}
    assert set(cables) == {"stirrer", "balance", "rotavap", "pump", "laptop"}
    plates = [surface(only(layout, kind, owner), "socket_plate") for kind, owner in SOCKETED]
    hood = asset_mesh(layout.asset("hood"))
    posts = trimesh.Trimesh(hood.vertices, hood.faces, process=False)
    turn = trimesh.transformations.rotation_matrix(math.pi, (0.0, 0.0, 1.0))
    plates.append(posts.apply_transform(turn).apply_translation(layout.placement("hood").position))
    for owner, cable in cables.items():
        points = vertices(cable, "cable_black")
        gap = min(distance(plate, points) for plate in plates)
        assert gap < 0.001, owner
        box = layout.box(owner)
        local = np.array([box.to_local(x, y) for x, y in points[:, :2]])
        inside = (np.abs(local) < (box.width / 2.0, box.depth / 2.0)).all(axis=1)
        assert inside.any(), owner


SOCKETED = (("trunking", "bench"), ("trunking", "station"), ("turret", "island"))


def test_no_cable_passes_through_another_object(layout: Layout) -> None:
    for each in installations(layout):
        if each.kind != "cable":
            continue
        support = layout.placement(each.owner).support
        for other in layout.children(support):
            if other.id == each.owner:
                continue
            box = layout.box(other.id)
            points = vertices(each)
            local = np.array([box.to_local(x, y) for x, y in points[:, :2]])
            inside = (np.abs(local) < (box.width / 2.0 - 1e-3, box.depth / 2.0 - 1e-3)).all(axis=1)
            inside &= (points[:, 2] > box.z0) & (points[:, 2] < box.z1)
            assert not inside.any(), (each.owner, other.id)


def test_turrets_and_sinks_stand_clear_of_everything_on_the_island(layout: Layout) -> None:
    fitted = [only(layout, kind, "island") for kind in ("turret", "sink")]
    for installation in fitted:
        points = vertices(installation)
        low, high = points.min(axis=0), points.max(axis=0)
        assert low[2] == pytest.approx(0.9, abs=1e-6)
        for item in layout.children("island"):
            x0, y0, x1, y1 = layout.box(item.id).bounds()
            for patch in installation.patches:
                near = (patch.vertices[:, :2] > (x0, y0)).all(axis=1) & (patch.vertices[:, :2] < (x1, y1)).all(axis=1)
                assert not near.any(), item.id
        x0, y0, x1, y1 = layout.box("island").bounds()
        assert low[0] > x0
        assert low[1] > y0
        assert high[0] < x1
        assert high[1] < y1


def test_trunking_leaves_windows_free() -> None:
    window = Opening(kind="window", position=4.2, width=0.6, sill=0.95, height=1.2)
    points = vertices(only(furnished(room([window])), "trunking", "bench"))
    assert not ((points[:, 0] > 3.9) & (points[:, 0] < 4.5)).any()
    assert points[:, 0].min() < 3.6
    assert points[:, 0].max() <= 4.75


def test_chains_go_round_the_cylinder_and_end_at_the_wall(layout: Layout) -> None:
    restraint = only(layout, "restraint", "cylinder")
    box = layout.box("cylinder")
    points = vertices(restraint)
    assert points[:, 0].max() == pytest.approx(8.0, abs=1e-6)
    local = np.array([box.to_local(x, y) for x, y in points[:, :2]])
    distance = np.hypot(*local.T)
    assert distance.min() > box.width / 2.0 - 0.004
    front = local[local[:, 1] > 0.0]
    assert np.hypot(*front.T).max() < box.width / 2.0 + 0.02
    angles = np.sort(np.arctan2(*front.T[::-1]))
    assert np.diff(angles).max() < 0.3
    assert angles[0] < 0.2
    assert angles[-1] > math.pi - 0.2


def test_the_gas_line_begins_at_the_regulator_and_ends_at_the_ceiling(layout: Layout) -> None:
    points = vertices(only(layout, "gas_line", "cylinder"), "copper")
    assert points[:, 2].max() == pytest.approx(CEILING, abs=1e-6)
    cylinder = asset_mesh(layout.asset("cylinder"))
    mesh = trimesh.Trimesh(cylinder.vertices, cylinder.faces, process=False)
    mesh.apply_transform(trimesh.transformations.rotation_matrix(HALF, (0.0, 0.0, 1.0)))
    mesh.apply_translation(layout.placement("cylinder").position)
    assert distance(mesh, points) < 0.005


def test_the_gas_line_keeps_clear_of_what_hangs_on_the_wall(layout: Layout) -> None:
    sign = Placement(id="sign", asset="SafetySign", position=(7.985, 4.04, 1.6), yaw=HALF, support="wall")
    signed = layout.replace(placements=(*layout.placements, sign))
    box = signed.box("sign")
    points = vertices(only(signed, "gas_line", "cylinder"))
    local = np.array([box.to_local(x, y) for x, y in points[:, :2]])
    covered = (np.abs(local[:, 0]) < box.width / 2.0) & (points[:, 2] > box.z0) & (points[:, 2] < box.z1)
    assert not (covered & (points[:, 0] > 7.93)).any()


def test_hoses_join_evaporator_pump_and_water_valves(layout: Layout) -> None:
    hoses = only(layout, "hose", "rotavap")
    for owner, material in (("rotavap", "hose_red"), ("pump", "hose_red"), ("rotavap", "silicone_blue")):
        local = asset_mesh(layout.asset(owner))
        mesh = trimesh.Trimesh(local.vertices, local.faces, process=False)
        mesh.apply_transform(trimesh.transformations.rotation_matrix(math.pi, (0.0, 0.0, 1.0)))
        mesh.apply_translation(layout.placement(owner).position)
        assert distance(mesh, vertices(hoses, material)) < 0.008, (owner, material)


def test_stored_glassware_is_empty_and_glassware_in_use_is_not(layout: Layout) -> None:
    stored = {part.material for part in asset_mesh(drawn_asset(layout, "stored")).parts}
    used = {part.material for part in asset_mesh(drawn_asset(layout, "beaker")).parts}
    assert "blue_liquid" in used
    assert "blue_liquid" not in stored
    assert "borosilicate" in stored


def test_a_stored_funnel_stands_on_its_rim(layout: Layout) -> None:
    stored = layout.placement("stored").model_copy(update={"id": "funnel", "asset": "GlassFunnel"})
    drawn = asset_mesh(drawn_asset(layout.replace(placements=(*layout.placements, stored)), "funnel"))
    size = drawn.asset.size
    assert drawn.vertices[:, 2].min() == pytest.approx(0.0, abs=1e-6)
    assert drawn.vertices[:, 2].max() == pytest.approx(size.height, abs=1e-6)
    rim = drawn.vertices[drawn.vertices[:, 2] < 0.002]
    assert np.hypot(*rim[:, :2].T).max() == pytest.approx(size.width / 2.0, abs=1e-3)
    mesh = trimesh.Trimesh(drawn.vertices, drawn.faces, process=False)
    assert mesh.volume > 0.0


def test_a_plain_room_has_no_installations_and_shows_its_placements_as_they_are(laboratory: Layout) -> None:
    assert installations(laboratory) == ()
    assert all(drawn_asset(laboratory, p.id) is laboratory.asset(p.id) for p in laboratory.placements)
    assert scene_mesh(laboratory).owner.max() == len(laboratory.placements) - 1


def test_mjcf_glb_and_usd_show_the_same_installations(layout: Layout, tmp_path: Path) -> None:
    from pxr import Usd, UsdGeom

    expected = {patch.name: patch for each in installations(layout) for patch in each.patches}
    glb = trimesh.load(write_glb(layout, tmp_path / "lab.glb"))
    for name, patch in expected.items():
        low, high = glb.geometry[name].bounds
        assert np.allclose((low, high), (patch.vertices.min(axis=0), patch.vertices.max(axis=0)), atol=1e-6)
    model = mujoco.MjModel.from_xml_path(str(write_mjcf(layout, tmp_path / "mjcf")))
    for name, patch in expected.items():
        geom = model.geom(name)
        mesh = model.mesh(int(geom.dataid[0]))
        first, count = int(mesh.vertadr[0]), int(mesh.vertnum[0])
        rotation = np.zeros(9)
        mujoco.mju_quat2Mat(rotation, geom.quat)
        points = model.mesh_vert[first : first + count] @ rotation.reshape(3, 3).T + geom.pos
        assert np.allclose(points.max(axis=0), patch.vertices.max(axis=0), atol=1e-5)
    stage = Usd.Stage.Open(str(write_usd(layout, tmp_path / "usd")))
    cache = UsdGeom.BBoxCache(Usd.TimeCode.Default(), ["default"])
    prims = {
        (prim.GetAttribute("labgym:owner").Get(), prim.GetName()): prim
        for prim in stage.GetPrimAtPath("/Laboratory/Fittings").GetChildren()
        if prim.HasAttribute("labgym:owner")
    }
    assert len(prims) == len(installations(layout))
    for each in installations(layout):
        (prim,) = (prim for (owner, name), prim in prims.items() if owner == each.owner and name.endswith(each.kind))
        extent = cache.ComputeWorldBound(prim).ComputeAlignedRange()
        points = vertices(each)
        assert np.allclose(extent.GetMin(), points.min(axis=0), atol=1e-4)
        assert np.allclose(extent.GetMax(), points.max(axis=0), atol=1e-4)


def test_a_hose_is_a_closed_tube_of_its_diameter() -> None:
    straight = hose("cable_black", 0.02, [(0.0, 0.0, 0.0), (0.0, 0.0, 1.0)])
    corners, faces = straight.triangles  # type: ignore[misc]
    mesh = trimesh.Trimesh(corners + straight.position, faces, process=False)
    assert mesh.is_watertight
    assert mesh.volume > 0.0
    assert np.allclose(np.hypot(*mesh.vertices[:-2, :2].T), 0.01)
    assert np.allclose(mesh.bounds[:, 2], (0.0, 1.0))
    bent = hose("cable_black", 0.01, curve((0.0, 0.0, 0.0), (0.0, 0.0, 0.2), (0.0, 0.0, -0.2), (0.3, 0.1, 0.0)))
    corners, faces = bent.triangles  # type: ignore[misc]
    assert trimesh.Trimesh(corners, faces, process=False).is_watertight


def test_rounded_corners_stay_within_their_radius() -> None:
    path = np.array(rounded_path([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 1.0, 0.0)], 0.1))
    assert tuple(path[0]) == (0.0, 0.0, 0.0)
    assert tuple(path[-1]) == (1.0, 1.0, 0.0)
    assert np.hypot(*(path[:, :2] - (1.0, 0.0)).T).min() > 0.03
    sides = np.minimum(np.abs(path[:, 1]), np.abs(path[:, 0] - 1.0))
    assert sides.max() < 0.1
