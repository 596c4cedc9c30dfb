"""Navigation metrics of one episode, and estimates over many.

S is 1 if the episode succeeded, else 0; L* is the length of the shortest path for a disc of the planning radius; P is
the length driven; d0 and dT are the straight distances to the goal at the start and at the end:

    SPL                  S L* / max(P, L*)                       (Anderson et al., 2018, arXiv:1807.06757)
    SoftSPL              max(0, 1 - dT / d0) L* / max(P, L*)     (Datta et al., 2020, arXiv:2009.03231)
    success              mean S
    spl, soft_spl        means over episodes
    collision_free       share of episodes that succeed without contact
    contacts_per_metre   control steps in contact, over all episodes, / meters driven
    min_clearance        mean over episodes of the smallest clearance of the chassis, meters
    time_to_goal         mean simulated seconds of the successful episodes
    planning_ms          mean wall-clock milliseconds of the policy per action
    final_distance       mean dT, meters

Suites with the NavDP benchmark's rules use that benchmark's metrics under separate names. They are not comparable with
those above: episodes end at a different distance from the goal, and the straight distance replaces L*.

    navdp_success        mean S, where S = 1 if the episode ended within the suite's distance of the goal
    navdp_spl            mean S min(1, d0 / P)
    navdp_time           mean simulated seconds of the successful episodes
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from labgym.eval.driving.bootstrap import RESAMPLES, Estimate, ratio_estimate
from labgym.eval.driving.episode_row import EpisodeRow

METRICS = (
    "success",
    "spl",
    "soft_spl",
    "collision_free",
    "contacts_per_metre",
    "min_clearance",
    "time_to_goal",
    "final_distance",
    "planning_ms",
)
"""Metrics of `summarise`, in the order of the tables."""

NAVDP_METRICS = (
    "navdp_success",
    "navdp_spl",
    "navdp_time",
    "contacts_per_metre",
    "min_clearance",
    "final_distance",
    "planning_ms",
)
"""Metrics of `summarise` for suites with the NavDP benchmark's rules."""


def spl(success: bool, shortest: float, driven: float) -> float:
    """Return success weighted by path length, in [0, 1].

    Args:
        success: whether the goal was reached.
        shortest: L*, meters, positive.
        driven: P, meters.
    """
    return shortest / max(driven, shortest) if success else 0.0


def soft_spl(initial: float, final: float, shortest: float, driven: float) -> float:
    """Return SPL with progress toward the goal instead of success, in [0, 1].

    Args:
        initial: distance to the goal at the start, meters.
        final: distance to the goal at the end, meters.
        shortest: L*, meters, positive.
        driven: P, meters.
    """
    progress = max(0.0, 1.0 - final / initial) if initial > 0.0 else 1.0
    return progress * shortest / max(driven, shortest)


def summarise(
    rows: Sequence[EpisodeRow],
    seed: int = 0,
    resamples: int = RESAMPLES,
    metrics: Literal["touchstone", "navdp"] = "touchstone",
) -> dict[str, Estimate]:
    """Return each metric with its 95% interval, bootstrapped over layouts.

    Args:
        rows: episodes of one policy.
        seed: random seed of the resampling, the same for every metric and policy.
        resamples: number of resamples.
        metrics: which metrics, as in the suite.
    """
    clusters = [row.layout for row in rows]
    success = np.array([row.success for row in rows], dtype=np.float64)
    time = _column([row.time if row.success else None for row in rows])
    touched = np.array([row.contacts for row in rows], dtype=np.float64)
    ones = np.ones(len(rows))
    parts: dict[str, tuple[NDArray[np.float64], NDArray[np.float64]]] = {
        "success": (success, ones),
        "navdp_success": (success, ones),
        "navdp_spl": (_column([row.navdp_spl for row in rows]), ones),
        "navdp_time": (time, ones),
        "spl": (_column([row.spl for row in rows]), ones),
        "soft_spl": (_column([row.soft_spl for row in rows]), ones),
        "collision_free": (success * (touched == 0), ones),
        "contacts_per_metre": (touched, np.array([row.path_length for row in rows], dtype=np.float64)),
        "min_clearance": (_column([row.min_clearance for row in rows]), ones),
        "time_to_goal": (time, ones),
        "final_distance": (_column([row.final_distance for row in rows]), ones),
        "planning_ms": (_column([row.planning_ms for row in rows]), ones),
    }
    names = NAVDP_METRICS if metrics == "navdp" else METRICS
    return {name: ratio_estimate(*parts[name], clusters, seed=seed, resamples=resamples) for name in names}


def _column(values: Sequence[float | None]) -> NDArray[np.float64]:
    return np.array([np.nan if value is None else value for value in values], dtype=np.float64)
