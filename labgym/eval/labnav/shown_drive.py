"""Drives as a page shows them: outcome, route, and the people along it, small enough for one file."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from labgym.documents import Record
from labgym.envs.conditions.cast import cast_of
from labgym.envs.conditions.crowd import REST, Crowd
from labgym.envs.conditions.intentions import DT
from labgym.envs.conditions.orca import Disc, Vector
from labgym.envs.conditions.passing import AT_REST
from labgym.envs.conditions.payload import MOST_LEGS
from labgym.envs.robot import ROBOT
from labgym.envs.state import Pose
from labgym.envs.tasks import Task
from labgym.envs.world import world_of
from labgym.eval.driving.drive import Route
from labgym.eval.driving.episode_row import Count, Ending, LabNavRow, Length, Share


@dataclass(frozen=True, eq=False)
class PeopleAlong:
    """The people of an episode along a route.

    Attributes:
        places: (t, n, 2) centers at the start and after each control step, meters, room frame.
        yields: whether each person avoids the robot while it moves, (n,).
        least: least distance between the centers of the robot and a person after a control step, meters; None without
            people.
    """

    places: NDArray[np.float64]
    yields: tuple[bool, ...]
    least: float | None


def people_along(task: Task, route: Sequence[Pose]) -> PeopleAlong:
    """Return where people were along a route.

    People depend on the episode and on the motion of the robot alone. The route has the robot's poses every 0.1 s, so
    that its velocity is that between two poses; `least` shows how near the result is to the recorded drive.

    Args:
        task: the episode after its conditions. route: poses at the start and after each control step.

    Raises:
        OptionError: the episode's data does not describe people.
    """
    data = task.conditions.get("people")
    crowd = Crowd(world_of(task.layout), cast_of({} if data is None else data))
    if not crowd.stops or not len(route):
        return PeopleAlong(np.zeros((len(route), 0, 2)), (), None)
    poses = np.asarray(route, dtype=np.float64)
    velocities = velocities_of(poses)
    rest = REST
    places: list[list[Vector]] = []
    for (x, y, _), (vx, vy) in zip(poses.tolist(), velocities.tolist(), strict=True):
        if places:
            rest = 0.0 if math.hypot(vx, vy) >= AT_REST else rest + DT
        places.append(crowd.places)
        crowd.step(Disc(x, y, vx, vy, ROBOT.chassis_radius), rest)
    at = np.array(places, dtype=np.float64)
    away = np.linalg.norm(at - poses[:, None, :2], axis=2)
    return PeopleAlong(at, crowd.yields, float(away.min()))


def velocities_of(poses: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the velocity at each pose of a route, (t, 2) m/s: along its heading, from the way since the last pose."""
    steps = np.diff(poses[:, :2], axis=0)
    along = np.column_stack([np.cos(poses[1:, 2]), np.sin(poses[1:, 2])])
    speeds = (steps * along).sum(axis=1) / ROBOT.control_dt
    return np.concatenate([np.zeros((1, 2)), speeds[:, None] * along])


MOST_POSES, MOST_MOMENTS = 400, 200
"""Greatest number of poses of a route, and of moments at which people are shown."""
LONGEST = 15_000
"""Most poses of a route that is shown; a shift of ten drives has 12 500."""

Packed = Annotated[tuple[int, ...], Field(max_length=100_000)]
"""A table of whole numbers as one list: its first row, then the difference of each row from the one before."""


class ShownRoute(Record):
    """A route.

    Attributes:
        dt: between two poses, seconds. seconds: from the first to the last.
        poses: packed rows of x, y in centimeters, and the continuous yaw in degrees.
    """

    dt: Length
    seconds: Length
    poses: Packed


class ShownPeople(Record):
    """The people along a route.

    Attributes:
        dt: between two moments, seconds. yields: 1 for each person who avoids the robot, 0 for the others.
        places: packed rows of the x and y of all people, centimeters.
    """

    dt: Length
    yields: Annotated[tuple[int, ...], Field(max_length=100)]
    places: Packed


class ShownThings(Record):
    """The things that the robot can push, along a drive.

    Attributes:
        names: ids of their placements. dt: between two moments, seconds.
        since: moment at which each thing is there, seconds.
        places: packed rows of the x and y of each thing in centimeters and its yaw in hundredths of a radian.
    """

    names: Annotated[tuple[Annotated[str, Field(max_length=100)], ...], Field(max_length=100)]
    dt: Length
    since: Annotated[tuple[Length, ...], Field(max_length=100)]
    places: Packed

    @classmethod
    def along(cls, shots: Sequence[Mapping[str, Pose]]) -> ShownThings | None:
        """Return the things at their poses at the start and after each control step; None without things."""
        names = sorted({name for shot in shots for name in shot})
        if not names:
            return None
        first = {name: next(k for k, shot in enumerate(shots) if name in shot) for name in names}
        last = {name: shots[first[name]][name] for name in names}
        rows = []
        for shot in shots:
            last |= shot
            rows.append([value for name in names for value in last[name]])
        every = max(1, -(-len(shots) // MOST_MOMENTS))
        return cls(
            names=tuple(names),
            dt=round(every * ROBOT.control_dt, 1),
            since=tuple(round(first[name] * ROBOT.control_dt, 1) for name in names),
            places=packed(np.array(rows, dtype=np.float64)[::every]),
        )


class ShownLeg(Record):
    """A drive of a shift: how it ended, whether the robot docked, and its time, seconds."""

    ending: Ending
    docked: bool
    time: Length


class ShownDrive(Record):
    """A drive.

    Attributes:
        key: of the episode. score, ending, time: as in the row.
        driven: path length, meters. away: distance from the goal at the end, meters.
        touches: control steps with a contact. contact: name of the thing whose touch ended the drive, "" without.
        error: of the policy, "" without. legs: in `shift`, the drives that were begun.
        route: None if it is too long. people: None without people. things: None without things or their way.
    """

    key: Annotated[str, Field(max_length=200)]
    score: Share
    ending: Ending
    time: Length
    driven: Length
    away: Length
    touches: Count
    contact: Annotated[str, Field(max_length=100)] = ""
    error: Annotated[str, Field(max_length=300)] = ""
    legs: Annotated[tuple[ShownLeg, ...], Field(max_length=MOST_LEGS)] = ()
    route: ShownRoute | None = None
    people: ShownPeople | None = None
    things: ShownThings | None = None

    @classmethod
    def of(cls, row: LabNavRow, route: Route, task: Task, things: ShownThings | None = None) -> ShownDrive:
        """Return what is shown of a drive.

        Args:
            row: its results. route: poses at the start and after each control step; empty if it is not known.
            task: the episode after its conditions. things: along the drive, if they are known.
        """
        drawn = route if len(route) <= LONGEST else ()
        return cls(
            key=row.key,
            score=row.score,
            ending=row.ending,
            time=row.time,
            driven=round(row.path_length, 2),
            away=round(row.final_distance, 2),
            touches=row.contacts,
            contact=row.contact,
            error=(row.error or "")[:300],
            legs=tuple(ShownLeg(ending=leg.ending, docked=leg.docked, time=round(leg.time, 1)) for leg in row.legs),
            route=shown_route(drawn) if len(drawn) else None,
            people=_shown_people(task, drawn),
            things=things,
        )


def shown_route(route: Route) -> ShownRoute:
    """Return a route of at most `MOST_POSES` poses and its last one."""
    every = max(1, -(-len(route) // MOST_POSES))
    poses = np.asarray(route, dtype=np.float64)
    indices = np.unique(np.append(np.arange(0, len(poses), every), len(poses) - 1))
    turns = np.degrees(np.unwrap(poses[indices, 2])) / 100.0
    return ShownRoute(
        dt=round(every * ROBOT.control_dt, 1),
        seconds=round((len(poses) - 1) * ROBOT.control_dt, 1),
        poses=packed(np.column_stack([poses[indices, :2], turns])),
    )


def _shown_people(task: Task, route: Route) -> ShownPeople | None:
    people = people_along(task, route)
    if not people.yields:
        return None
    every = max(1, -(-len(route) // MOST_MOMENTS))
    return ShownPeople(
        dt=round(every * ROBOT.control_dt, 1),
        yields=tuple(int(each) for each in people.yields),
        places=packed(people.places[::every].reshape(-1, 2 * len(people.yields))),
    )


def packed(table: NDArray[np.float64]) -> tuple[int, ...]:
    """Return a table in hundredths, as `Packed`."""
    whole = np.rint(table * 100.0).astype(np.int64)
    return tuple(np.diff(whole, axis=0, prepend=np.zeros((1, whole.shape[1]), dtype=np.int64)).ravel().tolist())
