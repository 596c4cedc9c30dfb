"""Phase 1 of LabGen: a first layout, room level then surface level."""

from __future__ import annotations

import hashlib
import typing
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from labgym.layouts.assembly import Plan, shortest_drive
from labgym.layouts.brief import LEVELS, Furnishing
from labgym.layouts.briefing import write_brief
from labgym.layouts.floor import Room
from labgym.layouts.floor_plan import solve
from labgym.layouts.infeasibility import (
    attempts_used_up,
    clashes,
    explain,
    height_conflicts,
    infeasible,
    room_conflicts,
    search_stopped,
)
from labgym.layouts.model import Layout
from labgym.layouts.request import Request
from labgym.layouts.rules import facility
from labgym.layouts.rules.arrangement import Arrangement
from labgym.layouts.rules.egress import MARGIN, narrow_ways
from labgym.layouts.rules.site import Site
from labgym.layouts.walls import choose_walls

ATTEMPTS = 6
"""Number of briefs tried at each level of furnishing before the next."""
QUICK, PATIENT, THOROUGH = 0.04, 0.4, 1.0
"""Deterministic search time with walls chosen beforehand, of one last attempt at a level at which the solver reached
that limit, and with walls left to the solver."""
QUICK_AREA = 100.0
"""Floor area for which QUICK suffices, square meters; the search time grows with the area above it."""
MOST_SCALE = 8.0
"""Greatest factor by which the search time grows."""
LIMIT_WORDS = "reached the solver's effort limit"
"""In notes: attempts without a result and without a proof."""
THOROUGH_ATTEMPTS = 4
"""Briefs with required furniture alone that are tried if a floor plan breaks a facility rule."""
LEAST_DRIVE = 1.0
"""Least distance between the goal poses of consecutive locations, meters: a drive starts well outside its goal."""


class Proposer(typing.Protocol):
    """Interface of proposers: makes a first layout, which the later phases repair and verify."""

    def propose(self, request: Request) -> Layout:
        """Return a layout that holds everything the protocol requires; it may violate rules."""


@dataclass(frozen=True)
class ProceduralProposer:
    """Laboratory planning habits, a constraint solver and a seed; offline and deterministic."""

    def propose(self, request: Request) -> Layout:
        """Return a layout without geometric or chemical violations.

        Raises:
            InfeasibleError: the room cannot hold what the protocol requires.
        """
        return self.plan(request).layout()

    def plan(self, request: Request) -> Plan:
        """Return the first acceptable plan that the solver finds, trying full furnishing first.

        Raises:
            InfeasibleError: the room cannot hold what the protocol requires.
            SearchLimitError: the search ended without a plan and without a proof of infeasibility.
        """
        conflicts = room_conflicts(request)
        if conflicts:
            raise infeasible(request, conflicts)
        room, seed = request.room, request.seed
        scale = _scale(room)
        failures: dict[Furnishing, Counter[str]] = {}
        entropy = int.from_bytes(hashlib.sha256(request.protocol.id.encode()).digest()[:8], "big")
        for level_index, level in enumerate(LEVELS):
            for attempt in range(ATTEMPTS + 1):
                last = attempt == ATTEMPTS
                if last and not failures[level]["stopped"]:
                    break
                generator = np.random.default_rng([seed, entropy, level_index, attempt])
                brief = write_brief(request, level, generator)
                if height_conflicts(request, brief):
                    break
                solution = solve(
                    choose_walls(brief, room, generator), room, seed, effort=(PATIENT if last else QUICK) * scale
                )
                outcome: str = solution.status
                if solution.status == "solved":
                    plan = Plan(request, brief, solution.poses, _note(failures))
                    if shortest_drive(plan.layout(), request.protocol) >= LEAST_DRIVE and not _errors(plan):
                        return plan
                    outcome = "rejected"
                failures.setdefault(level, Counter())[outcome] += 1
        return self._thorough_plan(request, entropy, _note(failures))

    def _thorough_plan(self, request: Request, entropy: int, note: str) -> Plan:
        """The required furniture alone, with the walls left to the solver."""
        effort = THOROUGH * _scale(request.room)
        errors: list[str] = []
        for attempt in range(THOROUGH_ATTEMPTS):
            generator = np.random.default_rng([request.seed, entropy, attempt] if attempt else [request.seed, entropy])
            brief = write_brief(request, "required", generator)
            conflicts = height_conflicts(request, brief)
            if conflicts:
                raise infeasible(request, conflicts)
            solution = solve(brief, request.room, request.seed + attempt, effort=effort)
            if solution.status == "infeasible":
                raise explain(request, brief)
            if solution.status == "stopped":
                raise search_stopped(request, effort, clashes(request, brief))
            plan = Plan(request, brief, solution.poses, note)
            errors = _errors(plan)
            if not errors:
                return plan
        raise attempts_used_up(request, THOROUGH_ATTEMPTS, errors)


def _note(failures: Mapping[Furnishing, Counter[str]]) -> str:
    """Why fuller levels of furnishing were given up: the outcomes of their attempts."""
    words = {
        "infeasible": "have no floor plan on the chosen walls",
        "stopped": LIMIT_WORDS,
        "rejected": "break a facility rule or have a drive that is too short",
    }
    notes = []
    for level, outcomes in failures.items():
        parts = ", ".join(f"{outcomes[outcome]} {text}" for outcome, text in words.items() if outcomes[outcome])
        notes.append(f"of {outcomes.total()} attempts at {level} furnishing {parts}")
    return "; ".join(notes)


def _scale(room: Room) -> float:
    """Factor on the search time for large rooms."""
    return min(max(1.0, room.width * room.depth / QUICK_AREA), MOST_SCALE)


def _errors(plan: Plan) -> list[str]:
    """Facility errors of a plan; ways are judged with the grid's error on the safe side."""
    arrangement = Arrangement.of(plan.layout())
    fixed = set(plan.brief.fixed)
    narrow = [
        f"the widest way from {way.entrance} to {way.destinations[0]} is {way.width:.2f} m"
        for way in narrow_ways(arrangement, margin=MARGIN)
    ]
    issues = [
        issue for issue in facility.issues(facility.PLACING, Site(arrangement)) if not fixed.issuperset(issue.ids)
    ]
    return [issue.message for issue in issues if issue.severity == "error"] + narrow
