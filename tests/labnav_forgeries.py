"""Routes that nobody drove: legal motions along a polyline, and rows that agree with them."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from labgym.envs.labnav.episodes import LabNavEpisode, LabNavEpisodes, straight
from labgym.envs.labnav.tasks import config_of
from labgym.envs.tasks import Task
from labgym.eval.driving.episode_row import LabNavRow
from labgym.eval.labnav.results import score_of

DT = 0.1
Points = Sequence[Sequence[float]]
Route = tuple[tuple[float, float, float], ...]


def profile(length: float, top: float, acceleration: float) -> list[float]:
    """Return the way covered after each step of a motion from rest to rest, beginning with 0."""
    ways, speed = [0.0], 0.0
    while length - ways[-1] > 1e-9:
        left = length - ways[-1]
        # The fastest speed from which the robot still comes to rest at the end; one step brakes the slowest one.
        braking = math.sqrt(2.0 * acceleration * left) - acceleration * DT
        speed = min(top, speed + acceleration * DT, max(braking, 0.9 * acceleration * DT))
        ways.append(min(length, ways[-1] + speed * DT))
    return ways


def legal_route(
    start: Sequence[float], points: Points, heading: float | None = None, acceleration: float = 1.3
) -> Route:
    """Return a route that turns in place and drives straight along a polyline, within the robot's limits."""
    poses = [(float(start[0]), float(start[1]), float(start[2]))]

    def turn(to: float) -> None:
        x, y, yaw = poses[-1]
        off = (to - yaw + math.pi) % (2.0 * math.pi) - math.pi
        poses.extend((x, y, yaw + math.copysign(way, off)) for way in profile(abs(off), 1.2, 3.0)[1:])

    for x, y in points:
        here = poses[-1]
        length = math.dist(here[:2], (x, y))
        if length < 1e-6:
            continue
        angle = math.atan2(y - here[1], x - here[0])
        turn(angle)
        ways = profile(length, 0.98, acceleration)[1:]
        poses.extend((here[0] + w * math.cos(angle), here[1] + w * math.sin(angle), poses[-1][2]) for w in ways)
        poses.append(poses[-1])
    if heading is not None:
        turn(heading)
    poses.append(poses[-1])
    return tuple((round(x, 3), round(y, 3), round((a + math.pi) % (2.0 * math.pi) - math.pi, 3)) for x, y, a in poses)


def quiet_outcomes(part: LabNavEpisodes, episode: LabNavEpisode, task: Task, route: Route) -> dict[str, object]:
    """Return outcomes of conditions as they are best for the score: nothing pushed, nobody near, nothing spilt."""
    people = episode.conditions.get("people", {}).get("people", [])
    near = [math.dist(pose[:2], role["start"]) for pose in route for role in people]
    least = max(1.0, 0.9 * min(near)) if near else None
    outcomes: dict[str, object] = {
        "changes": {
            "pushed": {name: {"mass": mass, "way": 0.0, "touched": False} for name, mass in task.pushable.items()},
            "appeared": {},
        },
        "people": {
            "people": len(people),
            "close_seconds": 0.0,
            "least_distance": least,
            "met": 0,
            "nearest": least,
            "beside_seconds": 0.0,
        },
        "payload": {"highest": 0.002, "spilt": False},
        "station": {"position": 0.0, "heading": 0.0, "docked": None},
        "parked": None,
        "glass": None,
    }
    names = {condition.name for condition in config_of(part.task, part.level).conditions}
    return {name: value for name, value in outcomes.items() if name in names}


def forged_row(part: LabNavEpisodes, episode: LabNavEpisode, task: Task, route: Route, **fields: object) -> LabNavRow:
    """Return a successful row that agrees with a route in every figure; `fields` replace some of them."""
    poses = np.array(route)
    off = (poses[-1, 2] - task.pair.goal[2] + math.pi) % (2.0 * math.pi) - math.pi
    row = LabNavRow(
        suite=part.label,
        task=part.task,
        level=part.level,
        floor=episode.floor,
        floor_hash=episode.floor_hash,
        number=episode.number,
        policy="mine",
        track="mapless",
        seed=0,
        score=0.0,
        success=True,
        ending="success",
        shortest=round(math.fsum(episode.lengths), 9),
        straight=round(straight(episode), 9),
        path_length=float(np.linalg.norm(np.diff(poses[:, :2], axis=0), axis=1).sum()),
        time=round(DT * (len(poses) - 1), 6),
        final_distance=math.dist(poses[-1, :2], task.pair.goal[:2]),
        final_heading=float(off),
        odometry_error=0.0,
        steps=len(poses) - 1,
        contacts=0,
        outcomes=quiet_outcomes(part, episode, task, route),
    ).model_copy(update=fields)
    return row.model_copy(update={"score": score_of(row, row.outcomes, episode.conditions)} | fields)
