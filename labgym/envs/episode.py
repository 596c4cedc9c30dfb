"""An episode in progress: the physics, and the state that the parts of an environment read."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from labgym.envs.assembly import Moving, assembly_of, is_standard
from labgym.envs.config import PointNavConfig
from labgym.envs.moving_scene import MovingScene, PushedScene
from labgym.envs.parts.protocols import Command, Condition, Motion, Randomization, Robot, Sensor
from labgym.envs.physics import Physics, make_physics
from labgym.envs.pushing import PushingSimulation
from labgym.envs.scene_simulation import SceneSimulation
from labgym.envs.setting import EpisodeSetting
from labgym.envs.simulation import arc
from labgym.envs.state import State
from labgym.envs.tasks import Task
from labgym.envs.world import world_of
from labgym.errors import OptionError
from labgym.geometry import wrap_angle

SUCCESS_DISTANCE = 0.5
"""The goal of `LabPointNav-v0` is reached within this distance, meters."""


class RunningEpisode:
    """An episode, from its start pose.

    Attributes:
        task: layout, protocol and drives. simulation: the physics. state: what the parts read.

    Args:
        robot: the robot. config: physics, control step, exactness and disc of the environment.
        setting: physics and colors of this episode; None for those of the layout.
        conditions: what is in the episode beyond its layout, with the data and the generator of each.
        simulation: the physics, in which the robot is at its start; None to make it.

    The attribute `company` has what the planar kernel advances of the conditions; None where it cannot.
    """

    def __init__(
        self,
        task: Task,
        robot: Robot,
        config: PointNavConfig,
        setting: EpisodeSetting | None = None,
        conditions: Sequence[tuple[Condition, Any, np.random.Generator]] = (),
        simulation: Physics | None = None,
    ) -> None:
        world = world_of(task.layout)
        self.task = task
        if task.pushable and config.physics == "planar":
            raise OptionError("the planar kernel moves nothing but the robot: pass physics='mujoco'")
        assembly = None if setting is None else setting.changed()
        if assembly is None and task.pushable:
            assembly = assembly_of(world, robot, Moving(pushable=tuple(task.pushable.items())))
        palette = None if setting is None else setting.palette
        self.simulation: Physics = (
            make_physics(config.physics, world, robot, config.control_dt, assembly)
            if simulation is None
            else simulation
        )
        self.simulation.place(task.pair.start)
        pose, planar = self.simulation.pose, config.physics == "planar"
        moving: MovingScene | PushedScene | None = None
        if isinstance(self.simulation, PushingSimulation):
            moving = PushedScene(self.simulation, task.layout, robot.size, config.exact, palette)
        elif config.interactive and isinstance(self.simulation, SceneSimulation):
            moving = MovingScene(self.simulation, task.layout, robot.size, palette)
        self.state = State(
            task,
            world,
            robot,
            config.exact,
            task.pair,
            config.control_dt,
            pose,
            disc=config.disc,
            planar=planar,
            moving=moving,
            palette=palette,
        )
        # The differential robot has grip, and its rules do not look at how it slips.
        self._slides = not is_standard(robot)
        self._read()
        for condition, data, rng in conditions:
            self.state.conditions[condition.name] = data
            self.state.presences[condition.name] = condition.begin(self.state, data, rng)
        self.company = company_of(self.state)

    @property
    def last(self) -> bool:
        """Whether the drive in progress is the last one of the task."""
        return self.state.leg == len(self.task.following)

    def go_on(self) -> None:
        """Begin the next drive, from where the robot is."""
        state = self.state
        state.pair = replace(self.task.following[state.leg], start=state.pose)
        state.leg, state.verdict, state.ending = state.leg + 1, None, ""
        state.distance = math.dist(state.pose[:2], state.pair.goal[:2])

    def drive(self, commands: Iterable[Command]) -> None:
        """Carry out one action: apply the command of each of its control steps."""
        state, touches = self.state, 0
        state.touched = ()
        for command in commands:
            driven, touched = self._drive_among(command) if state.presences else self.simulation.drive(*command)
            state.path_length += driven
            state.steps += 1
            touches += touched
            self._read()
            for presence in state.presences.values():
                presence.step(state)
        state.touches, state.collision = touches, touches > 0
        state.contacts += touches

    def _drive_among(self, command: Command) -> tuple[float, bool]:
        """Carry out one control step, in which conditions advance after each physics step.

        Returns:
            the length driven in meters, and whether the robot touched anything.
        """
        state, simulation = self.state, self.simulation
        if self.company is not None:
            kernel: Any = simulation  # the planar one
            driven, touches = kernel.drive_among(state.time, self.company, *command)
            motion = Motion(
                state.time + state.control_dt,
                state.control_dt,
                simulation.pose,
                simulation.velocity,
                simulation.sideways,
            )
            for presence in state.presences.values():
                presence.follow(motion)
            state.touched = tuple(dict.fromkeys((*state.touched, *touches)))
            return driven, bool(touches)
        dt = simulation.timestep
        touched: dict[str, None] = {}
        driven, (x, y, yaw) = 0.0, simulation.pose
        for step in range(1, round(state.control_dt / dt) + 1):
            names = simulation.substep(*command)
            last, (x, y, yaw) = (x, y, yaw), simulation.pose
            driven += arc(math.hypot(x - last[0], y - last[1]), wrap_angle(yaw - last[2]))
            motion = Motion(state.time + step * dt, dt, simulation.pose, simulation.velocity, simulation.sideways)
            others = [presence.substep(motion) for presence in state.presences.values()]
            touched |= dict.fromkeys((*names, *(name for name in others if name)))
        state.touched = tuple(dict.fromkeys((*state.touched, *touched)))
        return driven, bool(touched)

    def _read(self) -> None:
        state, simulation = self.state, self.simulation
        state.pose, state.velocity = simulation.pose, simulation.velocity
        if self._slides:
            state.sideways = simulation.sideways
        state.distance = math.dist(state.pose[:2], state.pair.goal[:2])
        state.views.clear()


def conditioned(
    task: Task, conditions: Sequence[Condition], rng: np.random.Generator
) -> tuple[Task, list[tuple[Condition, Any, np.random.Generator]]]:
    """Return the task as conditions change it, and each condition with its data and its generator.

    Args:
        rng: of the episode.
    """
    drawn = []
    for condition in conditions:
        name, own = condition.name, stream(rng, f"condition {condition.name}")
        data = task.conditions[name] if name in task.conditions else condition.draw(task, own)
        task = condition.prepare(task, data)
        drawn.append((condition, data, own))
    return task, drawn


def randomized(
    task: Task,
    config: PointNavConfig,
    robot: Robot,
    sensors: Sequence[Sensor],
    randomizations: Sequence[Randomization],
    rng: np.random.Generator,
) -> tuple[EpisodeSetting | None, dict[str, Any], tuple[Sensor, ...]]:
    """Return the setting of an episode, the drawn values of its randomizations by name, and its sensors.

    Args:
        rng: of the episode.
    """
    if not randomizations and not config.interactive:
        return None, {}, tuple(sensors)
    world = world_of(task.layout)
    moving = replace(config.moving, pushable=tuple(task.pushable.items()))
    assembly = None if config.physics == "planar" else assembly_of(world, robot, moving)
    setting = EpisodeSetting.of(assembly, sensors)
    drawn = {each.name: each.randomize(setting, stream(rng, f"randomization {each.name}")) for each in randomizations}
    return setting, drawn, setting.observed(sensors)


def company_of(state: State) -> Any:
    """Return the `Company` that the planar kernel advances within a control step; None where it cannot.

    People choose new velocities every 0.1 s, so that a control step with people must take as long.
    """
    if not state.planar or not state.presences:
        return None
    from labgym.envs.conditions.passing import nobody
    from labgym.envs.planar.simulation import TICK_S

    company: Any = nobody()
    for presence in state.presences.values():
        attend = getattr(presence, "attend", None)
        company = None if attend is None else attend(company)
        if company is None:
            return None
    aligned = not len(company.before) or math.isclose(state.control_dt, TICK_S)
    return company if aligned else None


def stream(rng: np.random.Generator, name: str) -> np.random.Generator:
    """Return the generator of one part: it depends on the episode's generator and on the part's name alone."""
    sequence: Any = rng.bit_generator.seed_seq
    key = (*sequence.spawn_key, *name.encode())
    return np.random.default_rng(np.random.SeedSequence(sequence.entropy, spawn_key=key))
