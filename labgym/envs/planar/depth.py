"""Depth images by drawing triangles: planar depth at the centers of the pixels, as rays through them would give.

A triangle covers a pixel if the direction of its center is on the inner side of the three planes through the eye and
one side (J. Olano and T. Greer, Triangle scan conversion using 2D homogeneous coordinates, 1997), so that triangles
which reach behind the eye need no clipping. Along a row of pixels, the reciprocal of the depth is linear. The largest
one at each pixel wins, in whatever order triangles come. Chunks are drawn from near to far, and those behind what has
been drawn are skipped (N. Greene, M. Kass and G. Miller, Hierarchical Z-buffer visibility, 1993).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from labgym.envs.planar.compiled import compiled, entry
from labgym.envs.sensors import Camera
from labgym.envs.simulation import Pose
from labgym.envs.world import World
from labgym.scenes import SceneMesh

FACES = 96
"""Largest number of triangles in a chunk."""


class Chunks(NamedTuple):
    """Triangles in groups of neighbors.

    Attributes:
        corners: (m, 9) x, y and z of the three corners of each triangle, meters, room frame; in single precision, as
            Embree reads them.
        first: (n + 1,) the first triangle of each chunk.
        center, half: (n, 3) center and half extents of the box around each chunk.
    """

    corners: NDArray[np.float32]
    first: NDArray[np.int64]
    center: NDArray[np.float64]
    half: NDArray[np.float64]


def chunks_of(world: World) -> Chunks:
    """Return what a camera sees of a world; it is built once."""
    return world.derived("planar chunks", lambda _: chunked(world.mesh("visual")))


def chunked(mesh: SceneMesh) -> Chunks:
    """Return the triangles of a mesh in chunks; a chunk belongs to one object."""
    order = np.argsort(mesh.owner, kind="stable")
    corners = mesh.vertices.astype(np.float32)[mesh.faces[order]]
    ends = np.flatnonzero(np.diff(mesh.owner[order], append=np.iinfo(np.int64).max)) + 1
    begins = np.concatenate([[0], ends[:-1]])
    parts = [np.arange(begin, end, FACES) for begin, end in zip(begins, ends, strict=True)]
    first = np.concatenate([*parts, [len(corners)]]).astype(np.int64)
    low = np.minimum.reduceat(corners.min(axis=1), first[:-1]).astype(np.float64)
    high = np.maximum.reduceat(corners.max(axis=1), first[:-1]).astype(np.float64)
    return Chunks(np.ascontiguousarray(corners.reshape(-1, 9)), first, (low + high) / 2.0, (high - low) / 2.0)


Array = NDArray[np.float64]
Image = NDArray[np.float32]

TILE = 8
"""Side of the squares of pixels whose largest depth is known, pixels."""
NEAR = 1e-3
"""Depth of the nearest corner up to which a triangle, or a chunk, may cover any pixel, meters."""
SLACK = 1e-6
"""Width by which the bounds of triangles and chunks are larger, to allow for rounding, pixels."""


class Eye(NamedTuple):
    """Where a level camera stands and looks.

    Attributes:
        x, y: place, meters. cosine, sine: of the yaw.
    """

    x: float
    y: float
    cosine: float
    sine: float


class Tiles(NamedTuple):
    """The largest depth of each square of pixels.

    Attributes:
        across: number of squares in a row. least: (n,) least reciprocal of the depth, 1/m.
        stale: (n,) whether pixels were drawn since `least` was computed.
    """

    across: int
    least: Array
    stale: NDArray[np.bool_]


class Lens(NamedTuple):
    """A level camera, as `labgym.envs.sensors.Camera`.

    Attributes:
        rows, columns: size of the image. focal: focal length, pixels. reach: largest depth, meters.
        forward, height: place ahead of the robot's axis and above the floor, meters.
    """

    rows: int
    columns: int
    focal: float
    reach: float
    forward: float
    height: float


def lens_of(camera: Camera) -> Lens:
    """Return the lens of a camera."""
    rows, columns = camera.shape
    return Lens(rows, columns, camera.focal, camera.reach, camera.forward, camera.height)


def depth(world: World, pose: Pose, camera: Camera) -> Image:
    """Return the planar depth that a camera sees from a pose of the robot, (rows, columns) meters."""
    image = np.empty(camera.shape, np.float32)
    draw(*pose, chunks_of(world), lens_of(camera), image.ravel())
    return image


@entry
def draw(x: float, y: float, yaw: float, chunks: Chunks, lens: Lens, image: Image) -> None:
    """Write the planar depth from a pose of the robot, (rows * columns,) meters."""
    cosine, sine = math.cos(yaw), math.sin(yaw)
    eye = Eye(x + lens.forward * cosine, y + lens.forward * sine, cosine, sine)
    count = len(chunks.first) - 1
    nearest = np.empty(count)
    which = np.empty(count, np.int64)
    windows = np.empty((count, 4), np.int64)
    visible = _visible(chunks.center, chunks.half, eye, lens, which, nearest, windows)
    across = (lens.columns + TILE - 1) // TILE
    count = across * ((lens.rows + TILE - 1) // TILE)
    background = 1.0 / lens.reach
    inverse = np.full(lens.rows * lens.columns, background)
    tiles = Tiles(across, np.full(count, background), np.zeros(count, np.bool_))
    for place in np.argsort(nearest[:visible]):
        if nearest[place] > NEAR and _hidden(nearest[place], windows[place], lens, inverse, tiles):
            continue
        first, last = chunks.first[which[place]], chunks.first[which[place] + 1]
        if _fill(chunks.corners[first:last], eye, lens, inverse):
            for row in range(windows[place, 0] // TILE, windows[place, 1] // TILE + 1):
                for column in range(windows[place, 2] // TILE, windows[place, 3] // TILE + 1):
                    tiles.stale[row * across + column] = True
    for pixel in range(lens.rows * lens.columns):
        image[pixel] = lens.reach if inverse[pixel] <= background else 1.0 / inverse[pixel]


@compiled
def _visible(
    center: Array,
    half: Array,
    eye: Eye,
    lens: Lens,
    which: NDArray[np.int64],
    nearest: Array,
    windows: NDArray[np.int64],
) -> int:
    """Write the chunks in view, their least depths, and the first and last row and column of each; return how many."""
    visible, (eye_x, eye_y, cosine, sine) = 0, eye
    for chunk in range(len(center)):
        dx, dy, dz = center[chunk, 0] - eye_x, center[chunk, 1] - eye_y, center[chunk, 2] - lens.height
        half_x, half_y, half_z = half[chunk, 0], half[chunk, 1], half[chunk, 2]
        ahead, left = cosine * dx + sine * dy, cosine * dy - sine * dx
        extent = abs(cosine) * half_x + abs(sine) * half_y
        near, far = ahead - extent, ahead + extent
        if far <= 0.0 or near > lens.reach:
            continue
        first_row, last_row, first_column, last_column = 0, lens.rows - 1, 0, lens.columns - 1
        if near > NEAR:
            low, high = math.inf, -math.inf
            for side_x in (-half_x, half_x):
                for side_y in (-half_y, half_y):
                    slope = (left + cosine * side_y - sine * side_x) / (ahead + cosine * side_x + sine * side_y)
                    low, high = min(low, slope), max(high, slope)
            first_column, last_column = _pixels(low, high, lens.columns, lens.focal)
            if first_column > last_column:
                continue
            up, down = dz + half_z, dz - half_z
            top, bottom = up / (near if up > 0.0 else far), down / (near if down < 0.0 else far)
            first_row, last_row = _pixels(bottom, top, lens.rows, lens.focal)
            if first_row > last_row:
                continue
        which[visible], nearest[visible] = chunk, near
        windows[visible, 0], windows[visible, 1] = first_row, last_row
        windows[visible, 2], windows[visible, 3] = first_column, last_column
        visible += 1
    return visible


@compiled
def _pixels(low: float, high: float, count: int, focal: float) -> tuple[int, int]:
    """Return the first and the last pixel whose center has a slope between two slopes; slopes fall along the image."""
    middle = count / 2.0 - 0.5
    begin, end = middle - focal * high - SLACK, middle - focal * low + SLACK
    if begin > count or end < 0.0:
        return 1, 0
    return max(0, math.ceil(begin)), min(count - 1, math.floor(end))


@compiled
def _hidden(near: float, window: NDArray[np.int64], lens: Lens, inverse: Array, tiles: Tiles) -> bool:
    """Return whether everything in the window of a chunk is nearer than the chunk."""
    inverse_near, (across, least, stale) = 1.0 / near, tiles
    for row in range(window[0] // TILE, window[1] // TILE + 1):
        for column in range(window[2] // TILE, window[3] // TILE + 1):
            tile = row * across + column
            if least[tile] < inverse_near and stale[tile]:
                smallest = math.inf
                for i in range(row * TILE, min(lens.rows, row * TILE + TILE)):
                    for j in range(column * TILE, min(lens.columns, column * TILE + TILE)):
                        smallest = min(smallest, inverse[i * lens.columns + j])
                least[tile], stale[tile] = smallest, False
            if least[tile] < inverse_near:
                return False
    return True


@compiled
def _fill(corners: Image, eye: Eye, lens: Lens, inverse: Array) -> bool:
    """Draw triangles (n, 9); return whether any covers a pixel.

    Coordinates of their corners a, b and c are ahead (u), to the left (v) and upwards (w) of the eye. `p`, `q` and `r`
    are the normals of the planes through the eye and the sides ab, bc and ca.
    """
    middle, step, drawn = lens.columns / 2.0 - 0.5, 1.0 / lens.focal, False
    eye_x, eye_y, cosine, sine = eye
    for face in range(len(corners)):
        dx, dy, aw = corners[face, 0] - eye_x, corners[face, 1] - eye_y, corners[face, 2] - lens.height
        au, av = cosine * dx + sine * dy, cosine * dy - sine * dx
        dx, dy, bw = corners[face, 3] - eye_x, corners[face, 4] - eye_y, corners[face, 5] - lens.height
        bu, bv = cosine * dx + sine * dy, cosine * dy - sine * dx
        dx, dy, cw = corners[face, 6] - eye_x, corners[face, 7] - eye_y, corners[face, 8] - lens.height
        cu, cv = cosine * dx + sine * dy, cosine * dy - sine * dx
        near = min(au, min(bu, cu))
        if max(au, max(bu, cu)) <= 0.0 or near > lens.reach:
            continue
        first_row, last_row, first_column, last_column = 0, lens.rows - 1, 0, lens.columns - 1
        if near > NEAR:
            a, b, c = 1.0 / au, 1.0 / bu, 1.0 / cu
            low, high = min(av * a, min(bv * b, cv * c)), max(av * a, max(bv * b, cv * c))
            first_column, last_column = _pixels(low, high, lens.columns, lens.focal)
            if first_column > last_column:
                continue
            low, high = min(aw * a, min(bw * b, cw * c)), max(aw * a, max(bw * b, cw * c))
            first_row, last_row = _pixels(low, high, lens.rows, lens.focal)
            if first_row > last_row:
                continue
        pu, pv, pw = av * bw - aw * bv, aw * bu - au * bw, au * bv - av * bu
        qu, qv, qw = bv * cw - bw * cv, bw * cu - bu * cw, bu * cv - bv * cu
        ru, rv, rw = cv * aw - cw * av, cw * au - cu * aw, cu * av - cv * au
        volume = au * qu + av * qv + aw * qw
        if volume == 0.0:
            continue
        sign = 1.0 if volume > 0.0 else -1.0
        scale = 1.0 / volume
        nu, nv, nw = (pu + qu + ru) * scale, (pv + qv + rv) * scale, (pw + qw + rw) * scale
        for row in range(first_row, last_row + 1):
            up = (lens.rows / 2.0 - 0.5 - row) * step
            # Two triangles with a common side compute the same bound for it: no pixel is left out between them.
            begin, end = _inner(sign * (pu + pw * up), sign * pv, middle, lens.focal, first_column, last_column)
            begin, end = _inner(sign * (qu + qw * up), sign * qv, middle, lens.focal, begin, end)
            begin, end = _inner(sign * (ru + rw * up), sign * rv, middle, lens.focal, begin, end)
            base, along = row * lens.columns, nu + nw * up
            drawn |= end >= begin
            for column in range(begin, end + 1):
                value = along + nv * ((middle - column) * step)
                if value > inverse[base + column]:
                    inverse[base + column] = value
    return drawn


@compiled
def _inner(constant: float, slope: float, middle: float, focal: float, begin: int, end: int) -> tuple[int, int]:
    """Return the first and the last column k from `begin` to `end` on the inner side of a line.

    There, constant + slope (middle - k) / focal is not negative.
    """
    if slope == 0.0:
        return (begin, end) if constant >= 0.0 else (1, 0)
    bound = middle + focal * constant / slope
    if slope > 0.0:
        if bound < begin:
            return 1, 0
        return begin, (math.floor(bound) if bound < end else end)
    if bound > end:
        return 1, 0
    return (math.ceil(bound) if bound > begin else begin), end
