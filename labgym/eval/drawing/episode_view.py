"""A rendered view of a LabNav episode: robot, people and route, from where the place that makes it hard is seen."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from labgym.envs.conditions.beaker import beaker_shape
from labgym.envs.conditions.bodies import Body
from labgym.envs.conditions.panes import FRAMED, FRAMELESS
from labgym.envs.conditions.payload import beaker_of, leg_payload_of
from labgym.envs.parts.endings import REST_DISTANCE
from labgym.envs.robot_mesh import robot_mesh
from labgym.envs.state import Pose
from labgym.envs.tasks import Task
from labgym.eval.drawing.episode_camera import Stage
from labgym.eval.drawing.episode_plan import dense, neck_of, people_of
from labgym.layouts.placement import FLOOR
from labgym.scenes.mesh import MATERIAL_NAMES, ROOM, SceneMesh, joined
from labgym.scenes.tracing import trace_view

BEFORE, BEFORE_GOAL = 1.5, 2.5
"""Way from the robot to the place that makes the episode hard, and to the goal if there is no such place, meters."""
CROWD = 1.5
"""Distance over which people count as near a place, meters."""
REMAINING = 0.15
"""By how much farther from the route a place may be for each meter that it is nearer to the goal."""
ROBOT_HEIGHT, PIN_HEIGHT, HARD_HEIGHT, PERSON_HEIGHT = 1.35, 1.6, 1.0, 1.75
"""Heights of what the camera takes in, meters."""
PIN_RADIUS = 0.14
"""Radius of the head of the pin over a goal, meters."""
NECK_RADIUS = 0.13
"""Radius of the marks in the neck of a route, meters."""
SPACING = 0.05
"""Distance between the points of a route, meters."""
RIBBON, DASH, ABOVE = 0.07, 0.22, 0.006
"""Width and length of the dashes of the route on the floor, and their height above it, meters."""

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Spot:
    """The place that a view shows.

    Attributes:
        robot: its pose on its route. hard: the middle of what makes the episode hard. goal: the next one.
        subject: id of the placement that makes it hard, if one does.
    """

    robot: Pose
    hard: tuple[float, float]
    goal: Pose
    subject: str | None = None


def spot_of(task: Task, route: Array, people: Sequence[Body] = ()) -> Spot:
    """Return the place of an episode to show.

    It is the neck, the glass, what is not on the map, the docking pose, or where most people are near the route, in
    this order; among several, one near the route and the goal. Without any of them, or with a beaker on the robot, it
    is the goal.
    """
    points = dense(route) if len(route) > 1 else np.array([task.pair.start[:2], task.pair.goal[:2]])
    goals, ends = [pair.goal for pair in (task.pair, *task.following)], [0]
    for x, y, _ in goals:
        ends.append(ends[-1] + int(np.linalg.norm(points[ends[-1] :] - (x, y), axis=1).argmin()))
    leg = np.clip(np.searchsorted(ends[1:], np.arange(len(points))), 0, len(goals) - 1)
    remaining = (np.array(ends[1:])[leg] - np.arange(len(points))) * SPACING
    nearest, hard, subject = _hard(task, points, np.maximum(remaining, 0.0), people)
    goal = goals[int(leg[nearest])]
    before = BEFORE if hard is not None else BEFORE_GOAL
    back = max(0, min(nearest - round(before / SPACING), len(points) - 2))
    ahead = points[min(back + 8, len(points) - 1)] - points[back]
    (x, y), (hard_x, hard_y) = points[back].tolist(), goal[:2] if hard is None else hard
    return Spot((x, y, math.atan2(ahead[1], ahead[0])), (float(hard_x), float(hard_y)), goal, subject)


def episode_view(
    task: Task, route: Array, people: Sequence[Body], width: int, height: int, samples: int = 8
) -> NDArray[np.uint8]:
    """Return a ray-traced view of an episode, shape (height, width, 3).

    Args:
        task: after its conditions. route: the shortest path, (n, 2) meters. people: their bodies.
        samples: rays per pixel.
    """
    stage = stage_of(task, route, people)
    view = stage.best_view((width, height))
    return trace_view(task.layout, view, width, height, samples, joined(*stage.parts.values()), stage.hidden(view))


def stage_of(task: Task, route: Array, people: Sequence[Body]) -> Stage:
    """Return what the view of an episode shows; arguments as those of `episode_view`."""
    spot = spot_of(task, route, people)
    parts = {"robot": _placed(robot_mesh(), spot.robot), "goal": _goal(spot.goal)}
    places = [(*spot.robot[:2], ROBOT_HEIGHT), (*spot.goal[:2], PIN_HEIGHT), (*spot.hard, HARD_HEIGHT)]
    if people:
        crowd = joined(*(_placed(body.shape.mesh, body.pose) for body in people))
        near = min((body.pose[:2] for body in people), key=lambda place: math.dist(place, spot.hard))
        if "payload" in task.conditions or spot.subject or "parked" in task.conditions:
            parts["people"] = crowd
        else:
            parts["subject"] = crowd
            places.append((*near, PERSON_HEIGHT))
    payload = task.conditions.get("payload")
    if payload is not None:
        beaker = leg_payload_of(payload)[0] if "legs" in payload else beaker_of(payload)
        parts["beaker" if spot.subject else "subject"] = _placed(beaker_shape(beaker).mesh, spot.robot)
    neck = neck_of(task) if "parked" in task.conditions else np.zeros((0, 2))
    if len(neck):
        parts["subject"] = joined(*(_disc(point, 0.0, NECK_RADIUS, "print_red", 2.0 * ABOVE) for point in neck))
    if len(route) > 1:
        parts["route"] = _ribbon(dense(route, 0.02))
    others = [pair.goal for pair in (task.pair, *task.following) if pair.goal != spot.goal]
    parts |= {f"goal {number}": _ring(goal) for number, goal in enumerate(others)}
    return Stage(task.layout, parts, spot.subject, np.array(places), spot.robot[2])


def _hard(
    task: Task, points: Array, remaining: Array, people: Sequence[Body]
) -> tuple[int, Sequence[float] | None, str | None]:
    """Return the nearest point of the route, the middle and the placement of what makes an episode hard, if any."""
    old, layout = task.old_map or task.layout, task.layout
    panes = [one for one in layout.placements if one.asset in (FRAMED, FRAMELESS)]
    moved = [
        one
        for one in layout.placements
        if one.support == FLOOR and one.asset not in (FRAMED, FRAMELESS) and _differs(old.by_id.get(one.id), one)
    ]
    neck = neck_of(task) if "parked" in task.conditions else np.zeros((0, 2))
    if len(neck):
        place = neck[len(neck) // 2]
        return int(np.linalg.norm(points - place, axis=1).argmin()), place, None
    if "station" in task.conditions:
        return len(points) - 1, points[-1], str(task.conditions["station"]["station"])
    if panes or moved:
        away = np.array([np.linalg.norm(points - one.position[:2], axis=1) for one in panes or moved])
        number, nearest = divmod(int((away + REMAINING * remaining).argmin()), len(points))
        one = (panes or moved)[number]
        return nearest, one.position[:2], one.id
    far = [one.pose[:2] for one in people_of(task, people) if math.dist(one.pose[:2], points[0]) > BEFORE]
    if far and "payload" not in task.conditions:
        # Where most people are near.
        away = np.linalg.norm(np.array(far)[:, None, :] - points[None, :, :], axis=2)
        nearest = int((np.exp(-away / CROWD).sum(axis=0) - REMAINING * remaining).argmax())
        return nearest, points[nearest], None
    return int(np.flatnonzero(remaining <= SPACING / 2.0)[0]), None, None


def _differs(then: object, now: object) -> bool:
    return then is None or any(getattr(then, name) != getattr(now, name) for name in ("position", "yaw", "state"))


def _placed(mesh: SceneMesh, pose: Pose) -> SceneMesh:
    x, y, yaw = pose
    cosine, sine = math.cos(yaw), math.sin(yaw)
    turn = np.array([[cosine, sine, 0.0], [-sine, cosine, 0.0], [0.0, 0.0, 1.0]])
    return SceneMesh(mesh.vertices @ turn + np.array([x, y, 0.0]), mesh.faces, mesh.material, mesh.owner)


def _ribbon(points: Array) -> SceneMesh:
    """Return the dashes of a route on the floor."""
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    along = np.concatenate([[0.0], np.cumsum(steps)])
    ahead = np.gradient(points, axis=0)
    ahead /= np.maximum(np.linalg.norm(ahead, axis=1), 1e-9)[:, None]
    left = np.column_stack([-ahead[:, 1], ahead[:, 0]]) * RIBBON / 2.0
    edges = np.stack([points - left, points + left], axis=1)
    vertices = np.column_stack([edges.reshape(-1, 2), np.full(2 * len(points), ABOVE)])
    drawn = np.flatnonzero(np.floor(along[:-1] / DASH) % 2 == 0)
    faces = np.concatenate(
        [
            np.column_stack([2 * drawn, 2 * drawn + 2, 2 * drawn + 1]),
            np.column_stack([2 * drawn + 1, 2 * drawn + 2, 2 * drawn + 3]),
        ]
    )
    return _painted(vertices, faces, "signal_blue")


def _goal(goal: Pose) -> SceneMesh:
    """Return the ring of a goal, and a pin over it, which is seen behind furniture."""
    import trimesh

    head = trimesh.creation.icosphere(subdivisions=2, radius=PIN_RADIUS)
    head.apply_translation((0.0, 0.0, PIN_HEIGHT - PIN_RADIUS))
    tip = trimesh.creation.cone(radius=0.94 * PIN_RADIUS, height=-0.45, sections=24)
    tip.apply_translation((0.0, 0.0, PIN_HEIGHT - 1.25 * PIN_RADIUS))
    pin = [_painted(np.asarray(each.vertices), np.asarray(each.faces), "signal_green") for each in (head, tip)]
    return joined(_ring(goal), *(_placed(each, goal) for each in pin))


def _ring(goal: Pose) -> SceneMesh:
    """Return the edge of a goal's disc on the floor."""
    return _disc(goal[:2], REST_DISTANCE - 0.10, REST_DISTANCE, "signal_green", ABOVE)


def _disc(middle: Sequence[float] | Array, inner: float, outer: float, material: str, z: float) -> SceneMesh:
    angles = np.linspace(0.0, 2.0 * math.pi, 49)
    circle = np.column_stack([np.cos(angles), np.sin(angles)])
    edges = np.stack([circle * inner, circle * outer], axis=1).reshape(-1, 2) + middle
    k = 2 * np.arange(len(angles) - 1)
    faces = np.concatenate([np.column_stack([k, k + 1, k + 2]), np.column_stack([k + 1, k + 3, k + 2])])
    return _painted(np.column_stack([edges, np.full(len(edges), z)]), faces, material)


def _painted(vertices: Array, faces: NDArray[np.int64], material: str) -> SceneMesh:
    count = len(faces)
    return SceneMesh(vertices, faces, np.full(count, MATERIAL_NAMES.index(material)), np.full(count, ROOM))
