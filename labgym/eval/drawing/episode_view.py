"""A rendered view of a LabNav episode: robot, people and route, from where the place that makes it hard is seen."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from labgym.envs.conditions.beaker import beaker_shape
from labgym.envs.conditions.bodies import Body, BodyRays
from labgym.envs.conditions.panes import FRAMED, FRAMELESS
from labgym.envs.conditions.payload import beaker_of, leg_payload_of
from labgym.envs.parts.endings import REST_DISTANCE
from labgym.envs.robot_mesh import robot_mesh
from labgym.envs.state import Pose
from labgym.envs.tasks import Task
from labgym.eval.drawing.episode_plan import dense, neck_of, people_of
from labgym.layouts.placement import FLOOR
from labgym.scenes.camera import View
from labgym.scenes.cutaway import walls_across
from labgym.scenes.mesh import MATERIAL_NAMES, ROOM, SceneMesh, joined
from labgym.scenes.rays import RayScene
from labgym.scenes.tracing import trace_view

BEFORE = 1.5
"""Way between the robot and the place that makes the episode hard, meters."""
DISTANCE, FOVY = 6.2, 38.0
"""Distance of the camera from its target, meters, and its vertical field of view, degrees."""
NEAR, SIDES = 4.2, 4
"""Distance of the camera from a robot with a beaker, and number of its first directions, which see the robot's back."""
ASIDE = tuple(math.radians(angle) for angle in (30.0, -30.0, 55.0, -55.0, 5.0, 85.0, -85.0, 120.0, -120.0, 165.0))
PITCHES = tuple(math.radians(angle) for angle in (30.0, 40.0, 52.0, 66.0))
"""Candidate directions of the camera, best first: angle from straight behind the robot, and above the horizontal."""
CROWD = 1.5
"""Distance over which people count as near a place, meters."""
STEEP = 0.6
"""Points of a scene that must be seen better from a steeper camera."""
OUTSIDE = 10.0
"""Points of a scene that must be seen better from a camera outside of all spaces and below their ceilings."""
HEIGHTS = (0.15, 0.7, 1.25)
"""Heights at which the robot and the hard place should be seen, meters."""
RIBBON, DASH, ABOVE = 0.07, 0.22, 0.006
"""Width and length of the dashes of the route on the floor, and their height above it, meters."""

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Spot:
    """The place that a view shows: the robot's pose on its route, and the middle of what makes the episode hard."""

    robot: Pose
    hard: tuple[float, float]


def spot_of(task: Task, route: Array, people: Sequence[Body] = ()) -> Spot:
    """Return the place of an episode to show.

    It is the neck, the glass, what is not on the map, the docking pose, or where most people are near the route, in
    this order; without any of them the middle of the route.
    """
    points = dense(route) if len(route) > 1 else np.array([task.pair.start[:2], task.pair.goal[:2]])
    hard = _hard(task, points, people)
    nearest = int(np.linalg.norm(points - hard, axis=1).argmin())
    back = max(0, min(nearest - round(BEFORE / 0.05), len(points) - 2))
    ahead = points[min(back + 8, len(points) - 1)] - points[back]
    x, y = points[back].tolist()
    return Spot((x, y, math.atan2(ahead[1], ahead[0])), (float(hard[0]), float(hard[1])))


def episode_view(
    task: Task, route: Array, people: Sequence[Body], width: int, height: int, samples: int = 8
) -> NDArray[np.uint8]:
    """Return a ray-traced view of an episode, shape (height, width, 3).

    Args:
        task: after its conditions. route: the shortest path, (n, 2) meters. people: their bodies.
        samples: rays per pixel.
    """
    spot = spot_of(task, route, people)
    meshes = [_placed(robot_mesh(), spot.robot), *(_placed(body.shape.mesh, body.pose) for body in people)]
    payload = task.conditions.get("payload")
    if payload is not None:
        beaker = leg_payload_of(payload)[0] if "legs" in payload else beaker_of(payload)
        meshes.append(_placed(beaker_shape(beaker).mesh, spot.robot))
    if len(route) > 1:
        meshes.append(_ribbon(dense(route, 0.02)))
    meshes += [_ring(pair.goal) for pair in (task.pair, *task.following)]
    place = _camera(task, spot, route, people)
    ends = (*spot.robot[:2], 0.0), (*spot.hard, 0.0), place.target
    hidden = {wall for end in ends for wall in walls_across(task.layout.floor, place.position, end)}
    return trace_view(task.layout, place, width, height, samples, joined(*meshes), hidden)


def _hard(task: Task, points: Array, people: Sequence[Body]) -> Array:
    old, layout = task.old_map or task.layout, task.layout
    panes = [one.position[:2] for one in layout.placements if one.asset in (FRAMED, FRAMELESS)]
    moved = [
        one.position[:2]
        for one in layout.placements
        if one.support == FLOOR and one.asset not in (FRAMED, FRAMELESS) and _differs(old.by_id.get(one.id), one)
    ]
    neck = neck_of(task) if "parked" in task.conditions else np.zeros((0, 2))
    if len(neck):
        return np.asarray(neck[len(neck) // 2])
    if "station" in task.conditions:
        return np.asarray(points[-1])
    far = [one.pose[:2] for one in people_of(task, people) if math.dist(one.pose[:2], points[0]) > BEFORE]
    if panes or moved:
        spots = np.array(panes or moved)
        away = np.linalg.norm(spots[:, None, :] - points[None, :, :], axis=2).min(axis=1)
        return np.asarray(spots[int(away.argmin())])
    if far:
        # Where most people are near.
        away = np.linalg.norm(np.array(far)[:, None, :] - points[None, :, :], axis=2)
        return np.asarray(points[int(np.exp(-away / CROWD).sum(axis=0).argmax())])
    return np.asarray(points[len(points) // 2])


def _differs(then: object, now: object) -> bool:
    return then is None or any(getattr(then, name) != getattr(now, name) for name in ("position", "yaw", "state"))


def _camera(task: Task, spot: Spot, route: Array, people: Sequence[Body]) -> View:
    """Return the candidate camera from which least hides the robot, the hard place and the way there.

    A beaker is seen from behind the robot and from nearer.
    """
    carries = "payload" in task.conditions and not task.following
    distance, sides = (NEAR, ASIDE[:SIDES]) if carries else (DISTANCE, ASIDE)
    x, y, yaw = spot.robot
    middle = (x + spot.hard[0]) / 2.0, (y + spot.hard[1]) / 2.0, 0.6
    keys = [(px, py, z) for px, py in (spot.robot[:2], spot.hard) for z in HEIGHTS]
    near = [point for point in dense(route) if math.dist(point, middle[:2]) < 2.5] if len(route) > 1 else []
    keys += [(float(px), float(py), 0.1) for px, py in near[::10]]
    points, scene = np.array(keys), RayScene(task.layout, "visual")
    count = len(scene.mesh.faces)
    rays, owner = BodyRays(scene, count, people), np.append(scene.mesh.owner, count)
    floor = task.layout.floor
    ceiling, best, view = max(space.ceiling for space in floor.spaces), math.inf, None
    for steep, pitch in enumerate(PITCHES):
        for aside in sides:
            bearing, level = yaw + math.pi + aside, math.cos(pitch)
            away = np.array([level * math.cos(bearing), level * math.sin(bearing), math.sin(pitch)])
            eye = np.array(middle) + distance * away
            sight = eye - points
            length = np.linalg.norm(sight, axis=1)
            distances, faces = rays.cast(points, sight / length[:, None], 2.0 * distance)
            blocked = (distances < length) & (faces >= 0) & (owner[np.minimum(faces, count)] != ROOM)
            outside = eye[2] < ceiling and floor.space_at(float(eye[0]), float(eye[1])) is None
            cost = float(blocked.sum()) + STEEP * steep + OUTSIDE * outside
            if cost < best - 1e-9:
                place = (float(eye[0]), float(eye[1]), float(eye[2]))
                best, view = cost, View(place, middle, FOVY)
    assert view is not None
    return view


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


def _ring(goal: Pose) -> SceneMesh:
    """Return the edge of a goal's disc on the floor."""
    angles = np.linspace(0.0, 2.0 * math.pi, 49)
    circle = np.column_stack([np.cos(angles), np.sin(angles)])
    edges = np.stack([circle * (REST_DISTANCE - 0.06), circle * REST_DISTANCE], axis=1).reshape(-1, 2) + goal[:2]
    k = 2 * np.arange(len(angles) - 1)
    faces = np.concatenate([np.column_stack([k, k + 1, k + 2]), np.column_stack([k + 1, k + 3, k + 2])])
    return _painted(np.column_stack([edges, np.full(len(edges), ABOVE)]), faces, "signal_green")


def _painted(vertices: Array, faces: NDArray[np.int64], material: str) -> SceneMesh:
    count = len(faces)
    return SceneMesh(vertices, faces, np.full(count, MATERIAL_NAMES.index(material)), np.full(count, ROOM))
