"""Navigation metrics of one episode, and estimates over many (definitions `navigation-v2`).

S is 1 if the episode succeeded, else 0; L* is the length of the shortest path for a disc of the planning radius; P is
the length driven; d0 and dT are the straight distances to the goal at the start and at the end:

    SPL                  S L* / max(P, L*)                       (Anderson et al., 2018, arXiv:1807.06757)
    SoftSPL              max(0, 1 - dT / d0) L* / max(P, L*)     (Datta et al., 2020, arXiv:2009.03231)
    success              mean S
    spl, soft_spl        means over episodes
    collision_free       share of episodes that succeed without contact
    contacts_per_meter   mean over episodes of min(10, control steps in contact / meters driven)
    min_clearance        mean over episodes of the smallest clearance of the chassis, meters
    time_to_goal         mean simulated seconds of the successful episodes
    final_distance       mean dT, meters

A robot that drives at full speed (1 m/s, 10 control steps per second) and touches something all the way has 10 contacts
per meter. More are the time for which it stands stuck; without the cap one stuck robot doubles the mean of a suite.

Measured on the machine that drove, and therefore not a result of the run:

    planning_ms          mean over episodes of the policy's wall-clock milliseconds per action

Suites with the NavDP benchmark's rules use that benchmark's metrics under separate names. They are not comparable with
those above: episodes end at a different distance from the goal, and the straight distance replaces L*.

    navdp_success        mean S, where S = 1 if the episode ended within the suite's distance of the goal
    navdp_spl            mean S min(1, d0 / P)
    navdp_time           mean simulated seconds of the successful episodes
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Literal

from labgym.eval.driving.episode_row import TransitionRow
from labgym.eval.driving.intervals import Estimate, bounded_mean, positive_mean, real_mean

VERSION = "navigation-v2"
"""Version of the definitions. Version 1 divided the contacts of all episodes by the meters of all episodes."""

CONTACT_CAP = 10.0
"""Largest contacts per meter of an episode: contact in every control step at full speed."""

METRICS = (
    "success",
    "spl",
    "soft_spl",
    "collision_free",
    "contacts_per_meter",
    "min_clearance",
    "time_to_goal",
    "final_distance",
)
"""Metrics of `summarise`, in the order of the tables."""

NAVDP_METRICS = (
    "navdp_success",
    "navdp_spl",
    "navdp_time",
    "contacts_per_meter",
    "min_clearance",
    "final_distance",
)
"""Metrics of `summarise` for suites with the NavDP benchmark's rules."""


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


def contacts_per_meter(contacts: int, driven: float) -> float:
    """Return control steps in contact per meter driven, at most `CONTACT_CAP`.

    Args:
        contacts: control steps in contact.
        driven: P, meters.
    """
    return min(contacts / driven, CONTACT_CAP) if driven > 0.0 else CONTACT_CAP * (contacts > 0)


def summarise(
    rows: Sequence[TransitionRow], metrics: Literal["touchstone", "navdp"] = "touchstone"
) -> dict[str, Estimate]:
    """Return each metric with its 95% interval over layouts and repeats (see `intervals`).

    Args:
        rows: episodes of one policy, in any order.
        metrics: which metrics, as in the suite.
    """
    layouts = [row.layout for row in rows]
    success = [float(row.success) for row in rows]
    time = positive_mean([row.time if row.success else None for row in rows], layouts)
    estimates = {
        "success": bounded_mean(success, layouts),
        "navdp_success": bounded_mean(success, layouts),
        "navdp_spl": bounded_mean([row.navdp_spl for row in rows], layouts),
        "navdp_time": time,
        "spl": bounded_mean([row.spl for row in rows], layouts),
        "soft_spl": bounded_mean([row.soft_spl for row in rows], layouts),
        "collision_free": bounded_mean([float(row.success and row.contacts == 0) for row in rows], layouts),
        "contacts_per_meter": bounded_mean(
            [contacts_per_meter(row.contacts, row.path_length) for row in rows], layouts, highest=CONTACT_CAP
        ),
        "min_clearance": real_mean([row.min_clearance for row in rows], layouts),
        "time_to_goal": time,
        "final_distance": positive_mean([row.final_distance for row in rows], layouts),
    }
    return {name: estimates[name] for name in (NAVDP_METRICS if metrics == "navdp" else METRICS)}


def planning_time(times: Mapping[str, float | None]) -> Estimate:
    """Return the mean planning time of a policy per action with its interval, milliseconds.

    Args:
        times: milliseconds by key; None for an episode without an action.
    """
    return positive_mean(list(times.values()), [key.rsplit("/", 2)[0] for key in times])
