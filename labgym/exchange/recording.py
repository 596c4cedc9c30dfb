"""Recordings of drives as ROS 2 messages in an MCAP file, for rosbag2, RViz and Foxglove."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.spatial.transform import Rotation

from labgym.envs.conditions.bodies import Body, BodyRays
from labgym.envs.robot import ROBOT
from labgym.envs.sensors import Camera, Lidar
from labgym.errors import LabgymError, optional_package
from labgym.eval.driving.drive import Route
from labgym.exchange.ros_map import FREE, OCCUPIED, RESOLUTION, UNKNOWN, ros_map
from labgym.exchange.urdf import BASE, FRAMES, LASER, OPTICAL
from labgym.geometry import compose, relative, rotate, wrap_angle
from labgym.layouts import Layout
from labgym.scenes import RayScene
from labgym.temporary import temporary_folder

if TYPE_CHECKING:
    from labgym.envs.state import Pose

MAP, ODOMETRY = "map", "odom"
TOPICS = {
    "/map": "nav_msgs/msg/OccupancyGrid",
    "/tf_static": "tf2_msgs/msg/TFMessage",
    "/tf": "tf2_msgs/msg/TFMessage",
    "/odom": "nav_msgs/msg/Odometry",
    "/scan": "sensor_msgs/msg/LaserScan",
    "/people": "geometry_msgs/msg/PoseArray",
    "/camera/color/image_raw": "sensor_msgs/msg/Image",
    "/camera/depth/image_raw": "sensor_msgs/msg/Image",
    "/camera/camera_info": "sensor_msgs/msg/CameraInfo",
}
"""Message types by topic."""
LATCHED = ("/map", "/tf_static")
"""Topics with one message, which late subscribers receive (durability transient local)."""
CARRIED = ("beaker",)
"""Bodies on the robot, which its sensors do not see."""


def write_recording(
    layout: Layout,
    route: Route,
    path: str | Path,
    bodies: Sequence[Sequence[Body]] = (),
    known: Layout | None = None,
) -> Path:
    """Write a drive as an MCAP file of ROS 2 messages and return the path.

    Frames follow REP 103 and REP 105: `map` is the frame of the file that the floor was read from, otherwise the
    floor's; `odom` is the pose at the start, and `base_link` lies on the floor below the robot's axis. Times count from
    the start of the drive. Odometry is exact; scans and images have no noise. A reading beyond the reach of its sensor
    is infinite (REP 117, REP 118).

    Args:
        layout: what the sensors see.
        route: poses in the floor's frame at the start and after each control step.
        bodies: people and pushed things at each pose; nothing beyond its end.
        known: the layout of the map, by default `layout`.

    Raises:
        LabgymError: the route is empty.
        MissingDependencyError: rosbags is not installed.
    """
    with optional_package("rosbags", "--out FILE.mcap", "ros"):
        from rosbags.rosbag2 import CompressionMode, StoragePlugin, Writer
    from rosbags.rosbag2.enums import CompressionFormat

    if not route:
        raise LabgymError("a recording needs at least one pose, and the drive has none")
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    with temporary_folder(path.parent) as temporary:
        writer = Writer(temporary / "bag", version=9, storage_plugin=StoragePlugin.MCAP)
        writer.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
        with writer:
            recorder = _Recorder(writer)
            recorder.begin(route[0], known or layout)
            sensors = _Sensors(layout)
            for step, pose in enumerate(route):
                present = bodies[step] if step < len(bodies) else ()
                recorder.step(step, (route[max(step - 1, 0)], pose), present, sensors)
        (temporary / "bag" / "bag.mcap").replace(path)
    return path


class _Sensors:
    """The lidar and the camera of the robot in a layout."""

    def __init__(self, layout: Layout) -> None:
        self.lidar, self.camera = Lidar(), Camera()
        self._solid, self._visible = RayScene(layout, "solid"), RayScene(layout, "visual")

    def readings(self, pose: Pose, present: Sequence[Body]) -> tuple[Any, Any, Any]:
        """Return ranges (rays,), color (rows, columns, 3) and depth (rows, columns), meters; inf beyond reach."""
        seen = [body for body in present if body.name not in CARRIED]
        solid, visible = (BodyRays(rays, len(rays.mesh.faces), seen) for rays in (self._solid, self._visible))
        ranges = self.lidar.scan(solid, pose)
        color, depth = self.camera.colour_and_depth(visible, pose)
        return (
            np.where(ranges < self.lidar.reach, ranges, np.float32(np.inf)),
            color,
            np.where(depth < self.camera.reach, depth, np.float32(np.inf)),
        )


class _Recorder:
    """Writes the messages of a drive to an open bag."""

    def __init__(self, writer: Any) -> None:
        from rosbags.typesys import Stores, get_typestore

        self._store, self._writer = get_typestore(Stores.ROS2_HUMBLE), writer
        self._connections = {
            topic: writer.add_connection(
                topic, kind, typestore=self._store, offered_qos_profiles=[_qos(topic in LATCHED)]
            )
            for topic, kind in TOPICS.items()
        }

    def begin(self, start: Pose, known: Layout) -> None:
        """Write the map and the frames that do not move."""
        self._start, self._origin = start, known.floor.origin
        there = compose(self._origin, start)
        values, (x, y) = ros_map(known)
        cells = np.select([values == OCCUPIED, values == FREE, values == UNKNOWN], [100, 0, -1]).astype(np.int8)
        info = self._new(
            "nav_msgs/msg/MapMetaData",
            map_load_time=self._time(0),
            resolution=RESOLUTION,
            width=cells.shape[1],
            height=cells.shape[0],
            origin=self._pose((x, y, 0.0)),
        )
        self._write("/map", 0, header=self._header(0, MAP), info=info, data=cells.ravel())
        mounts = [self._transform(0, mount.parent, name, mount.xyz, mount.rpy) for name, mount in FRAMES.items()]
        still = [self._transform(0, MAP, ODOMETRY, (*there[:2], 0.0), (0.0, 0.0, there[2])), *mounts]
        self._write("/tf_static", 0, transforms=still)

    def step(self, step: int, poses: tuple[Pose, Pose], present: Sequence[Body], sensors: _Sensors) -> None:
        """Write the messages of a control step from its poses, before and after, and the bodies present."""
        before, pose = poses
        there = relative(self._start, pose)
        moved = self._transform(step, ODOMETRY, BASE, (*there[:2], 0.0), (0.0, 0.0, there[2]))
        self._write("/tf", step, transforms=[moved])
        self._write(
            "/odom",
            step,
            header=self._header(step, ODOMETRY),
            child_frame_id=BASE,
            pose=self._new("geometry_msgs/msg/PoseWithCovariance", pose=self._pose(there), covariance=np.zeros(36)),
            twist=self._new(
                "geometry_msgs/msg/TwistWithCovariance", twist=self._twist(before, pose), covariance=np.zeros(36)
            ),
        )
        self._people(step, present)
        ranges, color, depth = sensors.readings(pose, present)
        turn = 2.0 * math.pi / len(ranges)
        self._write(
            "/scan",
            step,
            header=self._header(step, LASER),
            angle_min=-math.pi,
            angle_max=math.pi - turn,
            angle_increment=turn,
            time_increment=0.0,
            scan_time=ROBOT.control_dt,
            range_min=0.0,
            range_max=sensors.lidar.reach,
            ranges=ranges.astype(np.float32),
            intensities=np.zeros(0, np.float32),
        )
        self._image("/camera/color/image_raw", step, color, "rgb8")
        self._image("/camera/depth/image_raw", step, depth.astype(np.float32), "32FC1")
        self._camera(step, sensors.camera)

    def _people(self, step: int, present: Sequence[Body]) -> None:
        first = {body.name: body for body in reversed(present) if body.name.startswith("person ")}
        numbered = sorted(first, key=lambda name: int(name.removeprefix("person ")))
        poses = [self._pose(compose(self._origin, first[name].pose)) for name in numbered]
        self._write("/people", step, header=self._header(step, MAP), poses=poses)

    def _image(self, topic: str, step: int, pixels: Any, encoding: str) -> None:
        rows, columns = pixels.shape[:2]
        data = np.ascontiguousarray(pixels).view(np.uint8).ravel()
        self._write(
            topic,
            step,
            header=self._header(step, OPTICAL),
            height=rows,
            width=columns,
            encoding=encoding,
            is_bigendian=0,
            step=len(data) // rows,
            data=data,
        )

    def _camera(self, step: int, camera: Camera) -> None:
        (rows, columns), f = camera.shape, camera.focal
        # The center of the first pixel is at (0, 0), and the optical axis in the middle of the image.
        cx, cy = columns / 2.0 - 0.5, rows / 2.0 - 0.5
        self._write(
            "/camera/camera_info",
            step,
            header=self._header(step, OPTICAL),
            height=rows,
            width=columns,
            distortion_model="plumb_bob",
            d=np.zeros(5),
            k=np.array([f, 0.0, cx, 0.0, f, cy, 0.0, 0.0, 1.0]),
            r=np.eye(3).ravel(),
            p=np.array([f, 0.0, cx, 0.0, 0.0, f, cy, 0.0, 0.0, 0.0, 1.0, 0.0]),
            binning_x=0,
            binning_y=0,
            roi=self._new(
                "sensor_msgs/msg/RegionOfInterest", x_offset=0, y_offset=0, height=0, width=0, do_rectify=False
            ),
        )

    def _twist(self, before: Pose, pose: Pose) -> Any:
        """Return the mean velocity of the last control step in the frame of the base."""
        turned = wrap_angle(pose[2] - before[2])
        ahead, left = rotate(pose[0] - before[0], pose[1] - before[1], -before[2] - turned / 2.0)
        linear = self._vector((ahead / ROBOT.control_dt, left / ROBOT.control_dt, 0.0))
        angular = self._vector((0.0, 0.0, turned / ROBOT.control_dt))
        return self._new("geometry_msgs/msg/Twist", linear=linear, angular=angular)

    def _transform(
        self,
        step: int,
        parent: str,
        child: str,
        xyz: tuple[float, float, float],
        rpy: tuple[float, float, float],
    ) -> Any:
        transform = self._new(
            "geometry_msgs/msg/Transform", translation=self._vector(xyz), rotation=self._quaternion(rpy)
        )
        header = self._header(step, parent)
        return self._new("geometry_msgs/msg/TransformStamped", header=header, child_frame_id=child, transform=transform)

    def _pose(self, pose: Pose) -> Any:
        x, y, yaw = (float(value) for value in pose)
        position = self._new("geometry_msgs/msg/Point", x=x, y=y, z=0.0)
        return self._new("geometry_msgs/msg/Pose", position=position, orientation=self._quaternion((0.0, 0.0, yaw)))

    def _quaternion(self, rpy: tuple[float, float, float]) -> Any:
        x, y, z, w = Rotation.from_euler("xyz", rpy).as_quat().tolist()
        return self._new("geometry_msgs/msg/Quaternion", x=x, y=y, z=z, w=w)

    def _vector(self, xyz: tuple[float, float, float]) -> Any:
        x, y, z = (float(value) for value in xyz)
        return self._new("geometry_msgs/msg/Vector3", x=x, y=y, z=z)

    def _header(self, step: int, frame: str) -> Any:
        return self._new("std_msgs/msg/Header", stamp=self._time(step), frame_id=frame)

    def _time(self, step: int) -> Any:
        seconds, rest = divmod(_nanoseconds(step), 1_000_000_000)
        return self._new("builtin_interfaces/msg/Time", sec=seconds, nanosec=rest)

    def _new(self, kind: str, /, **fields: Any) -> Any:
        return self._store.types[kind](**fields)

    def _write(self, topic: str, step: int, /, **fields: Any) -> None:
        kind = TOPICS[topic]
        message = self._store.serialize_cdr(self._new(kind, **fields), kind)
        self._writer.write(self._connections[topic], _nanoseconds(step), message)


def _nanoseconds(step: int) -> int:
    return step * round(1e9 * ROBOT.control_dt)


def _qos(latched: bool) -> Any:
    """Return the reliable quality of service of a topic."""
    from rosbags.interfaces import Qos, QosDurability, QosHistory, QosLiveliness, QosReliability, QosTime

    durability = QosDurability.TRANSIENT_LOCAL if latched else QosDurability.VOLATILE
    unset = QosTime(0, 0)
    return Qos(
        QosHistory.KEEP_LAST,
        1 if latched else 10,
        QosReliability.RELIABLE,
        durability,
        unset,
        unset,
        QosLiveliness.SYSTEM_DEFAULT,
        unset,
        False,
    )
