"""The robot: a base with a column, an arm and a sensor head, as an MjSpec to attach to a scene.

The base moves in the plane on two slides and a hinge. Three velocity servos act in its own frame: forward, sideways and
turn. The target of the sideways servo of a differential drive is always zero: it models the grip of the wheels. The
force of each servo is limited, which limits both the acceleration and the push against an obstacle; nothing outside the
physics shapes the motion.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from labgym.envs.robot_look import dress, dress_plainly
from labgym.geometry import wrap_angle

PREFIX = "robot/"
"""Prefix of every name of the robot in a scene."""
BOTTOM, DECK, COLUMN_RADIUS = 0.02, 0.40, 0.21
"""Underside and top of the chassis above the floor, and radius of the column, meters."""


@dataclass(frozen=True)
class RobotSpec:
    """Dimensions and limits of the robot, SI units.

    Attributes:
        chassis_radius: radius of the colliding base, meters.
        planning_radius: radius of the disc that planners keep clear, meters.
        height: top of the sensor head, meters.
        mass: kilograms. yaw_inertia: about the vertical axis, kg m².
        v_min, v_max: limits of the forward velocity, m/s. w_max: limit of the turn rate in both directions, rad/s.
        acceleration, turn_acceleration: limits of the accelerations in both directions, m/s² and rad/s².
        grip: sideways acceleration at which the wheels slip, m/s².
        lag: time constant of the servos within their force limits, seconds.
        control_dt: time between two actions, seconds. timestep: physics step, seconds.
        lidar_height: height of the lidar's plane, meters.
        camera_height, camera_forward: position of the level camera in the robot frame (x ahead), meters.
        camera_hfov: horizontal field of view, radians.
        v_side: limit of the sideways velocity in both directions, m/s; 0 for a base whose wheels grip.
    """

    chassis_radius: float = 0.27
    planning_radius: float = 0.30
    height: float = 1.32
    mass: float = 50.0
    yaw_inertia: float = 2.0
    v_min: float = -0.3
    v_max: float = 1.0
    w_max: float = 1.5
    acceleration: float = 1.5
    turn_acceleration: float = 4.0
    grip: float = 3.0
    lag: float = 0.02
    control_dt: float = 0.1
    timestep: float = 0.005
    lidar_height: float = 0.25
    camera_height: float = 0.5
    camera_forward: float = 0.2
    camera_hfov: float = math.radians(68.0)
    v_side: float = 0.0

    @property
    def axes(self) -> tuple[str, ...]:
        """Names of the velocities that an action commands, which are those of the servos."""
        return ("forward", "sideways", "turn") if self.v_side > 0.0 else ("forward", "turn")

    @property
    def substeps(self) -> int:
        """Number of physics steps per control step."""
        return round(self.control_dt / self.timestep)

    def twist(self, forward: float, turn: float) -> tuple[float, float]:
        """Return the target velocities (v, w) of an action, m/s and rad/s.

        Both components are clipped to [-1, 1]. For forward, [-1, 0] maps to [v_min, 0] and [0, 1] to [0, v_max]; turn
        maps to [-w_max, w_max], counter-clockwise positive.
        """
        forward = min(max(forward, -1.0), 1.0)
        turn = min(max(turn, -1.0), 1.0)
        return forward * (self.v_max if forward >= 0.0 else -self.v_min), turn * self.w_max


ROBOT = RobotSpec()


def turn_towards(bearing: float, robot: RobotSpec = ROBOT) -> NDArray[np.float64]:
    """Return the action (2,) that turns in place by a bearing, radians."""
    rate = turn_rate(wrap_angle(bearing), robot)
    return np.array([0.0, min(max(rate / robot.w_max, -1.0), 1.0)])


def turn_rate(bearing: float, robot: RobotSpec) -> float:
    """Return the fastest turn rate from which the robot still stops at the bearing, one control step late."""
    rest = math.sqrt(robot.turn_acceleration * abs(bearing))
    return math.copysign(min(robot.w_max, rest, abs(bearing) / robot.control_dt), bearing)


def robot_spec(robot: RobotSpec = ROBOT) -> mujoco.MjSpec:
    """Return the robot without a scene: one body `base` at floor height, heading along +x at yaw 0.

    Joints `x`, `y` (m) and `yaw` (rad) are its pose. Actuators `forward` (m/s), `turn` (rad/s) are its commands;
    `grip` stays at 0, and a holonomic base has `sideways` (m/s, to the left) in its place. The geoms `chassis` and
    `column` (group 3) collide; the others are visual only.
    """
    spec = mujoco.MjSpec()
    spec.modelname = "robot"
    base = spec.worldbody.add_body(name="base")
    base.explicitinertial = True
    base.mass = robot.mass
    base.ipos = [0.0, 0.0, min(0.3, robot.height / 2.0)]
    base.inertia = [3.0, 3.0, robot.yaw_inertia]
    for name, axis in (("x", [1, 0, 0]), ("y", [0, 1, 0])):
        base.add_joint(name=name, type=mujoco.mjtJoint.mjJNT_SLIDE, axis=axis)
    base.add_joint(name="yaw", type=mujoco.mjtJoint.mjJNT_HINGE, axis=[0, 0, 1])
    base.add_site(name="centre", pos=[0, 0, 0], group=4)
    add_hulls(base, robot)
    _add_servo(spec, "forward", 0, robot.mass, robot.acceleration, robot.lag, (robot.v_min, robot.v_max))
    if robot.v_side > 0.0:
        side = (-robot.v_side, robot.v_side)
        _add_servo(spec, "sideways", 1, robot.mass, robot.acceleration, robot.lag, side)
    else:
        _add_servo(spec, "grip", 1, robot.mass, robot.grip, robot.timestep, (0.0, 0.0))
    _add_servo(spec, "turn", 5, robot.yaw_inertia, robot.turn_acceleration, robot.lag, (-robot.w_max, robot.w_max))
    add_camera(base, robot)
    add_look(spec, base, robot)
    return spec


def add_hulls(base: mujoco.MjsBody, robot: RobotSpec) -> None:
    """Add the colliding cylinders of a robot: the chassis, and the column if the robot is higher than the deck."""
    _add_hull(base, "chassis", robot.chassis_radius, BOTTOM, min(DECK, robot.height))
    if robot.height > DECK:
        _add_hull(base, "column", min(COLUMN_RADIUS, robot.chassis_radius), DECK, robot.height)


def add_camera(base: mujoco.MjsBody, robot: RobotSpec) -> None:
    """Add the camera of a robot, for scenes that are drawn."""
    base.add_camera(
        name="camera",
        pos=[robot.camera_forward, 0.0, robot.camera_height],
        xyaxes=[0, -1, 0, 0, 0, 1],
        fovy=math.degrees(2.0 * math.atan(math.tan(robot.camera_hfov / 2.0) * 9.0 / 16.0)),
        resolution=[640, 360],
    )


def add_look(spec: mujoco.MjSpec, base: mujoco.MjsBody, robot: RobotSpec) -> None:
    """Add visual geoms: those of our robot where it has its dimensions, else plain cylinders."""
    if (robot.chassis_radius, robot.height) == (ROBOT.chassis_radius, ROBOT.height):
        dress(spec, base, robot.chassis_radius, robot.height)
    else:
        dress_plainly(spec, base, robot.chassis_radius, robot.height, min(DECK, robot.height))


def attach_robot(scene: mujoco.MjSpec, robot: RobotSpec = ROBOT) -> None:
    """Attach the robot to a scene at the room's origin, with its names prefixed by `robot/`, and set the physics step.

    The scene's floor must be at z = 0. The joints start at 0; set qpos to the start pose.
    """
    scene.attach(robot_spec(robot), prefix=PREFIX, frame=scene.worldbody.add_frame())
    scene.option.timestep = robot.timestep
    scene.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    scene.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC


def _add_hull(base: mujoco.MjsBody, name: str, radius: float, bottom: float, top: float) -> None:
    """Add an invisible colliding cylinder; its stiff, slippery contact takes priority over the other geom's."""
    base.add_geom(
        name=name,
        type=mujoco.mjtGeom.mjGEOM_CYLINDER,
        size=[radius, (top - bottom) / 2.0, 0.0],
        pos=[0.0, 0.0, (top + bottom) / 2.0],
        rgba=[0.9, 0.5, 0.1, 0.4],
        group=3,
        priority=1,
        friction=[0.2, 0.005, 0.0001],
        solref=[0.01, 1.0],
        solimp=[0.95, 0.99, 0.001, 0.5, 2.0],
    )


def _add_servo(
    spec: mujoco.MjSpec, name: str, axis: int, inertia: float, limit: float, lag: float, commands: tuple[float, float]
) -> None:
    """Add a velocity servo along one of the six axes of the base's own frame.

    For a site without a reference site, the actuator velocity is the velocity along its gear in the site's frame.
    """
    gain = inertia / lag
    servo = spec.add_actuator(name=name)
    servo.trntype = mujoco.mjtTrn.mjTRN_SITE
    servo.target = "centre"
    servo.gear = [1.0 if index == axis else 0.0 for index in range(6)]
    servo.gaintype = mujoco.mjtGain.mjGAIN_FIXED
    servo.gainprm[0] = gain
    servo.biastype = mujoco.mjtBias.mjBIAS_AFFINE
    servo.biasprm[2] = -gain
    servo.forcelimited = True
    servo.forcerange = [-inertia * limit, inertia * limit]
    if commands[1] > commands[0]:
        servo.ctrllimited = True
        servo.ctrlrange = list(commands)
