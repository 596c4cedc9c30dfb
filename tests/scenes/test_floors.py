"""Scenes of floors of any shape: solids and rays against shapely, walls without gaps, cameras, and exports."""

from __future__ import annotations

import math
from itertools import pairwise
from pathlib import Path

import furnished_floors as floors
import mujoco
import numpy as np
import pytest
import shapely

from labgym.layouts import Layout, Room
from labgym.layouts.floor import Finishes, Floor, KeepOut, Opening, Rectangle, Space, Wall
from labgym.layouts.floor.solids import leaf
from labgym.layouts.floors import FAMILIES, draw_floor
from labgym.scenes import MissingRendererError, RayScene, make_renderer, scene_mesh, to_mjcf, views, write_usd
from labgym.scenes.building import building_patches, building_solids, leaves_of
from labgym.scenes.cutaway import across, hidden_walls
from labgym.scenes.mesh import ROOM
from labgym.scenes.mjcf import COLLISION_GROUP
from labgym.scenes.views import picture_view
from labgym.scenes.wall_faces import CUT

NAMES = tuple(floors.FLOORS)
HEIGHTS = (0.25, 1.3, 2.5)
"""Of the lidar, of windows and leaves, and of lintels, meters."""


@pytest.fixture(scope="module", params=[*NAMES, *(f"family {name}" for name in FAMILIES)])
def layout(request: pytest.FixtureRequest) -> Layout:
    """A floor by hand with a little furniture, or an empty floor of each family."""
    if request.param in NAMES:
        return floors.furnished(request.param)
    family = request.param.removeprefix("family ")
    return Layout(id=family, floor=draw_floor(family, seed=104).floor, placements=())


def bare(layout: Layout) -> Layout:
    return layout.replace(placements=())


def outline(floor: Floor, height: float) -> shapely.Geometry:
    """What is solid at a height."""
    return shapely.union_all([shapely.Polygon(box.corners()) for box in floor.solids if box.z0 < height < box.z1])


def free_points(floor: Floor, count: int, seed: int, gap: float = 0.01) -> np.ndarray:
    """Points of the spaces that are in no solid."""
    rng = np.random.default_rng(seed)
    x0, y0, x1, y1 = floor.bounds
    points = rng.uniform((x0, y0), (x1, y1), (40 * count, 2))
    points = points[floor.inside(points)]
    solid = shapely.union_all([outline(floor, height) for height in (0.2, *HEIGHTS)])
    return points[shapely.distance(solid, shapely.points(points)) > gap][:count]


def horizontal(count: int, seed: int) -> np.ndarray:
    angles = np.random.default_rng(seed).uniform(-math.pi, math.pi, count)
    return np.column_stack([np.cos(angles), np.sin(angles), np.zeros(count)])


@pytest.mark.parametrize("height", HEIGHTS)
def test_rays_end_where_shapely_finds_the_nearest_solid(layout: Layout, height: float) -> None:
    points = free_points(layout.floor, 150, 1)
    directions = horizontal(len(points), 2)
    origins = np.column_stack([points, np.full(len(points), height)])
    distances, _ = RayScene(bare(layout), "solid").cast(origins, directions, 60.0)
    solid = outline(layout.floor, height)
    rays = shapely.linestrings(np.stack([points, points + 60.0 * directions[:, :2]], axis=1))
    expected = shapely.distance(shapely.points(points), shapely.intersection(rays, solid))
    assert distances == pytest.approx(expected, abs=2e-4)


def test_rays_of_the_suite_end_at_distances_that_the_plan_gives() -> None:
    """From the corridor: to an exit, through the open door, through the passage to a window, to the glazed part."""
    scene = RayScene(bare(floors.furnished("suite")), "solid")
    origins = np.array(
        [(7.0, 4.9, 1.2), (1.9, 4.9, 1.2), (2.5, 4.9, 1.2), (5.0, 4.9, 1.2), (5.0, 4.9, 0.5), (2.5, 4.9, 2.5)]
    )
    directions = np.array([(1.0, 0, 0), (0, -1.0, 0), (0, 1.0, 0), (0, -1.0, 0), (0, -1.0, 0), (0, 1.0, 0)])
    distances, _ = scene.cast(origins, directions, 60.0)
    # Panes are 3 cm thick in the middle of walls; the wall below a pane and the lintel begin at the wall's face.
    assert distances == pytest.approx([7.0, 4.9, 5.2 - 0.015, 1.0 - 0.015, 0.9, 0.9], abs=1e-4)


def test_the_robot_can_neither_leave_nor_see_out_of_a_floor(layout: Layout) -> None:
    points = free_points(layout.floor, 300, 3)
    for geometry in ("solid", "visual"):
        for height in (0.05, 0.25, 1.3, min(wall.height for wall in layout.floor.walls) - 0.1):
            origins = np.column_stack([points, np.full(len(points), height)])
            _, faces = RayScene(bare(layout), geometry).cast(origins, horizontal(len(points), 4), 60.0)  # type: ignore[arg-type]
            assert (faces >= 0).all()


def test_visible_walls_are_where_the_solid_ones_are(layout: Layout) -> None:
    """Frames stand out by 12 mm and handles by 5 cm; the leaf of an exit is recessed by 6 cm."""
    points = free_points(layout.floor, 600, 5, gap=0.06)
    origins = np.column_stack([points, np.full(len(points), 0.4)])
    directions = horizontal(len(points), 6)
    seen, _ = RayScene(bare(layout)).cast(origins, directions, 60.0)
    solid, _ = RayScene(bare(layout), "solid").cast(origins, directions, 60.0)
    assert np.mean(np.abs(seen - solid) < 2e-3) > 0.85
    assert np.mean(np.abs(seen - solid) < 0.1) > 0.98


def test_there_is_a_floor_under_every_point_and_none_outside(layout: Layout) -> None:
    floor = layout.floor
    x0, y0, x1, y1 = floor.bounds
    points = np.random.default_rng(7).uniform((x0 - 0.5, y0 - 0.5), (x1 + 0.5, y1 + 0.5), (2000, 2))
    walls = shapely.union_all([shapely.Polygon(box.corners()) for box in floor.solids]).buffer(1e-6)
    (hull,) = [shapely.Polygon(part.exterior) for part in shapely.get_parts(walls) if part.area > 1.0]
    clear = ~shapely.contains(shapely.buffer(walls, 0.02), shapely.points(points))
    points = points[clear]
    inside = shapely.contains(hull, shapely.points(points))
    origins = np.column_stack([points, np.full(len(points), 0.01)])
    _, faces = RayScene(bare(layout)).cast(origins, np.tile([0.0, 0.0, -1.0], (len(points), 1)), 1.0)
    # Seen from 1 cm above the floor, doorways hold sills of frames and the undersides of leaves only.
    assert ((faces >= 0) == inside).all()
    assert floor.inside(points).sum() > 300
    assert (inside >= floor.inside(points)).all()


def test_contact_geoms_are_the_solids_of_the_floor(layout: Layout) -> None:
    model = to_mjcf(bare(layout), visible=False).compile()
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    geoms = [k for k in range(model.ngeom) if model.geom_type[k] == mujoco.mjtGeom.mjGEOM_BOX]
    rows = [(*data.geom_xpos[k], *(2.0 * model.geom_size[k])) for k in geoms]
    boxes = [(b.x, b.y, (b.z0 + b.z1) / 2.0, b.width, b.depth, b.z1 - b.z0) for b in layout.floor.solids]
    assert np.array(rows) == pytest.approx(np.array(boxes), abs=1e-9)
    assert (model.geom_group[geoms] == COLLISION_GROUP).all()


def test_mujoco_measures_the_distance_of_a_disc_from_the_walls_that_shapely_does(layout: Layout) -> None:
    spec = to_mjcf(bare(layout), visible=False)
    body = spec.worldbody.add_body(name="disc", mocap=True)
    body.add_geom(type=mujoco.mjtGeom.mjGEOM_CYLINDER, name="disc", size=[0.27, 0.5, 0.0])
    model = spec.compile()
    data = mujoco.MjData(model)
    disc = model.geom("disc").id
    walls = [k for k in range(model.ngeom) if model.geom_type[k] == mujoco.mjtGeom.mjGEOM_BOX]
    points = free_points(layout.floor, 60, 8, gap=0.3)
    expected = shapely.distance(outline(layout.floor, 0.5), shapely.points(points)) - 0.27
    for point, distance in zip(points, expected, strict=True):
        data.mocap_pos[0] = [*point, 0.55]
        mujoco.mj_kinematics(model, data)
        gaps = [mujoco.mj_geomDistance(model, data, disc, wall, 20.0, np.zeros(6)) for wall in walls]
        assert min(gaps) == pytest.approx(distance, abs=2e-3)


def test_a_room_is_as_solid_whichever_way_it_is_compiled() -> None:
    """The same rectangular room, once as such and once, with a keep-out, as a floor of any shape."""
    room = Room(width=6.0, depth=5.0).floor
    area = KeepOut(id="area", x=3.0, y=2.0, width=1.0, depth=1.0)
    general = room.model_copy(update={"keep_outs": (area,)})
    general = Floor(**{name: getattr(general, name) for name in Floor.model_fields})
    assert (room.as_room is None, general.as_room is None) == (False, True)
    rng = np.random.default_rng(9)
    origins = rng.uniform((0.1, 0.1, 0.05), (5.9, 4.9, 2.9), (500, 3))
    directions = rng.normal(size=(500, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    for geometry, least in (("solid", 0.999), ("visual", 0.9)):
        one, other = (
            RayScene(Layout(id="room", floor=floor, placements=()), geometry).cast(origins, directions, 20.0)[0]  # type: ignore[arg-type]
            for floor in (room, general)
        )
        # Visible parts differ at the door, and where the room has high windows.
        assert np.mean(np.abs(one - other) < 1e-4) > least


def test_finishes_color_the_spaces_and_the_accent_is_opposite_the_main_door() -> None:
    patches = building_patches(floors.suite())
    navy, teal = (
        np.concatenate([patch.vertices for patch in patches if patch.material == name])
        for name in ("accent_navy", "wall_accent")
    )
    assert navy[:, 1] == pytest.approx(0.0, abs=1e-9)
    assert (navy[:, 0].min(), navy[:, 0].max()) == pytest.approx((8.1, 14.0), abs=0.11)
    assert {round(y, 6) for y in teal[:, 1]} == {0.0, 10.0}
    materials = {patch.material for patch in patches}
    assert {
        "wall_paint",
        "wall_cream",
        "wall_sky",
        "wall_gray",
        "accent_ochre",
        "window_glass",
        "door_leaf",
    } <= materials


def test_a_rectangular_room_shows_its_finishes() -> None:
    floor = Room(width=6.0, depth=5.0).floor
    plain = {patch.material for patch in building_patches(floor)}
    finishes = Finishes(floor="concrete", walls="sage", accent="brick")
    spaces = (floor.spaces[0].model_copy(update={"finishes": finishes}),)
    painted = Floor(name=floor.name, walls=floor.walls, spaces=spaces)
    colored = {patch.material for patch in building_patches(painted)}
    assert {"wall_paint", "wall_accent"} <= plain
    assert {"wall_sage", "accent_brick"} <= colored
    assert not colored & {"wall_paint", "wall_accent"}
    model = to_mjcf(Layout(id="painted", floor=painted, placements=())).compile()
    assert model.material(model.geom("floor").matid[0]).name == "floor_concrete/unwrapped"


def void(layout: Layout, width: int = 128, height: int = 72) -> float:
    """Share of the overview in which nothing is seen."""
    view = picture_view(layout, "overview")
    mesh = scene_mesh(layout, hidden_walls(layout.floor, view.position)).trimesh()
    x, y = np.meshgrid((np.arange(width) + 0.5) / width * 2 - 1, (np.arange(height) + 0.5) / height * 2 - 1)
    tall = math.tan(math.radians(view.fovy) / 2.0)
    right, up, backward = view.axes()
    rays = x.ravel()[:, None] * tall * width / height * right + y.ravel()[:, None] * tall * up - backward
    hit = mesh.ray.intersects_any(np.tile(view.position, (len(rays), 1)), rays)
    return 1.0 - float(np.mean(hit))


def test_the_overview_holds_the_floor_and_is_not_half_empty(layout: Layout) -> None:
    assert void(layout) < 0.5
    floor, view = layout.floor, views(layout)["overview"]
    corners = np.concatenate([box.corners() for space in floor.spaces for box in space.boxes])
    places = view.project(np.column_stack([corners, np.zeros(len(corners))]))
    assert (np.abs(places) < (16.0 / 9.0, 1.0)).all()


@pytest.mark.parametrize("size", [(8.0, 8.0), (7.0, 13.0), (14.0, 5.0)])
def test_the_picture_of_a_rectangular_room_is_not_half_empty(size: tuple[float, float]) -> None:
    width, depth = size
    assert void(Layout(id="room", floor=Room(width=width, depth=depth).floor, placements=())) < 0.5


def test_the_overview_shows_the_floor_of_every_space() -> None:
    """More than half of the free floor of each room of a suite is in sight; with all walls less of most rooms is."""
    layout = bare(floors.furnished("suite"))
    floor, view = layout.floor, views(layout)["overview"]
    mesh = scene_mesh(layout, hidden_walls(floor, view.position)).trimesh()
    whole = scene_mesh(layout).trimesh()
    for space in floor.spaces:
        points = free_points(floor, 400, 10)
        points = points[space.contains(points)][:40]
        ground = np.column_stack([points, np.full(len(points), 0.02)])
        sight = np.array(view.position) - ground
        assert np.mean(mesh.ray.intersects_any(ground, sight)) < 0.5, space.id
        assert np.mean(whole.ray.intersects_any(ground, sight)) > 0.5 or space.id in ("analysis", "synthesis")


def test_no_wall_is_hidden_from_a_camera_inside(layout: Layout) -> None:
    for name, view in views(layout).items():
        if name not in ("overview",):
            assert hidden_walls(layout.floor, view.position) == ()


def test_what_hangs_on_a_hidden_wall_is_hidden_with_it() -> None:
    layout = floors.furnished("suite")
    clock = layout.placements[0].model_copy(
        update={"id": "clock", "asset": "Clock", "position": (10.0, 5.77, 2.0), "yaw": math.pi, "support": "wall"}
    )
    layout = layout.replace(placements=(*layout.placements, clock))
    index = len(layout.placements) - 1
    hidden = hidden_walls(layout.floor, views(layout)["overview"].position)
    assert index in scene_mesh(layout).owner
    assert index not in scene_mesh(layout, hidden).owner
    upper = [patch for patch in building_patches(layout.floor) if patch.wall in hidden]
    assert min(patch.vertices[:, 2].min() for patch in upper) == pytest.approx(CUT)


def test_lines_of_sight_are_crossed_by_the_walls_between() -> None:
    floor = floors.suite()
    assert across(floor, (2.0, 1.0, 2.0), np.array([(2.0, 3.0)])) == ()
    assert across(floor, (2.0, 8.0, 2.0), np.array([(4.0, 1.0)])) == ("wall_4/upper", "wall_5/upper")


def test_every_space_and_every_exit_has_a_camera_and_workplaces_are_seen_from_their_space(layout: Layout) -> None:
    floor, cameras = layout.floor, views(layout)
    exits = sum(doorway.exit for doorway in floor.doorways)
    assert sum(name == "door" or name.startswith("door_") for name in cameras) == exits
    for space in floor.spaces:
        x, y, z = cameras[f"space/{space.id}"].position
        assert floor.space_at(x, y) == space
        assert z < space.ceiling
    for placement in layout.placements:
        if placement.id in cameras:
            (x, y, _), (tx, ty, _) = cameras[placement.id].position, cameras[placement.id].target
            assert floor.space_at(x, y) == floor.space_at(tx, ty) is not None


def test_open_leaves_are_drawn_where_they_stop_the_robot() -> None:
    floor = floors.suite()
    mesh = scene_mesh(Layout(id="suite", floor=floor, placements=()))
    leaves = [part.box for part in floor.parts if part.kind == "leaf"]
    assert len(leaves) == 4
    for patch in building_patches(floor):
        if patch.material == "door_leaf":
            middles = patch.vertices[patch.faces].mean(axis=1)
            within = [
                np.all(
                    np.abs([box.to_local(x, y) for x, y, _ in middles]) <= (box.width / 2 + 1e-6, box.depth / 2 + 1e-6),
                    axis=1,
                )
                for box in leaves
            ]
            exits = np.isclose(middles[:, 0], 0.0, atol=0.2) | np.isclose(middles[:, 0], 14.0, atol=0.2)
            assert (np.any(within, axis=0) | exits).all()
    assert (mesh.owner == ROOM).all()


def test_a_scene_of_more_geoms_than_mujoco_draws_by_default_is_drawn_whole() -> None:
    spec = mujoco.MjSpec()
    count = 21_000
    for k in range(count):
        spec.worldbody.add_geom(
            type=mujoco.mjtGeom.mjGEOM_BOX, size=[0.01, 0.01, 0.01], pos=[0.03 * (k % 150), 0.03 * (k // 150), 0.0]
        )
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    try:
        renderer = make_renderer(model, 64, 64, "fast")
    except MissingRendererError as error:
        pytest.skip(str(error))
    with renderer:
        renderer.update_scene(data)
        assert renderer.scene.ngeom == count


@pytest.mark.cases(1)
@pytest.mark.parametrize("name", ["suite", "oblique"])
def test_the_stage_of_a_floor_is_clean_and_has_its_solids(name: str, tmp_path: Path) -> None:
    layout = floors.furnished(name)
    pytest.importorskip("pxr")
    from pxr import Usd

    from labgym.assets.usd import findings

    path = write_usd(layout, tmp_path / "scene")
    stage = Usd.Stage.Open(str(path))
    assert findings(stage) == ()
    assert stage.GetCompositionErrors() == []
    colliders = stage.GetPrimAtPath("/Laboratory/Room/Colliders").GetChildren()
    assert len(colliders) == len(layout.floor.solids) + 1
    validator = pytest.importorskip("omni.asset_validator")
    issues = validator.ValidationEngine().validate(str(path)).issues()
    assert [f"{issue.rule.__name__}: {issue.message}" for issue in issues] == []


@pytest.mark.parametrize("state", ["open", "closed"])
@pytest.mark.parametrize("swing", ["left", "right"])
@pytest.mark.parametrize("hinge", ["start", "end"])
def test_leaves_turn_about_their_hinges(hinge: str, swing: str, state: str) -> None:
    door = Opening(position=2.0, width=0.9, hinge=hinge, swing=swing, state=state, angle=1.9)
    walls = (
        *(
            Wall(start=a, end=b, thickness=0.2)
            for a, b in pairwise(((8.3, 5.1), (-0.1, 5.1), (-0.1, -0.1), (8.3, -0.1)))
        ),
        Wall(start=(8.3, -0.1), end=(8.3, 5.1), thickness=0.2, openings=(Opening(position=2.0),)),
        Wall(start=(4.1, 0.0), end=(4.1, 5.0), thickness=0.2, openings=(door,)),
    )
    spaces = (
        Space(id="west", region=(Rectangle(x0=0.0, y0=0.0, x1=4.0, y1=5.0),)),
        Space(id="east", region=(Rectangle(x0=4.2, y0=0.0, x1=8.2, y1=5.0),)),
    )
    floor = Floor(walls=walls, spaces=spaces)
    (one,) = leaves_of(floor)
    assert building_solids(floor)[one.name] == one.box
    assert one.name not in building_solids(floor, leaves=False)
    assert (one.angle, one.travel) == (1.9 if state == "open" else 0.0, 1.9)
    # Turned back about its hinge, the leaf closes the opening; the wall runs along y.
    (x, y), back = one.box.to_world(*one.hinge), -one.turn * one.angle
    dx, dy = one.box.x - x, one.box.y - y
    closed = x + math.cos(back) * dx - math.sin(back) * dy, y + math.sin(back) * dx + math.cos(back) * dy
    shut = leaf(walls[-1], door, 0.0)
    assert closed == pytest.approx((shut.x, shut.y))
    assert y == pytest.approx(2.0 - (1.0 if hinge == "start" else -1.0) * shut.width / 2.0)
    right = door.model_copy(update={"angle": 1.2, "state": "open"})
    (narrow,) = leaves_of(
        Floor(walls=(*walls[:-1], walls[-1].model_copy(update={"openings": (right,)})), spaces=spaces)
    )
    assert (narrow.angle, narrow.travel) == (1.2, math.pi / 2.0)


def test_solids_have_the_names_of_their_parts(layout: Layout) -> None:
    floor = layout.floor
    solids = building_solids(floor)
    assert list(solids.values()) == [part.box for part in floor.parts]
    for name, part in zip(solids, floor.parts, strict=True):
        assert name.startswith(
            f"column_{part.source}_" if part.kind == "column" else f"wall_{part.source}/{part.kind}_"
        )
    leaves = {name for name, part in zip(solids, floor.parts, strict=True) if part.kind == "leaf"}
    assert set(building_solids(floor, leaves=False)) == set(solids) - leaves
    assert {one.name for one in leaves_of(floor)} == leaves
