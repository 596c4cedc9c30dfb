"""Phase 3 of LabGen: navigation-aware refinement, until every transition of the protocol can be driven."""

from __future__ import annotations

import math
from collections.abc import Iterator

from labgym.geometry import OrientedBox, penetration, wrap_angle
from labgym.layouts.model import FLOOR, Layout
from labgym.layouts.moves import Command, Move, Rotate, apply
from labgym.layouts.optimise import optimise
from labgym.layouts.rules.objective import evaluate_layout
from labgym.layouts.rules.thresholds import Profile
from labgym.navigation import PLANNING_RADIUS, STAND_OFF, Transition, goal_pose
from labgym.protocols import Protocol

ITERATIONS = 8
BUDGET = 80
"""Commands verified in one iteration at the most."""
STEPS = (0.1, 0.2, 0.4, 0.7)
"""Translations that are tried, metres."""


def refine(layout: Layout, protocol: Protocol, profile: str | Profile = "default") -> Layout:
    """Return a layout in which more transitions are feasible, all of them where the space allows it.

    Failures are classified by the planner; rotation fixes come first, translations next, and after each accepted
    update the optimiser repairs what it broke. No update that adds a violation is kept. Deterministic.
    """
    current = evaluate_layout(layout, protocol, profile, navigation=True)
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
        mended = optimise(layout, protocol, profile)
        current = evaluate_layout(mended, protocol, profile, navigation=True)
        if best.better_than(current):
            current = best
        else:
            layout = mended
    return layout


def _commands(layout: Layout, failures: list[Transition]) -> list[Command]:
    """Suggestions for all failures, one a placement and axis and size, at most BUDGET of them."""
    suggestions: dict[Command, None] = {}
    for failure in failures:
        for command in _suggestions(layout, failure):
            suggestions.setdefault(command)
            if len(suggestions) >= BUDGET:
                return list(suggestions)
    return list(suggestions)


def _suggestions(layout: Layout, failure: Transition) -> Iterator[Command]:
    locations = {"start": failure.start_location, "goal": failure.goal_location}
    ends = failure.ends or ("start", "goal")
    targets = [placed.id for end in ends if (placed := layout.find(locations[end])) is not None]
    for target in targets:
        yield from _rotation_fixes(layout, target)
    for target in targets:
        for blocker in _blockers(layout, target):
            yield from _translations(blocker)
        yield from _translations(target)
    if failure.failure == "unreachable":
        for placement in layout.placements:
            if placement.support == FLOOR and placement.id not in targets:
                yield from _translations(placement.id)


def _rotation_fixes(layout: Layout, target: str) -> Iterator[Command]:
    """Headings other than the present one whose goal pose lies in the room."""
    box = layout.box(target)
    for quarter in range(1, 4):
        yaw = wrap_angle(box.yaw + quarter * math.pi / 2.0)
        turned = OrientedBox(box.x, box.y, box.width, box.depth, yaw, box.z0, box.z1)
        x, y, _ = goal_pose(turned)
        inside_x = PLANNING_RADIUS < x < layout.room.width - PLANNING_RADIUS
        inside_y = PLANNING_RADIUS < y < layout.room.depth - PLANNING_RADIUS
        if inside_x and inside_y:
            yield Rotate(target, yaw)


def _translations(placement_id: str) -> Iterator[Command]:
    for step in STEPS:
        for dx, dy in ((step, 0.0), (-step, 0.0), (0.0, step), (0.0, -step)):
            yield Move(placement_id, dx, dy)


def _blockers(layout: Layout, target: str) -> list[str]:
    """Floor objects that reach into the space where the robot would stand before a target."""
    box = layout.box(target)
    x, y, _ = goal_pose(box)
    side = 2.0 * (PLANNING_RADIUS + 0.05)
    stand = OrientedBox(x, y, side, side + STAND_OFF, box.yaw, 0.0, 1.0)
    return [
        placement.id
        for placement in layout.placements
        if placement.support == FLOOR and placement.id != target and penetration(stand, layout.box(placement.id)) > 0.0
    ]
