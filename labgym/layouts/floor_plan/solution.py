"""Floor plans: a pose for every unit of a brief."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from labgym.layouts.brief import Brief
from labgym.layouts.constraint_solver import CM, Status, run
from labgym.layouts.floor import Room
from labgym.layouts.floor_plan.program import WALL_GAP, Piece, Program
from labgym.layouts.placement import Placement
from labgym.layouts.rules.building.one_room import WALL_YAW

if TYPE_CHECKING:
    from ortools.sat.python import cp_model

GAP_LIMIT = 0.1
"""Relative distance to the best known bound at which the search stops: preferences need no proof of optimality."""


@dataclass(frozen=True)
class Pose:
    """Center of a footprint in the room frame, meters, and yaw, radians."""

    x: float
    y: float
    yaw: float


@dataclass(frozen=True)
class Solution:
    """Result of a search.

    Attributes:
        status: `solved`; `infeasible`, if it is proved that no floor plan exists; `stopped`, if the search reached its
            effort limit before it found a plan or a proof.
        poses: by unit id; empty unless solved.
    """

    status: Status
    poses: Mapping[str, Pose]


def solve(brief: Brief, room: Room, seed: int, lifted: Iterable[str] = (), effort: float = 1.0) -> Solution:
    """Search a pose for every unit.

    Args:
        seed: random seed of the search.
        lifted: names of GROUPS to leave out.
        effort: deterministic search time, in the solver's units (about seconds).
    """
    program = Program(brief, room, frozenset(lifted))
    status, solver = run(program.model, seed, effort, GAP_LIMIT)
    if status != "solved":
        return Solution(status, {})
    poses = {unit_id: _fixed_pose(placement) for unit_id, placement in brief.fixed.items()}
    poses |= {piece.unit.id: _pose(piece, solver, room) for piece in program.pieces}
    return Solution("solved", poses)


def _fixed_pose(placement: Placement) -> Pose:
    return Pose(placement.position[0], placement.position[1], placement.yaw)


def _pose(piece: Piece, solver: cp_model.CpSolver, room: Room) -> Pose:
    """Return the exact pose: the solver's centimeters along the wall, the exact gap across."""
    foot, unit = piece.foot, piece.unit
    x0, y0 = solver.value(foot.x0.value) / CM, solver.value(foot.y0.value) / CM
    if unit.stance != "wall":
        turned = bool(solver.value(piece.turned))
        width, depth = (unit.depth, unit.width) if turned else (unit.width, unit.depth)
        return Pose(x0 + width / 2.0, y0 + depth / 2.0, math.pi / 2.0 if turned else 0.0)
    wall = next(wall for wall, chosen in piece.walls.items() if solver.value(chosen))
    inset = WALL_GAP / CM + unit.depth / 2.0
    along = unit.width / 2.0 + (x0 if wall in ("front", "back") else y0)
    centre = {
        "front": (along, inset),
        "back": (along, room.depth - inset),
        "left": (inset, along),
        "right": (room.width - inset, along),
    }[wall]
    return Pose(*centre, WALL_YAW[wall])
