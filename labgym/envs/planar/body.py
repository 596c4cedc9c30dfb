"""The robot in the plane, as numbers that the kernel reads from its compiled MuJoCo model."""

from __future__ import annotations

from typing import NamedTuple

import mujoco

from labgym.envs.robot import PREFIX
from labgym.errors import OptionError

SERVOS = ("forward", "grip", "turn")
"""The servos along x, along y and about z of the robot's own frame."""

TIMESTEP = 0.001
"""Physics step of the kernel, seconds; five times as fine as MuJoCo's in the environment."""


class PlanarBody(NamedTuple):
    """Inertia, servos and contact of the robot, SI units.

    Attributes:
        timestep: physics step. mass: kilograms. inertia: about the vertical axis.
        forward_gain, grip_gain, turn_gain: force or torque per difference to the target velocity.
        forward_limit, grip_limit, turn_limit: largest force or torque.
        v_min, v_max, w_max: limits of the targets.
        friction: coefficient of the contact.
        stiffness, damping: of a contact's reference acceleration, 1/s² and 1/s.
        shallow, deep, width: the impedance at depth 0, from depth `width` on, and that depth in meters.
        midpoint, power: shape of the impedance between the two.
        mobility: the inverse inertia by which MuJoCo scales the softness of contacts.
        points: contact points of each solid: one above the other, or a single one if the model turns them off.
    """

    timestep: float
    mass: float
    inertia: float
    forward_gain: float
    grip_gain: float
    turn_gain: float
    forward_limit: float
    grip_limit: float
    turn_limit: float
    v_min: float
    v_max: float
    w_max: float
    friction: float
    stiffness: float
    damping: float
    shallow: float
    deep: float
    width: float
    midpoint: float
    power: float
    mobility: float
    points: float


class Hull(NamedTuple):
    """A colliding cylinder of the robot: its radius, bottom and top, meters."""

    radius: float
    bottom: float
    top: float


def body_of(model: mujoco.MjModel, timestep: float = TIMESTEP) -> PlanarBody:
    """Return the robot of a compiled scene; `labgym.envs.robot` describes it.

    Args:
        timestep: physics step, seconds.

    Raises:
        OptionError: the robot has no colliding cylinder.
    """
    base = model.body(PREFIX + "base").id
    forward, grip, turn = (model.actuator(PREFIX + name).id for name in SERVOS)
    gain, limit, target = -model.actuator_biasprm[:, 2], model.actuator_forcerange[:, 1], model.actuator_ctrlrange
    geom = _cylinders(model)[0]
    constant, ratio = (float(value) for value in model.geom_solref[geom])
    constant = max(constant, 2.0 * timestep)
    shallow, deep, width, midpoint, power = (float(value) for value in model.geom_solimp[geom])
    return PlanarBody(
        timestep=timestep,
        mass=float(model.body_mass[base]),
        inertia=float(model.body_inertia[base, 2]),
        forward_gain=float(gain[forward]),
        grip_gain=float(gain[grip]),
        turn_gain=float(gain[turn]),
        forward_limit=float(limit[forward]),
        grip_limit=float(limit[grip]),
        turn_limit=float(limit[turn]),
        v_min=float(target[forward, 0]),
        v_max=float(target[forward, 1]),
        w_max=float(target[turn, 1]),
        friction=float(model.geom_friction[geom, 0]),
        stiffness=1.0 / (deep * deep * constant * constant * ratio * ratio),
        damping=2.0 / (deep * constant),
        shallow=shallow,
        deep=deep,
        width=width,
        midpoint=midpoint,
        power=power,
        mobility=float(model.body_invweight0[base, 0]),
        points=1.0 if model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_MULTICCD else 2.0,
    )


def hulls_of(model: mujoco.MjModel) -> tuple[Hull, ...]:
    """Return the colliding cylinders of the robot of a compiled scene, the widest first."""
    hulls = []
    for geom in _cylinders(model):
        radius, half, z = float(model.geom_size[geom, 0]), float(model.geom_size[geom, 1]), model.geom_pos[geom, 2]
        hulls.append(Hull(radius, float(z) - half, float(z) + half))
    return tuple(sorted(hulls, reverse=True))


def _cylinders(model: mujoco.MjModel) -> list[int]:
    base = model.body(PREFIX + "base").id
    geoms = [
        geom
        for geom in range(model.ngeom)
        if model.geom_bodyid[geom] == base
        and model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_CYLINDER
        and (model.geom_contype[geom] or model.geom_conaffinity[geom])
    ]
    if not geoms:
        raise OptionError("the robot has no colliding cylinder, as the planar kernel needs: use physics='mujoco'")
    return geoms
