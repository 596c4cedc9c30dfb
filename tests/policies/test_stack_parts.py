from __future__ import annotations

import math

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from laboratories import island_laboratory
from map_drives import Drift, with_people

from labgym.envs.robot import ROBOT
from labgym.envs.sensors import Lidar
from labgym.geometry import OrientedBox, compose, to_local, to_world, wrap_angle
from labgym.policies.distance_field import FARTHEST_BOX_M, DistanceField
from labgym.policies.dwa import lidar_points
from labgym.policies.stack.controller import Controller, MotionLimits, limited, rollouts, visible
from labgym.policies.stack.costmap import Costmap
from labgym.policies.stack.docking import StationEstimate, moved
from labgym.policies.stack.localization import LidarMounting, Localizer
from labgym.policies.stack.old_map import OldMap, ray_lengths
from labgym.policies.stack.panes import CONTINUATION_M, SeenPanes
from labgym.policies.stack.people import (
    PeopleTracker,
    Track,
    TrackedPerson,
    Waiting,
    approach_cost,
    clusters,
    too_late,
    way_cost,
)
from labgym.policies.stack.planner import PlannedPath, planned
from labgym.scenes.rays import RayScene

BOXES = (OrientedBox(1.0, 1.0, 0.8, 0.4, 0.5), OrientedBox(3.0, 2.0, 1.0, 1.0), OrientedBox(1.5, 3.0, 2.0, 0.2, -0.3))
ROOM = (
    OrientedBox(2.0, -0.05, 4.2, 0.1),
    OrientedBox(2.0, 3.05, 4.2, 0.1),
    OrientedBox(-0.05, 1.5, 0.1, 3.2),
    OrientedBox(4.05, 1.5, 0.1, 3.2),
)


def room_field() -> DistanceField:
    return DistanceField.of_boxes(ROOM, (-1.0, -1.0, 5.0, 4.0))


def scan_of(boxes, pose, sigma: float = 0.0, seed: int = 0) -> np.ndarray:
    """Return the scan (180,) of a lidar among boxes, by shapely."""
    angles = pose[2] - math.pi + 2.0 * math.pi / 180 * np.arange(180)
    shape = shapely.union_all([shapely.Polygon(box.corners()).boundary for box in boxes])
    here = shapely.Point(pose[:2])
    ends = np.array(pose[:2]) + 10.0 * np.column_stack([np.cos(angles), np.sin(angles)])
    hits = shapely.intersection(shapely.linestrings([[pose[:2], end] for end in ends]), shape)
    ranges = np.array([10.0 if hit.is_empty else here.distance(hit) for hit in hits])
    return ranges + sigma * np.random.default_rng(seed).standard_normal(180) * (ranges < 10.0)


@given(x=st.floats(0.0, 4.0), y=st.floats(0.0, 4.0))
def test_the_field_is_the_distance_to_the_boxes(x, y):
    field = DistanceField.of_boxes(BOXES, (-1.0, -1.0, 5.0, 5.0), resolution=0.02)
    true = min(shapely.Polygon(box.corners()).distance(shapely.Point(x, y)) for box in BOXES)
    value = float(field.at(np.array([[x, y]]))[0])
    if true > 0.0:
        assert value == pytest.approx(min(true, FARTHEST_BOX_M), abs=0.012)
    else:
        assert value < 0.012


def test_the_slope_of_the_field_leads_away_from_a_wall():
    distance, slope = room_field().with_gradient(np.array([[0.31, 1.5], [2.0, 0.42], [3.77, 1.0]]))
    assert distance == pytest.approx([0.31, 0.42, 0.23])
    assert slope == pytest.approx(np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0]]), abs=1e-9)


@settings(max_examples=40, deadline=None)
@given(x=st.floats(-1.0, 5.0), y=st.floats(-1.0, 5.0), angle=st.floats(-3.1, 3.1))
def test_rays_meet_boxes_where_lines_cross_their_outlines(x, y, angle):
    direction = np.array([[math.cos(angle), math.sin(angle)]])
    lengths = ray_lengths(np.array([[x, y]]), direction, BOXES)[0]
    line = shapely.LineString([(x, y), (x + 20.0 * direction[0, 0], y + 20.0 * direction[0, 1])])
    for box, length in zip(BOXES, lengths, strict=True):
        shape = shapely.Polygon(box.corners())
        crossing = line.intersection(shape)
        if crossing.is_empty:
            assert length == math.inf or shape.distance(line) < 1e-9
        elif crossing.length > 1e-6:
            assert length == pytest.approx(shapely.Point(x, y).distance(crossing), abs=1e-6)


@pytest.mark.parametrize("offset", [(0.04, -0.03, 0.03), (-0.05, 0.05, -0.04), (0.0, 0.06, 0.05)])
def test_scan_matching_finds_the_pose_that_the_walls_of_a_room_determine(offset):
    true = (1.3, 1.1, 0.4)
    localizer = Localizer(room_field(), (true[0] + offset[0], true[1] + offset[1], true[2] + offset[2]))
    localizer.covariance = np.diag([1.0, 1.0, 1.0])
    for _ in range(3):
        localizer.match(lidar_points(scan_of(ROOM, true)))
    assert localizer.pose == pytest.approx(true, abs=1e-3)


def test_without_drift_scans_change_nothing():
    localizer = Localizer(room_field(), (1.0, 1.0, 0.0), drift=0.0)
    localizer.move((0.5, 0.1, 0.2))
    localizer.match(lidar_points(scan_of(ROOM, (1.4, 1.1, 0.2))))
    assert localizer.pose == pytest.approx((1.5, 1.1, 0.2))


@pytest.fixture(scope="module")
def laboratory():
    layout = island_laboratory()
    return layout, OldMap.of(layout), RayScene(layout, "solid")


def circuit(turns: int = 3):
    """Yield poses of a robot that drives around the island."""
    corners = [(1.6, 1.0), (6.4, 1.0), (6.4, 4.2), (1.6, 4.2)]
    for _ in range(turns):
        for k, (x, y) in enumerate(corners):
            nx, ny = corners[(k + 1) % 4]
            yaw, length = math.atan2(ny - y, nx - x), math.dist((x, y), (nx, ny))
            for step in np.linspace(0.0, 1.0, math.ceil(length / 0.1), endpoint=False):
                yield x + step * (nx - x), y + step * (ny - y), yaw


def test_the_pose_is_known_to_centimeters_while_the_odometry_drifts(laboratory):
    _, old, rays = laboratory
    lidar, noise = Lidar(), np.random.default_rng(1)
    poses = list(circuit())
    localizer, odometry = Localizer(old.seen, poses[0]), Drift(poses[0], 1.0, 4)
    errors, dead = [], []
    for pose in poses:
        reckoned = odometry.moved(pose)
        localizer.move(reckoned)
        ranges = np.asarray(lidar.scan(rays, pose), dtype=np.float64)
        ranges = np.where(ranges < 10.0, ranges + 0.03 * noise.standard_normal(180), ranges)
        localizer.match(lidar_points(np.clip(ranges, 0.0, 10.0)))
        errors.append((math.dist(localizer.pose[:2], pose[:2]), abs(wrap_angle(localizer.pose[2] - pose[2]))))
        dead.append(math.dist(compose(poses[0], reckoned)[:2], pose[:2]))
    worst = np.max(errors, axis=0)
    assert worst[0] < 0.04
    assert worst[1] < math.radians(1.5)
    assert max(dead) > 5.0 * worst[0]


def costmap(clearing: bool = True) -> Costmap:
    return Costmap(room_field(), room_field(), clearing=clearing)


def observe(layers: Costmap, boxes, pose, ignored: bool = False) -> np.ndarray:
    ranges = scan_of((*ROOM, *boxes), pose)
    points = to_world(lidar_points(ranges), pose)
    return layers.observe(pose, ranges, points, np.full(len(points), ignored))


CARTON = OrientedBox(2.6, 1.5, 0.3, 0.3)
HERE = (1.0, 1.5, 0.0)


def test_the_lidar_marks_what_the_map_lacks_and_nothing_else():
    layers = costmap()
    assert len(observe(layers, (), HERE)) == 0
    fresh = observe(layers, (CARTON,), HERE)
    assert np.abs(to_local(fresh, (2.45, 1.5, 0.0))[:, 0]).max() < 1e-6
    front = np.array([[2.05, 1.5], [2.3, 1.5]])
    assert layers.clearance(front) == pytest.approx([0.4, 0.15], abs=0.06)
    assert len(observe(layers, (CARTON,), HERE)) == 0


def test_rays_clear_what_has_gone_except_where_they_pass_through_things():
    for clearing in (True, False):
        layers = costmap(clearing)
        for _ in range(10):
            observe(layers, (CARTON,), HERE)
        for _ in range(16):
            observe(layers, (), HERE)
        assert bool((layers.evidence > 0).any()) is not clearing


def test_people_who_walk_leave_no_marks_and_marks_can_be_forgotten():
    layers = costmap()
    observe(layers, (CARTON,), HERE, ignored=True)
    assert not (layers.evidence > 0).any()
    observe(layers, (CARTON,), HERE)
    layers.forget(HERE, 0.5)
    assert (layers.evidence > 0).any()
    layers.forget(HERE, 3.0)
    assert not (layers.evidence > 0).any()


@pytest.mark.parametrize(("gap", "exists"), [(0.60, True), (0.64, True), (0.50, False)])
def test_a_plan_passes_a_gap_that_the_chassis_passes(gap, exists):
    sides = (
        OrientedBox(2.03, (1.5 - gap / 2) / 2, 0.4, 1.5 - gap / 2),
        OrientedBox(2.03, (4.5 + gap / 2) / 2, 0.4, 1.5 - gap / 2),
    )
    field = DistanceField.of_boxes((*ROOM, *sides), (-1.0, -1.0, 5.0, 4.0))
    plan = planned(Costmap(field, field), (1.0, 1.5, 0.0), (3.0, 1.5))
    assert (plan is not None) is exists
    if plan is not None:
        assert field.at(plan.points).min() > ROBOT.chassis_radius
        assert plan.remaining == pytest.approx(2.0, rel=0.1)


def test_a_plan_leads_around_a_mark_and_is_blocked_by_one():
    layers = costmap()
    straight = planned(layers, HERE, (3.5, 1.5))
    assert straight is not None
    assert not straight.blocked(layers)
    observe(layers, (CARTON,), HERE)
    assert straight.blocked(layers)
    around = planned(layers, HERE, (3.5, 1.5))
    assert around is not None
    assert layers.clearance(around.points).min() >= ROBOT.chassis_radius
    points, left = visible(around, HERE, layers)
    assert len(points) == len(left)
    assert left[0] == pytest.approx(around.remaining)


@given(v=st.floats(-0.3, 1.0), w=st.floats(-1.5, 1.5), seed=st.integers(0, 1000))
def test_sequences_keep_to_the_accelerations(v, w, seed):
    wanted = np.random.default_rng(seed).uniform((-0.3, -1.5), (1.0, 1.5), (5, 12, 2))
    limits = MotionLimits(acceleration=0.8, braking=1.2, turn_acceleration=2.0)
    driven = limited(wanted, (v, w), limits, 0.1)
    changes = np.diff(driven, axis=1, prepend=np.broadcast_to((v, w), (5, 1, 2)))
    assert (changes.max(axis=(0, 1)) <= np.array([0.08, 0.2]) + 1e-9).all()
    assert (changes.min(axis=(0, 1)) >= np.array([-0.12, -0.2]) - 1e-9).all()


def test_commands_keep_to_the_limits_and_lead_to_the_end_of_the_path():
    layers, limits = costmap(), MotionLimits(acceleration=0.7, braking=0.7, turn_acceleration=2.5)
    controller = Controller(np.random.default_rng(0), limits)
    plan = PlannedPath(np.array([[1.0, 1.5], [2.0, 1.5], [3.0, 2.3]]))
    pose, velocity, commands = HERE, (0.0, 0.0), [(0.0, 0.0)]
    for _ in range(40):
        plan.advance(pose)
        velocity = controller.command(pose, velocity, plan, layers, speed=max(plan.remaining, 0.05))
        commands.append(velocity)
        pose = tuple(rollouts(pose, velocity, np.array([[velocity]]), 0.1)[0, 0])
    assert math.dist(pose[:2], (3.0, 2.3)) < 0.2
    changes = np.abs(np.diff(np.array(commands), axis=0)).max(axis=0)
    assert changes[0] <= 0.07 + 1e-9
    assert changes[1] <= 0.25 + 1e-9


def test_a_rollout_at_constant_velocities_is_an_arc():
    v, w = 0.6, 0.9
    end = rollouts((1.0, 2.0, 0.3), (v, w), np.full((1, 20, 2), (v, w)), 0.1)[0, -1]
    angle = 0.3 + 2.0 * w
    center = np.array([1.0 - v / w * math.sin(0.3), 2.0 + v / w * math.cos(0.3)])
    assert end[:2] == pytest.approx(center + v / w * np.array([math.sin(angle), -math.cos(angle)]), abs=2e-3)
    assert end[2] == pytest.approx(angle)


def test_a_person_who_walks_is_tracked_at_their_velocity_and_one_who_stands_is_not_walking():
    crowd, walking = PeopleTracker(), np.zeros(0, dtype=bool)
    for k in range(25):
        centers = np.array([[1.0 + 0.08 * k, 2.0], [2.0, 0.8]])
        ranges = with_people(scan_of(ROOM, HERE), HERE, centers)
        points = to_world(lidar_points(np.asarray(ranges, dtype=np.float64)), HERE)
        unexplained = room_field().at(points) > 0.15
        walking = crowd.observe(HERE, points, unexplained)
    people = sorted(crowd.people, key=lambda person: person.place[1])
    assert [person.walking for person in people] == [False, True]
    assert people[1].velocity == pytest.approx((0.8, 0.0), abs=0.15)
    assert people[1].place == pytest.approx((1.0 + 0.08 * 24, 2.0), abs=0.12)
    assert walking.sum() >= 2


def test_clusters_are_separated_by_gaps_and_not_wider_than_a_person():
    wide = np.column_stack([np.linspace(0.0, 2.0, 15), np.zeros(15)])
    legs = np.array([[5.0, 0.0], [5.05, 0.05], [5.3, 0.0]])
    groups = clusters(np.concatenate([wide, legs]))
    assert [group.tolist() for group in groups] == [[15, 16, 17]]


def test_only_motion_can_touch_a_person():
    person = TrackedPerson((1.0, 0.0), (-1.0, 0.0), True)
    stay = np.zeros((1, 15, 2))
    resting = approach_cost((person,), (0.0, 0.0), stay, np.zeros((1, 15), dtype=bool), 0.1)
    driving = approach_cost((person,), (0.0, 0.0), stay, np.ones((1, 15), dtype=bool), 0.1)
    assert driving[0] > resting[0] + 50.0
    away = approach_cost(
        (TrackedPerson((9.0, 0.0), (0.0, 0.0), False),), (0.0, 0.0), stay, np.ones((1, 15), dtype=bool), 0.1
    )
    assert away[0] == 0.0


@pytest.mark.parametrize("offset", [(0.06, 0.05, 0.08), (-0.05, -0.07, -0.1), (0.0, 0.08, 0.0)])
def test_the_pose_of_a_station_is_measured_to_millimeters_in_depth_and_to_the_rays_spacing_across(laboratory, offset):
    layout, old, _ = laboratory
    hood = layout.box("FumeHood_1")
    goal = (hood.x, hood.y - hood.depth / 2.0 - 0.6, math.pi / 2.0)
    front = (hood.x, hood.y - hood.depth / 2.0, math.pi / 2.0)
    shifted = []
    for owner, box in old.sections:
        if owner == "FumeHood_1":
            x, y, yaw = moved((box.x, box.y, box.yaw), front, offset)
            shifted.append(OrientedBox(x, y, box.width, box.depth, yaw))
        else:
            shifted.append(box)
    station = StationEstimate(old, goal)
    for along in np.linspace(2.2, 0.8, 7):
        pose = compose(goal, (-along, 0.6 * (along - 0.8), 0.1))
        station.observe(pose, scan_of(shifted, pose))
    assert station.offset == pytest.approx(offset, abs=0.015)
    across, depth, turn = np.abs(np.array(station.goal) - moved(goal, front, offset))
    assert depth < 0.004
    assert turn < math.radians(0.3)
    assert across < 0.015


def test_a_robot_rests_near_people_who_come_and_sets_off_when_they_leave():
    waiting, here = Waiting(), (0.0, 0.0, 0.0)
    assert waiting.step(here, 0.6, (TrackedPerson((0.6, 0.0), (0.0, 0.0), False),))
    assert waiting.step(here, 0.6, (TrackedPerson((1.5, 0.0), (-1.0, 0.0), True),))
    assert not waiting.step(here, 0.6, (TrackedPerson((1.5, 0.0), (1.0, 0.0), True),))
    assert not waiting.step(here, 0.6, (TrackedPerson((1.0, 1.0), (1.0, 0.0), True),))
    assert waiting.step(here, 0.0, (TrackedPerson((0.9, 0.0), (-1.0, 0.0), True),))
    assert not waiting.step(here, 0.0, (TrackedPerson((0.9, 0.0), (1.0, 0.0), True),))
    assert not waiting.step(here, 0.0, (TrackedPerson((2.0, 0.0), (-1.0, 0.0), True),))


def test_what_stands_for_long_and_never_walked_is_a_thing():
    crowd, points = PeopleTracker(things=True), np.array([[2.0, 1.4], [2.0, 1.5], [2.0, 1.6]])
    for k in range(100):
        crowd.observe(HERE, np.add(points, (0.0, 0.1 * math.sin(k))), np.ones(3, dtype=bool))
        assert len(crowd.people) == 1
    assert not crowd.alive
    for k in range(10):
        crowd.observe(HERE, np.add(points, (0.0, 0.1 * k)), np.ones(3, dtype=bool))
    assert len(crowd.alive) == 1


def test_a_robot_does_not_brake_for_one_who_falls_behind():
    here, behind = (0.0, 0.0, 0.0), (-0.45, 0.4)
    assert not Waiting().step(here, 0.8, (TrackedPerson(behind, (0.6, 0.0), True),))
    assert Waiting().step(here, 0.8, (TrackedPerson((0.45, 0.4), (0.6, 0.0), True),))


def test_a_sequence_that_ends_in_the_way_of_a_person_costs_most():
    walks = (TrackedPerson((3.0, 0.0), (-1.0, 0.0), True),)
    costs = way_cost(walks, np.array([[1.5, 0.0], [1.5, 0.4], [1.5, 0.9], [4.5, 0.0]]))
    assert costs[0] > costs[1] > costs[2] == costs[3] == 0.0
    assert way_cost((TrackedPerson((3.0, 0.0), (0.0, 0.0), False),), np.array([[3.0, 0.0]]))[0] == 0.0


def test_a_new_cluster_nearby_is_expected_to_come():
    crowd = PeopleTracker()
    ranges = with_people(scan_of(ROOM, HERE), HERE, np.array([[2.2, 1.5]]))
    points = to_world(lidar_points(np.asarray(ranges, dtype=np.float64)), HERE)
    crowd.observe(HERE, points, room_field().at(points) > 0.15)
    (person,) = crowd.people
    assert person.velocity == pytest.approx((-1.0, 0.0), abs=0.05)


@pytest.mark.parametrize("offset", [(0.02, -0.015, 0.025), (-0.01, 0.02, -0.02), (0.0, 0.0, 0.0)])
def test_the_place_of_the_lidar_follows_from_scans_of_the_map_to_millimeters(offset):
    mounting = LidarMounting(room_field(), (9.0, 9.0, 0.0))
    for k in range(40):
        pose = (1.0 + 0.05 * k, 1.0 + 0.02 * k, 0.1 * k)
        mounting.observe(pose, lidar_points(scan_of(ROOM, compose(pose, offset), sigma=0.03, seed=k)))
    assert mounting.offset[:2] == pytest.approx(offset[:2], abs=0.003)
    assert mounting.offset[2] == pytest.approx(offset[2], abs=math.radians(0.2))
    corner = np.array([[1.0, 2.0]])
    assert mounting.corrected(corner) == pytest.approx(to_world(corner, mounting.offset))


def glass_scan(pose, pane=((-0.8, 2.0), (0.8, 2.0))) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return ranges (180,), returns, origins for a lidar that sees a pane along x up to 10 degrees off its normal."""
    angles = pose[2] - math.pi + 2.0 * math.pi / 180 * np.arange(180)
    (x0, y), (x1, _) = pane
    away = (y - pose[1]) / np.where(np.abs(np.sin(angles)) < 1e-9, 1e-9, np.sin(angles))
    place = pose[0] + away * np.cos(angles)
    seen = (away > 0.0) & (place >= x0) & (place <= x1) & (np.abs(np.sin(angles)) > math.cos(math.radians(10.0)))
    ranges = np.where(seen, away, 10.0)
    count = int(seen.sum())
    return ranges, np.column_stack([place[seen], np.full(count, y)]), np.tile(pose[:2], (count, 1))


def test_a_pane_is_drawn_on_from_what_was_seen_of_it_and_ends_where_rays_pass():
    panes, points = SeenPanes(), np.empty((0, 2))
    for step in np.linspace(0.0, 1.0, 12):
        pose = (-0.6 + 0.4 * step, 0.4 + 0.5 * step, 0.8)
        points = panes.observe(pose, *glass_scan(pose))
    seen = -0.2 + 1.1 * math.tan(math.radians(10.0))
    assert np.abs(points[:, 1] - 2.0).max() < 0.02
    assert points[:, 0].max() == pytest.approx(seen + CONTINUATION_M, abs=0.08)
    for x in np.linspace(-0.2, 1.4, 40):
        points = panes.observe((x, 1.2, 1.5), *glass_scan((x, 1.2, 1.5)))
    assert points[:, 0].max() == pytest.approx(0.8, abs=0.1)
    panes.doubt()
    assert panes.observe((1.4, 1.2, 1.5), *glass_scan((1.4, 1.2, 1.5)))[:, 0].min() > points[:, 0].min()


def test_a_guess_is_an_obstacle_until_it_closes_every_way():
    layers = costmap()
    layers.guess(np.column_stack([np.full(40, 2.0), np.linspace(0.0, 2.0, 40)]))
    around = planned(layers, HERE, (3.5, 1.5))
    assert around is not None
    assert layers.clearance(np.array([[1.7, 1.0]]))[0] == pytest.approx(0.3, abs=0.03)
    assert around.remaining > 2.7
    layers.guess(np.column_stack([np.full(70, 2.0), np.linspace(0.0, 3.0, 70)]))
    through = planned(layers, HERE, (3.5, 1.5))
    assert through is not None
    assert through.remaining < 2.7


COMMANDS = """
0.200000 -0.100000
0.288964 -0.339946
0.381017 -0.513629
0.456202 -0.647144
0.543644 -0.516958
0.635717 -0.697337
0.700851 -0.625816
0.760994 -0.789904
0.818754 -0.610654
0.836877 -0.364850
0.874054 -0.199480
0.913864 -0.108993
"""
"""Commands of a controller with a seed among a carton and a person who walks: its defaults decide published drives."""


def seeded_commands() -> np.ndarray:
    layers = costmap()
    observe(layers, (CARTON,), HERE)
    controller, plan = Controller(np.random.default_rng(3)), planned(layers, HERE, (3.5, 1.5))
    pose, velocity, commands = HERE, (0.1, 0.2), []
    for k in range(12):
        person = TrackedPerson((2.4 - 0.05 * k, 2.6 - 0.03 * k), (-0.5, -0.3), True)
        plan.advance(pose)
        velocity = controller.command(pose, velocity, plan, layers, (person,))
        commands.append(velocity)
        pose = tuple(rollouts(pose, velocity, np.array([[velocity]]), 0.1)[0, 0])
    return np.array(commands)


def test_a_seed_gives_the_commands_of_the_published_drives():
    assert seeded_commands() == pytest.approx(
        np.array([line.split() for line in COMMANDS.split("\n") if line], float), abs=1e-5
    )


def test_a_prediction_adds_the_covariance_of_white_acceleration():
    track, dt = Track(np.array([1.0, 2.0])), 0.1
    track.covariance = np.zeros((2, 2))
    track.predict(dt)
    lever = 2.5 * np.array([dt * dt / 2.0, dt])
    assert track.covariance == pytest.approx(np.outer(lever, lever))
    track.covariance, track.state = np.diag([0.01, 0.25]), np.array([[1.0, 2.0], [0.5, -1.0]])
    track.predict(dt)
    assert track.state[0] == pytest.approx([1.05, 1.9])
    assert track.covariance - np.outer(lever, lever) == pytest.approx(np.array([[0.0125, 0.025], [0.025, 0.25]]))


@pytest.mark.parametrize(("before", "steps"), [(0, 80), (2, 300)])
def test_what_never_walked_is_a_thing_after_8_seconds_or_30_if_first_seen_at_rest(before, steps):
    crowd, points = PeopleTracker(things=True), np.array([[2.0, 1.4], [2.0, 1.5], [2.0, 1.6]])
    for _ in range(before):
        crowd.observe(HERE, np.empty((0, 2)), np.empty(0, dtype=bool))
    alive = []
    for _ in range(steps + 2):
        crowd.observe(HERE, points, np.ones(3, dtype=bool))
        alive.append(bool(crowd.alive))
    assert alive.index(False) == steps


def test_clusters_end_at_their_gap_and_at_the_width_of_a_person():
    def number(step: float, count: int) -> int:
        return len(clusters(np.column_stack([step * np.arange(count), np.zeros(count)])))

    assert (number(0.297, 2), number(0.303, 2)) == (1, 2)
    assert (number(1.287 / 5, 6), number(1.313 / 5, 6)) == (1, 0)


@pytest.mark.parametrize(
    ("place", "velocity", "speed", "rests"),
    [
        ((0.653, 0.0), (0.0, 0.0), 0.6, True),  # rest distance 0.66 m
        ((0.667, 0.0), (0.0, 0.0), 0.6, False),
        ((0.841, 0.0), (0.0, 0.0), 0.0, True),  # 0.85 m to one who stands
        ((0.859, 0.0), (0.0, 0.0), 0.0, False),
        ((1.138, 0.0), (0.0, 0.5), 0.0, True),  # 1.15 m to one who walks
        ((1.162, 0.0), (0.0, 0.5), 0.0, False),
        ((0.9, 0.0), (0.198, 0.3), 0.0, True),  # unless they recede faster than 0.2 m/s
        ((0.9, 0.0), (0.202, 0.3), 0.0, False),
        ((1.5, 0.713), (-1.0, 0.0), 0.6, True),  # 0.72 m within 1 s
        ((1.5, 0.727), (-1.0, 0.0), 0.6, False),
        ((2.0, 0.9), (-0.3, -0.9), 0.6, False),
        ((0.5, 0.45), (-0.1, 0.2), 0.8, True),
        ((1.05, 0.3), (-0.2, 0.1), 0.9, True),
        ((-0.45, 0.4), (0.6, 0.0), 0.8, False),
    ],
)
def test_whether_a_robot_rests_for_a_person_is_the_same_in_every_frame(place, velocity, speed, rests):
    for frame in ((0.0, 0.0, 0.0), (3.0, -2.0, 0.7), (-1.0, 4.0, -1.9), (0.5, 0.5, 2.8)):
        (x, y), (vx, vy) = to_world([place], frame)[0], to_world([velocity], (0.0, 0.0, frame[2]))[0]
        person = TrackedPerson((x, y), (vx, vy), velocity != (0.0, 0.0))
        assert Waiting().step(frame, speed, (person,)) is rests


def test_braking_begins_before_it_is_too_late_in_every_frame():
    # 0.8 m/s at 1.4 m/s2 after 0.2 s: 0.771 s and 0.309 m, in which the person comes 0.386 m.
    distance = 0.66 + 0.8 * 0.8 / 2.8 + 0.08 + 0.5 * (0.8 / 1.4 + 0.2)
    for frame in ((0.0, 0.0, 0.0), (3.0, -2.0, 0.7), (-1.0, 4.0, -1.9)):
        for share, late in ((0.99, True), (1.01, False)):
            x, y = to_world([(share * distance, 0.0)], frame)[0]
            vx, vy = to_world([(-0.5, 0.0)], (0.0, 0.0, frame[2]))[0]
            assert too_late(TrackedPerson((x, y), (vx, vy), True), frame, 0.8) is late


def test_the_way_of_a_person_costs_28_and_falls_to_nothing_at_80_centimeters_beside_and_beyond_it():
    ends = np.array([[1.5, 0.0], [1.5, 0.4], [1.5, 0.79], [1.5, 0.81], [0.1, 0.0], [3.4, 0.0]])
    costs = way_cost((TrackedPerson((3.0, 0.0), (-1.0, 0.0), True),), ends)
    assert costs == pytest.approx([28.0, 14.0, 28.0 * 0.01 / 0.8, 0.0, 14.0, 14.0])
    assert way_cost((TrackedPerson((3.0, 0.0), (-0.24, 0.0), True),), ends).max() == 0.0
    assert way_cost((TrackedPerson((3.0, 0.0), (-0.26, 0.0), True),), ends).max() > 0.0


def open_floor() -> Costmap:
    field = DistanceField.of_boxes((OrientedBox(4.0, -0.05, 12.0, 0.1),), (-2.0, -1.0, 9.0, 3.0))
    return Costmap(field, field)


def marks(layers: Costmap, point: tuple[float, float], pose=(0.0, 1.5, 0.0), ranges: float = 0.0) -> bool:
    """Return whether a return in a scan marks its cell."""
    layers.observe(pose, np.full(180, ranges), np.array([point]), np.zeros(1, dtype=bool))
    return bool((layers.evidence > 0).any())


def test_returns_mark_beyond_10_centimeters_of_the_map_and_within_6_meters():
    assert [marks(open_floor(), (3.0, y)) for y in (0.09, 0.11)] == [False, True]
    assert [marks(open_floor(), (x, 1.5)) for x in (5.94, 6.06)] == [True, False]


@pytest.mark.parametrize(("hits", "misses"), [(1, 3), (2, 6), (5, 15), (9, 15)])
def test_each_return_holds_a_mark_for_three_scans_and_all_of_them_for_15(hits, misses):
    layers, far = open_floor(), (5.0, 0.0)
    for _ in range(hits):
        marks(layers, (2.0, 1.5))
    assert [marks(layers, far, ranges=9.0) for _ in range(misses + 1)] == [True] * (misses - 1) + [False] * 2


@pytest.mark.parametrize(("ray", "clears"), [(None, True), (89, False), (90, False), (91, False), (92, True)])
def test_a_mark_is_cleared_if_the_three_rays_around_it_end_15_centimeters_behind_it(ray, clears):
    for behind, passes in ((0.13, False), (0.17, clears)):
        layers = open_floor()
        assert marks(layers, (2.0, 1.5))
        ranges = np.full(180, 2.0 + behind)
        if ray is not None:
            ranges[ray] = 1.0
        for _ in range(3):
            layers.observe((0.0, 1.5, 0.0), ranges, np.empty((0, 2)), np.empty(0, dtype=bool))
        assert bool((layers.evidence > 0).any()) is not passes


def test_what_lies_outside_of_the_map_is_at_its_edge():
    layers = open_floor()
    layers.guess(np.array([[99.0, 99.0], [-99.0, -99.0]]))
    grid, _ = layers.everywhere(np.empty((0, 2)), marks=False)
    assert grid.occupied[-1, -1]
    assert grid.occupied[0, 0]
    assert layers.clearance(np.array([[99.0, 99.0], [-99.0, 99.0]])).shape == (2,)


def test_marks_are_known_on_all_sides_of_the_robot_as_it_drives_on():
    layers = open_floor()
    for x in (1.0, 4.0, 7.0):
        for dx, dy in ((0.8, 0.0), (-0.8, 0.0), (0.0, 0.9), (0.0, -0.9)):
            marks(layers, (x + dx, 1.5 + dy), pose=(x, 1.5, 0.0))
        near = np.array([[x + 0.5, 1.5], [x - 0.5, 1.5], [x, 2.1], [x, 0.9]])
        assert layers.clearance(near) == pytest.approx(0.3, abs=0.04)


def test_at_most_twelve_scans_of_a_station_are_compared_and_then_every_other_one(laboratory):
    layout, old, _ = laboratory
    hood = layout.box("FumeHood_1")
    goal = (hood.x, hood.y - hood.depth / 2.0 - 0.6, math.pi / 2.0)
    station, counts = StationEstimate(old, goal), []
    station._search = lambda: counts.append(len(station._scans))
    boxes = [box for _, box in old.sections]
    for k in range(15):
        pose = compose(goal, (-1.5 + 0.25 * (k % 2), 0.0, 0.0))
        station.observe(pose, scan_of(boxes, pose))
    assert counts == [*range(1, 13), 6, 7]  # the next one after the sixth is from the place of the last that was kept
    here = compose(goal, (-1.5 + 0.19, 0.0, 0.0))
    station.observe(here, scan_of(boxes, here))
    assert len(counts) == 14  # 0.19 m from the last one


def test_a_robot_that_stands_too_near_to_a_wall_may_drive_along_it():
    layers, plan = open_floor(), PlannedPath(np.array([[0.0, 0.265], [1.0, 0.265], [3.0, 0.265]]))
    controller, pose, velocity = Controller(np.random.default_rng(0)), (0.0, 0.265, 0.0), (0.0, 0.0)
    for _ in range(8):
        plan.advance(pose)
        velocity = controller.command(pose, velocity, plan, layers)
        pose = tuple(rollouts(pose, velocity, np.array([[velocity]]), 0.1)[0, 0])
    assert pose[0] > 0.2


@pytest.mark.parametrize("x", [0.0, 5.0])
def test_from_a_place_too_near_to_a_wall_the_path_away_from_it_is_visible(x):
    layers, plan = open_floor(), PlannedPath(np.array([[x, 0.2], [x, 2.4]]))
    points, _ = visible(plan, (x, 0.2, 0.0), layers)
    assert len(points) == len(plan.ahead(3.0)[0]) > 8
    low = PlannedPath(np.array([[x, 0.5], [x + 0.5, 0.2], [x + 2.5, 0.2]]))
    assert len(visible(low, (x, 0.5, 0.0), layers)[0]) < len(low.ahead(3.0)[0])


def test_a_cluster_corrects_a_track_as_a_kalman_filter_does():
    track = Track(np.array([1.0, 2.0]))
    track.state, track.covariance = np.array([[1.0, 2.0], [0.5, -1.0]]), np.array([[0.04, 0.02], [0.02, 0.3]])
    measured, select = np.array([1.1, 1.9]), np.array([[1.0, 0.0]])
    gain = track.covariance @ select.T / (select @ track.covariance @ select.T + 0.08**2)
    state = track.state + gain @ (measured[None] - select @ track.state)
    covariance = (np.eye(2) - gain @ select) @ track.covariance
    track.correct(measured)
    assert track.state == pytest.approx(state)
    assert track.covariance == pytest.approx(covariance)


def test_a_person_who_stands_too_near_already_may_be_left_but_not_approached():
    person = TrackedPerson((0.5, 0.0), (0.0, 0.0), False)
    steps = np.array([[[0.0, 0.0]], [[-0.05, 0.0]], [[0.05, 0.0]]])
    costs = approach_cost((person,), (0.0, 0.0), steps, np.ones((3, 1), dtype=bool), 0.1)
    assert max(costs[:2]) < 1.0
    assert costs[2] > 60.0
