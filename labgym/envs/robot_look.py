"""Visual geoms of the robot: white shells, graphite joints, one teal accent. They neither collide nor have mass."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import mujoco

Point = tuple[float, float, float]

# name: (rgba, specular, shininess, emission)
FINISHES: dict[str, tuple[tuple[float, float, float, float], float, float, float]] = {
    "white": ((0.93, 0.94, 0.95, 1.0), 0.5, 0.7, 0.0),
    "graphite": ((0.16, 0.17, 0.19, 1.0), 0.4, 0.5, 0.0),
    "rubber": ((0.07, 0.07, 0.08, 1.0), 0.1, 0.1, 0.0),
    "glass": ((0.03, 0.04, 0.06, 1.0), 1.0, 1.0, 0.0),
    "accent": ((0.05, 0.62, 0.62, 1.0), 0.3, 0.5, 0.35),
}

# The arm is folded over the deck, inside the chassis radius: shoulder, elbow, wrist, flange, in the robot frame.
ARM: tuple[Point, ...] = ((0.00, 0.0, 0.74), (-0.01, 0.0, 1.02), (0.15, 0.0, 0.86), (0.17, 0.0, 0.72))


@dataclass(frozen=True)
class Dresser:
    """Adds visual geoms to one body of a spec; lengths in meters, the robot frame."""

    spec: mujoco.MjSpec
    body: mujoco.MjsBody

    def shell(
        self, name: str, finish: str, half: Sequence[float], centre: Sequence[float], edges: float = 0.15
    ) -> None:
        """Add a superellipsoid of the given half extents: a box with rounded edges, or a cylinder if `edges` is 1."""
        mesh = self.spec.add_mesh(name=name)
        mesh.make_supersphere(28, edges, 0.15)
        mesh.scale = list(half)
        mesh.inertia = mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL
        self._add(mujoco.mjtGeom.mjGEOM_MESH, finish, meshname=name, pos=list(centre))

    def disc(self, finish: str, radius: float, bottom: float, top: float) -> None:
        """Add a cylinder about the robot's axis."""
        self.rod(finish, radius, (0.0, 0.0, bottom), (0.0, 0.0, top))

    def rod(
        self, finish: str, radius: float, start: Sequence[float], end: Sequence[float], round_ends: bool = False
    ) -> None:
        """Add a cylinder between two points, or a capsule if its ends are round."""
        kind = mujoco.mjtGeom.mjGEOM_CAPSULE if round_ends else mujoco.mjtGeom.mjGEOM_CYLINDER
        self._add(kind, finish, size=[radius, 0.0, 0.0], fromto=[*start, *end])

    def box(self, finish: str, half: Sequence[float], centre: Sequence[float]) -> None:
        """Add a box of half extents."""
        self._add(mujoco.mjtGeom.mjGEOM_BOX, finish, size=list(half), pos=list(centre))

    def _add(self, kind: mujoco.mjtGeom, finish: str, **shape: object) -> None:
        self.body.add_geom(type=kind, material=finish, contype=0, conaffinity=0, mass=0.0, group=1, **shape)


def dress(spec: mujoco.MjSpec, base: mujoco.MjsBody, radius: float, height: float) -> None:
    """Add materials and visual geoms to the base of a robot; radius of the chassis and height in meters."""
    for name, (rgba, specular, shininess, emission) in FINISHES.items():
        spec.add_material(name=name, rgba=rgba, specular=specular, shininess=shininess, emission=emission)
    dresser = Dresser(spec, base)
    _dress_base(dresser, radius)
    _dress_column(dresser, height)
    _dress_arm(dresser)


def dress_plainly(spec: mujoco.MjSpec, base: mujoco.MjsBody, radius: float, height: float, deck: float) -> None:
    """Add materials and cylinders to the base of a robot of other dimensions, with a mark of its heading; meters."""
    for name, (rgba, specular, shininess, emission) in FINISHES.items():
        spec.add_material(name=name, rgba=rgba, specular=specular, shininess=shininess, emission=emission)
    dresser = Dresser(spec, base)
    dresser.disc("white", radius, 0.02, deck)
    if height > deck:
        dresser.disc("graphite", radius / 3.0, deck, height)
    dresser.rod("accent", 0.015, (0.3 * radius, 0.0, deck + 0.005), (0.9 * radius, 0.0, deck + 0.005))


def _dress_base(dresser: Dresser, radius: float) -> None:
    dresser.shell("skirt", "graphite", (radius - 0.015, radius - 0.015, 0.06), (0.0, 0.0, 0.10), edges=1.0)
    for side in (-1.0, 1.0):
        dresser.rod("rubber", 0.075, (0.0, side * 0.20, 0.075), (0.0, side * 0.24, 0.075))
    # The lidar looks out of a dark slot between two white shells, at 0.25 m.
    dresser.shell("lower_shell", "white", (radius, radius, 0.065), (0.0, 0.0, 0.165), edges=1.0)
    dresser.disc("glass", radius - 0.025, 0.20, 0.30)
    dresser.shell("upper_shell", "white", (radius, radius, 0.055), (0.0, 0.0, 0.325), edges=1.0)
    dresser.disc("accent", radius - 0.022, 0.372, 0.384)
    dresser.disc("graphite", radius - 0.032, 0.372, 0.392)
    dresser.rod("graphite", 0.010, (0.19, 0.0, 0.39), (0.19, 0.0, 0.49))
    dresser.shell("depth_camera", "graphite", (0.014, 0.050, 0.014), (0.19, 0.0, 0.50))
    for side in (-0.028, 0.028):
        dresser.rod("glass", 0.008, (0.19, side, 0.50), (0.205, side, 0.50))


def _dress_column(dresser: Dresser, height: float) -> None:
    back = -0.11
    dresser.shell("foot", "graphite", (0.10, 0.12, 0.035), (back, 0.0, 0.41))
    dresser.shell("mast", "white", (0.065, 0.085, (height - 0.58) / 2.0), (back, 0.0, (height + 0.22) / 2.0))
    dresser.box("graphite", (0.010, 0.035, 0.30), (back + 0.060, 0.0, 0.76))
    dresser.box("accent", (0.002, 0.006, 0.20), (back - 0.065, 0.0, 0.80))
    dresser.rod("graphite", 0.035, (back, 0.0, height - 0.20), (back, 0.0, height - 0.10))
    dresser.shell("head", "white", (0.075, 0.125, 0.060), (back + 0.015, 0.0, height - 0.06), edges=0.4)
    dresser.shell("visor", "glass", (0.030, 0.105, 0.036), (back + 0.066, 0.0, height - 0.06), edges=0.4)
    for side in (-0.045, 0.045):
        dresser.rod("accent", 0.010, (back + 0.092, side, height - 0.06), (back + 0.098, side, height - 0.06))


def _dress_arm(dresser: Dresser) -> None:
    shoulder, elbow, wrist, flange = ARM
    dresser.rod("graphite", 0.045, (-0.06, 0.0, shoulder[2]), shoulder)
    for joint, size in ((shoulder, 0.048), (elbow, 0.042), (wrist, 0.034)):
        dresser.rod("graphite", size, (joint[0], -size - 0.012, joint[2]), (joint[0], size + 0.012, joint[2]))
        dresser.rod("accent", size * 0.75, (joint[0], -size - 0.015, joint[2]), (joint[0], size + 0.015, joint[2]))
    dresser.rod("white", 0.038, shoulder, elbow, round_ends=True)
    dresser.rod("white", 0.032, elbow, wrist, round_ends=True)
    dresser.rod("white", 0.026, wrist, flange, round_ends=True)
    dresser.shell("palm", "graphite", (0.030, 0.045, 0.025), (flange[0], 0.0, flange[2] - 0.03))
    for side in (-0.026, 0.026):
        dresser.box("graphite", (0.010, 0.006, 0.035), (flange[0], side, flange[2] - 0.08))
