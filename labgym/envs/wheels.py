"""A robot on wheels, as an MjSpec: two driven wheels and two sprung casters carry and move it by their friction."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco

from labgym.envs.robot import RobotSpec, add_camera, add_hulls, add_look

GRAVITY = 9.81
"""Acceleration for which the springs are preloaded, m/s²."""
CASTER_MASS = 0.3
"""Mass of a caster, kilograms."""


@dataclass(frozen=True)
class Wheels:
    """Wheels and casters of a base.

    Attributes:
        radius, width: of the driven wheels, meters. track: distance between their middles, meters.
        mass: of one driven wheel, kilograms.
        friction: coefficient of the driven wheels on the floor.
        caster_radius: meters. caster_reach: distance of the casters before and behind the axle, meters.
        caster_friction: resistance of the casters over their load, in all directions.
        caster_load: share of the weight on each caster at rest. caster_stiffness: of its spring, N/m.
        caster_damping: of its spring, N s/m.
    """

    radius: float = 0.075
    width: float = 0.03
    track: float = 0.40
    mass: float = 1.5
    friction: float = 0.8
    caster_radius: float = 0.03
    caster_reach: float = 0.20
    caster_friction: float = 0.03
    caster_load: float = 0.15
    caster_stiffness: float = 20000.0
    caster_damping: float = 600.0


def wheeled_spec(robot: RobotSpec, wheels: Wheels) -> mujoco.MjSpec:
    """Return the robot without a scene: body `base` with a free joint, at floor height, heading along +x.

    Hinges `left_wheel` and `right_wheel` turn the wheels. Two servos act on both: `forward` (m/s) on the mean of their
    speeds and `turn` (rad/s) on their difference over the track, with the limits of the base without wheels. What the
    robot does follows from the friction of the wheels.
    """
    spec = mujoco.MjSpec()
    spec.modelname = "wheeled_robot"
    base = spec.worldbody.add_body(name="base")
    base.add_freejoint(name="base")
    base.explicitinertial = True
    base.mass = robot.mass - 2.0 * wheels.mass - 2.0 * CASTER_MASS
    height = min(0.3, robot.height / 2.0)
    base.ipos = [0.0, 0.0, height]
    tilt = base.mass * max(height, robot.chassis_radius) ** 2 / 2.0
    base.inertia = [tilt, tilt, robot.yaw_inertia - 2.0 * wheels.mass * (wheels.track / 2.0) ** 2]
    add_hulls(base, robot)
    for side, name in ((1.0, "left_wheel"), (-1.0, "right_wheel")):
        _add_wheel(base, name, side, wheels)
    for name, ahead in (("front_caster", 1.0), ("rear_caster", -1.0)):
        _add_caster(base, name, ahead, wheels, robot.mass)
    half, across = wheels.radius / 2.0, wheels.radius / wheels.track
    _add_servo(spec, "forward", (half, half), robot.mass, robot.acceleration, robot.lag, (robot.v_min, robot.v_max))
    turn = (-robot.w_max, robot.w_max)
    _add_servo(spec, "turn", (-across, across), robot.yaw_inertia, robot.turn_acceleration, robot.lag, turn)
    add_camera(base, robot)
    add_look(spec, base, robot)
    return spec


def _add_wheel(base: mujoco.MjsBody, name: str, side: float, wheels: Wheels) -> None:
    """Add a driven wheel at a side: 1 is left, -1 right."""
    wheel = base.add_body(name=name, pos=[0.0, side * wheels.track / 2.0, wheels.radius])
    wheel.explicitinertial = True
    wheel.mass, wheel.ipos = wheels.mass, [0.0, 0.0, 0.0]
    round_axis, across = wheels.mass * wheels.radius**2 / 2.0, wheels.mass * wheels.radius**2 / 4.0
    wheel.inertia = [across, round_axis, across]
    wheel.add_joint(name=name, type=mujoco.mjtJoint.mjJNT_HINGE, axis=[0, 1, 0])
    # A crowned wheel touches the floor at one point and rolls smoothly; a cylinder's contact points jump as it turns.
    wheel.add_geom(
        name=name,
        type=mujoco.mjtGeom.mjGEOM_ELLIPSOID,
        size=[wheels.radius, wheels.width / 2.0, wheels.radius],
        rgba=[0.07, 0.07, 0.08, 1.0],
        group=3,
        mass=0.0,
        priority=1,
        friction=[wheels.friction, 0.005, 0.0001],
    )


def _add_caster(base: mujoco.MjsBody, name: str, ahead: float, wheels: Wheels, mass: float) -> None:
    """Add a caster before (ahead 1) or behind (ahead -1) the axle, on a spring that carries its share of the weight."""
    caster = base.add_body(name=name, pos=[ahead * wheels.caster_reach, 0.0, wheels.caster_radius])
    caster.explicitinertial = True
    caster.mass, caster.ipos = CASTER_MASS, [0.0, 0.0, 0.0]
    caster.inertia = [0.4 * CASTER_MASS * wheels.caster_radius**2] * 3
    caster.add_joint(
        name=name,
        type=mujoco.mjtJoint.mjJNT_SLIDE,
        axis=[0, 0, 1],
        stiffness=wheels.caster_stiffness,
        damping=wheels.caster_damping,
        springref=-wheels.caster_load * mass * GRAVITY / wheels.caster_stiffness,
    )
    caster.add_geom(
        name=name,
        type=mujoco.mjtGeom.mjGEOM_SPHERE,
        size=[wheels.caster_radius, 0.0, 0.0],
        rgba=[0.16, 0.17, 0.19, 1.0],
        group=3,
        mass=0.0,
        priority=1,
        friction=[wheels.caster_friction, 0.005, 0.0001],
    )


def _add_servo(
    spec: mujoco.MjSpec,
    name: str,
    gear: tuple[float, float],
    inertia: float,
    limit: float,
    lag: float,
    commands: tuple[float, float],
) -> None:
    """Add a velocity servo on a combination of the wheels' turn rates; gear of the left and of the right one."""
    tendon = spec.add_tendon(name=name)
    for wheel, share in zip(("left_wheel", "right_wheel"), gear, strict=True):
        tendon.wrap_joint(wheel, share)
    gain = inertia / lag
    servo = spec.add_actuator(name=name)
    servo.trntype = mujoco.mjtTrn.mjTRN_TENDON
    servo.target = name
    servo.gaintype = mujoco.mjtGain.mjGAIN_FIXED
    servo.gainprm[0] = gain
    servo.biastype = mujoco.mjtBias.mjBIAS_AFFINE
    servo.biasprm[2] = -gain
    servo.forcelimited, servo.forcerange = True, [-inertia * limit, inertia * limit]
    servo.ctrllimited, servo.ctrlrange = True, list(commands)
