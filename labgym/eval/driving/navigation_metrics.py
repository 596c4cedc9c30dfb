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

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Literal

from labgym.eval.driving.episode_row import TransitionRow
from labgym.eval.driving.intervals import Estimate, bounded_mean, positive_mean, real_mean

VERSION = "navigation-v2"
"""Version of the definitions. Version 1 divided the contacts of all episodes by the meters of all episodes."""

CONTACT_CAP = 10.0
"""Largest contacts per meter of an episode: contact in every control step at full speed."""


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


@dataclass(frozen=True)
class NavigationMetric:
    """A navigation metric.

    Attributes:
        heading: in tables. value: of an episode; None if the metric does not apply.
        mean: estimates the mean over episodes from values and layouts.
        rules: of the suites that have it. compared: whether two policies are compared in it.
        digits: in tables.
    """

    heading: str
    value: Callable[[TransitionRow], float | None]
    mean: Callable[[Sequence[float | None], Sequence[str]], Estimate] = bounded_mean
    rules: tuple[str, ...] = ("touchstone",)
    compared: bool = False
    digits: int = 3


def _success(row: TransitionRow) -> float:
    return float(row.success)


def _time(row: TransitionRow) -> float | None:
    return row.time if row.success else None


def _contacts(row: TransitionRow) -> float:
    return contacts_per_meter(row.contacts, row.path_length)


NAVDP, BOTH = ("navdp",), ("touchstone", "navdp")
METRICS = {
    "navdp_success": NavigationMetric("SR (NavDP rules) ↑", _success, rules=NAVDP, compared=True),
    "navdp_spl": NavigationMetric("SPL (NavDP rules) ↑", lambda row: row.navdp_spl, rules=NAVDP, compared=True),
    "navdp_time": NavigationMetric("Time (NavDP rules), s ↓", _time, positive_mean, NAVDP, compared=True, digits=2),
    "success": NavigationMetric("SR ↑", _success, compared=True),
    "spl": NavigationMetric("SPL ↑", lambda row: row.spl, compared=True),
    "soft_spl": NavigationMetric("SoftSPL ↑", lambda row: row.soft_spl, compared=True),
    "collision_free": NavigationMetric(
        "Collision-free SR ↑", lambda row: float(row.success and row.contacts == 0), compared=True
    ),
    "contacts_per_meter": NavigationMetric(
        "Contacts per meter ↓", _contacts, partial(bounded_mean, highest=CONTACT_CAP), BOTH
    ),
    "min_clearance": NavigationMetric("Minimum clearance, m ↑", lambda row: row.min_clearance, real_mean, BOTH),
    "time_to_goal": NavigationMetric("Time to goal, s ↓", _time, positive_mean, compared=True, digits=2),
    "final_distance": NavigationMetric(
        "Distance left, m ↓", lambda row: row.final_distance, positive_mean, BOTH, digits=2
    ),
}
"""The metrics by name, in the order of tables; those of the NavDP benchmark replace SR, SPL and the time."""


def metrics_of(rules: Literal["touchstone", "navdp"]) -> dict[str, NavigationMetric]:
    """Return the metrics of the suites with some rules."""
    return {name: metric for name, metric in METRICS.items() if rules in metric.rules}


def summarise(
    rows: Sequence[TransitionRow], metrics: Literal["touchstone", "navdp"] = "touchstone"
) -> dict[str, Estimate]:
    """Return each metric with its 95% interval over layouts and repeats (see `intervals`).

    Args:
        rows: episodes of one policy, in any order.
        metrics: which metrics, as in the suite.
    """
    layouts = [row.layout for row in rows]
    return {
        name: metric.mean([metric.value(row) for row in rows], layouts) for name, metric in metrics_of(metrics).items()
    }


def planning_time(times: Mapping[str, float | None]) -> Estimate:
    """Return the mean planning time of a policy per action with its interval, milliseconds.

    Args:
        times: milliseconds by key; None for an episode without an action.
    """
    return positive_mean(list(times.values()), [key.rsplit("/", 2)[0] for key in times])
