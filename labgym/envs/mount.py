"""A robot attached to a scene: where it is in the compiled model, and how it stands on the floor at rest."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import mujoco
import numpy as np
from numpy.typing import NDArray

from labgym.envs.parts.protocols import Robot
from labgym.envs.robot import PREFIX
from labgym.errors import OptionError
from labgym.scenes.interactive import IMPRATIO

BASE = PREFIX + "base"
"""The body of the base in a scene."""
SETTLING = 1.0
"""Time that a robot has to come to rest on the floor, seconds."""
FREE, BALL, SLIDE, HINGE = (
    int(kind)
    for kind in (
        mujoco.mjtJoint.mjJNT_FREE,
        mujoco.mjtJoint.mjJNT_BALL,
        mujoco.mjtJoint.mjJNT_SLIDE,
        mujoco.mjtJoint.mjJNT_HINGE,
    )
)
"""Types of joints."""
WIDTHS = {FREE: 7, BALL: 4, SLIDE: 1, HINGE: 1}
"""Number of coordinates of a joint of each type."""
MAX_CONSTRAINTS = 1_000
"""Largest number of scalar constraints of a robot that comes to rest."""
DRIFT, TILT, SINK = 0.01, math.radians(3.0), 0.03
"""A robot at rest moves less (meters), is tilted less (radians), and is lower or higher by less (meters)."""


@dataclass(frozen=True, eq=False)
class Mount:
    """The parts of a compiled scene that belong to the robot.

    Attributes:
        geoms: which geoms are the robot's, (ngeom,). floor: which are the floor, (ngeom,).
        coordinates, rates: the robot's entries of qpos and qvel; those of the base come first.
        planar: whether the base moves on the joints x, y and yaw, and not on a free joint.
        alone: whether nothing but the base moves, on these three joints.
    """

    geoms: NDArray[np.bool_]
    floor: NDArray[np.bool_]
    coordinates: slice
    rates: slice
    planar: bool
    alone: bool

    @classmethod
    def of(cls, model: mujoco.MjModel) -> Mount:
        """Return the mount of the robot in a compiled scene.

        Raises:
            OptionError: the robot has no body `base` in the world, or other joints than it needs.
        """
        names = [model.body(body).name for body in range(model.nbody)]
        if BASE not in names or model.body(BASE).parentid[0] != 0:
            raise OptionError("robot: its specification has no body 'base' in the world")
        base = model.body(BASE).id
        own = model.body_rootid == base
        joints = np.flatnonzero(own[model.jnt_bodyid])
        of_base = [joint for joint in joints.tolist() if model.jnt_bodyid[joint] == base]
        planar = [model.joint(joint).name for joint in of_base] == [PREFIX + name for name in ("x", "y", "yaw")]
        kinds = model.jnt_type[of_base].tolist()
        planar, free = planar and kinds == [SLIDE, SLIDE, HINGE], kinds == [FREE]
        if not planar and not free:
            raise OptionError("robot: body 'base' needs the joints x, y (slides) and yaw (hinge), or one free joint")
        if joints[0] != of_base[0]:
            raise OptionError("robot: the joints of body 'base' are not the first ones of the robot")
        dofs = np.flatnonzero(own[model.dof_bodyid])
        start, size = int(model.jnt_qposadr[joints[0]]), sum(WIDTHS[kind] for kind in model.jnt_type[joints].tolist())
        mine = own[model.geom_bodyid]
        floor = (model.geom_type == mujoco.mjtGeom.mjGEOM_PLANE) & ~mine
        rates = slice(int(dofs[0]), int(dofs[-1]) + 1)
        return cls(mine, floor, slice(start, start + size), rates, planar, planar and model.nv == 3)


def attach(scene: mujoco.MjSpec, robot: Robot) -> None:
    """Attach a robot to a scene at the room's origin, with its names prefixed by `robot/`, and set the physics options.

    The scene's floor must be at z = 0.
    """
    spec = robot.spec()
    rolls = any(joint.type == mujoco.mjtJoint.mjJNT_FREE for joint in spec.joints)
    spec.assets = {**scene.assets, **spec.assets}  # MuJoCo warns if only one of the two has files
    scene.attach(spec, prefix=PREFIX, frame=scene.worldbody.add_frame())
    scene.option.timestep = robot.size.timestep
    scene.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    scene.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    if rolls:
        scene.option.impratio = IMPRATIO


def on_floor(robot: Robot) -> mujoco.MjModel:
    """Return a robot on an empty floor."""
    scene = mujoco.MjSpec()
    scene.worldbody.add_geom(name="floor/solid", type=mujoco.mjtGeom.mjGEOM_PLANE, size=[10.0, 10.0, 0.1])
    attach(scene, robot)
    try:
        return scene.compile()
    except (ValueError, RuntimeError, MemoryError) as error:
        reason = " ".join(str(error).split())[:300]
        raise OptionError(f"robot {type(robot).__name__}: MuJoCo cannot compile it ({reason})") from None


def at_rest(robot: Robot) -> NDArray[np.float64]:
    """Return the coordinates of a robot at rest on the floor, at the origin, heading along +x.

    Raises:
        OptionError: it does not come to rest upright where it is put.
    """
    try:
        return _at_rest(robot)  # type: ignore[arg-type]
    except TypeError:  # a robot without a hash
        return _settled(robot)


def _settled(robot: Robot) -> NDArray[np.float64]:
    model = on_floor(robot)
    mount, data = Mount.of(model), mujoco.MjData(model)
    missing = [name for name in robot.actuators if not _has_actuator(model, name)]
    if missing:
        raise OptionError(f"robot {type(robot).__name__}: its specification has no actuator {missing[0]!r}")
    if mount.planar:
        return np.array(data.qpos[mount.coordinates])
    for _ in range(round(SETTLING / model.opt.timestep)):
        mujoco.mj_step(model, data)
        if data.nefc > MAX_CONSTRAINTS:
            raise OptionError(
                f"robot {type(robot).__name__}: {data.nefc} constraints act on it at rest; at most {MAX_CONSTRAINTS} "
                "are simulated: let parts that touch be excluded from contact"
            )
    x, y, z, w, i, j, k = data.qpos[mount.coordinates][:7].tolist()
    upright = 1.0 - 2.0 * (i * i + j * j)
    still = math.isfinite(x + y + z + w) and math.hypot(x, y) < DRIFT and abs(z) < SINK and upright > math.cos(TILT)
    if not still or data.warning[mujoco.mjtWarning.mjWARN_BADQACC].number:
        tilt = math.degrees(math.acos(min(max(upright, -1.0), 1.0)))
        raise OptionError(
            f"robot {type(robot).__name__}: it does not stand still on the floor: after {SETTLING:g} s it is at "
            f"({x:.3f}, {y:.3f}, {z:.3f}) m, tilted by {tilt:.1f} degrees"
        )
    rest = np.array(data.qpos[mount.coordinates])
    yaw = math.atan2(2.0 * (w * k + i * j), 1.0 - 2.0 * (j * j + k * k))
    rest[:2] = 0.0
    rest[3:7] = turned(rest[3:7], -yaw)
    return rest


_at_rest = lru_cache(maxsize=16)(_settled)


def turned(quaternion: NDArray[np.float64], yaw: float) -> NDArray[np.float64]:
    """Return an orientation (w, x, y, z) turned about the vertical axis."""
    result = np.empty(4)
    about = np.array([math.cos(yaw / 2.0), 0.0, 0.0, math.sin(yaw / 2.0)])
    mujoco.mju_mulQuat(result, about, np.asarray(quaternion, dtype=np.float64))
    return result


def _has_actuator(model: mujoco.MjModel, name: str) -> bool:
    return bool(mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_ACTUATOR, PREFIX + name) >= 0)
