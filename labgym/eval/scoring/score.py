"""LabTouchstone for layouts: all metrics of one layout, and means over many."""

from __future__ import annotations

import math
from collections.abc import Iterable
from collections.abc import Set as AbstractSet
from dataclasses import asdict
from pathlib import Path

from labgym.eval.scoring.consistency import consistency_proxy
from labgym.eval.scoring.layout_report import (
    Gated,
    LayoutReport,
    LayoutReport2,
    LayoutSummary,
    MetricMean,
    PhysicalScore,
    ReportedViolation,
)
from labgym.eval.scoring.version2 import METRICS_2, version_2
from labgym.layouts.model import Layout
from labgym.layouts.placement import FLOOR, WALL
from labgym.layouts.rules.arrangement import Arrangement
from labgym.layouts.rules.facility import facility_issues
from labgym.layouts.rules.objective import Assessment, evaluate_layout
from labgym.layouts.rules.satisfaction import mean, penalised, worst_mean
from labgym.layouts.rules.separation import contained
from labgym.layouts.rules.storage import in_own_class
from labgym.layouts.rules.thresholds import OVERLAP_VOLUME, PENETRATION, VERSION, VERSION_2, Profile
from labgym.layouts.rules.touchstone2.assessment import Assessment2
from labgym.navigation import resolve_protocol
from labgym.protocols import Protocol

CHEMISTRY_POINTS = 35.0
"""Points of S_chem, in equal shares of the scores that apply."""

METRICS = (
    "obj", "ob", "cn", "cn_sw", "cn_mj", "asset", "step_nav", "prot_nav", "flam", "store", "incomp", "glass",
    "incomp_contained", "store_class", "v", "fitness", "s_phys", "s_chem", "real", "lay", "comp", "s_consist",
    "total", "total_with_proxy",
)  # fmt: skip
"""Fields of a report that `aggregate` averages, in addition to the gated scores and the proxy."""

GATED = ("flam", "store", "incomp", "glass")
PROXY = ("realism", "layout", "completeness", "total")


def score(
    layout: Layout,
    protocol: Protocol | str | Path | None = None,
    profile: str | Profile = "default",
    contacts: bool = True,
    metrics: str | None = None,
) -> LayoutReport:
    """Return the LabTouchstone metrics of a layout.

    Args:
        layout: the layout.
        protocol: a protocol, its id or its .json file; by default the layout's first, if it has one.
        profile: name of the thresholds, or a `Profile`.
        contacts: whether to compile the scene and count contacts in MuJoCo (`cn_mj`).
        metrics: version of the definitions, `touchstone-v1` or `touchstone-v2`; by default the profile's, which is
            touchstone-v1 for all named profiles. `labgym score` takes touchstone-v2.

    Returns:
        A `LayoutReport2` under touchstone-v2.

    Raises:
        UnknownNameError: the protocol, the profile or the version does not exist.
        DocumentError: the layout names an asset or a support that does not exist, or is inconsistent.
    """
    layout.check_references()
    target = layout.protocol if protocol is None else resolve_protocol(layout, protocol)
    assessment = evaluate_layout(layout, target, profile, navigation=True, metrics=metrics)
    report = _report(layout, target, assessment, contacts)
    return version_2(report, assessment) if isinstance(assessment, Assessment2) else report


def _report(layout: Layout, target: Protocol | None, assessment: Assessment, contacts: bool) -> LayoutReport:
    flam, incomp = worst_mean(assessment.flammable), worst_mean(assessment.incompatible)
    store, glass = mean(assessment.storage), mean(assessment.glass)
    asset = None if assessment.missing is None else int(not assessment.missing)
    feasible = [transition.feasible for transition in assessment.transitions or ()]
    separated = contained(assessment.arrangement, assessment.incompatible)
    ventilate = mean(assessment.ventilation) if isinstance(assessment, Assessment2) else None
    physical, s_chem = _physical(assessment), _chemical_points((flam, incomp, store, glass, ventilate))
    proxy = consistency_proxy(assessment, target, 2 if isinstance(assessment, Assessment2) else 1)
    return LayoutReport(
        layout=layout.id,
        layout_hash=layout.hash,
        protocol=None if target is None else target.id,
        profile=assessment.profile.name,
        version=VERSION,
        obj=len(assessment.arrangement),
        ob=len(assessment.out_of_bounds),
        cn=len(assessment.collisions),
        cn_sw=sum(collision.volume > OVERLAP_VOLUME for collision in assessment.collisions),
        cn_mj=_contact_pairs(assessment.arrangement) if contacts else None,
        asset=asset,
        missing=assessment.missing or (),
        step_nav=sum(feasible) / len(feasible) if feasible else None,
        prot_nav=int(all(feasible)) if feasible else None,
        transitions=len(feasible),
        flam=flam,
        store=store,
        incomp=incomp,
        glass=glass,
        gated=Gated(
            flam=_gate(asset, flam), store=_gate(asset, store), incomp=_gate(asset, incomp), glass=_gate(asset, glass)
        ),
        incomp_contained=worst_mean(penalised(separated, assessment.faulty)),
        store_class=in_own_class(assessment.arrangement),
        instances={
            "flam": len(assessment.flammable),
            "store": len(assessment.storage),
            "incomp": len(assessment.incompatible),
            "glass": len(assessment.glass),
        },
        v=assessment.v,
        fitness=assessment.fitness,
        physical=physical,
        s_phys=physical.total,
        s_chem=s_chem,
        consistency_proxy=proxy,
        total_with_proxy=None if s_chem is None else physical.total + s_chem + proxy.total,
        violations=tuple(ReportedViolation(**asdict(violation)) for violation in assessment.violations.items),
        warnings=assessment.issues
        if isinstance(assessment, Assessment2)
        else facility_issues(assessment.arrangement, assessment.profile),
    )


def aggregate(reports: Iterable[LayoutReport]) -> LayoutSummary:
    """Return the means over layouts by metric; nulls are left out of the means and counted.

    Gated scores are named `gated_flam` and so on, scores of the proxy `proxy_realism` and so on. Under touchstone-v2
    the transitions of all layouts are pooled: `step_nav` and `door_nav` are means over drives, not over layouts.
    """
    names = (*METRICS, *(f"gated_{name}" for name in GATED), *(f"proxy_{name}" for name in PROXY))
    columns: dict[str, list[float | None]] = {name: [] for name in names}
    further: dict[str, list[float | None]] = {name: [] for name in METRICS_2}
    drives: dict[str, list[int]] = {"step_nav": [], "door_nav": []}
    definitions = set()
    for report in reports:  # One at a time: a million reports take gigabytes.
        definitions.add((report.profile, report.version))
        gated, proxy = report.gated, report.consistency_proxy
        values = [getattr(report, name) for name in METRICS]
        values += [getattr(gated, name) for name in GATED] + [getattr(proxy, name) for name in PROXY]
        for column, value in zip(columns.values(), values, strict=True):
            column.append(value)
        if isinstance(report, LayoutReport2):
            drives["step_nav"].append(report.transitions)
            drives["door_nav"].append(report.entries)
            for name, own in further.items():
                own.append(getattr(report, name))
    versions = {version for _, version in definitions}
    pooled = versions == {VERSION_2}
    if pooled:
        columns |= further
    return LayoutSummary(
        layouts=len(columns["obj"]),
        profiles=tuple(sorted({profile for profile, _ in definitions})),
        versions=tuple(sorted(versions)),
        metrics={name: _mean(column, drives.get(name) if pooled else None) for name, column in columns.items()},
    )


def _mean(column: list[float | None], weights: list[int] | None = None) -> MetricMean:
    """Return the mean of the values that are not null; weights have one value for each of the column."""
    values = [value for value in column if value is not None]
    if weights is None:
        mean = math.fsum(values) / len(values) if values else None
    else:
        shares = [(value, weight) for value, weight in zip(column, weights, strict=True) if value is not None]
        total = sum(weight for _, weight in shares)
        mean = math.fsum(value * weight for value, weight in shares) / total if total else None
    return MetricMean(mean=mean, count=len(values), nulls=len(column) - len(values))


def _gate(asset: int | None, value: float | None) -> float | None:
    return None if asset is None or value is None else asset * value


def _chemical_points(scores: tuple[float | None, ...]) -> float | None:
    applicable = [value for value in scores if value is not None]
    return CHEMISTRY_POINTS * sum(applicable) / len(applicable) if applicable else None


def _physical(assessment: Assessment) -> PhysicalScore:
    """Return S_phys: for each of four faults, the share of the relevant objects without it, 1 for no objects."""
    placements = assessment.arrangement.placements
    desktop = {placement.id for placement in placements if placement.support not in (FLOOR, WALL)}
    standing = {placement.id for placement in placements} - desktop
    colliding = frozenset[str]().union(*(collision.ids for collision in assessment.collisions))
    misplaced = {fault.id for fault in assessment.bounds if fault.cause != "height"}
    if isinstance(assessment, Assessment2):
        misplaced |= {front.ids[0] for front in assessment.fronts if front.hard}
    floating = {fault.id for fault in assessment.bounds if fault.cause == "height"}
    return PhysicalScore(
        tabletop_bounds=10.0 * _clean(desktop, misplaced),
        desktop_collisions=10.0 * _clean(desktop, colliding),
        heights=5.0 * _clean(desktop | standing, floating),
        room=10.0 * _clean(standing, misplaced | colliding),
    )


def _clean(relevant: set[str], faulty: AbstractSet[str]) -> float:
    return 1.0 - len(relevant & faulty) / len(relevant) if relevant else 1.0


def _contact_pairs(arrangement: Arrangement) -> int:
    from labgym.scenes.contacts import contacts  # imported here because it loads MuJoCo

    objects = arrangement.index
    return sum(contact.a in objects and contact.b in objects for contact in contacts(arrangement.layout, PENETRATION))
