"""What makes scenes look real: textures in exports and pictures, finishes, contact shadows, cutaways, windows."""

from __future__ import annotations

import math
from pathlib import Path

import furnished_floors as floors
import mujoco
import numpy as np
import pytest
import trimesh

from labgym.assets.textures import texture
from labgym.layouts import Layout, Placement, Room
from labgym.layouts.floor import Finishes, Floor, Opening, Rectangle, Space
from labgym.scenes import render, scene_mesh, to_mjcf, write_glb, write_mjcf, write_usd
from labgym.scenes.building import building_patches
from labgym.scenes.cutaway import hidden_walls
from labgym.scenes.finishes import palette
from labgym.scenes.ghosts import blank_backs
from labgym.scenes.mesh import MATERIAL_NAMES
from labgym.scenes.tracing import trace_view
from labgym.scenes.views import View, picture_view
from labgym.scenes.wall_faces import CUT

DRESSED = Finishes(
    floor="concrete", walls="sky", accent="navy", accent_wall="left", worktop="black", fronts="oak", doors="walnut"
)


def room(finishes: Finishes = DRESSED, **window: object) -> Floor:
    """A room of 6 x 5 m with an exit in its front wall and a window in its back wall."""
    opening = Opening(kind="window", position=3.0, width=2.0, sill=1.0, height=1.2, **window)  # type: ignore[arg-type]
    corners = [(0.0, 0.0), (6.0, 0.0), (6.0, 5.0), (0.0, 5.0)]
    walls = floors.walls_around(corners, {0: (Opening(position=1.5),), 2: (opening,)})
    space = Space(region=(Rectangle(x1=6.0, y1=5.0),), finishes=finishes)
    return Floor(name="room", walls=tuple(walls), spaces=(space,))


def furnished(finishes: Finishes = DRESSED) -> Layout:
    placements = (
        Placement(id="bench", asset="LabBench1800", position=(3.0, 2.5, 0.0), yaw=0.3),
        Placement(id="desk", asset="WritingDesk", position=(1.5, 4.0, 0.0), yaw=math.pi),
    )
    return Layout(id="dressed", floor=room(finishes), placements=placements)


def test_furniture_and_doors_have_the_finishes_of_their_space() -> None:
    mesh = scene_mesh(furnished())
    used = {MATERIAL_NAMES[index] for index in np.unique(mesh.material)}
    assert {"epoxy_black", "front_oak", "edge_gray", "door_walnut", "wall_sky", "accent_navy", "floor_concrete"} <= used
    assert not used & {"epoxy_white", "laminate_white", "edge_blue", "door_leaf"}
    model = to_mjcf(furnished()).compile()
    assert {"epoxy_black", "front_oak"} <= {model.material(k).name for k in range(model.nmat)}


def test_finishes_at_their_defaults_change_no_material_and_no_bytes_of_a_document() -> None:
    assert palette(Finishes()) == {}
    assert set(Finishes().model_dump()) == {"floor", "walls", "accent"}
    assert Finishes.model_validate(DRESSED.model_dump()) == DRESSED


@pytest.mark.parametrize(
    ("side", "axis", "place"), [("opposite", 1, 5.0), ("left", 0, 0.0), ("right", 0, 6.0), ("door", 1, 0.0)]
)
def test_the_accent_is_on_the_wall_that_the_finishes_name(side: str, axis: int, place: float) -> None:
    finishes = DRESSED.model_copy(update={"accent_wall": side})
    patches = [patch for patch in building_patches(room(finishes)) if patch.material == "accent_navy"]
    vertices = np.concatenate([patch.vertices for patch in patches])
    assert vertices[:, axis] == pytest.approx(place, abs=1e-6)


@pytest.mark.parametrize(("kind", "share"), [("none", 0.0), ("roller", 0.5), ("slats", 0.1)])
def test_blinds_cover_part_of_their_window(kind: str, share: float) -> None:
    patches = building_patches(room(DRESSED.model_copy(update={"blinds": kind})))
    blinds = [patch for patch in patches if patch.material == "blind"]
    assert bool(blinds) == (kind != "none")
    if blinds:
        area = sum(trimesh.Trimesh(p.vertices, p.faces, process=False).area for p in blinds) / 2.0
        assert 0.5 * share < area / (2.0 * 1.2) < 1.0
        vertices = np.concatenate([patch.vertices for patch in blinds])
        assert (vertices[:, 2].min() > 1.0, vertices[:, 2].max() <= 2.2 + 1e-9) == (True, True)


def test_columns_are_cut_away_in_views_from_outside_and_stand_in_views_from_inside() -> None:
    layout = floors.furnished("oblique")
    patches = [patch for patch in building_patches(layout.floor) if patch.wall.startswith("column")]
    outside, inside = picture_view(layout, "overview").position, picture_view(layout, "door").position
    hidden = hidden_walls(layout.floor, outside)
    assert max(p.vertices[:, 2].max() for p in patches if p.wall not in hidden) == pytest.approx(CUT)
    assert {p.wall for p in patches if p.wall in hidden} == {"column_0/upper", "column_1/upper"}
    assert hidden_walls(layout.floor, inside) == ()


@pytest.mark.parametrize(
    ("asset", "yaw", "ghost"),
    [("AcidCabinet", 0.0, True), ("AcidCabinet", math.pi, False), ("EmergencyShower", 0.0, False)],
)
def test_a_blank_back_at_a_cut_wall_does_not_hide_what_is_behind(asset: str, yaw: float, ghost: bool) -> None:
    """Yellow doors are seen past what stands between them and the cut front wall, unless it shows its own doors."""
    floor = Room(width=6.0, depth=5.0).floor
    front = Placement(id="front", asset=asset, position=(3.0, 0.4, 0.0), yaw=yaw)
    yellow = Placement(id="yellow", asset="FlammableCabinet", position=(3.0, 1.6, 0.0), yaw=math.pi)
    layout = Layout(id="back", floor=floor, placements=(front, yellow))
    view = View((3.0, -8.0, 3.0), (3.0, 1.2, 0.8), 12.0)
    hidden = hidden_walls(floor, view.position)
    assert blank_backs(scene_mesh(layout, hidden), layout, view.position, hidden) == [0] * ghost
    red, _, blue = trace_view(layout, view, 96, 54)[20:34, 40:56].reshape(-1, 3).mean(axis=0)
    assert (red > blue) == (ghost or asset == "EmergencyShower")


def test_a_surface_is_darker_at_a_contact_than_half_a_meter_away() -> None:
    """The floor next to the long side of a bench, seen from straight above, against the floor 0.5 m away."""
    floor = Room(width=6.0, depth=5.0).floor
    bench = Placement(id="bench", asset="BalanceTable", position=(3.0, 2.5, 0.0))
    layout = Layout(id="contact", floor=floor, placements=(bench,))
    picture = render(layout, 480, 270, "topdown").astype(float).mean(axis=2)
    view = picture_view(layout, "topdown")
    box = layout.box("bench")

    def brightness(gap: float) -> float:
        edges = [(3.0 + dx, 2.5 + side * (box.depth / 2.0 + gap), 0.0) for side in (-1, 1) for dx in (-0.2, 0.0, 0.2)]
        x, y = view.project(np.array(edges)).T
        rows, columns = np.rint(135.0 - y * 135.0).astype(int), np.rint(240.0 + x * 135.0).astype(int)
        return float(picture[rows, columns].mean())

    assert brightness(0.05) < brightness(0.5) - 6.0


def test_views_from_inside_have_a_ceiling_with_lamps_and_a_landscape_behind_windows() -> None:
    layout = Layout(id="empty", floor=room(), placements=())
    picture = render(layout, 320, 180, "door").astype(float)
    ceiling = picture[4:16, 100:220].reshape(-1, 3)
    assert ceiling.max() > 245.0
    assert 90.0 < np.median(ceiling) < 245.0
    view = picture_view(layout, "door")

    def seen(height: float) -> np.ndarray:
        at = view.project(np.array([(x, 5.1, height) for x in np.linspace(2.2, 3.8, 15)]))
        return picture[np.rint(90.0 - at[:, 1] * 90.0).astype(int), np.rint(160.0 + at[:, 0] * 90.0).astype(int)].mean(
            axis=0
        )

    sky, ground = seen(2.1), seen(1.1)
    assert sky[2] > ground[2] + 10.0
    assert sky[2] - sky[1] > ground[2] - ground[1] + 10.0


def test_compiled_scenes_have_textures(tmp_path: Path) -> None:
    plain = Layout(id="plain", floor=Room(width=6.0, depth=5.0).floor, placements=furnished().placements)
    assert list((write_mjcf(plain, tmp_path / "plain").parent / "textures").iterdir())
    path = write_mjcf(furnished(), tmp_path / "dressed")
    written = {file.stem for file in (path.parent / "textures").iterdir()}
    assert {"floor_concrete", "wall_sky", "accent_navy", "front_oak", "epoxy_black"} <= written
    model = mujoco.MjModel.from_xml_path(str(path))
    for name in written:
        image = texture(name)
        assert image is not None
        index = model.texture(name).id
        start, size = model.tex_adr[index], model.tex_height[index] * model.tex_width[index] * 3
        # MuJoCo stores the rows of an image from bottom to top.
        stored = model.tex_data[start : start + size].reshape(image.pixels.shape)
        assert (stored == image.pixels).all() or (stored[::-1] == image.pixels).all()


def test_a_texture_repeats_at_its_period_on_the_floor_of_a_compiled_scene() -> None:
    model = to_mjcf(furnished()).compile()
    mesh = model.mesh("floor/floor_concrete").id
    image = texture("floor_concrete")
    assert image is not None
    faces = slice(model.mesh_faceadr[mesh], model.mesh_faceadr[mesh] + model.mesh_facenum[mesh])
    points = model.mesh_vert[model.mesh_vertadr[mesh] + model.mesh_face[faces]]
    places = model.mesh_texcoord[model.mesh_texcoordadr[mesh] + model.mesh_facetexcoord[faces]]
    apart = np.linalg.norm(points[:, 0] - points[:, 1], axis=1)
    assert np.linalg.norm(places[:, 0] - places[:, 1], axis=1) * image.period == pytest.approx(apart, rel=1e-4)


def test_glb_textures_are_those_of_the_materials_and_span_their_period(tmp_path: Path) -> None:
    scene = trimesh.load(write_glb(furnished(), tmp_path / "scene.glb"))
    assert isinstance(scene, trimesh.Scene)
    textured = set()
    for mesh in scene.geometry.values():
        material = mesh.visual.material
        image = texture(material.name)
        assert (material.baseColorTexture is not None) == (image is not None)
        if image is None:
            continue
        textured.add(material.name)
        assert (np.asarray(material.baseColorTexture.convert("RGB")) == image.pixels).all()
        corners, places = mesh.vertices[mesh.faces], mesh.visual.uv[mesh.faces]
        upright = np.abs(mesh.face_normals).max(axis=1) > 0.999
        apart = np.linalg.norm(corners[:, 0] - corners[:, 1], axis=1)[upright]
        reach = np.linalg.norm(places[:, 0] - places[:, 1], axis=1)[upright] * image.period
        assert reach == pytest.approx(apart, abs=2e-4)
    assert {"floor_concrete", "wall_sky", "front_oak", "epoxy_black"} <= textured
    assert (tmp_path / "scene.glb").stat().st_size < 3_000_000


def test_usd_textures_load_with_the_pixels_of_the_materials(tmp_path: Path) -> None:
    pytest.importorskip("pxr")
    from PIL import Image
    from pxr import Usd, UsdGeom, UsdShade

    from labgym.assets.usd import findings

    path = write_usd(furnished(), tmp_path / "scene")
    stage = Usd.Stage.Open(str(path))
    assert findings(stage) == ()
    textured = set()
    for prim in Usd.PrimRange(stage.GetPseudoRoot(), Usd.TraverseInstanceProxies()):
        if not prim.IsA(UsdShade.Shader) or prim.GetName() != "Image":
            continue
        name = prim.GetParent().GetName()
        image = texture(name)
        assert image is not None
        file = UsdShade.Shader(prim).GetInput("file").Get().resolvedPath
        assert (np.asarray(Image.open(file)) == image.pixels).all()
        textured.add(name)
    assert {"floor_concrete", "wall_sky", "front_oak", "epoxy_black"} <= textured
    floor = next(p for p in stage.Traverse() if p.GetName().startswith("floor_floor_concrete"))
    coordinates = UsdGeom.PrimvarsAPI(floor).GetPrimvar("st")
    assert coordinates.GetInterpolation() == UsdGeom.Tokens.faceVarying
    places = np.array(coordinates.ComputeFlattened())
    period = texture("floor_concrete").period  # type: ignore[union-attr]
    points = np.array(UsdGeom.Mesh(floor).GetPointsAttr().Get())[UsdGeom.Mesh(floor).GetFaceVertexIndicesAttr().Get()]
    assert places * period == pytest.approx(points[:, :2], abs=1e-3)
    plain = Layout(id="plain", floor=Room(width=6.0, depth=5.0).floor, placements=())
    assert list((write_usd(plain, tmp_path / "plain").parent / "textures").iterdir())


@pytest.mark.parametrize("name", ["suite", "ell", "oblique"])
def test_every_piece_of_furniture_is_seen_in_the_overview(name: str) -> None:
    layout = floors.furnished(name)
    view = picture_view(layout, "overview")
    mesh = scene_mesh(layout, hidden_walls(layout.floor, view.position))
    tall, (width, height) = math.tan(math.radians(view.fovy) / 2.0), (384, 216)
    x, y = np.meshgrid((np.arange(width) + 0.5) / width * 2 - 1, (np.arange(height) + 0.5) / height * 2 - 1)
    right, up, backward = view.axes()
    rays = x.ravel()[:, None] * tall * width / height * right + y.ravel()[:, None] * tall * up - backward
    first = mesh.trimesh().ray.intersects_first(np.tile(view.position, (len(rays), 1)), rays)
    pixels = np.bincount(mesh.owner[first[first >= 0]] + 1, minlength=len(layout.placements) + 1)[1:]
    boxes = [layout.box(placement.id) for placement in layout.placements]
    assert all(count >= 3 for count, box in zip(pixels, boxes, strict=True) if box.width * box.depth > 0.2)


def test_the_overview_looks_at_the_fronts_of_hoods() -> None:
    """Three hoods along any wall of a square room show their fronts."""
    floor = room()
    for yaw, along in ((0.0, [(x, 0.4) for x in (2.9, 4.1, 5.3)]), (math.pi, [(x, 4.6) for x in (0.9, 2.4, 3.9)])):
        hoods = tuple(
            Placement(id=f"hood_{k}", asset="FumeHood1200", position=(*place, 0.0), yaw=yaw)
            for k, place in enumerate(along)
        )
        view = picture_view(Layout(id="hoods", floor=floor, placements=hoods), "overview")
        front = np.array([-math.sin(yaw), math.cos(yaw)])
        assert (np.array(view.position[:2]) - np.array(view.target[:2])) @ front > 0.0
