"""Recordings: rosbags reads the messages back, and they state where the robot was and what it saw."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from labgym.envs.conditions.figures import figure
from labgym.errors import LabgymError
from labgym.exchange.formats import empty_layout
from labgym.exchange.recording import write_recording
from labgym.layouts.floor import Floor

pytest.importorskip("rosbags")
LAYOUT = empty_layout(Floor.rectangle(6.0, 4.0))
ROUTE = ((1.0, 2.0, 0.0), (1.1, 2.0, 0.0), (1.1, 2.0, 0.15))


@pytest.fixture(scope="module")
def messages(tmp_path_factory):
    from rosbags.highlevel import AnyReader

    path = tmp_path_factory.mktemp("bags") / "drive.mcap"
    write_recording(LAYOUT, ROUTE, path, [figure(0, 3.0, 3.0, 0.5, 0.0, False)])
    with AnyReader([path]) as bag:
        assert bag.message_count == 2 + 7 * len(ROUTE)
        rows = [(link.topic, time, bag.deserialize(raw, link.msgtype)) for link, time, raw in bag.messages()]
    return {topic: [(time, m) for name, time, m in rows if name == topic] for topic in {row[0] for row in rows}}


def matrix(transform):
    whole, q, t = np.eye(4), transform.rotation, transform.translation
    whole[:3, :3] = Rotation.from_quat([q.x, q.y, q.z, q.w]).as_matrix()
    whole[:3, 3] = t.x, t.y, t.z
    return whole


def test_frames_lead_from_the_map_to_the_pose_of_the_robot_and_to_its_sensors(messages):
    still = {
        t.child_frame_id: (t.header.frame_id, matrix(t.transform)) for t in messages["/tf_static"][0][1].transforms
    }
    assert still["odom"][0] == "map"
    for (time, message), (x, y, yaw), step in zip(messages["/tf"], ROUTE, range(3), strict=True):
        (moved,) = message.transforms
        assert (moved.header.frame_id, moved.child_frame_id) == ("odom", "base_link")
        assert time == moved.header.stamp.sec * 10**9 + moved.header.stamp.nanosec == step * 10**8
        place = still["odom"][1] @ matrix(moved.transform)
        assert np.allclose(place[:3, 3], (x, y, 0.0), atol=1e-9)
        assert math.atan2(place[1, 0], place[0, 0]) == pytest.approx(yaw)
    optical = still["camera_link"][1] @ still["camera_optical_frame"][1]
    assert np.allclose(optical @ (0, 0, 1, 0), (1, 0, 0, 0), atol=1e-9)  # z looks ahead
    assert np.allclose(optical @ (1, 0, 0, 0), (0, -1, 0, 0), atol=1e-9)  # x points to the right
    assert np.allclose(optical[:3, 3], (0.2, 0.0, 0.5))


def test_odometry_has_velocities_in_the_frame_of_the_base(messages):
    twists = [message.twist.twist for _, message in messages["/odom"]]
    assert [each.linear.x for each in twists] == pytest.approx([0.0, 1.0, 0.0])
    assert [each.angular.z for each in twists] == pytest.approx([0.0, 0.0, 1.5])


def test_scans_and_images_measure_the_walls(messages):
    scan = messages["/scan"][0][1]
    ahead = round((0.0 - scan.angle_min) / scan.angle_increment)
    assert scan.ranges[ahead] == pytest.approx(5.0, abs=1e-3)
    left = round((math.pi / 2.0 - scan.angle_min) / scan.angle_increment)
    assert scan.ranges[left] == pytest.approx(2.0, abs=1e-3)
    depth, info = messages["/camera/depth/image_raw"][0][1], messages["/camera/camera_info"][0][1]
    assert (depth.encoding, depth.header.frame_id) == ("32FC1", "camera_optical_frame")
    meters = depth.data.view(np.float32).reshape(depth.height, depth.width)
    assert meters[depth.height // 2, depth.width // 2] == pytest.approx(4.8, abs=0.05)
    assert math.degrees(2.0 * math.atan(info.width / 2.0 / info.k[0])) == pytest.approx(68.0)
    color = messages["/camera/color/image_raw"][0][1]
    assert (color.encoding, len(color.data)) == ("rgb8", 3 * color.width * color.height)


def test_the_map_has_the_cells_of_the_floor_and_people_their_places(messages):
    grid = messages["/map"][0][1]
    cells = grid.data.reshape(grid.info.height, grid.info.width)
    origin, cell = grid.info.origin.position, grid.info.resolution
    assert cells[int((2.0 - origin.y) / cell), int((3.0 - origin.x) / cell)] == 0
    assert cells[int((2.0 - origin.y) / cell), int((-0.1 - origin.x) / cell)] == 100
    assert cells[0, 0] == -1
    counts = [len(message.poses) for _, message in messages["/people"]]
    assert counts == [1, 0, 0]
    assert (messages["/people"][0][1].poses[0].position.x, messages["/people"][0][1].header.frame_id) == (3.0, "map")


def test_equal_drives_give_equal_bytes(tmp_path):
    paths = [write_recording(LAYOUT, ROUTE, tmp_path / name) for name in ("a.mcap", "b.mcap")]
    assert paths[0].read_bytes() == paths[1].read_bytes()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.mcap", "b.mcap"]


def test_a_drive_without_poses_is_refused(tmp_path):
    with pytest.raises(LabgymError, match="at least one pose"):
        write_recording(LAYOUT, (), tmp_path / "a.mcap")
