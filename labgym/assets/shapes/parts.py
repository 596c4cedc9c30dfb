"""A part: one primitive or swept solid with a material, somewhere in an asset's frame; and its triangles."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from itertools import pairwise
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from labgym.assets.shapes.joints import Joint

Array = NDArray[np.float64]
Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]
Point = tuple[float, float]
Spans = tuple[Point, Point, Point]
"""Ends of a box along x, y and z, meters."""
Primitive = Literal["box", "cylinder", "sphere", "ellipsoid", "capsule", "revolve", "prism", "mesh"]
Triangles = tuple[Array, NDArray[np.int64]]

UPRIGHT: Quaternion = (1.0, 0.0, 0.0, 0.0)
ALONG_X: Quaternion = (math.sqrt(0.5), 0.0, math.sqrt(0.5), 0.0)
ALONG_Y: Quaternion = (math.sqrt(0.5), -math.sqrt(0.5), 0.0, 0.0)
SIDEWAYS: Quaternion = (0.5, 0.5, 0.5, 0.5)
"""Turns a prism so that its outline lies in the (y, z) plane and its length along x."""


@dataclass(frozen=True)
class Part:
    """One solid of an asset.

    Attributes:
        primitive: box, cylinder, sphere, ellipsoid and capsule as MuJoCo has them; `revolve` turns a profile about
            z; `prism` extrudes a convex outline along z, symmetric about z = 0; `mesh` lists its triangles.
        size: full extents along the part's own axes before rotation, meters; (0, 0, 0) for a revolve.
        position: origin of the part in the asset's frame: its center, for a revolve the profile's (0, 0).
        quaternion: rotation (w, x, y, z).
        material: name in `MATERIALS`.
        profile: points (radius, z) of a revolve from bottom to top, or (x, y) of a prism counter-clockwise.
        triangles: vertices (n, 3) about the position and faces (m, 3) of a mesh.
        joint: the joint by which it moves, None for a fixed part.
        hidden: whether it is inside the asset, or behind a moving part, while everything is closed.
    """

    primitive: Primitive
    size: Vector
    position: Vector
    quaternion: Quaternion
    material: str
    profile: tuple[Point, ...] = ()
    triangles: Triangles | None = field(default=None, compare=False)
    joint: Joint | None = None
    hidden: bool = False

    @property
    def rotation(self) -> Array:
        """Rotation matrix, shape (3, 3)."""
        w, x, y, z = self.quaternion
        return np.array(
            [
                [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
            ]
        )

    def bounds(self) -> Array:
        """Return the exact axis-aligned bounds in the asset's frame, shape (2, 3)."""
        rotation, center = self.rotation, np.array(self.position)
        if self.primitive == "revolve":
            discs = np.array(self.profile)
            middle = center + discs[:, 1:] * rotation[:, 2]
            reach = discs[:, :1] * np.hypot(rotation[:, 0], rotation[:, 1])
            return np.array([(middle - reach).min(axis=0), (middle + reach).max(axis=0)])
        if self.primitive == "prism":
            outline = np.array(self.profile)
            middle = center + outline @ rotation[:, :2].T
            reach = np.abs(rotation[:, 2]) * self.size[2] / 2.0
            return np.array([(middle - reach).min(axis=0), (middle + reach).max(axis=0)])
        half = np.array(self.size) / 2.0
        if self.primitive in ("box", "mesh"):
            reach = np.abs(rotation) @ half
        elif self.primitive == "cylinder":
            reach = np.hypot(rotation[:, 0], rotation[:, 1]) * half[0] + np.abs(rotation[:, 2]) * half[2]
        elif self.primitive == "capsule":
            reach = half[0] + np.abs(rotation[:, 2]) * (half[2] - half[0])
        else:
            reach = np.linalg.norm(rotation * half, axis=1)
        return np.array([center - reach, center + reach])


def span(half: float, middle: float = 0.0) -> Point:
    """Return the ends of a span by half its length and its middle, meters."""
    return middle - half, middle + half


def block(material: str, x: Point, y: Point, z: Point) -> Part:
    """An upright box between spans along x, y and z; the ends of a span may come in either order."""
    size = (abs(x[1] - x[0]), abs(y[1] - y[0]), abs(z[1] - z[0]))
    return Part("box", size, ((x[0] + x[1]) / 2.0, (y[0] + y[1]) / 2.0, (z[0] + z[1]) / 2.0), UPRIGHT, material)


def plate(material: str, size: Vector, at: Vector, quaternion: Quaternion) -> Part:
    """A turned box, its center at `at`."""
    return Part("box", size, at, quaternion, material)


def rounded(material: str, x: Point, y: Point, z: Point, radius: float = 0.02) -> Part:
    """An upright box between spans whose four vertical edges are round."""
    hx, hy = abs(x[1] - x[0]) / 2.0, abs(y[1] - y[0]) / 2.0
    r = min(radius, 0.99 * hx, 0.99 * hy)
    center = ((x[0] + x[1]) / 2.0, (y[0] + y[1]) / 2.0, (z[0] + z[1]) / 2.0)
    return Part("prism", (2 * hx, 2 * hy, abs(z[1] - z[0])), center, UPRIGHT, material, _rounded_outline(hx, hy, r))


def cylinder(material: str, diameter: float, height: float, at: Vector, quaternion: Quaternion = UPRIGHT) -> Part:
    """A cylinder, its center at `at`, its axis along the rotated z."""
    return Part("cylinder", (diameter, diameter, height), at, quaternion, material)


def column(material: str, diameter: float, x: float, y: float, z: Point) -> Part:
    """An upright cylinder at (x, y) over a span of heights."""
    return cylinder(material, diameter, z[1] - z[0], (x, y, (z[0] + z[1]) / 2.0))


def sphere(material: str, diameter: float, at: Vector) -> Part:
    """A sphere."""
    return Part("sphere", (diameter, diameter, diameter), at, UPRIGHT, material)


def ellipsoid(material: str, size: Vector, at: Vector, quaternion: Quaternion = UPRIGHT) -> Part:
    """An ellipsoid of full extents `size`."""
    return Part("ellipsoid", size, at, quaternion, material)


def rod(material: str, diameter: float, start: Vector, end: Vector, flat: bool = False) -> Part:
    """A rod between two points: a capsule whose caps lie inside the points, or a flat-ended cylinder."""
    a, b = np.array(start), np.array(end)
    length = float(np.linalg.norm(b - a))
    x, y, z = ((b - a) / length).tolist()
    center = ((start[0] + end[0]) / 2.0, (start[1] + end[1]) / 2.0, (start[2] + end[2]) / 2.0)
    kind: Primitive = "cylinder" if flat else "capsule"
    return Part(kind, (diameter, diameter, length), center, between((0.0, 0.0, 1.0), (x, y, z)), material)


def tube(material: str, diameter: float, points: Sequence[Vector]) -> list[Part]:
    """Capsules along a polyline; the joints overlap by half a diameter so that bends look whole."""
    parts = []
    for start, end in pairwise(points):
        a, b = np.array(start), np.array(end)
        reach = (b - a) / np.linalg.norm(b - a) * diameter / 2.0
        first, last = (a - reach).tolist(), (b + reach).tolist()
        parts.append(rod(material, diameter, (first[0], first[1], first[2]), (last[0], last[1], last[2])))
    return parts


def revolved(
    material: str, profile: Sequence[Point], at: Vector = (0.0, 0.0, 0.0), quaternion: Quaternion = UPRIGHT
) -> Part:
    """A solid of revolution about the part's z axis; ends that are off the axis are closed by discs."""
    points = [(float(r), float(z)) for r, z in profile]
    if points[0] != points[-1]:
        points = [(0.0, points[0][1])] * (points[0][0] > 0.0) + points
        points = points + [(0.0, points[-1][1])] * (points[-1][0] > 0.0)
    return Part("revolve", (0.0, 0.0, 0.0), at, quaternion, material, tuple(points))


def collar(
    material: str, radii: Point, z: Point, at: Vector = (0.0, 0.0, 0.0), quaternion: Quaternion = UPRIGHT
) -> Part:
    """A ring about the part's z axis between an inner and an outer radius, over a span of heights."""
    (inner, outer), (low, high) = radii, z
    profile = [(inner, low), (outer, low), (outer, high), (inner, high), (inner, low)]
    return revolved(material, profile, at, quaternion)


def band(material: str, diameter: float, z: Point, x: float = 0.0, y: float = 0.0) -> Part:
    """A label or mark round a revolved body: turned with as many sides as the body, so that it never dips into it."""
    radius = diameter / 2.0
    return revolved(material, [(radius, z[0]), (radius, z[1])], (x, y, 0.0))


def prism(material: str, outline: Sequence[Point], length: float, at: Vector, quaternion: Quaternion = UPRIGHT) -> Part:
    """A convex outline (counter-clockwise) extruded along the part's z axis, half of `length` to each side."""
    points = tuple((float(u), float(v)) for u, v in outline)
    u, v = zip(*points, strict=True)
    return Part("prism", (max(u) - min(u), max(v) - min(v), length), at, quaternion, material, points)


def side_profile(material: str, outline: Sequence[Point], x: Point) -> Part:
    """A convex outline in the (y, z) plane, counter-clockwise seen from +x, over a span along x."""
    return prism(material, outline, x[1] - x[0], ((x[0] + x[1]) / 2.0, 0.0, 0.0), SIDEWAYS)


def turned(axis: Vector, angle: float) -> Quaternion:
    """Return the quaternion of a rotation about a unit axis, radians."""
    sine = math.sin(angle / 2.0)
    return math.cos(angle / 2.0), axis[0] * sine, axis[1] * sine, axis[2] * sine


def between(start: Vector, end: Vector) -> Quaternion:
    """Return a rotation that takes one unit vector to another."""
    dot = sum(a * b for a, b in zip(start, end, strict=True))
    if dot < -1.0 + 1e-9:
        return 0.0, 1.0, 0.0, 0.0
    cross = np.cross(start, end)
    norm = math.sqrt((1.0 + dot) ** 2 + float(cross @ cross))
    return (1.0 + dot) / norm, float(cross[0]) / norm, float(cross[1]) / norm, float(cross[2]) / norm


def _rounded_outline(hx: float, hy: float, radius: float, segments: int = 3) -> tuple[Point, ...]:
    outline = []
    for quarter, (cx, cy) in enumerate(((hx, hy), (-hx, hy), (-hx, -hy), (hx, -hy))):
        ox, oy = math.copysign(abs(cx) - radius, cx), math.copysign(abs(cy) - radius, cy)
        for k in range(segments + 1):
            angle = (quarter + k / segments) * math.pi / 2.0
            outline.append((ox + radius * math.cos(angle), oy + radius * math.sin(angle)))
    return tuple(outline)


if TYPE_CHECKING:
    import trimesh

SECTIONS = 24
"""Sides of a full turn."""

Faces = NDArray[np.int64]


def tessellate(part: Part) -> tuple[Array, Faces]:
    """Return a part's vertices (n, 3) in the asset's frame and its faces (m, 3), wound outwards."""
    vertices, faces = part.triangles or local_mesh(part.primitive, part.size, part.profile)
    return vertices @ part.rotation.T + np.array(part.position), faces


@lru_cache(maxsize=4096)
def local_mesh(primitive: Primitive, size: Vector, profile: tuple[Point, ...] = ()) -> tuple[Array, Faces]:
    """Return vertices and faces of a primitive before rotation and translation. The arrays are read-only."""
    mesh = _mesh(primitive, size, profile)
    vertices, faces = np.array(mesh.vertices, dtype=np.float64), np.array(mesh.faces, dtype=np.int64)
    vertices.setflags(write=False)
    faces.setflags(write=False)
    return vertices, faces


def _mesh(primitive: Primitive, size: Vector, profile: tuple[Point, ...]) -> trimesh.Trimesh:
    import trimesh

    creation = trimesh.creation
    mesh: trimesh.Trimesh
    if primitive == "box":
        mesh = creation.box(extents=size)
    elif primitive == "cylinder":
        mesh = creation.cylinder(radius=size[0] / 2.0, height=size[2], sections=_sections(size[0]))
    elif primitive == "capsule":
        sides = 16 if size[0] > 0.02 else 8
        # trimesh stands the capsule's lower cap center on the origin.
        mesh = creation.capsule(radius=size[0] / 2.0, height=max(size[2] - size[0], 1e-9), count=[sides // 2, sides])
        mesh.apply_translation(-mesh.bounds.mean(axis=0))
    elif primitive in ("sphere", "ellipsoid"):
        large = sorted(size)[1] > 0.05
        ball = creation.uv_sphere(radius=0.5, count=[12, SECTIONS] if large else [6, 12])
        mesh = trimesh.Trimesh(ball.vertices * np.array(size), ball.faces, process=False)
    elif primitive == "revolve":
        mesh = creation.revolve(np.array(profile), sections=_sections(2.0 * max(r for r, _ in profile)))
    else:
        mesh = _prism(np.array(profile), size[2])
    return mesh


def _sections(diameter: float) -> int:
    """Sides of a full turn; a multiple of four, so that all four sides are reached exactly."""
    return SECTIONS if diameter > 0.03 else 16 if diameter > 0.012 else 8


def _prism(outline: Array, length: float) -> trimesh.Trimesh:
    import trimesh

    count = len(outline)
    ring = np.arange(count)
    after = np.roll(ring, -1)
    fan = np.stack([np.zeros(count - 2, dtype=np.int64), ring[1:-1], ring[2:]], axis=1)
    sides = np.concatenate(
        [np.stack([ring, after, after + count], axis=1), np.stack([ring, after + count, ring + count], axis=1)]
    )
    bottom = np.column_stack([outline, np.full(count, -length / 2.0)])
    top = np.column_stack([outline, np.full(count, length / 2.0)])
    faces = np.concatenate([fan[:, ::-1], fan + count, sides])
    return trimesh.Trimesh(np.concatenate([bottom, top]), faces, process=False)
