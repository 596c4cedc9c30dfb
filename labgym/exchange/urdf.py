"""The robot for ROS: its frames, and its description as URDF."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from xml.etree import ElementTree

from labgym.envs.robot import BOTTOM, COLUMN_RADIUS, DECK, ROBOT

BASE, LASER, CAMERA, OPTICAL = "base_link", "laser", "camera_link", "camera_optical_frame"
INERTIA_XY_KGM2 = 3.0
"""Inertia about the horizontal axes, as that of the simulated robot."""
MASS_HEIGHT_M = 0.3
"""Height of the center of mass above the floor."""


@dataclass(frozen=True)
class Mount:
    """A fixed frame of the robot: its parent, its position in meters and its roll, pitch and yaw in radians."""

    parent: str
    xyz: tuple[float, float, float]
    rpy: tuple[float, float, float] = (0.0, 0.0, 0.0)


FRAMES: Mapping[str, Mount] = {
    LASER: Mount(BASE, (0.0, 0.0, ROBOT.lidar_height)),
    CAMERA: Mount(BASE, (ROBOT.camera_forward, 0.0, ROBOT.camera_height)),
    OPTICAL: Mount(CAMERA, (0.0, 0.0, 0.0), (-math.pi / 2.0, 0.0, -math.pi / 2.0)),
}
"""Frames by name (REP 103): x ahead, y to the left; of the optical frame z ahead and x to the right.

The base is on the floor below the robot's axis.
"""


def robot_urdf() -> str:
    """Return the URDF of the robot: a base of two cylinders with the frames of its sensors."""
    robot = ElementTree.Element("robot", name="labgym")
    base = ElementTree.SubElement(robot, "link", name=BASE)
    inertial = ElementTree.SubElement(base, "inertial")
    ElementTree.SubElement(inertial, "origin", xyz=f"0 0 {MASS_HEIGHT_M:g}")
    ElementTree.SubElement(inertial, "mass", value=f"{ROBOT.mass:g}")
    flat = f"{INERTIA_XY_KGM2:g}"
    moments = {"ixx": flat, "iyy": flat, "izz": f"{ROBOT.yaw_inertia:g}", "ixy": "0", "ixz": "0", "iyz": "0"}
    ElementTree.SubElement(inertial, "inertia", moments)
    for radius, low, high in ((ROBOT.chassis_radius, BOTTOM, DECK), (COLUMN_RADIUS, DECK, ROBOT.height)):
        for role in ("visual", "collision"):
            part = ElementTree.SubElement(base, role)
            ElementTree.SubElement(part, "origin", xyz=f"0 0 {(low + high) / 2.0:g}")
            shape = ElementTree.SubElement(part, "geometry")
            ElementTree.SubElement(shape, "cylinder", radius=f"{radius:g}", length=f"{high - low:g}")
    for name, mount in FRAMES.items():
        ElementTree.SubElement(robot, "link", name=name)
        joint = ElementTree.SubElement(robot, "joint", name=f"{name}_joint", type="fixed")
        ElementTree.SubElement(joint, "parent", link=mount.parent)
        ElementTree.SubElement(joint, "child", link=name)
        places = {"xyz": mount.xyz, "rpy": mount.rpy}
        ElementTree.SubElement(joint, "origin", {key: " ".join(f"{v:.9g}" for v in at) for key, at in places.items()})
    ElementTree.indent(robot)
    return '<?xml version="1.0"?>\n' + ElementTree.tostring(robot, encoding="unicode") + "\n"
