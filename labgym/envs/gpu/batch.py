"""Control steps of many robots on a device; the interface of `labgym.envs.planar.batch`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from labgym.envs.gpu import device_of, wp
from labgym.envs.gpu.motion import DeviceRobot, DeviceRobots, drive
from labgym.envs.gpu.scene import DeviceScene, device_scene
from labgym.envs.gpu.sensors import DeviceRays
from labgym.envs.parts.rays import DepthSensor, LidarSensor
from labgym.envs.planar.batch import remaining
from labgym.envs.planar.body import PlanarBody
from labgym.envs.planar.contacts import CONTACTS
from labgym.envs.planar.routes import CompiledDistanceToGo, RouteLengths
from labgym.envs.planar.scene import clearance, scene_of
from labgym.envs.planar.simulation import CHECK_INTERVAL
from labgym.envs.simulation import Pose
from labgym.envs.world import World
from labgym.geometry import Array, wrap_angle


@dataclass
class DeviceOutcome:
    """Results of the latest control step, in the memory of the processor.

    Attributes:
        targets: (n, 2) target velocities of the next step, m/s and rad/s.
        poses: (n, 3) x, y and yaw in (-pi, pi]. velocities: (n, 2) m/s and rad/s.
        driven: (n,) meters. touched: (n,). clearances: (n,) meters.
        to_go: (n,) remaining distance by the field, meters; NaN without a field.
    """

    targets: Array
    poses: Array
    velocities: Array
    driven: Array
    touched: NDArray[np.bool_]
    clearances: Array
    to_go: Array


class DeviceBatch:
    """Robots on a device, each in its scene.

    Args:
        count: number of robots. control_dt: duration of a control step, seconds.
        sensors: lidars and depth cameras without noise. device: name of a device of Warp.

    Attributes:
        robots: the latest outcome. routes: exact remaining distances, computed by the processor.
    """

    def __init__(
        self, count: int, control_dt: float, sensors: Sequence[LidarSensor | DepthSensor], device: str
    ) -> None:
        self._device = device_of(device)
        self._count, self._checks = count, round(control_dt / CHECK_INTERVAL)
        zeros = np.zeros(count)
        self.robots = DeviceOutcome(
            np.zeros((count, 2)),
            np.zeros((count, 3)),
            np.zeros((count, 2)),
            zeros.copy(),
            zeros.astype(np.bool_),
            zeros.copy(),
            np.full(count, np.nan),
        )
        self.routes = RouteLengths(count)
        self._addresses, self._sizes = np.zeros((count, 6), dtype=np.uint64), np.zeros((count, 6), dtype=np.int32)
        self._plans, self._states = np.zeros((count, 4)), np.zeros((count, 6))
        self._fields, self._grids = np.zeros((count, 3), dtype=np.int64), np.zeros((count, 3))
        # What addresses point to must live as long as they are used.
        self._scenes: list[DeviceScene | None] = [None] * count
        self._distances: list[Array | None] = [None] * count
        self._body: Any = None
        self._steps = 0
        self._placed: set[int] = set()
        self._rays = {sensor.name: DeviceRays(sensor, count, self._device) for sensor in sensors}
        self._arrays = {
            name: wp.zeros(shape, dtype=dtype, device=self._device)
            for name, shape, dtype in (
                ("targets", (count, 2), wp.float64),
                ("addresses", (count, 6), wp.uint64),
                ("sizes", (count, 6), wp.int32),
                ("plans", (count, 4), wp.float64),
                ("states", (count, 6), wp.float64),
                ("contacts", (count, CONTACTS, 6), wp.float64),
                ("poses", (count, 3), wp.float64),
                ("velocities", (count, 2), wp.float64),
                ("driven", count, wp.float64),
                ("touched", count, wp.int32),
                ("clearances", count, wp.float64),
            )
        }
        self._table = DeviceRobots()
        for name, array in self._arrays.items():
            setattr(self._table, name, array)

    def place(
        self,
        robot: int,
        pose: Pose,
        world: World,
        field: tuple[Array, Pose] | None,
        exact: CompiledDistanceToGo | None = None,
    ) -> None:
        """Put a robot at rest into a world.

        Args:
            field: distances to its goal on a grid (rows, columns), and the grid's origin and resolution.
            exact: exact distances to its goal.
        """
        robots, scene = self.robots, device_scene(world, self._device)
        if self._body is None:
            body = scene_of(world).body
            self._body, self._steps = _robot(body), round(CHECK_INTERVAL / body.timestep)
        self._scenes[robot] = scene
        self._addresses[robot], self._sizes[robot], self._plans[robot] = scene.addresses, scene.sizes, scene.plan
        self._states[robot, :3], self._states[robot, 3:] = pose, 0.0
        for rays in self._rays.values():
            rays.enter(robot, world)
        self._placed.add(robot)
        robots.poses[robot] = (*pose[:2], wrap_angle(pose[2]))
        robots.velocities[robot], robots.driven[robot], robots.touched[robot] = 0.0, 0.0, False
        robots.clearances[robot] = clearance(world, pose)
        distances, grid = (None, (0.0, 0.0, 1.0)) if field is None else field
        self._distances[robot], self._grids[robot] = distances, grid
        self._fields[robot] = 0 if distances is None else (distances.ctypes.data, *distances.shape)
        own = slice(robot, robot + 1)
        remaining(robots.poses[own], self._fields[own], self._grids[own], robots.to_go[own])
        self.routes.place(robot, exact, robots.poses)

    def step(self) -> None:
        """Advance all robots by one control step towards their targets."""
        self._enter()
        arrays, robots = self._arrays, self.robots
        arrays["targets"].assign(robots.targets)
        inputs = [self._body, self._checks, self._steps, self._table]
        wp.launch(drive, dim=self._count, inputs=inputs, device=self._device)
        for rays in self._rays.values():
            rays.cast(np.arange(self._count, dtype=np.int32), arrays["poses"])
        for name in ("poses", "velocities", "driven", "touched", "clearances"):
            getattr(robots, name)[:] = arrays[name].numpy()
        remaining(robots.poses, self._fields, self._grids, robots.to_go)
        self.routes.measure(0, self._count, robots.poses)

    def readings(self, sensor: str) -> NDArray[np.float32]:
        """Return the readings of a sensor, (n, k) meters."""
        self._enter()
        return self._rays[sensor].readings

    def close(self) -> None:
        """Do nothing: the device frees its memory with the arrays."""

    def _enter(self) -> None:
        """Take the robots that were placed to the device, and let them see."""
        if not self._placed:
            return
        rows, arrays = sorted(self._placed), self._arrays
        states, poses = arrays["states"].numpy().copy(), arrays["poses"].numpy().copy()
        states[rows], poses[rows] = self._states[rows], self.robots.poses[rows]
        arrays["states"].assign(states)
        arrays["poses"].assign(poses)
        for name, table in (("addresses", self._addresses), ("sizes", self._sizes), ("plans", self._plans)):
            arrays[name].assign(table)
        for rays in self._rays.values():
            rays.cast(np.array(rows, dtype=np.int32), arrays["poses"])
        self._placed.clear()


def _robot(body: PlanarBody) -> Any:
    """Return the robot as a structure of Warp."""
    robot = DeviceRobot()
    for name, value in body._asdict().items():
        setattr(robot, name, value)
    return robot
