"""Chooses a stretch of wall for each unit of a space before the constraint program is solved, which makes it fast."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from labgym.geometry import OrientedBox
from labgym.layouts.brief import Demands, Nearness, Proximity, Separation, Unit
from labgym.layouts.ground import Segment
from labgym.layouts.interiors.program import Option, Stand
from labgym.layouts.interiors.standing import SIDE_GAP, WALL_GAP, Distances, Intervals, Standing
from labgym.layouts.interiors.supply import Options, preferred, required, supplied
from labgym.layouts.rules.supplies import Supplies
from labgym.navigation.plan import STAND_OFF

CROWDED = 3.0
"""Cost of a full segment; it grows with the square of the share that is used. Noise of up to 1 is set against it."""
HOSTILE = 0.7
"""Cost of sharing a segment with a unit that must stay at a distance."""
NEIGHBOR = 0.6
"""Bonus for sharing a segment with a unit that should be near."""
REMOTE = 20.0
"""Cost of a segment from which no place is near enough to a unit that must be near."""
OVERFLOW = 100.0
"""Cost of a segment that is too short: more than all other costs together."""
CORNER = 0.9
"""Length that a row on the next wall takes at one end of a segment, meters."""
FAR = 3.0
"""Cost of a place beyond the reach of what a unit needs: as much as this distance from where it was drawn, meters."""
SPACING = 0.25
"""Spacing of the places along a segment whose distances are compared, meters."""
OBLIQUE_UNITS = 2
"""Most units of the first pass on one oblique segment."""

DOOR_STEPS = (3.0 + SIDE_GAP, 2.5, 2.0, 1.5)
"""Distances from doors that are tried for hoods, flammables and oxidizers, meters: NFPA 45 and ANSI/AIHA Z9.5 ask 3."""

Places = dict[str, Options]
Aloof = Literal["all", "hoods", "none"]
"""Which units stand farther from doors than they must: hoods with flammables and oxidizers, hoods, or none."""


def all_places(
    standing: Standing,
    units: Sequence[Unit],
    apart: Mapping[str, Distances],
    hood_walls: Collection[str],
    near_supplies: bool = True,
    aloof: Aloof = "none",
) -> Places:
    """Return the segments on which each unit can stand, with the places along them, by unit id.

    Args:
        apart: boxes from which units keep a distance, by unit id.
        hood_walls: ids of the segments for hoods; any segment if none of them has a place.
        near_supplies: whether a unit stands within reach of what it needs if it can; else only where the floor requires
            it.
        aloof: which units stand farther from doors and ways than they must if they can.
    """
    return {
        unit.id: aloof_options(standing, unit, apart.get(unit.id, ()), hood_walls, near_supplies)
        if (unit.asset.fume_hood and aloof != "none") or ("burning" in unit.hazards and aloof == "all")
        else _usual_options(standing, unit, apart.get(unit.id, ()), hood_walls, near_supplies)
        for unit in units
    }


def aloof_options(
    standing: Standing,
    unit: Unit,
    apart: Distances = (),
    hood_walls: Collection[str] = (),
    near_supplies: bool = True,
    least: float = 0.0,
) -> Options:
    """Return the places of a hood, or of flammables and oxidizers, that are farthest from doors, in steps.

    Of equal ones those with the services that the unit needs come first, then those of a hood whose front is off the
    ways between doors, and then those on the walls for hoods.

    Args:
        least: distance from doors under which there is no place, meters.
    """
    supplies = standing.ground.supplies
    for gap in (gap for gap in DOOR_STEPS if gap >= least):
        aside = (True, False) if unit.asset.fume_hood else (False,)
        offered = [options_on(standing, unit, apart, gap, off_traffic) for off_traffic in aside]
        for near in (supplied, required) if near_supplies else (required,):
            for options in offered:
                for some in (_on_walls(options, hood_walls), options):
                    able = near(some, unit, supplies)
                    if able:
                        return able
    return [] if least else _usual_options(standing, unit, apart, hood_walls, near_supplies)


def _usual_options(
    standing: Standing, unit: Unit, apart: Distances, hood_walls: Collection[str], near_supplies: bool
) -> Options:
    options = options_on(standing, unit, apart)
    if unit.asset.fume_hood:
        options = _on_walls(options, hood_walls) or options
    return (preferred if near_supplies else required)(options, unit, standing.ground.supplies)


def _on_walls(options: Options, hood_walls: Collection[str]) -> Options:
    return [option for option in options if option[0].id in hood_walls]


def options_on(
    standing: Standing, unit: Unit, apart: Distances, off_doors: float = 0.0, off_traffic: bool = False
) -> Options:
    """The places of a unit along all segments."""
    apart, options = tuple(apart), []
    for segment in standing.ground.segments:
        intervals = standing.places(segment, unit, apart, off_doors, off_traffic)
        if intervals:
            options.append((segment, intervals))
    return options


def stand_oblique(
    standing: Standing,
    units: Sequence[Unit],
    places: Places,
    separations: Sequence[Separation],
    generator: np.random.Generator,
) -> dict[str, OrientedBox]:
    """Return footprints of units along oblique walls, one after the other; they are obstacles for all that follow."""
    feet: dict[str, OrientedBox] = {}
    segments = {s.id: s for options in places.values() for s, _ in options if not s.straight}
    for segment in segments.values():
        able = [unit for unit in units if unit.id not in feet and any(s is segment for s, _ in places[unit.id])]
        for index in generator.permutation(len(able))[:OBLIQUE_UNITS]:
            unit = able[index]
            able_at = next(intervals for s, intervals in places[unit.id] if s is segment)
            apart = distances_from(feet, [unit.id], separations).get(unit.id, [])
            intervals = [place for place in standing.places(segment, unit, apart) if place in able_at]
            if not intervals:
                continue
            along = intervals[int(generator.integers(len(intervals)))][0]
            foot = standing.oblique_foot(segment, along, unit)
            if standing.along_its_wall(segment, foot):
                standing.add(foot, unit.front, unit.clear)
                feet[unit.id] = foot
    return feet


def distances_from(
    feet: Mapping[str, OrientedBox], units: Collection[str], separations: Sequence[Separation]
) -> dict[str, list[tuple[OrientedBox, float]]]:
    """Return the footprints from which units keep a distance, and the distance in meters, by unit id."""
    apart: dict[str, list[tuple[OrientedBox, float]]] = {}
    for rule in separations:
        for unit, other in ((rule.first, rule.second), (rule.second, rule.first)):
            if unit in units and other in feet:
                apart.setdefault(unit, []).append((feet[other], rule.distance))
    return apart


def choose_segments(
    units: Sequence[Unit], places: Places, demands: Demands, generator: np.random.Generator
) -> list[Stand]:
    """Return each unit with one straight segment.

    Greedy: a hood draws its segment with equal chances, then come units that must be near others, then the longest.
    Crowded segments and those with a unit that must stay away cost much, neighbors attract, and noise makes seeds
    differ.
    """
    used: dict[str, float] = {}
    chosen: dict[str, str] = {}
    stands: dict[str, Stand] = {}
    hostile_to, friendly_to = _partners(demands.separations), _partners(demands.nearness)
    bound = _partners(demands.proximities)
    for unit in sorted(units, key=lambda unit: (not unit.asset.fume_hood, unit.id not in bound, -unit.width, unit.id)):
        options = [option for option in places[unit.id] if option[0].straight]
        if not options:
            stands[unit.id] = Stand(unit, ())
            continue
        noise = generator.uniform(0.0, 1.0, len(options))
        costs = []
        for index, (segment, intervals) in enumerate(options):
            length = max(sum(high - low for low, high in intervals) + unit.width - CORNER, 0.1)
            share = (used.get(segment.id, 0.0) + unit.width) / length
            cost = noise[index] + (OVERFLOW if share > 1.0 else 0.0)
            cost += REMOTE * sum(
                not _within(
                    unit, segment, intervals, stands[rule.second if rule.first == unit.id else rule.first], rule
                )
                for rule in demands.proximities
                if unit.id in (rule.first, rule.second) and {rule.first, rule.second} & stands.keys()
            )
            if not unit.asset.fume_hood:
                hostile = sum(chosen.get(other) == segment.id for other in hostile_to.get(unit.id, ()))
                friends = sum(chosen.get(other) == segment.id for other in friendly_to.get(unit.id, ()))
                cost += CROWDED * share**2 + HOSTILE * hostile - NEIGHBOR * friends
            costs.append(cost)
        segment, intervals = options[int(np.argmin(costs))]
        chosen[unit.id] = segment.id
        used[segment.id] = used.get(segment.id, 0.0) + unit.width
        stands[unit.id] = Stand(unit, (Option(segment, tuple(intervals), draw_place(intervals, generator)),))
    return [stands[unit.id] for unit in units]


def every_segment(
    units: Sequence[Unit], places: Places, supplies: Supplies, generator: np.random.Generator
) -> list[Stand]:
    """Return each unit with all its straight segments, between which the program chooses.

    Places beyond the reach of what a unit needs are separate options, at a cost.
    """
    stands = []
    for unit in units:
        straight = [option for option in places[unit.id] if option[0].straight]
        near = supplied(straight, unit, supplies)
        options = [
            Option(segment, tuple(intervals), draw_place(intervals, generator), 0.0 if near is straight else FAR)
            for segment, intervals in straight
        ]
        if near is not straight:
            options += [Option(s, tuple(intervals), draw_place(intervals, generator)) for s, intervals in near]
        stands.append(Stand(unit, tuple(options)))
    return stands


def draw_place(intervals: Intervals, generator: np.random.Generator) -> float:
    """Return a random place in intervals, each as likely as it is long."""
    lengths = np.array([high - low for low, high in intervals]) + 1e-3
    index = int(generator.choice(len(intervals), p=lengths / lengths.sum()))
    low, high = intervals[index]
    return float(generator.uniform(low, high))


def _within(unit: Unit, segment: Segment, intervals: Intervals, other: Stand, rule: Proximity) -> bool:
    """Whether some place of a unit on a segment is as near to one of another unit's as a rule asks."""
    goals = _goals(unit, segment, intervals)
    others = [_goals(other.unit, option.segment, option.places) for option in other.options]
    return any(float(np.abs(goals[:, None] - each[None]).sum(axis=-1).min()) <= rule.distance for each in others)


def _goals(unit: Unit, segment: Segment, intervals: Sequence[tuple[float, float]]) -> NDArray[np.float64]:
    """Goal poses (n, 2) of a unit at places along a segment, the ends of the intervals among them."""
    alongs = np.concatenate([np.append(np.arange(low, high, SPACING), high) for low, high in intervals])
    return segment.points(alongs + unit.width / 2.0, WALL_GAP + unit.depth + STAND_OFF)


def _partners(
    pairs: Sequence[Separation] | Sequence[Nearness] | Sequence[Proximity],
) -> dict[str, set[str]]:
    partners: dict[str, set[str]] = {}
    for pair in pairs:
        partners.setdefault(pair.first, set()).add(pair.second)
        partners.setdefault(pair.second, set()).add(pair.first)
    return partners
