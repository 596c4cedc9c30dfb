"""Holodeck's spatial constraints and the scores of candidate spots under them.

Definitions and weights are those of the public repository allenai/Holodeck, `floor_objects.py`; the paper (arXiv
2312.09067, section 3) names the constraints. Footprints are axis-aligned and padded.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from labgym.paper.rivals.household import Relation
from labgym.paper.rivals.plan import Constraint

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

WEIGHTS = {"distance": 1.8, "position": 0.5, "alignment": 0.5, "rotation": 0.5}
"""Score of a constraint of each type; `constraint_type2weight`, with a bonus of 1 per constraint."""
EDGE_SCORE, FREE_SCORE = 2.0, 1.0
"""Base score of a spot along a wall, and of any other."""
NEAR_LIMIT = 0.8
"""Gap from which a spot is no longer near, meters; `place_distance`."""
ALIGNED = 0.05
"""Greatest offset of aligned centers, meters; `place_alignment_center`."""

TYPES: dict[Relation, str] = {
    "near": "distance",
    "far": "distance",
    "in front of": "position",
    "behind": "position",
    "left of": "position",
    "right of": "position",
    "side of": "position",
    "center aligned": "alignment",
    "face to": "rotation",
}
"""Type of each constraint that refers to another object."""


@dataclass(frozen=True)
class Spots:
    """n candidate spots.

    Attributes:
        center: (n, 2), meters. half: half extents along x and y, (n, 2). turn: quarter turns, (n,); the front looks
            along +y at 0, -x at 1. score: (n,).
    """

    center: Array
    half: Array
    turn: NDArray[np.intp]
    score: Array

    def __len__(self) -> int:
        return len(self.turn)

    def __getitem__(self, rows: NDArray[np.intp] | Mask | slice) -> Spots:
        return Spots(self.center[rows], self.half[rows], self.turn[rows], self.score[rows])

    @classmethod
    def joined(cls, parts: Sequence[Spots]) -> Spots:
        """Return the spots of all parts."""
        return cls(
            np.concatenate([part.center for part in parts]),
            np.concatenate([part.half for part in parts]),
            np.concatenate([part.turn for part in parts]),
            np.concatenate([part.score for part in parts]),
        )

    @property
    def front(self) -> Array:
        """Unit vectors that the spots face, (n, 2)."""
        return FRONTS[self.turn]


FRONTS = np.array([(0.0, 1.0), (-1.0, 0.0), (0.0, -1.0), (1.0, 0.0)])
"""Front of an object after 0 to 3 quarter turns."""


def expanded(constraint: Constraint) -> tuple[Constraint, ...]:
    """Return the constraints that one of the plan stands for.

    "around" means near and facing; "in front of" includes alignment of the centers.
    """
    relation, target = constraint.relation, constraint.target
    if relation == "around":
        return Constraint("near", target), Constraint("face to", target)
    if relation == "in front of":
        return constraint, Constraint("center aligned", target)
    return (constraint,)


def scores(spots: Spots, constraints: Sequence[Constraint], placed: Mapping[str, Spots], grid: float) -> Array:
    """Return the score of n spots: base and weighted constraints, divided by the number of constraints.

    Args:
        spots: candidates; their score is the base.
        constraints: expanded; those whose target is not placed are left out.
        placed: the one spot of each placed object. grid: spacing of the grid, meters.
    """
    known = [c for c in constraints if not c.target or c.target in placed]
    total = spots.score.copy()
    for constraint in known:
        if constraint.target:
            total += WEIGHTS[TYPES[constraint.relation]] * satisfied(spots, constraint, placed[constraint.target], grid)
    return total / max(len(known), 1)


def satisfied(spots: Spots, constraint: Constraint, target: Spots, grid: float) -> Array:
    """Return how well n spots satisfy one constraint, 0 to 1; only distances have values in between."""
    relation = constraint.relation
    if relation in ("near", "far"):
        gaps = gap(spots, target)
        return near(gaps) if relation == "near" else far(gaps)
    if relation == "center aligned":
        return (np.abs(spots.center - target.center) < ALIGNED).any(axis=1).astype(float)
    if relation == "face to":
        return _faces(spots, target).astype(float)
    return _beside(relation, spots, target, grid).astype(float)


def gap(spots: Spots, target: Spots) -> Array:
    """Return the distances between the footprints of n spots and the target, shape (n,), meters."""
    apart = np.abs(spots.center - target.center) - spots.half - target.half
    distances: Array = np.linalg.norm(np.maximum(apart, 0.0), axis=1)
    return distances


def near(gaps: Array) -> Array:
    """Return scores that fall from 1 at the least gap to 0 at `NEAR_LIMIT`; all 0 if no gap is below it."""
    least, greatest = gaps.min(), gaps.max()
    if least >= NEAR_LIMIT:
        return np.zeros(len(gaps))
    end = min(NEAR_LIMIT, greatest) if greatest > least else NEAR_LIMIT
    shares: Array = np.clip((end - gaps) / (end - least), 0.0, 1.0)
    return shares


def far(gaps: Array) -> Array:
    """Return scores that rise from 0 at the least gap to 1 at the greatest."""
    least, greatest = gaps.min(), gaps.max()
    shares: Array = (gaps - least) / (greatest - least) if greatest > least else np.zeros(len(gaps))
    return shares


def _faces(spots: Spots, target: Spots) -> Mask:
    """Whether the half-line from a spot's center along its front meets the target's footprint."""
    offset, front = target.center - spots.center, spots.front
    ahead = (offset * front).sum(axis=1) + np.abs(front) @ target.half[0]
    aside = np.abs(offset * front[:, ::-1] @ np.array([1.0, -1.0]))
    reach = np.abs(front[:, ::-1]) @ target.half[0]
    met: Mask = (ahead >= 0.0) & (aside <= reach)
    return met


def _beside(relation: Relation, spots: Spots, target: Spots, grid: float) -> Mask:
    """Position of the spots' centers in the target's frame: right along its own right, ahead along its front."""
    front = target.front[0]
    right = np.array([front[1], -front[0]])
    offset = spots.center - target.center[0]
    across, ahead = offset @ right, offset @ front
    half_across, half_ahead = np.abs(right) @ target.half[0], np.abs(front) @ target.half[0]
    level = np.abs(ahead) <= half_ahead
    masks: dict[Relation, Mask] = {
        "in front of": (ahead > half_ahead) & (np.abs(across) < grid),
        "behind": (ahead < -half_ahead) & (np.abs(across) <= half_across),
        "left of": (across < -half_across) & level,
        "right of": (across > half_across) & level,
        "side of": level,
    }
    return masks[relation]
