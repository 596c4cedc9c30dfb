"""Lidars and cameras of many robots on a device: each ray is cast against the mesh of the robot's scene."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from labgym.envs.gpu import wp
from labgym.envs.gpu.scene import DeviceMesh, device_mesh
from labgym.envs.parts.rays import DepthSensor, LidarSensor
from labgym.envs.planar.plan import LEVEL
from labgym.envs.sensors import pixel_slopes
from labgym.envs.world import World


@wp.struct
class Optics:
    """The rays of a sensor.

    Attributes:
        directions: (k,) unit vectors in the robot frame. scales: (k,) reading per length of the ray.
        forward, height: start point of the rays in the robot's plane of symmetry, meters.
        reach: greatest length of a ray, meters. limit: greatest reading, meters.
    """

    directions: wp.array[wp.vec3]
    scales: wp.array[wp.float32]
    forward: wp.float64
    height: wp.float32
    reach: wp.float32
    limit: wp.float32


@wp.kernel(enable_backward=False)
def cast(
    rows: wp.array[wp.int32],
    poses: wp.array2d[wp.float64],
    meshes: wp.array[wp.uint64],
    optics: Optics,
    readings: wp.array2d[wp.float32],
):
    """Write what each ray of some robots reads, meters.

    Args:
        rows: (m,) the robots. poses: (n, 3). meshes: (n,) identity of the mesh of each robot. readings: (n, k).
    """
    place, ray = wp.tid()
    robot = rows[place]
    cosine = wp.cos(poses[robot, 2])
    sine = wp.sin(poses[robot, 2])
    start = wp.vec3(
        wp.float32(poses[robot, 0] + optics.forward * cosine),
        wp.float32(poses[robot, 1] + optics.forward * sine),
        optics.height,
    )
    ahead = wp.float64(optics.directions[ray][0])
    left = wp.float64(optics.directions[ray][1])
    along = wp.vec3(
        wp.float32(cosine * ahead - sine * left), wp.float32(sine * ahead + cosine * left), optics.directions[ray][2]
    )
    hit = wp.mesh_query_ray(meshes[robot], start, along, optics.reach)
    distance = optics.reach
    if hit.result:
        distance = hit.t
    readings[robot, ray] = wp.min(distance * optics.scales[ray], optics.limit)


class DeviceRays:
    """The rays of one sensor of `count` robots, as `labgym.envs.sensors` casts them.

    Args:
        sensor: a lidar or a depth camera. device: of Warp.
    """

    def __init__(self, sensor: LidarSensor | DepthSensor, count: int, device: Any) -> None:
        forward, height = 0.0, sensor.height
        if isinstance(sensor, LidarSensor):
            height += LEVEL  # tops in the plane of the lidar are not seen, as mostly by Embree; Warp would hit them
            angles = -np.pi + 2.0 * np.pi / sensor.rays * np.arange(sensor.rays)
            directions = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(sensor.rays)])
            lengths = np.ones(sensor.rays)
        else:
            left, up = pixel_slopes((sensor.rows, sensor.columns), sensor.hfov)
            parts = np.broadcast_arrays(np.ones((sensor.rows, sensor.columns)), left[None, :], up[:, None])
            grid = np.stack(parts, axis=-1).reshape(-1, 3)
            lengths = np.linalg.norm(grid, axis=1)
            directions, forward = grid / lengths[:, None], sensor.forward
        self.name, self._geometry = sensor.name, sensor.sees
        self._device, self._rays = device, len(directions)
        self._optics = Optics()
        self._optics.directions = wp.array(directions.astype(np.float32), dtype=wp.vec3, device=device)
        self._optics.scales = wp.array((1.0 / lengths).astype(np.float32), dtype=wp.float32, device=device)
        self._optics.forward, self._optics.height = forward, height
        self._optics.reach, self._optics.limit = sensor.reach * float(lengths.max()), sensor.reach
        self._readings = wp.zeros((count, self._rays), dtype=wp.float32, device=device)
        self._numbers = np.zeros(count, dtype=np.uint64)
        self._meshes: list[DeviceMesh | None] = [None] * count

    def enter(self, robot: int, world: World) -> None:
        """Let a robot see another world."""
        mesh = device_mesh(world, self._geometry or "solid", self._device)
        self._meshes[robot], self._numbers[robot] = mesh, mesh.number

    def cast(self, rows: NDArray[np.int32], poses: Any) -> None:
        """Cast the rays of some robots.

        Args:
            rows: (m,) robots. poses: (n, 3) of all, on the device.
        """
        robots = wp.array(rows, dtype=wp.int32, device=self._device)
        meshes = wp.array(self._numbers, dtype=wp.uint64, device=self._device)
        inputs = [robots, poses, meshes, self._optics, self._readings]
        wp.launch(cast, dim=(len(rows), self._rays), inputs=inputs, device=self._device)

    @property
    def readings(self) -> NDArray[np.float32]:
        """The readings of all robots, (n, rays) meters."""
        return np.array(self._readings.numpy())
