"""A robot from an MJCF file."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import field, fields, replace
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from labgym.envs.mount import Mount, on_floor
from labgym.envs.parts.protocols import Command, Robot
from labgym.envs.parts.registry import registered
from labgym.envs.parts.robots import check_size, velocities
from labgym.envs.robot import ROBOT, RobotSpec
from labgym.envs.robot_files import FAULTS, RobotFile, quiet, read_robot
from labgym.envs.scene_simulation import SceneSimulation
from labgym.errors import DocumentError, LabgymError, OptionError, check_name

AXES = ("forward", "sideways", "turn")
WHEELS = ("left_wheel", "right_wheel")
LIMITS = ("v_min", "v_max", "v_side", "w_max", "timestep", "control_dt")
"""What the argument `size` may set; everything else is measured."""
MAX_CONTACTS = 200
"""Largest number of contacts of a robot with itself and the floor where it is put."""
OBEYS = 0.2
"""A robot that obeys reaches this share of a velocity within a second."""


@registered("robot", "mjcf")
class MjcfRobot(Robot):
    """A robot from an MJCF file, in which the following have these names.

    - body `base`, the only one in the world: its origin is on the floor on the robot's axis, heading along +x;
    - its joints: `x` and `y` (slides, meters) and `yaw` (hinge, radians), or one free joint for a robot that stands on
      wheels;
    - velocity actuators `forward` (m/s) and `turn` (rad/s), and `sideways` (m/s, to the left) for a holonomic robot; or
      `left_wheel` and `right_wheel` (rad/s) of a differential drive, whose joints have those names, too.

    Other joints and actuators are left at 0. The file may name meshes and textures in its folder; other files, plugins
    and worlds with more than the robot are refused. The robot must stand still, obey its actuators, and fit into the
    disc for which goals are planned. Its colliding geoms are measured.

    Attributes:
        path: the file.
        size: limits that differ from the actuators' `ctrlrange`: v_min, v_max, v_side, w_max, and timestep.
    """

    path: str | Path
    size: RobotSpec = ROBOT
    _file: RobotFile = field(init=False, repr=False)
    _axes: tuple[str, ...] = field(init=False, repr=False)
    _wheels: tuple[float, float, float, float] | None = field(init=False, repr=False)

    def __post_init__(self) -> None:
        limits = _limits(self.size)
        object.__setattr__(self, "_file", read_robot(self.path))
        model = self._file.compile()
        names = [model.actuator(index).name for index in range(model.nu)]
        wheels = all(name in names for name in WHEELS)
        axes = AXES if "sideways" in names else ("forward", "turn")
        if not wheels and not all(name in names for name in axes):
            raise DocumentError(
                self.path, "actuator", "expected velocity actuators forward and turn, or left_wheel and right_wheel"
            )
        object.__setattr__(self, "_axes", ("forward", "turn") if wheels else axes)
        object.__setattr__(self, "_wheels", _wheels(self.path, model) if wheels else None)
        object.__setattr__(self, "size", _measured(self.path, model, self._axes, wheels, limits))
        with quiet():
            try:
                self._check()
            except LabgymError:
                raise
            except FAULTS as error:
                reason = " ".join(str(error).split())[:200]
                raise DocumentError(self.path, "", f"MuJoCo cannot simulate it ({reason})") from None

    @property
    def axes(self) -> tuple[str, ...]:
        """The velocities that an action commands."""
        return self._axes

    def command(self, action: Iterable[float]) -> Command:
        """Return the target velocities of an action in [-1, 1] per axis; values outside are clipped."""
        return velocities(self.size, action) if "sideways" in self._axes else self.size.twist(*action)

    def spec(self) -> mujoco.MjSpec:
        """Return the robot without a scene."""
        return self._file.spec()

    @property
    def actuators(self) -> tuple[str, ...]:
        """The wheels, or the actuators of the axes."""
        return WHEELS if self._wheels is not None else self._axes

    def controls(self, command: Command) -> Sequence[float]:
        """Return the turn rates of the wheels, rad/s, or the target velocities."""
        if self._wheels is None:
            return command
        (v, w), (left, right, y_left, y_right) = command, self._wheels
        return (v - w * y_left) * left, (v - w * y_right) * right

    def _check(self) -> None:
        """Check that the robot stands still and obeys each of its axes."""
        model = on_floor(self)
        Mount.of(model)
        _check_contacts(self.path, model)
        simulation = SceneSimulation(model, self, 0.1)
        for index, name in enumerate(self._axes):
            simulation.place((0.0, 0.0, 0.0))
            command = self.command([0.5 if axis == index else 0.0 for axis in range(len(self._axes))])
            for _ in range(10):
                simulation.drive(*command)
            v, w = simulation.velocity
            reached = {"forward": v, "sideways": simulation.sideways, "turn": w}[name]
            if not reached >= OBEYS * command[index]:
                unit = "rad/s" if name == "turn" else "m/s"
                raise DocumentError(
                    self.path,
                    "actuator",
                    f"after 1 s of {name} at {command[index]:.2f} {unit} the robot does {reached:.2f} {unit}: "
                    "controls are target velocities, forward is +x, and turns are counter-clockwise",
                )


def _check_contacts(path: str | Path, model: mujoco.MjModel) -> None:
    """Check that few parts of a robot touch before it is simulated; each contact takes time at each step."""
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    mujoco.mj_collision(model, data)
    if data.ncon > MAX_CONTACTS:
        raise DocumentError(
            path, "geom", f"{data.ncon} contacts as it is placed, at most {MAX_CONTACTS} are simulated: exclude some"
        )


def _limits(value: Any) -> dict[str, float]:
    """Return the limits that were passed."""
    if isinstance(value, RobotSpec):
        value = {name: getattr(value, name) for name in LIMITS if getattr(value, name) != getattr(ROBOT, name)}
    if not isinstance(value, Mapping):
        raise OptionError(f"size of the robot is a {type(value).__name__}, expected a mapping of limits")
    limits = [each.name for each in fields(RobotSpec) if each.name in LIMITS]
    for name in value:
        check_name("limit of a robot from a file", name, limits)
    return dict(value)


def _measured(
    path: str | Path, model: mujoco.MjModel, axes: Sequence[str], wheels: bool, limits: Mapping[str, float]
) -> RobotSpec:
    """Return dimensions and limits of a robot: those passed, those of its actuators, and what is measured."""
    own: dict[str, float] = {"timestep": 0.0025}
    for name in () if wheels else axes:
        low, high = model.actuator(name).ctrlrange.tolist() if model.actuator(name).ctrllimited[0] else (0.0, 0.0)
        if high > low:
            own |= {
                "forward": {"v_min": min(low, 0.0), "v_max": high},
                "sideways": {"v_side": high},
                "turn": {"w_max": high},
            }[name]
    if "sideways" in axes:
        own = {"v_side": 0.5, **own}
    radius, height = _extent(model)
    mass = float(model.body_mass.sum())
    size = replace(ROBOT, chassis_radius=radius, height=height, mass=mass, **{**own, **limits})
    try:
        check_size(size)
    except OptionError as error:
        raise DocumentError(path, "", str(error)) from None
    return size


def _extent(model: mujoco.MjModel) -> tuple[float, float]:
    """Return the largest distance of a colliding geom from the axis, and the largest height, meters.

    Round geoms are measured by the spheres and circles that enclose them, boxes and meshes by their corners.
    """
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    radius = height = 0.0
    for geom in np.flatnonzero((model.geom_contype | model.geom_conaffinity) != 0).tolist():
        center, turn = data.geom_xpos[geom], data.geom_xmat[geom].reshape(3, 3)
        points, around = _hull(model, geom)
        places = center + points @ turn.T
        radius = max(radius, float(np.hypot(places[:, 0], places[:, 1]).max()) + around)
        height = max(height, float(places[:, 2].max()) + around)
    return radius, height


def _hull(model: mujoco.MjModel, geom: int) -> tuple[np.ndarray, float]:
    """Return points (n, 3) in the frame of a geom and a radius; spheres around them enclose it with their hull."""
    kind, size = int(model.geom_type[geom]), model.geom_size[geom]
    types = mujoco.mjtGeom
    if kind == int(types.mjGEOM_SPHERE):
        return np.zeros((1, 3)), float(size[0])
    if kind == int(types.mjGEOM_CAPSULE):
        return np.array([[0.0, 0.0, -size[1]], [0.0, 0.0, size[1]]]), float(size[0])
    if kind == int(types.mjGEOM_CYLINDER):
        angles = np.linspace(0.0, 2.0 * math.pi, 64, endpoint=False)
        rim = np.column_stack([np.cos(angles), np.sin(angles)]) * size[0] / math.cos(math.pi / 64.0)
        return np.vstack([np.column_stack([rim, np.full(64, end)]) for end in (-size[1], size[1])]), 0.0
    if kind == int(types.mjGEOM_MESH):
        mesh = int(model.geom_dataid[geom])
        first = int(model.mesh_vertadr[mesh])
        return np.asarray(model.mesh_vert[first : first + int(model.mesh_vertnum[mesh])], dtype=np.float64), 0.0
    signs = np.array(np.meshgrid((-1, 1), (-1, 1), (-1, 1))).reshape(3, 8).T
    box = model.geom_aabb[geom]
    return box[:3] + signs * box[3:], 0.0


def _wheels(path: str | Path, model: mujoco.MjModel) -> tuple[float, float, float, float]:
    """Return the turn rate per m/s of the left and of the right wheel, and their distances to the left of the axis."""
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    rates, places = [], []
    for name in WHEELS:
        joint = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, name)
        if joint < 0 or int(model.jnt_type[joint]) != int(mujoco.mjtJoint.mjJNT_HINGE):
            raise DocumentError(path, "joint", f"expected a hinge {name!r} for the actuator of that name")
        anchor, axis = data.xanchor[joint], data.xaxis[joint]
        if abs(axis[1]) < 0.99 or anchor[2] <= 0.0:
            raise DocumentError(path, "joint", f"{name!r} must turn about the y axis, above the floor")
        rates.append(math.copysign(1.0 / float(anchor[2]), float(axis[1])))
        places.append(float(anchor[1]))
    if places[0] <= places[1]:
        raise DocumentError(path, "joint", "'left_wheel' must be to the left (+y) of 'right_wheel'")
    return rates[0], rates[1], places[0], places[1]
