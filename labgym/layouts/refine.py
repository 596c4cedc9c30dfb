"""Phase 3 of LabGen: refinement for navigation, until the robot can drive every transition of the protocol."""

from __future__ import annotations

import math
from collections.abc import Iterator

from labgym.geometry import OrientedBox, penetration, wrap_angle
from labgym.layouts.model import FLOOR, Layout
from labgym.layouts.moves import Command, Move, Place, Rotate, apply, may_move
from labgym.layouts.optimise import optimise_assessed
from labgym.layouts.relocation import free_places
from labgym.layouts.rules.building import building_of
from labgym.layouts.rules.objective import Assessment, evaluate_layout
from labgym.layouts.rules.thresholds import Profile
from labgym.navigation import PLANNING_RADIUS, STAND_OFF, Transition, goal_pose
from labgym.protocols import Protocol

ITERATIONS = 8
BUDGET = 80
"""Maximum number of commands verified in one iteration."""
PLACES = 4
"""Maximum number of free places tried for an object."""
STEPS = (0.1, 0.2, 0.4, 0.7)
"""Translations that are tried, meters."""


def refine(layout: Layout, protocol: Protocol, profile: str | Profile = "default") -> Layout:
    """Return a layout in which more transitions are feasible, all of them if the space allows it.

    Failures are classified by the planner; rotations come first, then translations and free places, and
    after each accepted update the optimizer repairs what it broke. No update that adds a violation is accepted. Fixed
    objects never move. Deterministic.
    """
    return refine_assessed(layout, evaluate_layout(layout, protocol, profile, navigation=True), protocol)[0]


def refine_assessed(layout: Layout, current: Assessment, protocol: Protocol) -> tuple[Layout, Assessment]:
    """Return the layout of `refine` and its assessment, given the assessment of a layout with navigation."""
    profile = current.profile
    for _ in range(ITERATIONS):
        failures = [transition for transition in current.transitions or () if not transition.feasible]
        if not failures:
            break
        best, best_command = current, None
        for command in _commands(layout, failures):
            candidate = evaluate_layout(apply(layout, command), protocol, profile, navigation=True)
            if candidate.better_than(best):
                best, best_command = candidate, command
        if best_command is None:
            break
        layout = apply(layout, best_command)
        repaired, current = optimise_assessed(layout, protocol, profile)
        if best.better_than(current):
            current = best
        else:
            layout = repaired
    return layout, current


def _commands(layout: Layout, failures: list[Transition]) -> list[Command]:
    """Suggestions for all failures without repetition, at most BUDGET of them."""
    suggestions: dict[Command, None] = {}
    for failure in failures:
        for command in _suggestions(layout, failure):
            if may_move(layout, command.id):
                suggestions.setdefault(command)
            if len(suggestions) >= BUDGET:
                return list(suggestions)
    return list(suggestions)


def _suggestions(layout: Layout, failure: Transition) -> Iterator[Move | Rotate | Place]:
    locations = {"start": failure.start_location, "goal": failure.goal_location}
    ends = failure.ends or ("start", "goal")
    targets = [placement.id for end in ends if (placement := layout.find(locations[end])) is not None]
    for target in targets:
        yield from _rotation_fixes(layout, target)
    for target in targets:
        for blocker in _blockers(layout, target):
            yield from free_places(layout, blocker, PLACES)
            yield from _translations(blocker)
        yield from _translations(target)
        yield from free_places(layout, target, PLACES)
    if failure.failure == "unreachable":
        for placement in layout.placements:
            if placement.support == FLOOR and placement.id not in targets:
                yield from _translations(placement.id)


def _rotation_fixes(layout: Layout, target: str) -> Iterator[Rotate]:
    """Other headings whose goal pose lies in the room."""
    box, building = layout.box(target), building_of(layout)
    for quarter in range(1, 4):
        yaw = wrap_angle(box.yaw + quarter * math.pi / 2.0)
        turned = OrientedBox(box.x, box.y, box.width, box.depth, yaw, box.z0, box.z1)
        x, y, _ = goal_pose(turned)
        if building.roomy(x, y, PLANNING_RADIUS):
            yield Rotate(target, yaw)


def _translations(placement_id: str) -> Iterator[Move]:
    for step in STEPS:
        for dx, dy in ((step, 0.0), (-step, 0.0), (0.0, step), (0.0, -step)):
            yield Move(placement_id, dx, dy)


def _blockers(layout: Layout, target: str) -> list[str]:
    """Floor objects that reach into the space where the robot would stand in front of a target."""
    box = layout.box(target)
    x, y, _ = goal_pose(box)
    side = 2.0 * (PLANNING_RADIUS + 0.05)
    stand = OrientedBox(x, y, side, side + STAND_OFF, box.yaw, 0.0, 1.0)
    return [
        placement.id
        for placement in layout.placements
        if placement.support == FLOOR and placement.id != target and penetration(stand, layout.box(placement.id)) > 0.0
    ]
