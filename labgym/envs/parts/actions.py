"""How an agent's action becomes commands to the robot: velocities, wheels that slip, and discrete actions."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np
from gymnasium import spaces

from labgym.counts import check_switch, is_whole, whole_number
from labgym.envs.checks import finite, positive
from labgym.envs.parts import actuation  # noqa: F401 - errors may be named by their kind
from labgym.envs.parts.protocols import Actions, ActuationNoise, Command, Robot
from labgym.envs.parts.registry import part_of, registered
from labgym.envs.state import State
from labgym.errors import OptionError
from labgym.geometry import wrap_angle


@registered("actions", "velocity", frozen=False)
class VelocityActions(Actions):
    """Target velocities: `Box(-1, 1, (n,), float32)`, one component per axis of the robot, for one control step.

    Attributes:
        stop: whether a further component declares the arrival, and the robot brakes: STOP.
        delay: number of control steps by which the robot obeys later, at rest until then.
        threshold, hold: it is STOP above `threshold` in `hold` control steps in a row.
    """

    stop: bool = False
    delay: int = 0
    threshold: float = 0.0
    hold: int = 1

    def __post_init__(self) -> None:
        check_switch("VelocityActions: stop", self.stop)
        finite(self, "threshold")
        whole_number("VelocityActions: hold", self.hold)
        if not is_whole(self.delay) or self.delay < 0:
            raise OptionError(f"VelocityActions: delay is {self.delay!r}, expected a whole number of control steps")

    def space(self, robot: Robot) -> spaces.Space[Any]:
        """Return the box."""
        return spaces.Box(-1.0, 1.0, (len(robot.axes) + self.stop,), np.float32)

    def reset(self, state: State, rng: np.random.Generator) -> None:  # noqa: ARG002
        """Begin an episode at rest."""
        rest = state.robot.command([0.0] * len(state.robot.axes))
        self._axes = (*state.robot.axes, "stop") if self.stop else tuple(state.robot.axes)
        self._waiting = deque([rest] * self.delay)
        self._stopped, self._held = False, 0

    def commands(self, action: Any, state: State, rng: np.random.Generator) -> Iterable[Command]:  # noqa: ARG002
        """Return one command.

        Raises:
            OptionError: not one finite number per axis.
        """
        values = numbers(action, self._axes)
        if self.stop:
            self._held = self._held + 1 if values.pop() > self.threshold else 0
            self._stopped = self._held >= self.hold
            self._held = 0 if self._stopped else self._held
            values = [0.0] * len(values) if self._stopped else values
        command = state.robot.command(values)
        if not self.delay:
            return (command,)
        self._waiting.append(command)
        return (self._waiting.popleft(),)

    def is_stop(self, action: Any) -> bool:  # noqa: ARG002
        """Whether the action was STOP."""
        return self._stopped


def numbers(action: Any, names: tuple[str, ...]) -> list[float]:
    """Return the components of an action.

    Raises:
        OptionError: not one finite number per name.
    """
    try:
        values = np.asarray(action, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        values = np.empty(0)
    components: list[float] = values.tolist() if values.shape == (len(names),) else []
    if not components or not all(map(math.isfinite, components)):
        shown = " ".join(repr(action).split())[:80]
        count = {2: "two", 3: "three"}.get(len(names), str(len(names)))
        raise OptionError(f"action {shown} must be {count} finite numbers in [-1, 1]: {', '.join(names)}")
    return components


@registered("actions", "slipping", frozen=False)
class SlippingActions(VelocityActions):
    """Target velocities that the wheels carry out with errors, so that commands do not tell where the robot is.

    For each episode, factors on the forward velocity and on the turn rate are drawn from N(1, scale), and a veer, which
    turns the robot as it drives, from N(0, veer).

    Attributes:
        scale: standard deviation of the factors. veer: of the veer, degrees per meter.
    """

    scale: float = 0.03
    veer: float = 2.0

    def __post_init__(self) -> None:
        super().__post_init__()
        positive(self, "scale", "veer", zero=True)

    def space(self, robot: Robot) -> Any:
        """Return the box.

        Raises:
            OptionError: the robot has other axes than forward and turn.
        """
        if tuple(robot.axes) != ("forward", "turn"):
            raise OptionError(
                f"SlippingActions: the robot has the axes {', '.join(robot.axes)}, expected forward, turn"
            )
        return super().space(robot)

    def reset(self, state: State, rng: np.random.Generator) -> None:
        """Begin an episode at rest, with new errors."""
        super().reset(state, rng)
        drawn = rng.standard_normal(3).tolist()
        self._forward, self._turn = (1.0 + self.scale * each for each in drawn[:2])
        self._veer = math.radians(self.veer) * drawn[2]

    @property
    def errors(self) -> tuple[float, float, float]:
        """The errors of the episode: factors on forward velocity and turn rate, and the veer, radians per meter."""
        return self._forward, self._turn, self._veer

    def commands(self, action: Any, state: State, rng: np.random.Generator) -> Iterable[Command]:
        """Return one command, with the errors of the episode.

        Raises:
            OptionError: not one finite number per axis.
        """
        return [(v * self._forward, w * self._turn + v * self._veer) for v, w in super().commands(action, state, rng)]


STOP, FORWARD, LEFT, RIGHT = range(4)
BRAKING = 0.6
"""Share of the robot's acceleration with which an action brakes."""
SLOWEST = 0.25
"""Time constant of the last centimeters, seconds."""
DISTANCE_ERROR, ANGLE_ERROR = 0.002, math.radians(0.1)
"""An action ends within these of its amount, meters and radians."""
LONGEST = 4.0
"""Seconds after which an action ends in any case, as against a wall."""


@registered("actions", "discrete")
class DiscreteActions(Actions):
    """`Discrete(4)`, in the order of Habitat: 0 STOP, 1 forward, 2 turn left, 3 turn right.

    The robot carries out an action in the simulation, by velocity commands over several control steps, and ends it at
    rest within 2 mm or 0.1 degrees of its amount; an obstacle stops it earlier. STOP takes one control step.

    Attributes:
        forward: meters. turn: degrees.
        noise: error of the amounts; None for exact ones.
    """

    forward: float = 0.25
    turn: float = 15.0
    noise: ActuationNoise | None = None

    def __post_init__(self) -> None:
        positive(self, "forward", "turn")
        if self.noise is not None:
            object.__setattr__(self, "noise", part_of(self.noise, "actuation noise"))

    def space(self, robot: Robot) -> spaces.Space[Any]:
        """Return the four actions.

        Raises:
            OptionError: the robot does not turn on the spot by "forward" and "turn".
        """
        if robot.axes != ("forward", "turn"):
            raise OptionError(f"discrete actions need a robot with the axes forward and turn, got {robot.axes}")
        return spaces.Discrete(4)

    def commands(self, action: Any, state: State, rng: np.random.Generator) -> Iterator[Command]:
        """Yield the commands of an action.

        Raises:
            OptionError: not 0, 1, 2 or 3.
        """
        return self._motions(checked(action), state, rng)

    def _motions(self, action: int, state: State, rng: np.random.Generator) -> Iterator[Command]:
        if action == STOP:
            yield (0.0, 0.0)
            return
        ahead, turn = (self.forward, 0.0) if action == FORWARD else (0.0, math.radians(self.turn) * (5 - 2 * action))
        if self.noise is not None:
            more, turned = self.noise.errors(ahead, turn, rng)
            ahead, turn = ahead + more, turn + turned
        if ahead:
            yield from _drive(ahead, state)
        if turn:
            yield from _turn(turn, state)

    def is_stop(self, action: Any) -> bool:
        """Whether the action is 0."""
        return checked(action) == STOP


def checked(action: Any) -> int:
    """Return a discrete action.

    Raises:
        OptionError: not 0, 1, 2 or 3.
    """
    whole = is_whole(action) or (isinstance(action, np.ndarray) and action.ndim == 0)
    if not whole or action not in range(4):
        shown = " ".join(repr(action).split())[:80]
        raise OptionError(f"action {shown} must be 0 (stop), 1 (forward), 2 (left) or 3 (right)")
    return int(action)


def _drive(distance: float, state: State) -> Iterator[Command]:
    """Yield commands that move the robot along its heading, and let it rest."""
    (x, y, yaw), size, until = state.pose, state.robot.size, state.time + LONGEST
    while state.time < until - 1e-9:
        left = distance - math.cos(yaw) * (state.pose[0] - x) - math.sin(yaw) * (state.pose[1] - y)
        if abs(left) < DISTANCE_ERROR and abs(state.velocity[0]) < 0.01:
            break
        limit = size.v_max if left > 0.0 else -size.v_min
        yield (math.copysign(_speed(abs(left), limit, size.acceleration), left), 0.0)
    yield (0.0, 0.0)


def _turn(angle: float, state: State) -> Iterator[Command]:
    """Yield commands that turn the robot on the spot, and let it rest."""
    yaw, size, until = state.pose[2], state.robot.size, state.time + LONGEST
    while state.time < until - 1e-9:
        left = wrap_angle(yaw + angle - state.pose[2])
        if abs(left) < ANGLE_ERROR and abs(state.velocity[1]) < 0.02:
            break
        yield (0.0, math.copysign(_speed(abs(left), size.w_max, size.turn_acceleration), left))
    yield (0.0, 0.0)


def _speed(left: float, limit: float, acceleration: float) -> float:
    """Return the speed at which the robot can still brake within a way."""
    return min(limit, math.sqrt(2.0 * BRAKING * acceleration * left), left / SLOWEST)
