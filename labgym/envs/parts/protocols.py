"""The parts of an environment, as interfaces: a class of the same members takes the place of any of ours.

An environment works on copies of its parts, so that environments never share what a part remembers. Classes may inherit
from these protocols, which gives them the members that do nothing by default.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol, runtime_checkable

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

if TYPE_CHECKING:
    import mujoco

    from labgym.envs.conditions.bodies import Body
    from labgym.envs.conditions.passing import Company
    from labgym.envs.robot import RobotSpec
    from labgym.envs.setting import EpisodeSetting
    from labgym.envs.state import State, Verdict
    from labgym.envs.tasks import Task
    from labgym.scenes.rays import Geometry, RaySource

Reading = NDArray[Any]
Command = tuple[float, ...]
"""Target velocities for one control step, in the order of `Robot.axes`: m/s and rad/s."""


@runtime_checkable
class Sensor(Protocol):
    """One entry of the observation."""

    name: str
    """The key of the observation."""

    @property
    def space(self) -> spaces.Space[Any]:
        """The space of the readings; noise must not lead out of it."""
        ...

    @property
    def sees(self) -> Geometry | None:
        """The geometry that the sensor casts rays against, prepared by a layout pool in advance; None without rays."""
        return None

    def reset(self, state: State, rng: np.random.Generator) -> None:  # noqa: ARG002
        """Begin an episode; called before its first reading."""
        return

    @abstractmethod
    def reading(self, state: State, rng: np.random.Generator) -> Reading:
        """Return the reading in a state.

        Args:
            rng: the sensor's own generator; it depends on the environment's seed, the episode and the sensor's name.
        """
        ...


@runtime_checkable
class Noise(Protocol):
    """An error of a sensor."""

    @abstractmethod
    def apply(self, reading: Reading, state: State, rng: np.random.Generator) -> Reading:
        """Return a disturbed copy of a reading, of the same shape and type."""
        ...


@runtime_checkable
class RewardTerm(Protocol):
    """One term of the reward."""

    name: str
    """The key in `info["reward_terms"]`."""

    weight: float
    """Factor on the value."""

    def reset(self, state: State) -> None:  # noqa: ARG002
        """Begin a drive: at the start of an episode, and when a goal was reached and the next one begins."""
        return

    @abstractmethod
    def value(self, state: State) -> float:
        """Return the value for the latest action, without the weight."""
        ...


@runtime_checkable
class Ending(Protocol):
    """A rule that ends a drive. The first of an environment's endings that gives a verdict decides."""

    name: str
    """The value of `info["ending"]` when this rule ended the episode."""

    def reset(self, state: State) -> None:  # noqa: ARG002
        """Begin a drive: at the start of an episode, and when a goal was reached and the next one begins."""
        return

    @abstractmethod
    def verdict(self, state: State) -> Verdict | None:
        """Return how the drive ends in a state, None if it goes on.

        "success" and "failure" terminate the episode, "truncation" truncates it. After "success" on a task of several
        drives, the next one begins instead.
        """
        ...


@runtime_checkable
class Measure(Protocol):
    """One entry of the info."""

    name: str
    """The key of the info."""

    @abstractmethod
    def value(self, state: State) -> Any:
        """Return the value in a state, at reset and after every action; always of the same type."""
        ...


@runtime_checkable
class Actions(Protocol):
    """How an agent's action becomes commands to the robot."""

    def space(self, robot: Robot) -> spaces.Space[Any]:
        """Return the action space for a robot."""
        ...

    def reset(self, state: State, rng: np.random.Generator) -> None:  # noqa: ARG002
        """Begin an episode."""
        return

    def commands(self, action: Any, state: State, rng: np.random.Generator) -> Iterable[Command]:
        """Yield the command of each control step of an action; `state` changes between them.

        Raises:
            OptionError: not an action of the space.
        """
        ...

    def is_stop(self, action: Any) -> bool:  # noqa: ARG002
        """Whether the action is STOP: the agent declares that it has arrived."""
        return False


@runtime_checkable
class Robot(Protocol):
    """A robot, as an agent commands it and as the physics moves it."""

    size: RobotSpec
    """Dimensions, limits and physics step."""

    @property
    def axes(self) -> tuple[str, ...]:
        """Names of the components of a command, such as ("forward", "turn")."""
        ...

    def command(self, action: Iterable[float]) -> Command:
        """Return the target velocities of an action in [-1, 1] per axis; values outside are clipped."""
        ...

    def spec(self) -> mujoco.MjSpec:
        """Return the robot without a scene.

        Its only body in the world is `base`, whose origin is on the floor on the robot's axis, heading along +x. The
        base moves on the joints `x`, `y` (slides, meters) and `yaw` (hinge, radians), or on a free joint.
        """
        ...

    @property
    def actuators(self) -> tuple[str, ...]:
        """Names of the actuators that `controls` sets; by default those of the axes."""
        return self.axes

    def controls(self, command: Command) -> Sequence[float]:
        """Return the controls of the actuators for a command; by default the target velocities themselves."""
        return command


@runtime_checkable
class Randomization(Protocol):
    """A change of an environment that is drawn anew for each episode."""

    name: str
    """The key of the drawn values in the info entry `randomization`."""

    def randomize(self, setting: EpisodeSetting, rng: np.random.Generator) -> Any:
        """Change the setting of an episode and return the drawn values, as plain data.

        Args:
            setting: robot, sensors, physics and colors, which this episode alone has.
            rng: the randomization's own generator; it depends on the environment's seed, the episode and the name.
        """
        ...


class Motion(NamedTuple):
    """The motion of the robot after a physics step.

    Attributes:
        time: seconds since the start of the episode. dt: duration of the step, seconds.
        pose: (x, y, yaw) in the room frame, meters and radians.
        velocity: forward velocity, m/s, and turn rate, rad/s. sideways: velocity to the left, m/s.
    """

    time: float
    dt: float
    pose: tuple[float, float, float]
    velocity: tuple[float, float]
    sideways: float


@runtime_checkable
class Presence(Protocol):
    """A condition in an episode in progress."""

    visible: bool = True
    """Whether sensors see it: whether `rays` returns anything but its source."""
    planar: bool = False
    """Whether the lidar of the planar kernel sees it: as its `bodies`, or as glass."""

    def substep(self, motion: Motion) -> str:  # noqa: ARG002
        """Advance by one physics step of the robot; return the name of what the robot touches of it, "" for nothing."""
        return ""

    def attend(self, company: Company) -> Company | None:
        """Return a company with what the planar kernel advances of this condition in each physics step.

        None if `substep` must be called instead, after each of them. Otherwise `follow` is called after each control
        step.
        """
        return company if type(self).substep is Presence.substep else None

    def follow(self, motion: Motion) -> None:  # noqa: ARG002
        """Follow the robot after a control step of the planar kernel."""
        return

    def step(self, state: State) -> None:  # noqa: ARG002
        """Advance after a control step; the state has been read."""
        return

    def rays(self, source: RaySource, geometry: Geometry, state: State) -> RaySource:  # noqa: ARG002
        """Return the scene that sensors cast rays against, given the scene without this condition."""
        return source

    @property
    def bodies(self) -> Sequence[Body]:
        """The bodies that pictures show besides the layout."""
        return ()

    @property
    def outcome(self) -> Any:
        """The results so far, as plain data: the entry of the condition in the measure `outcomes`."""
        return None


@runtime_checkable
class Condition(Protocol):
    """Something in an episode beyond its layout: people, things that moved, glass, a payload.

    An episode draws its data, changes the task by it, and then begins. The data is plain, so that published episodes
    store it.
    """

    name: str
    """The key of the data in the measure `conditions` and in `Task.conditions`."""

    def draw(self, task: Task, rng: np.random.Generator) -> Any:
        """Return the data of an episode, as plain JSON data.

        Args:
            rng: the condition's own generator; it depends on the environment's seed, the episode and the name.
        """
        ...

    def prepare(self, task: Task, data: Any) -> Task:  # noqa: ARG002
        """Return the task with what this condition changes of it, such as the layout."""
        return task

    def begin(self, state: State, data: Any, rng: np.random.Generator) -> Presence:
        """Return the condition in an episode that begins.

        Raises:
            OptionError: the data is not of this condition.
        """
        ...


@runtime_checkable
class Tasks(Protocol):
    """Chooses the task of each episode."""

    def draw(self, rng: np.random.Generator, options: Mapping[str, Any], fresh: bool) -> Task:
        """Return the next task.

        Args:
            rng: the environment's generator.
            options: the options of `reset`.
            fresh: whether `reset` was called with a seed, so that the task may depend on `rng` and `options` only.

        Raises:
            UnknownNameError: an option is unknown.
        """
        ...

    def close(self) -> None:
        """Release what the source holds; `draw` may be called again."""


@runtime_checkable
class ActuationNoise(Protocol):
    """Errors of discrete actions."""

    def errors(self, ahead: float, turn: float, rng: np.random.Generator) -> tuple[float, float]:
        """Return the errors along the heading, m, and of the yaw, radians, of an action.

        Args:
            ahead: length of the step, meters; 0 for a turn. turn: its angle, radians; 0 for a step.
        """
        ...


INTERFACES: dict[str, Any] = {
    "sensor": Sensor,
    "noise": Noise,
    "reward term": RewardTerm,
    "ending": Ending,
    "measure": Measure,
    "actions": Actions,
    "actuation noise": ActuationNoise,
    "robot": Robot,
    "condition": Condition,
    "randomization": Randomization,
}
"""The interface of the parts of each role."""
