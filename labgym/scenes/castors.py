"""Things that a push moves in the plane: bodies on joints x, y and yaw, with the friction of castors or feet.

Friction of a body that slides freely has the same size in all directions. `DIRECTIONS` tendons, each with its share of
the force along one direction of the plane, approximate it within 1.3%. Turning and sliding resist independently of each
other, which overestimates the friction of a body that does both (assumption).
"""

from __future__ import annotations

import math

import mujoco

from labgym.assets import Asset
from labgym.geometry.frames import PlanarPose

GRAVITY = 9.81
"""Acceleration of gravity, m/s²."""
DIRECTIONS = 8
"""Number of directions along which friction acts."""
MOVES, MEETS = 3, 2
"""Bits of contact: what is pushed meets everything that collides but the floor (`MOVES & 1`), and its like."""
AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0)}


def lever(asset: Asset) -> float:
    """Return the mean distance of the feet from the axis of a turn, meters.

    Assumption: castors or feet are halfway between the middle and the corners of the bounding box.
    """
    return math.hypot(asset.size.width, asset.size.depth) / 4.0


def add_castored(
    scene: mujoco.MjSpec, name: str, asset: Asset, pose: PlanarPose, mass: float, friction: float
) -> mujoco.MjsBody:
    """Add an asset as a body on the joints `<name>/x`, `<name>/y` and `<name>/yaw`, and return the body.

    Its solids are geoms `<name>/solid/<k>`, which collide with everything but the floor. The joints are 0 at the pose.

    Args:
        scene: a scene whose floor is the geom `floor/solid`.
        pose: (x, y, yaw) in the room frame, meters and radians.
        mass: kg, spread evenly over the bounding box.
        friction: coefficient of friction on the floor.
    """
    x, y, yaw = pose
    scene.geom("floor/solid").conaffinity = 0
    # The joints are those of the room: the body's own frame is turned by its geoms.
    body = scene.worldbody.add_body(name=name, pos=[x, y, 0.0])
    size, half = asset.size, asset.size.height / 2.0
    body.explicitinertial = True
    body.mass, body.ipos, body.iquat = mass, [0.0, 0.0, half], about_z(yaw)
    pairs = ((size.depth, size.height), (size.width, size.height), (size.width, size.depth))
    body.inertia = [mass / 12.0 * (a * a + b * b) for a, b in pairs]
    weight = friction * mass * GRAVITY
    for axis, along in AXES.items():
        body.add_joint(name=f"{name}/{axis}", type=mujoco.mjtJoint.mjJNT_SLIDE, axis=along)
    turn = weight * lever(asset)
    body.add_joint(name=f"{name}/yaw", type=mujoco.mjtJoint.mjJNT_HINGE, axis=[0.0, 0.0, 1.0], frictionloss=turn)
    # The mean of the sum of |cos| over evenly spaced directions is 2 / pi times their number.
    share = weight * math.pi / 2.0 / DIRECTIONS
    for k in range(DIRECTIONS):
        angle = k * math.pi / DIRECTIONS
        tendon = scene.add_tendon(name=f"{name}/friction_{k}", frictionloss=share)
        tendon.wrap_joint(f"{name}/x", math.cos(angle))
        tendon.wrap_joint(f"{name}/y", math.sin(angle))
    for k, box in enumerate(asset.solids()):
        cosine, sine = math.cos(yaw), math.sin(yaw)
        body.add_geom(
            name=f"{name}/solid/{k}",
            type=mujoco.mjtGeom.mjGEOM_BOX,
            pos=[cosine * box.x - sine * box.y, sine * box.x + cosine * box.y, (box.z0 + box.z1) / 2.0],
            quat=about_z(yaw + box.yaw),
            size=[box.width / 2.0, box.depth / 2.0, (box.z1 - box.z0) / 2.0],
            contype=MOVES,
            conaffinity=MEETS,
            group=3,
        )
    return body


def about_z(angle: float) -> list[float]:
    """Return a rotation about the vertical axis as a quaternion (w, x, y, z)."""
    return [math.cos(angle / 2.0), 0.0, 0.0, math.sin(angle / 2.0)]
