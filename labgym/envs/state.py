"""The state of an episode: everything that sensors, rewards, endings and measures read."""

from __future__ import annotations

from dataclasses import dataclass, field
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from labgym.envs.robot import ROBOT
from labgym.navigation import GoalPair, Method
from labgym.scenes.rays import Geometry, RaySource

if TYPE_CHECKING:
    from labgym.envs.conditions.bodies import Body
    from labgym.envs.distance_to_go import DistanceToGo
    from labgym.envs.moving_scene import MovingScene, PushedScene
    from labgym.envs.parts.protocols import Presence, Robot
    from labgym.envs.sensors import Camera, Lidar
    from labgym.envs.setting import Palette
    from labgym.envs.tasks import Task
    from labgym.envs.world import World

Pose = tuple[float, float, float]
Verdict = Literal["success", "failure", "truncation"]
"""How an episode ended: its goal was reached, it failed, or it was cut short."""


@dataclass
class State:
    """The state of an episode after the latest action. Parts of an environment read it and never change it.

    Positions are in the room frame, meters and radians; times are in seconds.

    Attributes:
        task: layout, protocol and drives. world: the layout prepared for simulation. robot: the robot.
        exact: whether readings must be equal on every processor.
        planar: whether the physics is the planar kernel, which also computes lidar ranges, depth and clearances.
        pair: the drive in progress, from its start to its goal. leg: its place among the drives of the task, from 0.
        pose: (x, y, yaw) of the robot; yaw in (-pi, pi].
        velocity: forward velocity, m/s, and turn rate, rad/s. sideways: velocity to the left, m/s; 0 for the robot of
            `LabPointNav-v0`, which has grip.
        distance: distance from the robot's center to the goal.
        collision: whether the robot touched something during the latest action.
        touches: number of control steps with a contact during the latest action.
        contacts: number of control steps with a contact since the start.
        steps: number of control steps since the start. control_dt: duration of one of them.
        path_length: length driven since the start, meters.
        disc: radius of the disc around the goal at which shortest paths end, meters; 0 for the goal itself.
        stop: whether the latest action was STOP.
        verdict: the verdict of the endings on the drive in progress; None while it goes on. ending: the name of the
            ending that gave it, "" without one.
        terms: the weighted reward terms of the latest action, by name.
        moving: what sensors see of a scene in which furniture moves or can be pushed; None if nothing but the robot
            moves.
        palette: colors of this episode; None for those of the layout.
        randomization: the drawn values of the randomizations by name.
        conditions: the data of the conditions by name. presences: the conditions in progress by name.
        touched: names of what the robot touched during the latest action; empty without conditions.
        slip: factor on the errors of odometry at this place.
        views: what sensors share with each other at this pose, such as one ray cast for depth and color.
    """

    task: Task
    world: World
    robot: Robot
    exact: bool
    pair: GoalPair
    control_dt: float
    pose: Pose
    leg: int = 0
    planar: bool = False
    velocity: tuple[float, float] = (0.0, 0.0)
    sideways: float = 0.0
    distance: float = 0.0
    collision: bool = False
    touches: int = 0
    contacts: int = 0
    steps: int = 0
    path_length: float = 0.0
    disc: float = 0.0
    stop: bool = False
    verdict: Verdict | None = None
    ending: str = ""
    terms: dict[str, float] = field(default_factory=dict)
    moving: MovingScene | PushedScene | None = None
    palette: Palette | None = None
    randomization: dict[str, Any] = field(default_factory=dict)
    conditions: dict[str, Any] = field(default_factory=dict)
    presences: dict[str, Presence] = field(default_factory=dict)
    touched: tuple[str, ...] = ()
    slip: float = 1.0
    views: dict[Any, Any] = field(default_factory=dict)
    _measured: GoalPair | None = field(default=None, init=False, repr=False)
    _length: float = field(default=0.0, init=False, repr=False)

    @property
    def goal(self) -> Pose:
        """The goal of the drive in progress, (x, y, yaw)."""
        return self.pair.goal

    @property
    def shortest_path_length(self) -> float:
        """Length of the shortest any-angle path of the drive in progress, meters; inf if no path exists. Privileged.

        It leads through what the robot can push, so that no drive is shorter.
        """
        if self._measured is not self.pair:
            self._measured, world = self.pair, self.fixtures
            self._length = (
                world.shortest_length(self.pair) if not self.disc else world.length_to_disc(self.pair, self.disc)
            )
        return self._length

    @property
    def time(self) -> float:
        """Seconds since the start of the episode."""
        return self.steps * self.control_dt

    @property
    def success(self) -> bool:
        """Whether the robot has reached the goal of the drive in progress, by the rules of the endings."""
        return self.verdict == "success"

    @property
    def failed(self) -> bool:
        """Whether an ending gives the verdict "failure"."""
        return self.verdict == "failure"

    @property
    def clearance(self) -> float:
        """Distance from the chassis to the nearest footprint or wall, meters; 0 if they overlap."""
        if self.planar:
            from labgym.envs.planar.scene import clearance

            return clearance(self.world, self.pose)
        if self.moving is not None:
            return self.moving.clearance(*self.pose[:2])
        if self.robot.size.chassis_radius != ROBOT.chassis_radius:
            return self.world.clearance(*self.pose[:2], self.robot.size.chassis_radius)
        return self.world.clearance(*self.pose[:2])

    @property
    def compiled(self) -> bool:
        """Whether the planar kernel computes depth images: they show the layout alone."""
        return self.planar and not any(presence.visible for presence in self.presences.values())

    def to_go(self, method: Method) -> DistanceToGo:
        """Return the driving distances to the goal of the drive in progress."""
        to_go = self.world.to_go(self.goal, method)
        if method == "grid" or find_spec("numba") is None:
            return to_go
        from labgym.envs.planar.routes import compiled_to_go

        return compiled_to_go(self.world, to_go)

    @property
    def fixtures(self) -> World:
        """The world without the things that the robot can push: the static part of what sensors see."""
        fixtures: World = getattr(self.moving, "fixtures", self.world)
        return fixtures

    @property
    def bodies(self) -> tuple[Body, ...]:
        """Bodies that pictures show besides `fixtures`: things that the robot can push, and those of conditions."""
        things: tuple[Body, ...] = getattr(self.moving, "bodies", tuple)()
        return (*things, *(body for presence in self.presences.values() for body in presence.bodies))

    def ranges(self, lidar: Lidar) -> NDArray[np.float32]:
        """Return the ranges of a lidar, meters."""
        ready = self.views.get(lidar)
        if ready is not None:  # by the vector environment
            return np.array(ready)
        if self.planar and all(each.planar or not each.visible for each in self.presences.values()):
            from labgym.envs.planar.scene import ranges, shown_at

            pose, shown = lidar.at(self.pose), shown_at(self, lidar.height)
            return ranges(self.world, pose, lidar.count, lidar.reach, lidar.height, shown)
        return lidar.scan(self.rays("solid"), self.pose)

    def depth(self, camera: Camera) -> NDArray[np.float32]:
        """Return the planar depth that a camera sees, (rows, columns) meters."""
        if self.compiled and camera.level:
            from labgym.envs.planar.depth import depth

            return depth(self.world, self.pose, camera)
        return camera.depth(self.rays("visual"), self.pose)

    def rays(self, geometry: Geometry) -> RaySource:
        """Return the scene that sensors cast rays against: "solid" boxes or "visual" shapes."""
        source = self._layout_rays(geometry)
        for presence in self.presences.values():
            source = presence.rays(source, geometry, self)
        return source

    def _layout_rays(self, geometry: Geometry) -> RaySource:
        if self.moving is not None:
            return self.moving.rays(geometry)
        if geometry == "visual" and self.palette is not None:
            return self.palette.paint(self.world.visible_exact if self.exact else self.world.visible)
        if geometry == "solid":
            return self.world.solid_exact if self.exact else self.world.solid
        return self.world.visible_exact if self.exact else self.world.visible
