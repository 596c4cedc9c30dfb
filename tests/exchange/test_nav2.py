"""The folder for Nav2: masks, waypoints and robot mean what map_server, the filters, RViz and URDF parsers read."""

from __future__ import annotations

import math
from xml.etree import ElementTree

import numpy as np
import pytest
import yaml
from laboratories import PROTOCOL, island_laboratory
from PIL import Image
from scipy.spatial.transform import Rotation

from exchange.floors import suite
from labgym.envs.robot import ROBOT
from labgym.exchange.formats import empty_layout
from labgym.exchange.ros_map import write_ros_map
from labgym.layouts import Layout
from labgym.navigation import goal_pairs
from labgym.protocols import get

ORIGIN = (412.5, -73.25, 0.6)


def read(folder, name):
    """Return the values of a map as map_server of Nav2 computes them, and a function that looks one up by x and y."""
    fields = yaml.safe_load((folder / f"{name}.yaml").read_text())
    shade = np.asarray(Image.open(folder / fields["image"])).astype(float)[::-1] / 255.0
    occupancy = shade if fields["negate"] else 1.0 - shade
    high, low = fields["occupied_thresh"], fields["free_thresh"]
    between = np.rint((occupancy - low) / (high - low) * 100.0) if fields["mode"] == "scale" else -1
    values = np.where(occupancy > high, 100, np.where(occupancy < low, 0, between))
    x0, y0, yaw = fields["origin"]
    assert yaw == 0.0
    cell = fields["resolution"]
    return values, lambda x, y: values[math.floor((y - y0) / cell), math.floor((x - x0) / cell)]


def moved(layout: Layout) -> Layout:
    return layout.replace(floor=layout.floor.model_copy(update={"origin": ORIGIN}))


def in_file(x, y):
    cosine, sine = math.cos(ORIGIN[2]), math.sin(ORIGIN[2])
    return ORIGIN[0] + cosine * x - sine * y, ORIGIN[1] + sine * x + cosine * y


def test_the_robot_is_kept_out_of_what_is_not_free_and_of_exits(tmp_path):
    layout = island_laboratory()
    write_ros_map(layout, tmp_path / "ros")
    (keep_out, at), (values, _) = read(tmp_path / "ros", "keepout"), read(tmp_path / "ros", "map")
    assert set(np.unique(keep_out)) == {0, 100}
    assert keep_out.shape == values.shape
    assert (keep_out[values != 0] == 100).all()
    exits = [way for way in layout.floor.doorways if way.exit]
    assert exits
    assert all(at(way.floor.x, way.floor.y) == 100 for way in exits)
    assert (keep_out[values == 0] == 0).mean() > 0.95


def test_half_the_speed_is_the_limit_near_doors_and_in_front_of_furniture(tmp_path):
    floor = suite()
    write_ros_map(empty_layout(floor), tmp_path / "ros")
    values, at = read(tmp_path / "ros", "speed")
    limits = 100.0 - 1.0 * values  # base and multiplier of nav2.yaml
    assert set(np.unique(limits)) == {50.0, 100.0}
    door = next(way for way in floor.doorways if not way.exit)
    assert at(door.floor.x, door.floor.y) == 50
    assert at(0.5, 0.5) == 0
    filters = yaml.safe_load((tmp_path / "ros" / "nav2.yaml").read_text())
    speed = filters["speed_filter_info_server"]["ros__parameters"]
    assert (speed["type"], speed["base"], speed["multiplier"]) == (1, 100.0, -1.0)
    assert filters["keepout_filter_info_server"]["ros__parameters"]["type"] == 0


def test_waypoints_are_the_goals_of_each_protocol_in_the_frame_of_the_file(tmp_path):
    layout = moved(island_laboratory())
    pairs = goal_pairs(layout, PROTOCOL)
    poses = [pairs[0].start, *(pair.goal for pair in pairs)]
    write_ros_map(layout.replace(protocols=(get(PROTOCOL),)), tmp_path / "ros")
    listed = yaml.safe_load((tmp_path / "ros" / "waypoints" / f"{PROTOCOL}.yaml").read_text())["waypoints"]
    assert list(listed) == [f"waypoint{number}" for number in range(len(poses))]
    _, at = read(tmp_path / "ros", "map")
    for point, (x, y, yaw) in zip(listed.values(), poses, strict=True):
        assert point["pose"][:2] == pytest.approx(in_file(x, y), abs=1e-3)
        w, *axis = point["orientation"]
        turn = Rotation.from_quat([*axis, w]).as_euler("xyz")[2]
        assert math.cos(turn - yaw - ORIGIN[2]) == pytest.approx(1.0, abs=1e-6)
        assert at(*point["pose"][:2]) == 0


def test_a_floor_that_was_read_from_a_file_has_its_map_in_the_frame_of_the_file(tmp_path):
    layout = island_laboratory()
    write_ros_map(layout, tmp_path / "plain")
    write_ros_map(moved(layout), tmp_path / "moved")
    (_, plain), (_, turned) = read(tmp_path / "plain", "map"), read(tmp_path / "moved", "map")
    x, y = np.random.default_rng(5).uniform((0.0, 0.0), (8.0, 6.0), (400, 2)).T
    same = [plain(*point) == turned(*in_file(*point)) for point in zip(x, y, strict=True)]
    assert np.mean(same) > 0.95  # cells at edges differ


def test_the_robot_has_the_size_and_the_sensors_of_the_simulated_one(tmp_path):
    write_ros_map(empty_layout(suite()), tmp_path / "ros")
    robot = ElementTree.parse(tmp_path / "ros" / "robot.urdf").getroot()
    links = {link.get("name") for link in robot.iter("link")}
    joints = {j.find("child").get("link"): j for j in robot.iter("joint")}
    assert links - set(joints) == {"base_link"}
    assert {j.find("parent").get("link") for j in joints.values()} <= links
    parts = [
        (float(c.find("geometry/cylinder").get("radius")), float(c.find("origin").get("xyz").split()[2]),
         float(c.find("geometry/cylinder").get("length")))
        for c in robot.iter("collision")
    ]  # fmt: skip
    assert max(radius for radius, _, _ in parts) == ROBOT.chassis_radius
    assert max(z + length / 2.0 for _, z, length in parts) == pytest.approx(ROBOT.height)
    assert joints["laser"].find("origin").get("xyz") == "0 0 0.25"
