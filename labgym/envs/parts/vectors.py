"""Sensors of the robot's own state and of its goal, and a sensor that joins others."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from gymnasium import spaces

from labgym.envs.checks import MAX_METERS, positive
from labgym.envs.parts.noise import NoisySensor
from labgym.envs.parts.protocols import Noise, Reading, Robot, Sensor
from labgym.envs.parts.registry import parts_of, registered
from labgym.envs.robot import ROBOT
from labgym.envs.state import Pose, State
from labgym.errors import OptionError, check_name
from labgym.scenes.rays import Geometry

if TYPE_CHECKING:
    from labgym.envs.state import State

GOAL_RANGE = 50.0
"""Largest distance in the goal reading, meters."""
POSITION_RANGE = 200.0
"""Largest coordinate in the readings of positions, meters."""


def planar(pose: Pose, reach: float) -> Reading:
    """Return x and y, clipped to [-reach, reach], cosine and sine of the yaw of a pose, (4,) float32."""
    return np.array([*_within(*pose[:2], reach), math.cos(pose[2]), math.sin(pose[2])], np.float32)


def _within(x: float, y: float, reach: float) -> tuple[float, float]:
    return min(max(x, -reach), reach), min(max(y, -reach), reach)


def polar_space(reach: float) -> spaces.Box:
    """Return the space of goals in polar form: distance in [0, reach], cosine and sine in [-1, 1]."""
    return spaces.Box(np.array([0, -1, -1], np.float32), np.array([reach, 1, 1], np.float32))


def polar(goal: Pose, pose: Pose, reach: float) -> Reading:
    """Return the distance to a goal, at most `reach` meters, and cosine and sine of its bearing from a pose, (3,)."""
    dx, dy = goal[0] - pose[0], goal[1] - pose[1]
    bearing = math.atan2(dy, dx) - pose[2]
    return np.array([min(math.hypot(dx, dy), reach), math.cos(bearing), math.sin(bearing)], np.float32)


@registered("sensor", "goal")
class GoalSensor(NoisySensor):
    """The goal in polar form, as the robot sees it: (3,) float32.

    Distance in meters, clipped to `reach`; cosine and sine of the bearing relative to the heading, counter-clockwise.
    """

    name: str = "goal"
    reach: float = GOAL_RANGE
    noise: tuple[Noise, ...] = ()

    def __post_init__(self) -> None:
        positive(self, "reach", most=MAX_METERS)
        super().__post_init__()

    @property
    def space(self) -> spaces.Space[Any]:
        """Distance in [0, reach], cosine and sine in [-1, 1]."""
        return polar_space(self.reach)

    def measured(self, state: State) -> Reading:
        """Return distance, cosine and sine."""
        return polar(state.pair.goal, state.pose, self.reach)


@registered("sensor", "velocity")
class VelocitySensor(NoisySensor):
    """The velocity of the robot: (2,) float32, forward in m/s and turn rate in rad/s, counter-clockwise.

    With three limits, (3,): forward, to the left, and turn rate.

    Attributes:
        low, high: limits of the components; readings are clipped to them.
    """

    name: str = "velocity"
    low: tuple[float, ...] = (ROBOT.v_min, -ROBOT.w_max)
    high: tuple[float, ...] = (ROBOT.v_max, ROBOT.w_max)
    noise: tuple[Noise, ...] = ()

    def __post_init__(self) -> None:
        for name in ("low", "high"):
            limits = tuple(getattr(self, name))
            if not all(
                isinstance(limit, int | float | np.number) and abs(float(limit)) <= MAX_METERS for limit in limits
            ):
                raise OptionError(f"VelocitySensor: {name} is {str(limits)[:60]}, expected finite numbers")
            object.__setattr__(self, name, limits)
        if len(self.low) not in (2, 3) or len(self.high) != len(self.low):
            raise OptionError("VelocitySensor: low and high need two or three components each")
        super().__post_init__()

    @classmethod
    def of(cls, robot: Robot) -> VelocitySensor:
        """Return the sensor with the limits of a robot, of its sideways velocity too if it commands one."""
        size = robot.size
        side = (size.v_side,) if "sideways" in robot.axes else ()
        low = (size.v_min, *(-each for each in side), -size.w_max)
        return cls(low=low, high=(size.v_max, *side, size.w_max))

    @property
    def space(self) -> spaces.Space[Any]:
        """The limits."""
        return spaces.Box(np.array(self.low, np.float32), np.array(self.high, np.float32))

    def measured(self, state: State) -> Reading:
        """Return forward velocity and turn rate."""
        (v, w), low, high = state.velocity, self.low, self.high
        if len(low) == 3:
            return np.clip((v, state.sideways, w), low, high).astype(np.float32)
        return np.array([min(max(v, low[0]), high[0]), min(max(w, low[1]), high[1])], np.float32)


@registered("sensor", "pose")
class PoseSensor(NoisySensor):
    """The pose of the robot in the room frame: (4,) float32, x and y in meters, cosine and sine of the yaw. Privileged.

    Attributes:
        reach: x and y are clipped to [-reach, reach], meters.
    """

    name: str = "pose"
    reach: float = POSITION_RANGE
    noise: tuple[Noise, ...] = ()

    def __post_init__(self) -> None:
        positive(self, "reach", most=MAX_METERS)
        super().__post_init__()

    @property
    def space(self) -> spaces.Space[Any]:
        """Position within the reach, cosine and sine in [-1, 1]."""
        high = np.array([self.reach, self.reach, 1.0, 1.0], np.float32)
        return spaces.Box(-high, high)

    def measured(self, state: State) -> Reading:
        """Return x, y, cosine and sine."""
        return planar(state.pose, self.reach)


@registered("sensor", "place")
class PlaceSensor(Sensor):
    """A position in the room frame: (2,) float32, meters.

    Attributes:
        of: "robot" or "goal". reach: components are clipped to [-reach, reach], meters.
    """

    name: str = "achieved_goal"
    of: str = "robot"
    reach: float = POSITION_RANGE

    def __post_init__(self) -> None:
        positive(self, "reach", most=MAX_METERS)
        check_name("place", self.of, ("robot", "goal"))

    @property
    def space(self) -> spaces.Space[Any]:
        """Both within the reach."""
        return spaces.Box(-self.reach, self.reach, (2,), np.float32)

    def reading(self, state: State, rng: np.random.Generator) -> Reading:  # noqa: ARG002
        """Return x and y."""
        x, y = state.pose[:2] if self.of == "robot" else state.pair.goal[:2]
        return np.array(_within(x, y, self.reach), np.float32)


@registered("sensor", "joint")
class JointSensor(Sensor):
    """The readings of several sensors as one float32 vector, one after the other.

    Attributes:
        sensors: the sensors; their readings are flattened.
    """

    name: str = "observation"
    sensors: tuple[Sensor, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "sensors", parts_of(self.sensors, "sensor"))
        if not self.sensors:
            raise OptionError("JointSensor: sensors is empty; it needs at least one")

    @property
    def space(self) -> spaces.Space[Any]:
        """The limits of all components."""
        boxes = [sensor.space for sensor in self.sensors]
        low, high = (np.concatenate([getattr(box, end).ravel() for box in boxes]) for end in ("low", "high"))
        return spaces.Box(low.astype(np.float32), high.astype(np.float32))

    @property
    def sees(self) -> Geometry | None:
        """The visual shapes if one of the sensors sees them."""
        geometries = {sensor.sees for sensor in self.sensors}
        return "visual" if "visual" in geometries else "solid" if "solid" in geometries else None

    def reset(self, state: State, rng: np.random.Generator) -> None:
        """Begin an episode."""
        for sensor in self.sensors:
            sensor.reset(state, rng)

    def reading(self, state: State, rng: np.random.Generator) -> Reading:
        """Return the joint vector."""
        readings = [np.asarray(sensor.reading(state, rng)).ravel() for sensor in self.sensors]
        return np.concatenate(readings).astype(np.float32, copy=False)
