"""Control steps of many robots in many scenes, in one call without the interpreter lock.

The arrays of scenes differ in size, so a row of addresses stands for the scene of each robot.
"""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from labgym.counts import MAX_PROCESSES, whole_number
from labgym.envs.parts.rays import DepthSensor, LidarSensor
from labgym.envs.planar.body import PlanarBody
from labgym.envs.planar.compiled import carray, compiled, entry, floats, integers, pointer, points, row_of
from labgym.envs.planar.contacts import ContactBuffers, buffers
from labgym.envs.planar.depth import Chunks, chunks_of, draw, lens_of
from labgym.envs.planar.plan import Cells, Outlines
from labgym.envs.planar.routes import CompiledDistanceToGo, RouteLengths
from labgym.envs.planar.scene import Beams, Boxes, beams, clearance_at, scan, scene_of, walls_at
from labgym.envs.planar.simulation import CHECK_INTERVAL, StepInputs, control_step
from labgym.envs.robot import ROBOT
from labgym.envs.simulation import Pose
from labgym.envs.world import World

Array = NDArray[np.float64]
Index = NDArray[np.int64]

ARRAYS = 18
"""Number of arrays of a scene; those of the lidar and of the field of distances included."""
SHARE = 8
"""Fewest robots of a thread."""


class Driving(NamedTuple):
    """Properties that all robots share during a control step.

    Attributes:
        checks: contact checks of a control step; 0 only measures. steps: physics steps between two of them.
        body: inertia and servos. beams: directions of the lidar's rays. reach: its range, meters.
    """

    checks: int
    steps: int
    body: PlanarBody
    beams: Beams
    reach: float


class Robots(NamedTuple):
    """The robots, and what the latest control step gave.

    Attributes:
        states: (n, 6), as in `labgym.envs.planar.simulation`.
        targets: (n, 2) target velocities, m/s and rad/s.
        scenes: (n, 2 ARRAYS + 2) address and size of each array of a robot's scene; rows and columns of its field.
        fields: (n, 3) origin and resolution of the field of distances, meters.
        poses: (n, 3) x, y and yaw in (-pi, pi]. velocities: (n, 2) m/s and rad/s.
        driven: (n,) meters. touched: (n,). clearances: (n,) meters.
        to_go: (n,) remaining distance by the field, meters; NaN without a field.
        ranges: (n, rays) readings of the lidar, meters.
    """

    states: Array
    targets: Array
    scenes: Index
    fields: Array
    poses: Array
    velocities: Array
    driven: Array
    touched: NDArray[np.bool_]
    clearances: Array
    to_go: Array
    ranges: NDArray[np.float32]


_NOTHING = Chunks(np.empty((0, 9), np.float32), np.zeros(1, np.int64), np.empty((0, 3)), np.empty((0, 3)))


class PlanarBatch:
    """Robots, each in its scene.

    Args:
        count: number of robots. control_dt: duration of a control step, seconds.
        lidar, camera: without noise; None for no readings.
        threads: number of threads; None for one per processor that this process may use.

    Attributes:
        robots: the arrays. routes: exact remaining distances.
    """

    def __init__(
        self,
        count: int,
        control_dt: float,
        lidar: LidarSensor | None,
        camera: DepthSensor | None = None,
        threads: int | None = None,
    ) -> None:
        size = 2 * ARRAYS + 2
        rays, reach, self._height = (
            (0, 1.0, ROBOT.lidar_height) if lidar is None else (lidar.rays, float(lidar.reach), lidar.height)
        )
        self.robots = Robots(
            states=np.zeros((count, 6)),
            targets=np.zeros((count, 2)),
            scenes=np.zeros((count, size), dtype=np.int64),
            fields=np.zeros((count, 3)),
            poses=np.zeros((count, 3)),
            velocities=np.zeros((count, 2)),
            driven=np.zeros(count),
            touched=np.zeros(count, dtype=np.bool_),
            clearances=np.zeros(count),
            to_go=np.full(count, np.nan),
            ranges=np.zeros((count, rays), dtype=np.float32),
        )
        self.routes = RouteLengths(count)
        # The arrays that addresses point to must live as long as they are used.
        self._arrays: list[Sequence[NDArray[np.generic]]] = [()] * count
        self._body: PlanarBody | None = None
        lens = None if camera is None else lens_of(camera.camera)
        self._lens, self._camera_name = lens, None if camera is None else camera.name
        self._chunks = [_NOTHING] * count
        self._depths = np.zeros((count, 0 if lens is None else lens.rows * lens.columns), np.float32)
        self._checks, self._reach, self._beams = round(control_dt / CHECK_INTERVAL), reach, beams(max(rays, 1))
        if threads is not None:
            whole_number("threads", threads, most=MAX_PROCESSES)
        available = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
        workers = max(1, min(available if threads is None else threads, count // (SHARE if lens is None else 1)))
        bounds = [count * k // workers for k in range(workers + 1)]
        self._shares = [(first, last, buffers()) for first, last in pairwise(bounds)]
        self._pool = ThreadPoolExecutor(workers - 1, "planar") if workers > 1 else None

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
        robots, walls, (plan, self._body, boxes) = self.robots, walls_at(world, self._height), scene_of(world)
        distances, grid = (np.empty((0, 0)), (0.0, 0.0, 1.0)) if field is None else field
        arrays = (*plan.solids, *plan.near, *walls, *boxes, distances)
        self._arrays[robot] = arrays
        robots.scenes[robot] = (*row_of(arrays), *distances.shape)
        robots.fields[robot] = grid
        robots.states[robot, :3], robots.states[robot, 3:] = pose, 0.0
        driving = Driving(0, 0, self._scene_body, self._beams, self._reach)
        _step(robot, robot + 1, robots, driving, self._shares[0][2])
        robots.driven[robot], robots.touched[robot] = 0.0, False
        self.routes.place(robot, exact, robots.poses)
        if self._lens is not None:
            self._chunks[robot] = chunks_of(world)
        self._look(robot, robot + 1)

    def step(self) -> None:
        """Advance all robots by one control step towards their targets."""
        body = self._scene_body
        steps = round(CHECK_INTERVAL / body.timestep)
        driving = Driving(self._checks, steps, body, self._beams, self._reach)

        def run(first: int, last: int, work: ContactBuffers) -> None:
            _step(first, last, self.robots, driving, work)
            self.routes.measure(first, last, self.robots.poses)
            self._look(first, last)

        if self._pool is None:
            run(*self._shares[0])
            return
        others = [self._pool.submit(run, *share) for share in self._shares[1:]]
        run(*self._shares[0])
        for other in others:
            other.result()

    def _look(self, first: int, last: int) -> None:
        """Draw the depth images of the robots from `first` to `last` - 1."""
        if self._lens is not None:
            for k in range(first, last):
                x, y, yaw = self.robots.poses[k]
                draw(x, y, yaw, self._chunks[k], self._lens, self._depths[k])

    def readings(self, sensor: str) -> NDArray[np.float32]:
        """Return the readings of the lidar or the depth camera of this name, (n, k) meters."""
        return (self._depths if sensor == self._camera_name else self.robots.ranges).copy()

    def close(self) -> None:
        """End the threads."""
        if self._pool is not None:
            self._pool.shutdown()

    @property
    def _scene_body(self) -> PlanarBody:
        if self._body is None:
            raise RuntimeError("place a robot first")
        return self._body


@entry
def _step(first: int, last: int, robots: Robots, driving: Driving, work: ContactBuffers) -> None:
    """Advance the robots from `first` to `last` - 1, and measure."""
    checks, steps, body, beams, reach = driving
    for k in range(first, last):
        row, state = robots.scenes[k], robots.states[k]
        solids, walls = _outlines(row, 0), _outlines(row, 9)
        near = Cells(floats(row, 5), integers(row, 6), integers(row, 7), integers(row, 8))
        boxes = Boxes(points(row, 14), points(row, 15), points(row, 16))
        v, w = robots.targets[k, 0], robots.targets[k, 1]
        driven, touched = control_step(state, v, w, checks, steps, StepInputs(body, solids, near, work))
        robots.driven[k], robots.touched[k] = driven, touched
        yaw = wrapped(state[2])
        robots.poses[k, 0], robots.poses[k, 1], robots.poses[k, 2] = state[0], state[1], yaw
        robots.velocities[k, 0] = math.cos(state[2]) * state[3] + math.sin(state[2]) * state[4]
        robots.velocities[k, 1] = state[5]
        robots.clearances[k] = clearance_at(state[0], state[1], boxes)
        if row[2 * 17 + 1] > 0:
            field = carray(pointer(row[2 * 17]), (row[2 * ARRAYS], row[2 * ARRAYS + 1]), np.float64)
            robots.to_go[k] = interpolated(state[0], state[1], field, robots.fields[k])
        else:
            robots.to_go[k] = math.nan
        if robots.ranges.shape[1] > 0:
            scan(state[0], state[1], yaw, walls, beams, reach, robots.ranges[k])


@entry
def remaining(poses: Array, fields: Index, grids: Array, to_go: Array) -> None:
    """Write the remaining distances of many robots (n,), meters; NaN without a field.

    Args:
        poses: (n, 3). fields: (n, 3) address, rows and columns of each field of distances; address 0 for none.
        grids: (n, 3) origin and resolution of each field, meters.
    """
    for k in range(len(poses)):
        to_go[k] = math.nan
        if fields[k, 0] != 0:
            field = carray(pointer(fields[k, 0]), (fields[k, 1], fields[k, 2]), np.float64)
            to_go[k] = interpolated(poses[k, 0], poses[k, 1], field, grids[k])


@compiled
def wrapped(angle: float) -> float:
    """Return the angle in (-pi, pi], as `labgym.geometry.wrap_angle`."""
    return math.pi - (math.pi - angle) % (2.0 * math.pi)


@compiled
def interpolated(x: float, y: float, field: Array, grid: Array) -> float:
    """Return the remaining distance from a point, as `GridDistanceToGo.at`."""
    rows, columns = field.shape
    u = min(max((x - grid[0]) / grid[2] - 0.5, 0.0), columns - 1.001)
    v = min(max((y - grid[1]) / grid[2] - 0.5, 0.0), rows - 1.001)
    column, row = int(u), int(v)
    u, v = u - column, v - row
    a, b = field[row, column], field[row, column + 1]
    c, d = field[row + 1, column], field[row + 1, column + 1]
    distance: float = (1.0 - v) * ((1.0 - u) * a + u * b) + v * ((1.0 - u) * c + u * d)
    return distance


@compiled
def _outlines(row: Index, place: int) -> Outlines:
    return Outlines(
        points(row, place),
        points(row, place + 1),
        floats(row, place + 2),
        integers(row, place + 3),
        floats(row, place + 4),
    )
