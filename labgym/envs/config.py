"""The configuration of an environment, and the interfaces of its parts."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules
from typing import Any

from labgym.counts import check_switch, is_finite, whole_number
from labgym.envs import parts
from labgym.envs.assembly import STATIC, Moving, is_standard
from labgym.envs.checks import positive, record_of
from labgym.envs.conditions import changes, glass, parked, payload, people, station, wet  # noqa: F401 - register
from labgym.envs.labnav.curriculum import Curriculum
from labgym.envs.parts.endings import TouchEnding
from labgym.envs.parts.measures import STANDARD, NamedMeasure
from labgym.envs.parts.protocols import (
    Actions,
    Command,
    Condition,
    Ending,
    Measure,
    Noise,
    Randomization,
    Reading,
    RewardTerm,
    Robot,
    Sensor,
    Tasks,
)
from labgym.envs.parts.rays import ColorSensor, DepthSensor, LidarSensor
from labgym.envs.parts.registry import part_of, parts_of
from labgym.envs.parts.rewards import RewardWeights, checked_terms
from labgym.envs.parts.robots import check_size
from labgym.envs.parts.vectors import GoalSensor, VelocitySensor
from labgym.envs.physics import check_physics
from labgym.envs.pool import LayoutPool, PoolAddress
from labgym.envs.residents import RESIDENT_MB, check_budget
from labgym.envs.robot import ROBOT
from labgym.envs.simulation import CHECK_STEPS
from labgym.envs.stage import LayoutSenses
from labgym.envs.state import Pose, State, Verdict
from labgym.envs.training import LayoutSource
from labgym.errors import OptionError, UnknownNameError, check_name
from labgym.layouts import Layout
from labgym.navigation import METHODS, Method
from labgym.protocols import Protocol
from labgym.scenes.opengl import LARGEST, QUALITIES, Quality

__all__ = [
    "OBSERVATIONS", "RENDER_MODES", "Actions", "Command", "Condition", "Ending", "Measure", "Noise", "PointNavConfig",
    "Pose", "Randomization", "Reading", "RewardTerm", "Robot", "Sensor", "State", "Tasks", "Verdict",
]  # fmt: skip

for _module in iter_modules(parts.__path__):
    import_module(f"{parts.__name__}.{_module.name}")

OBSERVATIONS = ("lidar", "depth", "rgbd")
RENDER_MODES = ("human", "rgb_array", "depth_array")
DRIVES = ("pair", "protocol")
LABNAV = "labnav-"
"""Beginning of the names of drives that are drawn as those of a LabNav task at a level."""


@dataclass(frozen=True)
class PointNavConfig:
    """The configuration of a `LabPointNavEnv`; the keyword arguments of `gym.make` are its fields.

    A part is an object with the members of its interface, or plain data: the name of a kind, or a mapping with "kind"
    and the arguments of its class. So a configuration can be read from JSON or YAML.

    Attributes:
        split, layout, protocol, profile, episodes_per_layout, training, pool: choose the layout, the protocol and the
            drive of each episode; `LabPointNavEnv` describes them.
        resident_mb: budget of this process for prepared layouts, megabytes.
        drives: "pair", one drive an episode; "protocol", all drives of a protocol in one; or the task and level of
            LabNav as whose drives they are drawn, such as "labnav-aisle-2".
        tasks: chooses the tasks instead of these.
        floors: folder of a pack of floors (`labgym train floors`), from which a LabNav id draws its episodes.
        curriculum: of a LabNav id, "mixed", "rising" or "tasks": the ladder on which its level is the last rung.
        observation: "lidar", "depth" or "rgbd": names the usual sensors.
        sensors: the entries of the observation, instead of the usual sensors.
        weights: weights of the usual reward. distance_to_go: how it measures progress.
        rewards: the terms of the reward, instead of the usual ones.
        endings: the rules that end an episode; by default success within 0.5 m of the goal.
        onward: names of endings after whose failure the next drive of an episode begins; after other failures it ends.
        disc: radius of the disc around the goal at which `shortest_path_length` ends, meters.
        actions: how an action becomes commands.
        robot: the robot. physics: its physics, "mujoco" or "planar". control_dt: duration of a control step, seconds.
        interactive: whether drawers, doors, stools, trolleys and boxes move. loose: objects on surfaces too.
        randomizations: changes of sensors, physics and colors that are drawn anew for each episode.
        conditions: what is in the episodes beyond their layouts: people, things that moved, glass, a payload.
        measures: the entries of the info.
        render_mode, width, height, quality: pictures.
        exact: whether readings are equal on every processor.
    """

    split: str = "train"
    layout: Layout | str | Path | None = None
    protocol: Protocol | str | Path | None = None
    observation: str = "lidar"
    render_mode: str | None = None
    profile: str = "default"
    weights: RewardWeights | Mapping[str, float] | None = None
    episodes_per_layout: int = 64
    control_dt: float = ROBOT.control_dt
    width: int = 480
    height: int = 360
    quality: Quality = "fast"
    exact: bool = False
    distance_to_go: Method = "grid"
    training: str | LayoutSource = "rooms"
    pool: LayoutPool | PoolAddress | None = None
    resident_mb: float = RESIDENT_MB
    drives: str = "pair"
    tasks: Tasks | None = None
    sensors: Any = None
    rewards: Any = None
    endings: Any = (TouchEnding(),)
    onward: tuple[str, ...] = ()
    actions: Any = "velocity"
    robot: Any = "differential"
    physics: str = "mujoco"
    disc: float = 0.0
    measures: Any = STANDARD
    interactive: bool = False
    loose: bool = False
    randomizations: Any = ()
    conditions: Any = ()
    curriculum: Curriculum | None = None
    floors: str | Path | None = None

    def __post_init__(self) -> None:
        """Check all values, and make parts of plain data.

        Raises:
            UnknownNameError: a name does not exist.
            OptionError: a value is out of range or of the wrong type.
        """
        for kind, value, available in (
            ("observation", self.observation, OBSERVATIONS),
            ("quality", self.quality, QUALITIES),
            ("distance_to_go", self.distance_to_go, METHODS),
            ("drives", self.drives, _drives(self.drives)),
        ):
            check_name(kind, value, available)
        check_physics(self.physics)
        if self.render_mode is not None and self.render_mode not in RENDER_MODES:
            raise UnknownNameError("render_mode", self.render_mode, RENDER_MODES)
        positive(self, "disc", zero=True)
        _check_pixels(self.width, self.height)
        _check_control_dt(self.control_dt)
        check_budget(self.resident_mb)
        whole_number("episodes_per_layout", self.episodes_per_layout)
        check_switch("exact", self.exact)
        if self.weights is not None:
            self._set("weights", record_of(self.weights, RewardWeights(), "weights", "reward term"))
        if self.sensors is not None:
            self._set("sensors", parts_of(self.sensors, "sensor"))
            if not self.sensors:
                raise OptionError("sensors is empty: an environment needs at least one, such as 'lidar'")
        if self.rewards is not None:
            if self.weights is not None:
                raise OptionError("pass weights or rewards, not both: weights are those of the usual rewards")
            self._set("rewards", parts_of(self.rewards, "reward term"))
        checked_terms(self.reward_terms)
        self._set("endings", parts_of(self.endings, "ending"))
        self._set("onward", _names("onward", self.onward))
        self._set("actions", part_of(self.actions, "actions"))
        self._set("robot", part_of(self.robot, "robot"))
        check_size(self.robot.size)
        self._set("randomizations", parts_of(self.randomizations, "randomization"))
        self._set("conditions", parts_of(self.conditions, "condition"))
        self._check_scene()
        self._set("measures", parts_of(_named(self.measures), "measure"))
        if self.floors is not None and not isinstance(self.floors, str | Path):
            raise OptionError(f"floors is a {type(self.floors).__name__}, expected the folder of a pack of floors")
        if self.curriculum is not None and not isinstance(self.curriculum, Curriculum):
            raise OptionError(f"curriculum={str(self.curriculum)[:40]!r} needs a LabNav id, such as LabNavPeople-v0")
        if self.tasks is not None and not isinstance(self.tasks, Tasks):
            raise OptionError(f"tasks is a {type(self.tasks).__name__}, expected an object with draw and close")

    @property
    def observed(self) -> tuple[Sensor, ...]:
        """The sensors: those passed, or the usual ones of `observation`."""
        if self.sensors is not None:
            return tuple(self.sensors)
        usual: dict[str, tuple[Sensor, ...]] = {
            "lidar": (LidarSensor(),),
            "depth": (DepthSensor(),),
            "rgbd": (ColorSensor(), DepthSensor()),
        }
        return (GoalSensor(), VelocitySensor.of(self.robot), *usual[self.observation])

    @property
    def reward_terms(self) -> tuple[RewardTerm, ...]:
        """The terms of the reward: those passed, or the usual ones with `weights`."""
        if self.rewards is not None:
            return tuple(self.rewards)
        weights = self.weights if isinstance(self.weights, RewardWeights) else RewardWeights()
        return weights.terms(self.distance_to_go, self.onward)

    @property
    def rungs(self) -> tuple[PointNavConfig, ...]:
        """The configurations of the curriculum, the easiest first; without one, this one alone."""
        return (self,) if self.curriculum is None else self.curriculum.rungs

    @property
    def moving(self) -> Moving:
        """The kinds of things that move in the scene besides the robot."""
        if not self.interactive:
            return STATIC
        sees = "visual" in {sensor.sees for sensor in self.observed} or self.render_mode == "depth_array"
        return Moving(True, self.loose, sees)

    def _check_scene(self) -> None:
        """Check robot and moving furniture against each other and against the physics."""
        for name in ("interactive", "loose"):
            check_switch(name, getattr(self, name))
        if self.loose and not self.interactive:
            raise OptionError("loose objects need a scene in which things move: pass interactive=True, too")
        if self.interactive and self.exact:
            raise OptionError("interactive scenes have no exact readings: pass exact=False")
        if self.physics == "planar":
            if self.interactive:
                raise OptionError("the planar kernel moves nothing but the robot: pass physics='mujoco'")
            if not is_standard(self.robot):
                raise OptionError(
                    f"the planar kernel has no {type(self.robot).__name__} of these dimensions: pass physics='mujoco'"
                )

    @property
    def senses(self) -> LayoutSenses:
        """The quantities that a layout pool prepares."""
        geometries = {sensor.sees for sensor in self.observed} - {None}
        return LayoutSenses("visual" if "visual" in geometries else "solid", self.distance_to_go)

    def _set(self, name: str, value: object) -> None:
        object.__setattr__(self, name, value)


def _drives(value: object) -> tuple[str, ...]:
    """Return the names of drives, with that of a LabNav task if the value is one; its source checks it."""
    return (*DRIVES, value) if isinstance(value, str) and value.startswith(LABNAV) else DRIVES


def _named(measures: Any) -> Any:
    """Replace the names of our measures by the measures."""
    if not isinstance(measures, list | tuple):
        return measures
    return [NamedMeasure(each) if isinstance(each, str) and ":" not in each else each for each in measures]


def _names(field: str, value: Any) -> tuple[str, ...]:
    """Return a list of names as a tuple."""
    if not isinstance(value, list | tuple) or not all(isinstance(name, str) for name in value):
        raise OptionError(f"{field} is {str(value)[:60]!r}, expected a list of names")
    return tuple(value)


def _check_pixels(width: object, height: object) -> None:
    for name, value, most in (("width", width, LARGEST[0]), ("height", height, LARGEST[1])):
        whole_number(f"{name} in pixels", value, most=most)


def _check_control_dt(control_dt: object) -> None:
    checks = control_dt / (CHECK_STEPS * ROBOT.timestep) if is_finite(control_dt) else 0.0
    if not (1 <= round(checks) <= 40 and abs(checks - round(checks)) < 1e-6):
        raise OptionError(f"control_dt is {control_dt} s, expected a multiple of 0.025 s, at most 1 s")
