"""The constraint program that places furniture along the walls of one space, in centimeters.

Each unit has options: segments of wall with the places along them that the building leaves. The program chooses an
option and a place for each so that footprints keep their gaps, the depth in front of each unit is free, and hazards
keep their distance. Deterministic: one worker, a fixed seed and a deterministic time limit.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor, wait
from dataclasses import dataclass
from itertools import combinations
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

from labgym.geometry import OrientedBox
from labgym.layouts.brief import Demands, Nearness, Proximity, Unit
from labgym.layouts.ground import Segment
from labgym.layouts.interiors.standing import SIDE_GAP, WALL_GAP
from labgym.navigation.plan import STAND_OFF

if TYPE_CHECKING:
    from ortools.sat.python import cp_model

GAP_LIMIT = 0.3
"""Relative distance to the best known bound at which the search stops: preferences need no proof of optimality."""


@dataclass(frozen=True)
class Option:
    """A segment on which a unit may stand, the intervals of places along it, and the place it prefers; meters.

    Attributes:
        cost: of choosing it, as a distance from the preferred place, meters.
    """

    segment: Segment
    places: tuple[tuple[float, float], ...]
    anchor: float
    cost: float = 0.0


@dataclass(frozen=True)
class Stand:
    """A unit and its options."""

    unit: Unit
    options: tuple[Option, ...]


@dataclass(frozen=True)
class WallPlan:
    """Result of a search: footprints by unit id, empty unless the status is `solved`."""

    status: Status
    feet: Mapping[str, OrientedBox]


class _Edge(NamedTuple):
    """A coordinate in centimeters: sign * variable + constant, between two numbers."""

    sign: int
    constant: int
    low: int
    high: int


class _Rect(NamedTuple):
    x0: _Edge
    y0: _Edge
    x1: _Edge
    y1: _Edge


@dataclass(frozen=True)
class _Choice:
    """An option of a unit in the program: variable, literal (None if there is no other option), and rectangles.

    The middle of `goal` is the unit's goal pose.
    """

    stand: Stand
    option: Option
    place: Any
    chosen: Any
    foot: _Rect
    reach: _Rect
    goal: _Rect


def plan_walls(stands: Sequence[Stand], demands: Demands, seed: int, effort: float) -> WallPlan:
    """Search a place along a wall for every unit.

    Args:
        stands: units with their options.
        demands: those between two of the units count; the distance of a proximity is |dx| + |dy| in the frame of the
            space.
        seed: random seed of the search.
        effort: deterministic search time, in the solver's units (about seconds).
    """
    if any(not stand.options for stand in stands):
        return WallPlan("infeasible", {})
    program = _Program(stands, demands)
    status, solver = run(program.model, seed, effort, GAP_LIMIT)
    if status != "solved":
        return WallPlan(status, {})
    feet = {}
    for choice in (choice for choices in program.choices.values() for choice in choices):
        if choice.chosen is None or solver.boolean_value(choice.chosen):
            unit, along = choice.stand.unit, solver.value(choice.place) / CM
            feet[unit.id] = choice.option.segment.box(along, WALL_GAP, unit.width, unit.depth)
    return WallPlan("solved", feet)


class _Program:
    """The model, and the choices of each unit."""

    def __init__(self, stands: Sequence[Stand], demands: Demands) -> None:
        from ortools.sat.python import cp_model

        self.model: cp_model.CpModel = cp_model.CpModel()
        self.domain = cp_model.Domain
        self.terms: list[Any] = []
        self.choices = {stand.unit.id: self._choices(stand) for stand in stands}
        self._rows()
        for first, second in combinations(self.choices.values(), 2):
            self._pair(first, second)
        for rule in demands.separations:
            if rule.first in self.choices and rule.second in self.choices:
                gap = centimeters(rule.distance)
                for one in self.choices[rule.first]:
                    for other in self.choices[rule.second]:
                        self._apart(one, one.foot, other, other.foot, gap)
        for near in demands.nearness:
            if near.first in self.choices and near.second in self.choices:
                self._near(near)
        for pair in demands.proximities:
            if pair.first in self.choices and pair.second in self.choices:
                self._within(pair)
        self.model.minimize(sum(self.terms))

    def _choices(self, stand: Stand) -> list[_Choice]:
        choices = []
        for number, option in enumerate(stand.options):
            intervals = [(math.ceil(a * CM - 1e-6), math.floor(b * CM + 1e-6)) for a, b in option.places]
            intervals = [(low, high) for low, high in intervals if low <= high]
            name = f"{stand.unit.id}.{number}"
            place = self.model.new_int_var_from_domain(self.domain.from_intervals(intervals or [(0, 0)]), name)
            chosen = self.model.new_bool_var(f"{name}.chosen") if len(stand.options) > 1 else None
            if not intervals and chosen is not None:
                self.model.add(chosen == 0)
            low, high = (intervals[0][0], intervals[-1][1]) if intervals else (0, 0)
            unit = stand.unit
            foot = _rect(option.segment, unit, low, high, unit.depth)
            reach = _rect(option.segment, unit, low, high, unit.depth + unit.front)
            goal = _rect(option.segment, unit, low, high, 2.0 * (unit.depth + STAND_OFF))
            choices.append(_Choice(stand, option, place, chosen, foot, reach, goal))
            self._anchor(choices[-1], max(high - low, 1))
        if len(choices) > 1:
            self.model.add_exactly_one(choice.chosen for choice in choices)
        return choices

    def _anchor(self, choice: _Choice, span: int) -> None:
        distance = self.model.new_int_var(0, span + CM * CM, "")
        offset = choice.place - round(choice.option.anchor * CM)
        for side in (offset, -offset):
            bound = self.model.add(distance >= side)
            if choice.chosen is not None:
                bound.only_enforce_if(choice.chosen)
        self.terms.append(distance)
        if choice.option.cost > 0.0 and choice.chosen is not None:
            self.terms.append(centimeters(choice.option.cost) * choice.chosen)

    def _rows(self) -> None:
        """Units on one segment do not overlap."""
        rows: dict[str, list[Any]] = {}
        for choice in (choice for choices in self.choices.values() for choice in choices):
            size = centimeters(choice.stand.unit.width) + centimeters(SIDE_GAP)
            if choice.chosen is None:
                interval = self.model.new_fixed_size_interval_var(choice.place, size, "")
            else:
                interval = self.model.new_optional_fixed_size_interval_var(choice.place, size, choice.chosen, "")
            rows.setdefault(choice.option.segment.id, []).append(interval)
        for intervals in rows.values():
            if len(intervals) > 1:
                self.model.add_no_overlap(intervals)

    def _pair(self, first: Sequence[_Choice], second: Sequence[_Choice]) -> None:
        """Two units keep their gap, and the depth in front of each is free of the other."""
        clear = max(first[0].stand.unit.clear, second[0].stand.unit.clear)
        gap = centimeters(max(clear, SIDE_GAP))
        for one in first:
            for other in second:
                same = one.option.segment.id == other.option.segment.id
                if not same or clear > SIDE_GAP:
                    self._apart(one, one.foot, other, other.foot, gap)
                if not same:
                    self._apart(one, one.reach, other, other.foot, 0)
                    self._apart(one, one.foot, other, other.reach, 0)

    def _apart(self, one: _Choice, first: _Rect, other: _Choice, second: _Rect, gap: int) -> None:
        """Two rectangles lie at least a gap apart along x or along y, if both options are chosen."""
        sides = (
            (one, first.x1, other, second.x0),
            (other, second.x1, one, first.x0),
            (one, first.y1, other, second.y0),
            (other, second.y1, one, first.y0),
        )
        if any(before.high + gap <= after.low for _, before, _, after in sides):
            return
        literals = []
        for owner, before, successor, after in sides:
            if before.low + gap <= after.high:
                literal = self.model.new_bool_var("")
                value = before.sign * owner.place + before.constant + gap
                self.model.add(value <= after.sign * successor.place + after.constant).only_enforce_if(literal)
                literals.append(literal)
        literals += [choice.chosen.negated() for choice in (one, other) if choice.chosen is not None]
        self.model.add_bool_or(literals)

    def _near(self, near: Nearness) -> None:
        for axis in (0, 1):
            feet = ([(choice, choice.foot) for choice in self.choices[unit]] for unit in (near.first, near.second))
            first, second = (self._doubled_middle(rects, axis) for rects in feet)
            value = self.model.new_int_var(0, 4 * 100 * CM, "")
            self.model.add(value >= first - second)
            self.model.add(value >= second - first)
            self.terms.append(near.weight * value)

    def _within(self, pair: Proximity) -> None:
        limit, sides = math.floor(2.0 * pair.distance * CM), []
        for axis in (0, 1):
            goals = ([(choice, choice.goal) for choice in self.choices[unit]] for unit in (pair.first, pair.second))
            first, second = (self._doubled_middle(rects, axis) for rects in goals)
            sides.append(self.model.new_int_var(0, limit, ""))
            self.model.add(sides[-1] >= first - second)
            self.model.add(sides[-1] >= second - first)
        self.model.add(sum(sides) <= limit)

    def _doubled_middle(self, rects: Sequence[tuple[_Choice, _Rect]], axis: int) -> Any:
        """Twice the middle of a unit's rectangle along an axis."""
        values, choices = [], [choice for choice, _ in rects]
        for choice, rect in rects:
            low, high = rect[axis], rect[axis + 2]
            values.append((low.sign + high.sign) * choice.place + low.constant + high.constant)
        if len(choices) == 1:
            return values[0]
        middle = self.model.new_int_var(-400 * CM, 400 * CM, "")
        for choice, value in zip(choices, values, strict=True):
            self.model.add(middle == value).only_enforce_if(choice.chosen)
        return middle


def _rect(segment: Segment, unit: Unit, low: int, high: int, depth: float) -> _Rect:
    """A rectangle from the wall to a depth in meters, as wide as a unit whose place is between two numbers."""
    cosine, sine = round(math.cos(segment.yaw)), round(math.sin(segment.yaw))
    wall, far, width = centimeters(WALL_GAP), centimeters(WALL_GAP + depth), centimeters(unit.width)
    x, y = round(segment.x * CM), round(segment.y * CM)
    corners = [(along, inward) for along in (0, width) for inward in (wall, far)]
    edges = []
    for base, moves, values in (
        (x, cosine, [along * cosine - inward * sine for along, inward in corners]),
        (y, sine, [along * sine + inward * cosine for along, inward in corners]),
    ):
        ends = sorted((moves * low, moves * high))
        edges.append(
            [_Edge(moves, base + value, base + value + ends[0], base + value + ends[1]) for value in _range(values)]
        )
    return _Rect(edges[0][0], edges[1][0], edges[0][1], edges[1][1])


def _range(values: Sequence[int]) -> tuple[int, int]:
    return min(values), max(values)


CM = 100
SIGNAL_INTERVAL = 0.2
"""Seconds after which a pending signal interrupts a search at the latest."""
Status = Literal["solved", "infeasible", "stopped"]
"""Result of a search: `infeasible` is proved; `stopped` is the effort limit, without a solution and without a proof."""


def centimeters(meters: float) -> int:
    """Return a length in whole centimeters, rounded up."""
    return math.ceil(meters * CM - 1e-6)


def run(model: cp_model.CpModel, seed: int, effort: float, gap_limit: float) -> tuple[Status, cp_model.CpSolver]:
    """Search a solution of a program with one worker, and return the status and the solver with the solution.

    Args:
        seed: random seed of the search.
        effort: deterministic search time, in the solver's units (about seconds).
        gap_limit: relative distance to the best known bound at which the search stops.
    """
    from ortools.sat.python import cp_model

    solver = cp_model.CpSolver()
    solver.parameters.num_workers = 1
    solver.parameters.random_seed = seed % (2**31)
    solver.parameters.max_deterministic_time = effort
    solver.parameters.relative_gap_limit = gap_limit
    status = search(solver, model)
    if status == cp_model.UNKNOWN:
        return "stopped", solver
    return ("solved" if status in (cp_model.OPTIMAL, cp_model.FEASIBLE) else "infeasible"), solver


def search(solver: cp_model.CpSolver, model: cp_model.CpModel) -> cp_model.CpSolverStatus:
    """Run a solver and return its status. Ctrl-C and other signals stop it and reach the caller as exceptions.

    By itself the solver would end at Ctrl-C as at its effort limit, and a layout would depend on the interruption. It
    runs in a thread, because Python handles signals in the main thread only between two Python instructions.
    """
    solver.parameters.catch_sigint_signal = False
    with ThreadPoolExecutor(1) as thread:
        status = thread.submit(solver.solve, model)
        try:
            # With a time limit: a signal that another thread receives does not wake one that waits without.
            while not wait([status], timeout=SIGNAL_INTERVAL).done:
                pass
            return status.result()
        except BaseException:
            solver.stop_search()
            raise
