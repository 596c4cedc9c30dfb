"""Condition "changes": the map is of before, and things stand in the way that were not there."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from labgym.counts import check_switch
from labgym.envs.checks import count, positive
from labgym.envs.conditions.change_draw import KINDS, draw_changes
from labgym.envs.conditions.change_list import Added, changed, changes_of, masses, plain
from labgym.envs.moving_scene import PushedScene
from labgym.envs.parts.protocols import Condition, Presence
from labgym.envs.parts.registry import registered
from labgym.envs.robot import ROBOT
from labgym.envs.state import State
from labgym.envs.tasks import Task
from labgym.envs.world import World, world_of
from labgym.errors import OptionError, check_name
from labgym.navigation.barriers import Barriers

UNSEEN_FROM = 3.0
"""A thing comes while the robot is at least this far away, meters."""
EYES = (0.25, 0.5)
"""Heights of lidar and camera, from which a thing that comes must not be seen, meters."""


@registered("condition", "changes")
class Changes(Condition):
    """Things that moved since the map was drawn.

    On the shortest route of the map there is one change per `spacing` meters, as far as they fit and a way round exists
    for the disc of 0.30 m: a stool (8 kg) or a trolley (30 kg) on castors, cartons, a drawer or a cabinet door that
    stands open, a door that is shut. Stools, trolleys and half of the cartons can be pushed (`pushable`); that is no
    contact. The data is a list of changes (`labgym.envs.conditions.change_list`), and the agent's map is
    `Task.old_map`.

    The outcome has `pushed`, a mapping of each thing that can be pushed to its `mass` in kg, the `way` that it was
    pushed in meters, and whether it was `touched`; and `appeared`, the time in seconds at which each late thing came.

    Attributes:
        spacing: length of route per change, meters. most: largest number of changes.
        kinds: kinds of changes that are drawn, with equal weights.
        pushable: whether the robot can push things; without it, all stand fast, even those that were drawn with a mass.
        late: whether half of those come while the robot drives; without `pushable` they are there from the start.
        detour: largest ratio of the shortest path on the true floor to that on the map.
    """

    spacing: float = 5.0
    most: int = 16
    kinds: tuple[str, ...] = KINDS
    pushable: bool = True
    late: bool = False
    detour: float = 3.0
    name: str = "changes"

    def __post_init__(self) -> None:
        positive(self, "spacing", "detour")
        count(self, "most")
        object.__setattr__(self, "kinds", tuple(self.kinds))
        for kind in self.kinds:
            check_name("kind of change", kind, KINDS)
        if not self.kinds:
            raise OptionError(f"kinds of changes are empty: pass some of {', '.join(KINDS)}")
        for name in ("pushable", "late"):
            check_switch(f"Changes: {name}", getattr(self, name))

    def draw(self, task: Task, rng: np.random.Generator) -> list[dict[str, Any]]:
        """Return changes on the shortest route of the task's layout."""
        drawn = draw_changes(
            task,
            rng,
            spacing=self.spacing,
            most=self.most,
            kinds=self.kinds,
            pushable=self.pushable,
            late=self.late,
            detour=self.detour,
        )
        return plain(drawn)

    def prepare(self, task: Task, data: Any) -> Task:
        """Return the task on the true floor, with the layout of before as its map.

        Raises:
            OptionError: the data is no list of changes of this layout, or start or goal of a drive are blocked.
        """
        changes = changes_of(data)
        layout = changed(task.layout, changes)
        barriers = Barriers.of(layout)
        start = barriers.clearance(np.array([task.pair.start[:2]]))[0]
        if start < ROBOT.chassis_radius:
            x, y, _ = task.pair.start
            raise OptionError(f"changes: the robot would touch something at its start ({x:.2f}, {y:.2f})")
        world = world_of(layout)
        for pair in (task.pair, *task.following):
            if not math.isfinite(world.shortest_length(pair)):
                x, y, _ = pair.goal
                raise OptionError(f"changes: no way round leads to the goal ({x:.2f}, {y:.2f}) for a disc of 0.30 m")
        old = task.layout if task.old_map is None else task.old_map
        pushable = {**task.pushable, **masses(changes)} if self.pushable else task.pushable
        return replace(task, layout=layout, old_map=old, pushable=pushable)

    def begin(self, state: State, data: Any, rng: np.random.Generator) -> Changed:  # noqa: ARG002
        """Return the changes of an episode; late things are away at first."""
        changes = changes_of(data)
        coming = [each for each in changes if isinstance(each, Added)] if self.pushable else []
        late = {each.id: each.after for each in coming if each.after is not None}
        moving = state.moving if isinstance(state.moving, PushedScene) else None
        if late and (moving is None or not set(late) <= set(masses(changes))):
            raise OptionError("changes: a thing that comes late must be one that can be pushed: give its mass")
        return Changed(moving, masses(changes), late)


class Changed(Presence):
    """The changes of an episode in progress.

    A late thing comes at the first control step at which the robot has driven far enough, is at least `UNSEEN_FROM`
    away, has no free line of sight to its corners, and nothing stands in its place.
    """

    visible = False

    def __init__(self, scene: PushedScene | None, weights: Mapping[str, float], late: Mapping[str, float]) -> None:
        self._scene, self._masses, self._late = scene, dict(weights), dict(late)
        self._appeared: dict[str, float] = {}
        if scene is not None:
            for name in self._late:
                scene.simulation.remove(name)

    def step(self, state: State) -> None:
        """Let late things come."""
        for name, after in tuple(self._late.items()):
            if state.path_length >= after and self._scene is not None and unseen(self._scene, name, state.pose):
                self._scene.simulation.put_back(name)
                self._appeared[name] = state.time
                del self._late[name]

    @property
    def outcome(self) -> dict[str, Any]:
        """The mass and the way of each thing that can be pushed, and the times at which late things came."""
        pushed: dict[str, Any] = {}
        if self._scene is not None:
            simulation = self._scene.simulation
            for thing, way in zip(simulation.things, simulation.ways.tolist(), strict=True):
                if thing.name in self._masses:
                    pushed[thing.name] = {"mass": thing.mass, "way": way, "touched": thing.name in simulation.touched}
        return {"pushed": pushed, "appeared": dict(self._appeared)}


def unseen(scene: PushedScene, name: str, pose: tuple[float, float, float]) -> bool:
    """Whether a thing that is away can come: the robot is far and does not see its place, and the place is free."""
    simulation, (x, y, _) = scene.simulation, pose
    index = [thing.name for thing in simulation.things].index(name)
    thing = simulation.things[index]
    if math.dist(thing.pose[:2], (x, y)) < UNSEEN_FROM:
        return False
    for other, (a, b, _) in zip(simulation.things, simulation.poses.tolist(), strict=True):
        if other is not thing and math.dist((a, b), thing.pose[:2]) < thing.radius + other.radius:
            return False
    return not sees(scene.fixtures, (x, y), thing.pose[:2], thing.radius)


def sees(world: World, here: tuple[float, float], there: tuple[float, float], radius: float) -> bool:
    """Whether lidar or camera at a point has a free line of sight to the edge or the middle of a cylinder."""
    angles = np.arange(8) * (math.pi / 4.0)
    ring = np.array(there) + radius * np.column_stack([np.cos(angles), np.sin(angles)])
    targets = np.concatenate([ring, [there]])
    for height in EYES:
        flat = targets - np.array(here)
        away = np.hypot(flat[:, 0], flat[:, 1])
        along = np.column_stack([flat / away[:, None], np.zeros(len(flat))])
        origins = np.tile((*here, height), (len(flat), 1))
        reached, _ = world.solid_exact.cast(origins, along, float(away.max()) + 1.0)
        if (reached > away - 1e-3).any():
            return True
    return False
