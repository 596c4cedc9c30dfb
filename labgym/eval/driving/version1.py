"""Evaluations of labgym 0.1: read and reported, never resumed."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

from labgym.documents import Record, read_json
from labgym.errors import DocumentError
from labgym.eval.driving.episode_row import EpisodeRow, Key
from labgym.eval.driving.intervals import Estimate
from labgym.eval.driving.record import NavigationSummary

SCHEMA = "labgym.navigation-summary/1"


class Provenance1(Record):
    """The code that produced an evaluation: versions, commit, whether there were changes, and a digest."""

    versions: dict[str, str]
    commit: str | None
    dirty: bool | None
    code: str


def read_summary1(path: Path) -> tuple[NavigationSummary, Provenance1] | None:
    """Return the summary of an evaluation of labgym 0.1 and its provenance; None if the file has another schema.

    The summary's metrics are those of 0.1, planning times included.

    Raises:
        DocumentError: the file cannot be read.
    """
    data = read_json(path)
    if not isinstance(data, dict) or data.get("schema") != SCHEMA:
        return None
    fields = {key: value for key, value in data.items() if key not in ("arguments", "provenance")}
    summary = NavigationSummary.parse({**fields, "schema": NavigationSummary.SCHEMA}, path)
    try:
        return summary, Provenance1.model_validate(data.get("provenance"))
    except ValueError:
        raise DocumentError(path, "provenance", "expected versions, commit, dirty and code") from None


def row1(times: dict[Key, float | None]) -> Callable[[object], EpisodeRow]:
    """Return a parser of rows of labgym 0.1, which puts their planning times into `times`."""

    def parse(data: object) -> EpisodeRow:
        if not isinstance(data, dict) or "planning_ms" not in data:
            raise ValueError("planning_ms is missing")
        planning = data["planning_ms"]
        if planning is not None and (not isinstance(planning, int | float) or planning < 0.0):
            raise ValueError(f"planning_ms is {planning!r}, expected milliseconds")
        row = EpisodeRow.model_validate({key: value for key, value in data.items() if key != "planning_ms"})
        times.setdefault(row.key, None if planning is None else float(planning))
        return row

    return parse


def values1(rows: Sequence[EpisodeRow], times: Iterable[float | None]) -> dict[str, float | None]:
    """Return the metrics of labgym 0.1 by name: plain means, and for contacts the ratio of two sums."""
    means: dict[str, Iterable[float | None]] = {
        "success": [float(row.success) for row in rows],
        "spl": [row.spl for row in rows],
        "soft_spl": [row.soft_spl for row in rows],
        "collision_free": [float(row.success and row.contacts == 0) for row in rows],
        "min_clearance": [row.min_clearance for row in rows],
        "time_to_goal": [row.time if row.success else None for row in rows],
        "final_distance": [row.final_distance for row in rows],
        "planning_ms": times,
        "navdp_success": [float(row.success) for row in rows],
        "navdp_spl": [row.navdp_spl for row in rows],
        "navdp_time": [row.time if row.success else None for row in rows],
    }
    driven = math.fsum(row.path_length for row in rows)
    contacts = sum(row.contacts for row in rows)
    return {
        **{name: _mean(values) for name, values in means.items()},
        "contacts_per_metre": contacts / driven if driven else None,
    }


def _mean(values: Iterable[float | None]) -> float | None:
    present = [value for value in values if value is not None]
    return math.fsum(present) / len(present) if present else None


def differences1(
    metrics: dict[str, Estimate], rows: Sequence[EpisodeRow], times: Iterable[float | None]
) -> tuple[str, ...]:
    """Return the metrics of a summary of labgym 0.1 that its rows do not give."""
    values: dict[str, Any] = values1(rows, times)
    return tuple(
        name
        for name, estimate in metrics.items()
        if not _equal(estimate.value, values.get(name)) or estimate.count + estimate.nulls != len(rows)
    )


def _equal(one: float | None, other: float | None) -> bool:
    return one is other or (one is not None and other is not None and math.isclose(one, other, rel_tol=1e-9))
