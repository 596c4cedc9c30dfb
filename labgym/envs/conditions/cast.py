"""The people of an episode as plain data, and how they are drawn: how many, where they start and where they go."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, ValidationError
from scipy import ndimage

from labgym.envs.tasks import Task
from labgym.envs.world import World, world_of
from labgym.errors import OptionError
from labgym.layouts import Layout
from labgym.layouts.drives import entry_poses, places_of_work
from labgym.layouts.placement import FLOOR
from labgym.navigation import OccupancyGrid, Pose, goal_pose

RADIUS = 0.30
"""Radius of a person, meters."""
MOST = 64
"""Greatest number of people, and of the stops of one of them."""

Coordinate = Annotated[float, Field(ge=-1e4, le=1e4, allow_inf_nan=False)]
Seconds = Annotated[float, Field(ge=0.0, le=600.0, allow_inf_nan=False)]
Model = Literal["orca", "social_force"]


class _Record(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class Role(_Record):
    """One person.

    Attributes:
        start: x, y at the start, meters. yields: whether the person avoids the robot while it moves.
        group: people of one number walk together.
        stops: (x, y, yaw, seconds) of the places where the person stands, in turn and again from the first; meters,
            radians.
    """

    start: tuple[Coordinate, Coordinate]
    yields: bool
    group: Annotated[int, Field(ge=0, lt=MOST)]
    stops: Annotated[tuple[tuple[Coordinate, Coordinate, Coordinate, Seconds], ...], Field(max_length=MOST)] = ()


class PeopleCast(_Record):
    """The people of an episode.

    Attributes:
        model: how they avoid each other. speed: m/s. people: the people.
    """

    model: Model = "orca"
    speed: Annotated[float, Field(gt=0.0, le=3.0, allow_inf_nan=False)] = 1.0
    people: Annotated[tuple[Role, ...], Field(max_length=MOST)] = ()


def cast_of(data: Any) -> PeopleCast:
    """Return the people that plain data describes.

    Raises:
        OptionError: it does not describe people.
    """
    try:
        return PeopleCast.model_validate(data)
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(str(each) for each in first["loc"])
        raise OptionError(f"people: {place or 'data'}: {first['msg'][:120]}") from None


Stop = list[float]

STAND = (2.0, 6.0)
"""Shortest and longest time at a stop, seconds."""
STOPS = 8
"""Number of stops of a person, after which they begin again."""
FROM_ROBOT = 1.5
"""Least distance from the start of the robot at which people begin, meters (assumption)."""
APART = 2.0 * RADIUS + 0.1
"""Least distance between people at the start, meters (assumption)."""
TOGETHER = 1.5
"""Largest distance of a member of a group from its first one at the start and at stops, meters (assumption)."""
SMALLEST = 0.3
"""Least footprint of furniture in front of which people work, m2 (assumption)."""
TRIES = 200
"""Number of places that are tried for one person."""


def free_floor(world: World, place: Sequence[float]) -> float:
    """Return the area of the floor on which a person can stand who came from a place, m2, on a 5 cm grid.

    It has the centers of discs of the planning radius, 0.30 m, in the part of the free floor nearest to the place.
    """
    grid = world.planning_grid
    parts, count = ndimage.label(~grid.occupied)
    if not count:
        return 0.0
    rows, columns = np.nonzero(parts)
    row, column = grid.cell_of(float(place[0]), float(place[1]))
    nearest = int(np.argmin((rows - row) ** 2 + (columns - column) ** 2))
    return float((parts == parts[rows[nearest], columns[nearest]]).sum()) * grid.resolution**2


def workplaces(layout: Layout) -> list[Pose]:
    """Return where people work: the goal poses of the protocols, in front of furniture, and inside the exits."""
    poses = [*places_of_work(layout).values()]
    for placement in layout.placements:
        box = layout.box(placement.id)
        if placement.support == FLOOR and box.width * box.depth >= SMALLEST:
            poses.append(goal_pose(box))
    poses += entry_poses(layout).values()
    distinct: list[Pose] = []
    for x, y, yaw in poses:
        pose = (round(x, 4), round(y, 4), round(yaw, 4))
        if all(math.dist(pose[:2], other[:2]) > RADIUS for other in distinct):
            distinct.append(pose)
    return distinct


def draw_cast(
    task: Task, rng: np.random.Generator, density: float, group: int, yielding: float, speed: float, model: Model
) -> dict[str, object]:
    """Return the people of an episode as the data of a `PeopleCast`.

    Args:
        task: the task, whose start people keep away from. rng: draws everything.
        density: people for each m2 of floor on which they can stand; at least one person unless it is 0.
        group: number of people who walk together. yielding: share of people who avoid the robot while it moves.
        speed: m/s. model: how they avoid each other.
    """
    world = world_of(task.layout)
    start = task.pair.start[:2]
    area = free_floor(world, start)
    count = min(MOST, max(1, round(density * area))) if density > 0.0 else 0
    stops = [pose for pose in world.derived("workplaces", workplaces) if world.paths.connected(start, pose)]
    places = _Places(world, start, rng)
    starts: list[tuple[float, float]] = []
    groups: list[int] = []
    routes: list[list[Stop]] = []
    for number in range(count):
        leader = number - number % group
        near = starts[leader] if number > leader and leader < len(starts) else None
        place = places.draw(starts, near)
        if place is None:
            break
        starts.append(place)
        groups.append(number // group)
        routes.append(_route(stops, place, rng) if near is None else _beside(world, routes[leader], rng))
    yields = np.zeros(len(starts), dtype=bool)
    yields[rng.permutation(len(starts))[: round(yielding * len(starts))]] = True
    people = [
        {"start": list(place), "yields": bool(yields[k]), "group": groups[k], "stops": routes[k]}
        for k, place in enumerate(starts)
    ]
    return {"model": model, "speed": speed, "people": people}


class _Places:
    """Free places that the robot can reach."""

    def __init__(self, world: World, start: Sequence[float], rng: np.random.Generator) -> None:
        self._world, self._start, self._rng = world, (float(start[0]), float(start[1])), rng
        self._grid: OccupancyGrid = world.planning_grid
        self._cells: NDArray[np.intp] = np.argwhere(~self._grid.occupied)

    def draw(
        self, others: Sequence[tuple[float, float]], near: tuple[float, float] | None
    ) -> tuple[float, float] | None:
        """Return a place away from the robot and from others, if possible `near` one; None if none is left."""
        for _ in range(TRIES if len(self._cells) else 0):
            row, column = self._cells[int(self._rng.integers(len(self._cells)))].tolist()
            x, y = (round(each, 4) for each in self._grid.centre_of(row, column))
            if near is not None and math.dist((x, y), near) > TOGETHER:
                continue
            if math.dist((x, y), self._start) < FROM_ROBOT or any(math.dist((x, y), each) < APART for each in others):
                continue
            if self._world.paths.connected((x, y), self._start):
                return x, y
        return None if near is None else self.draw(others, None)


def _route(stops: Sequence[Pose], start: tuple[float, float], rng: np.random.Generator) -> list[Stop]:
    """Return stops with the times there; no stop follows itself."""
    route: list[Stop] = []
    last: tuple[float, ...] = start
    for _ in range(STOPS):
        others = [pose for pose in stops if math.dist(pose[:2], last[:2]) > RADIUS]
        if not others:
            break
        pose = others[int(rng.integers(len(others)))]
        route.append([*pose, round(float(rng.uniform(*STAND)), 2)])
        last = pose
    return route


def _beside(world: World, route: Sequence[Stop], rng: np.random.Generator) -> list[Stop]:
    """Return stops next to those of another person, at which the person faces the same way for the same time."""
    stops = []
    for x, y, yaw, seconds in route:
        place = x, y
        for _ in range(8):
            angle, distance = rng.uniform(-math.pi, math.pi), rng.uniform(APART, TOGETHER)
            other = round(x + distance * math.cos(angle), 4), round(y + distance * math.sin(angle), 4)
            if world.paths.free(*other) and world.paths.connected(other, (x, y)):
                place = other
                break
        stops.append([*place, yaw, seconds])
    return stops
