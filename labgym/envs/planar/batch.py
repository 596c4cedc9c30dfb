"""Control steps of many robots in many scenes, in one call without the interpreter lock.

The arrays of scenes differ in size, so a row of addresses stands for the scene of each robot.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from labgym.counts import MAX_PROCESSES, whole_number
from labgym.envs.conditions.cast import MOST
from labgym.envs.conditions.glass import NORMAL
from labgym.envs.conditions.passing import Company
from labgym.envs.parts.rays import DepthSensor, LidarSensor
from labgym.envs.planar.body import PlanarBody
from labgym.envs.planar.compiled import carray, compiled, entry, floats, integers, pointer, points, row_of
from labgym.envs.planar.contacts import ContactBuffers, buffers
from labgym.envs.planar.depth import Chunks, chunks_of, draw, lens_of
from labgym.envs.planar.plan import Cells, Outlines
from labgym.envs.planar.routes import CompiledDistanceToGo, RouteLengths
from labgym.envs.planar.scene import (
    NO_OUTLINES,
    Beams,
    Boxes,
    ShownShapes,
    beams,
    clearance_at,
    scan,
    scan_shown,
    scene_of,
    walls_at,
)
from labgym.envs.planar.simulation import (
    CHECK_INTERVAL,
    StepInputs,
    company_step,
    control_step,
    touched_names,
)
from labgym.envs.robot import ROBOT
from labgym.envs.simulation import Pose, RobotMotion
from labgym.envs.world import World

Array = NDArray[np.float64]
Index = NDArray[np.int64]

SOLIDS, NEAR, WALLS, BOXES, FIELD, COMPANY, PANES, SHAPES, PLACES, ARRAYS = 0, 5, 9, 14, 17, 18, 22, 27, 32, 33
"""First places of the arrays of a scene, and their number."""
SHARE = 8
"""Fewest robots of a thread."""


class Driving(NamedTuple):
    """Properties that all robots share during a control step.

    Attributes:
        checks: contact checks of a control step; 0 only measures. steps: physics steps between two of them.
        body: inertia and servos. beams: directions of the lidar's rays. reach: its range, meters.
        cosine: least of the angle to the normal at which it sees glass.
    """

    checks: int
    steps: int
    body: PlanarBody
    beams: Beams
    reach: float
    cosine: float


class Robots(NamedTuple):
    """The robots, and what the latest control step gave.

    Attributes:
        states: (n, 6), as in `labgym.envs.planar.simulation`.
        targets: (n, 2) target velocities, m/s and rad/s.
        scenes: (n, 2 ARRAYS + 2) address and size of each array of a robot's scene; rows and columns of its field.
        times: (n,) of the episodes, seconds; NaN of those whose contacts are not checked after each physics step.
        first: (n, 1 + people) ranks of what was touched, as of `company_step`.
        eyes: (n, 3) poses of the lidars.
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
    times: Array
    first: Index
    eyes: Array
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
            times=np.full(count, np.nan),
            first=np.zeros((count, 1 + MOST), dtype=np.int64),
            eyes=np.zeros((count, 3)),
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
        self._conditions: list[Sequence[NDArray[np.generic]]] = [()] * count
        self._places = [np.empty((0, 4))] * count
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
        self._arrays[robot], self._conditions[robot] = arrays, ()
        robots.scenes[robot, : 2 * COMPANY] = row_of(arrays)
        robots.scenes[robot, 2 * COMPANY : 2 * ARRAYS] = 0
        robots.scenes[robot, 2 * ARRAYS :] = distances.shape
        robots.fields[robot], robots.times[robot] = grid, math.nan
        robots.states[robot, :3], robots.states[robot, 3:] = pose, 0.0
        _step(robot, robot + 1, robots, self._driving(0), True, self._shares[0][2])
        robots.driven[robot], robots.touched[robot] = 0.0, False
        self.routes.place(robot, exact, robots.poses)
        if self._lens is not None:
            self._chunks[robot] = chunks_of(world)
        self._look(robot, robot + 1)

    def accompany(self, robot: int, company: Company, shown: ShownShapes | None, world: World, height: float) -> None:
        """Add the conditions of an episode to the scene of a robot that was placed.

        Args:
            company: people and docking, whose arrays advance in place. shown: what the lidar sees of the conditions.
            height: of the lidar, meters.
        """
        robots = self.robots
        panes, _, shapes, places = (
            ShownShapes(NO_OUTLINES, NORMAL, NO_OUTLINES, np.empty((0, 4))) if shown is None else shown
        )
        walls, others = walls_at(world, height, shown), (*company, *panes, *shapes, places)
        self._conditions[robot] = (*walls, *others)
        robots.scenes[robot, 2 * WALLS : 2 * BOXES] = row_of(walls)
        robots.scenes[robot, 2 * COMPANY : 2 * ARRAYS] = row_of(others)
        self._places[robot] = places
        robots.times[robot] = 0.0

    def show(self, robot: int, eye: Pose, shown: ShownShapes | None) -> None:
        """Set the pose of a lidar, and where the bodies are that it sees."""
        self.robots.eyes[robot] = eye
        if shown is not None:
            self._places[robot][:] = shown.places

    def step(self, look: bool = True) -> None:
        """Advance all robots by one control step towards their targets; `look` reads the lidars, too."""
        driving = self._driving(self._checks)

        def run(first: int, last: int, work: ContactBuffers) -> None:
            _step(first, last, self.robots, driving, look, work)
            self.routes.measure(first, last, self.robots.poses)
            self._look(first, last)

        self._shared(run)

    def scan(self, first: int = 0, last: int | None = None) -> None:
        """Read the lidars of the robots from `first` to `last` - 1, by default of all, at the poses `robots.eyes`."""
        driving = self._driving(0)
        if last is not None:
            _scan_all(first, last, self.robots, driving)
            return
        self._shared(lambda begin, end, _: _scan_all(begin, end, self.robots, driving))

    def _shared(self, run: Callable[[int, int, ContactBuffers], None]) -> None:
        """Carry out a function of first robot, last robot and buffers for all robots, shared among the threads."""
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

    @property
    def timestep(self) -> float:
        """Duration of a physics step, seconds."""
        return CHECK_INTERVAL / self._driving(0).steps

    def close(self) -> None:
        """End the threads."""
        if self._pool is not None:
            self._pool.shutdown()

    def _driving(self, checks: int) -> Driving:
        if self._body is None:
            raise RuntimeError("place a robot first")
        steps = round(CHECK_INTERVAL / self._body.timestep)
        return Driving(checks, steps, self._body, self._beams, self._reach, NORMAL)


class BatchRobot(RobotMotion):
    """One robot of a batch as the physics of an episode: it has driven already, and is read.

    Args:
        batch: of the robot. robot: its number.
    """

    def __init__(self, batch: PlanarBatch, robot: int) -> None:
        self._batch, self._robot = batch, robot
        self.place((0.0, 0.0, 0.0))

    def place(self, pose: Pose) -> None:  # noqa: ARG002
        """Read where the batch has put the robot."""
        self._move(*self._batch.robots.states[self._robot].tolist())

    @property
    def timestep(self) -> float:
        """Duration of a physics step, seconds."""
        return self._batch.timestep

    def drive(self, *command: float) -> tuple[float, bool]:  # noqa: ARG002
        """Return the length driven in the latest control step, meters, and whether the robot touched anything."""
        self.place(self.pose)
        robots = self._batch.robots
        return float(robots.driven[self._robot]), bool(robots.touched[self._robot])

    def drive_among(self, time: float, company: Company, *command: float) -> tuple[float, tuple[str, ...]]:  # noqa: ARG002
        """Return the length driven in the latest control step, meters, and the names of what the robot touched."""
        driven, touched = self.drive(*command)
        first = self._batch.robots.first[self._robot, : 1 + len(company.before)]
        return driven, touched_names(first) if touched else ()


@entry
def _step(first: int, last: int, robots: Robots, driving: Driving, look: bool, work: ContactBuffers) -> None:
    """Advance the robots from `first` to `last` - 1, and measure; `look` reads the lidars."""
    checks, steps, body, _, _, _ = driving
    for k in range(first, last):
        row, state = robots.scenes[k], robots.states[k]
        near = Cells(floats(row, NEAR), integers(row, NEAR + 1), integers(row, NEAR + 2), integers(row, NEAR + 3))
        boxes = Boxes(points(row, BOXES), points(row, BOXES + 1), points(row, BOXES + 2))
        around = StepInputs(body, _outlines(row, SOLIDS), near, work)
        v, w = robots.targets[k, 0], robots.targets[k, 1]
        if checks == 0 or math.isnan(robots.times[k]):
            robots.driven[k], robots.touched[k] = control_step(state, v, w, checks, steps, around)
        else:
            company = Company(
                points(row, COMPANY), points(row, COMPANY + 1), floats(row, COMPANY + 2), floats(row, COMPANY + 3)
            )
            ranks = robots.first[k, : 1 + len(company.before)]
            robots.driven[k] = company_step(state, (v, w), (checks, steps), around, robots.times[k], company, ranks)
            robots.touched[k] = ranks.max() > 0
        yaw = wrapped(state[2])
        robots.poses[k, 0], robots.poses[k, 1], robots.poses[k, 2] = state[0], state[1], yaw
        robots.eyes[k, 0], robots.eyes[k, 1], robots.eyes[k, 2] = state[0], state[1], yaw
        robots.velocities[k, 0] = math.cos(state[2]) * state[3] + math.sin(state[2]) * state[4]
        robots.velocities[k, 1] = state[5]
        robots.clearances[k] = clearance_at(state[0], state[1], boxes)
        if row[2 * FIELD + 1] > 0:
            field = carray(pointer(row[2 * FIELD]), (row[2 * ARRAYS], row[2 * ARRAYS + 1]), np.float64)
            robots.to_go[k] = interpolated(state[0], state[1], field, robots.fields[k])
        else:
            robots.to_go[k] = math.nan
        if look:
            scan_row(k, robots, driving)


@entry
def _scan_all(first: int, last: int, robots: Robots, driving: Driving) -> None:
    """Read the lidars of the robots from `first` to `last` - 1."""
    for k in range(first, last):
        scan_row(k, robots, driving)


@compiled
def scan_row(k: int, robots: Robots, driving: Driving) -> None:
    """Read the lidar of a robot."""
    if robots.ranges.shape[1] == 0:
        return
    row, x, y, yaw = robots.scenes[k], robots.eyes[k, 0], robots.eyes[k, 1], robots.eyes[k, 2]
    scan(x, y, yaw, _outlines(row, WALLS), driving.beams, driving.reach, robots.ranges[k])
    if row[2 * PANES + 1] > 0 or row[2 * PLACES + 1] > 0:
        places = carray(pointer(row[2 * PLACES]), (row[2 * PLACES + 1] // 4, 4), np.float64)
        shown = ShownShapes(_outlines(row, PANES), driving.cosine, _outlines(row, SHAPES), places)
        scan_shown(x, y, yaw, shown, driving.beams, driving.reach, robots.ranges[k])


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


@entry
def polar(poses: Array, goals: Array, distances: Array, reach: float, readings: NDArray[np.float32]) -> None:
    """Write the goals (n, 3) in polar form, as `labgym.envs.parts.vectors.polar`, to readings (n, 3).

    Args:
        poses: (n, 3). distances: (n,) to the goals, meters. reach: largest distance that is read, meters.
    """
    for k in range(len(poses)):
        bearing = math.atan2(goals[k, 1] - poses[k, 1], goals[k, 0] - poses[k, 0]) - poses[k, 2]
        readings[k, 0] = min(distances[k], reach)
        readings[k, 1], readings[k, 2] = math.cos(bearing), math.sin(bearing)


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
