"""The world of a LabNav episode from above: the map, what differs from it, glass, people, the route and its ends."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from labgym.envs.conditions.bodies import Body
from labgym.envs.conditions.panes import FRAMED, FRAMELESS
from labgym.envs.labnav.necks import RADII, widest_disc
from labgym.envs.parts.endings import REST_DISTANCE
from labgym.envs.robot import ROBOT
from labgym.envs.state import Pose
from labgym.envs.tasks import Task
from labgym.eval.drawing.changed_plan import draw_changes
from labgym.eval.drawing.plan_drawing import ON_TOP, draw_plan
from labgym.eval.drawing.plan_labels import FONT
from labgym.layouts.placement import FLOOR
from labgym.navigation import OBSTACLE_HEIGHT, PLANNING_RADIUS, ShortestPaths

if TYPE_CHECKING:
    from matplotlib.axes import Axes

FURNITURE, EDGE = "#dfe2e4", "#a7aeb4"
ROUTE, DRIVEN, GOAL, ROBOT_COLOR = "#0f6fb5", "#d97706", "#2c7a3f", "#0b7a7a"
PERSON, UNSEEING, PANE, NECK = "#8e63b8", "#5a2a86", "#00a6c8", "#c62828"
"""Colors of people who yield to the robot and of those who do not see it, of glass, and of the neck of a route."""
SHOULDERS = 0.26
"""Radius of a person's symbol, meters."""

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Person:
    """A person on a plan: pose (x, y, yaw), and whether the person yields to the robot."""

    pose: Pose
    yields: bool = True


def people_of(task: Task, bodies: Sequence[Body]) -> tuple[Person, ...]:
    """Return the people among the bodies of an episode, each by the first of their bodies."""
    roles = task.conditions.get("people", {}).get("people", ())
    first = {body.name: body for body in reversed(bodies) if body.name.startswith("person ")}
    numbers = {name: int(name.removeprefix("person ")) - 1 for name in first}
    return tuple(
        Person(first[name].pose, bool(roles[number]["yields"]) if number < len(roles) else True)
        for name, number in sorted(numbers.items(), key=lambda item: item[1])
    )


def route_of(task: Task) -> Array:
    """Return the shortest path of the disc of 0.30 m on the true floor through all goals, (n, 2) meters."""
    paths = ShortestPaths(task.layout, PLANNING_RADIUS)
    legs = [paths.path(pair.start, pair.goal) for pair in (task.pair, *task.following)]
    return np.concatenate([np.zeros((0, 2)), *(path.points for path in legs if path is not None)])


def neck_of(task: Task) -> Array:
    """Return the points of a route of the widest disc at which a wider one cannot pass, (n, 2) meters."""
    radius, (start, goal) = widest_disc(task.layout, task.pair), (task.pair.start, task.pair.goal)
    if radius is None or radius == RADII[-1]:
        return np.zeros((0, 2))
    path = ShortestPaths(task.layout, radius).path(start, goal)
    assert path is not None
    points = dense(path.points)
    wider = ShortestPaths(task.layout, RADII[RADII.index(radius) + 1])
    fits = wider.space.holds(points)
    necks = []
    for last, first in zip(np.flatnonzero(fits)[:-1], np.flatnonzero(fits)[1:], strict=True):
        # Between two places where it fits: a neck, unless another way joins them.
        if first > last + 1 and not wider.connected(points[last].tolist(), points[first].tolist()):
            necks.append(points[last + 1 : first])
    return np.concatenate([np.zeros((0, 2)), *necks])


def dense(points: Array, spacing: float = 0.05) -> Array:
    """Return a line with points at most `spacing` meters apart."""
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    along = np.concatenate([[0.0], np.cumsum(steps)])
    places = np.linspace(0.0, along[-1], max(2, math.ceil(along[-1] / spacing) + 1))
    return np.column_stack([np.interp(places, along, points[:, k]) for k in range(2)])


def draw_world(
    axes: Axes, task: Task, route: Array, people: Sequence[Person] = (), neck: bool = False, robot: Pose | None = None
) -> None:
    """Draw the world of an episode and set the limits of the axes to the floor.

    Args:
        task: after the conditions. route: to draw, (n, 2) meters.
        people: where they are. neck: whether to mark the neck of the route.
        robot: pose of the robot; None for the start.
    """
    draw_map(axes, task)
    draw_route(axes, task, route)
    if neck:
        points = neck_of(task)
        if len(points):
            axes.plot(*points.T, "o", color=NECK, markersize=5.0, markeredgewidth=0.0, zorder=ON_TOP + 7)
    draw_people(axes, people)
    start: dict[str, Any] = {
        "color": ROBOT_COLOR,
        "markerfacecolor": "#ffffff",
        "markersize": 9.0,
        "markeredgewidth": 2.0,
    }
    axes.plot(*np.array(task.pair.start[:2])[:, None], "o", **start, zorder=ON_TOP + 8)
    draw_robot(axes, task.pair.start if robot is None else robot)


def draw_map(axes: Axes, task: Task, loose: bool = True) -> None:
    """Draw floor, walls and furniture of the map, and in color what differs from it.

    Args:
        loose: whether to draw things that the robot can push.
    """
    from matplotlib.patches import Polygon

    before, after = task.old_map or task.layout, task.layout
    panes = [one for one in after.placements if one.asset in (FRAMED, FRAMELESS)]
    after = after.without([one.id for one in panes] + ([] if loose else list(task.pushable)))
    draw_plan(axes, after.floor)
    for placement in before.placements:
        box = before.box(placement.id)
        if placement.support == FLOOR and box.z0 < OBSTACLE_HEIGHT and placement.id in after.by_id:
            axes.add_patch(Polygon(box.corners(), facecolor=FURNITURE, edgecolor=EDGE, linewidth=0.7, zorder=8))
    draw_changes(axes, before, after, list(task.pushable))
    for pane in panes:
        box = task.layout.box(pane.id)
        ends = np.array([box.to_world(side * box.width / 2.0, 0.0) for side in (-1.0, 1.0)])
        axes.plot(*ends.T, color=PANE, linewidth=4.0, solid_capstyle="butt", zorder=ON_TOP + 3)


def draw_route(axes: Axes, task: Task, route: Array, color: str = ROUTE) -> None:
    """Draw the shortest path and the goals with their discs; an arrow shows the heading of a docking pose."""
    from matplotlib.patches import Circle

    if len(route) > 1:
        axes.plot(*route.T, color="#ffffff", linewidth=4.0, alpha=0.8, zorder=ON_TOP + 4)
        axes.plot(*route.T, color=color, linewidth=2.0, linestyle=(0, (4, 2)), zorder=ON_TOP + 5)
    pairs = (task.pair, *task.following)
    for number, pair in enumerate(pairs, start=1):
        x, y, yaw = pair.goal
        disc: dict[str, Any] = {"facecolor": GOAL + "30", "edgecolor": GOAL, "linewidth": 2.0}
        axes.add_patch(Circle((x, y), REST_DISTANCE, zorder=ON_TOP + 6, **disc))
        if len(pairs) > 1:
            font: dict[str, Any] = {"color": GOAL, "family": FONT, "weight": "bold", "ha": "center", "va": "center"}
            axes.text(x, y, str(number), fontsize=8.0, **font, zorder=ON_TOP + 9)
        else:
            axes.plot([x], [y], "o", color=GOAL, markersize=4.0, zorder=ON_TOP + 7)
        if "station" in task.conditions:
            _arrow(axes, (x, y), yaw, 0.7, GOAL)


def draw_people(axes: Axes, people: Sequence[Person]) -> None:
    """Draw people from above with their headings; those who do not see the robot are darker."""
    from matplotlib.patches import Circle, Polygon

    for person in people:
        color = PERSON if person.yields else UNSEEING
        look: dict[str, Any] = {"facecolor": color, "edgecolor": "#ffffff", "linewidth": 0.8}
        axes.add_patch(Polygon(nose(person.pose, SHOULDERS), zorder=ON_TOP + 10, **look))
        axes.add_patch(Circle(person.pose[:2], SHOULDERS, zorder=ON_TOP + 11, **look))


def draw_robot(axes: Axes, pose: Pose) -> None:
    """Draw the robot as an arrowhead in the outline of its chassis."""
    from matplotlib.patches import Circle, Polygon

    radius = ROBOT.chassis_radius
    body: dict[str, Any] = {"facecolor": "#ffffff", "edgecolor": ROBOT_COLOR, "linewidth": 1.8}
    axes.add_patch(Circle(pose[:2], radius, zorder=ON_TOP + 12, **body))
    axes.add_patch(Polygon(arrowhead(pose, 0.8 * radius), facecolor=ROBOT_COLOR, zorder=ON_TOP + 13))


def arrowhead(pose: Pose, reach: float) -> Array:
    """Return the corners (4, 2) of an arrowhead of a length along a pose's heading, meters."""
    x, y, yaw = pose
    corners = reach * np.array([(1.0, 0.0), (-0.7, 0.7), (-0.35, 0.0), (-0.7, -0.7)])
    turn = np.array([[math.cos(yaw), math.sin(yaw)], [-math.sin(yaw), math.cos(yaw)]])
    return np.asarray(corners @ turn + (x, y))


def nose(pose: Pose, radius: float) -> Array:
    """Return the corners (3, 2) of a triangle that points from a disc along a heading, meters."""
    x, y, yaw = pose
    corners = radius * np.array([(2.0, 0.0), (0.6, 0.75), (0.6, -0.75)])
    turn = np.array([[math.cos(yaw), math.sin(yaw)], [-math.sin(yaw), math.cos(yaw)]])
    return np.asarray(corners @ turn + (x, y))


def _arrow(axes: Axes, place: tuple[float, float], yaw: float, length: float, color: str) -> None:
    tip = place[0] + length * math.cos(yaw), place[1] + length * math.sin(yaw)
    look = {"arrowstyle": "-|>,head_width=0.25,head_length=0.45", "color": color, "linewidth": 1.8}
    axes.annotate("", xy=tip, xytext=place, arrowprops=look | {"shrinkA": 0, "shrinkB": 0}, zorder=ON_TOP + 10)
