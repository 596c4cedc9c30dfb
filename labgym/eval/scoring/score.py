"""LabTouchstone for layouts: all metrics of one layout, and means over many."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import asdict
from pathlib import Path

from labgym.eval.scoring.consistency import consistency_proxy
from labgym.eval.scoring.layout_report import (
    COLUMNS,
    Gated,
    LayoutReport,
    LayoutSummary,
    MetricMean,
    PhysicalScore,
    ReportedViolation,
)
from labgym.layouts.model import Layout
from labgym.layouts.placement import FLOOR, WALL
from labgym.layouts.rules.arrangement import Arrangement
from labgym.layouts.rules.objective import Assessment, evaluate_layout
from labgym.layouts.rules.rule import penalised, worst_mean
from labgym.layouts.rules.rule_sets import PAPER, TOUCHSTONE, RuleSet, rule_set
from labgym.layouts.rules.separation import contained
from labgym.layouts.rules.storage import in_own_class
from labgym.layouts.rules.thresholds import OVERLAP_VOLUME, PENETRATION, Profile
from labgym.navigation import resolve_protocol
from labgym.navigation.feasibility import Transition
from labgym.protocols import Protocol

CHEMISTRY_POINTS = 35.0
"""Points of S_chem, in equal shares of the scores that apply."""

GATED = ("flam", "store", "incomp", "glass")
PROXY = ("realism", "layout", "completeness", "total")


def score(
    layout: Layout,
    protocol: Protocol | str | Path | None = None,
    rules: str | RuleSet = TOUCHSTONE,
    profile: str | Profile | None = None,
    contacts: bool = True,
) -> LayoutReport:
    """Return the LabTouchstone metrics of a layout.

    Args:
        layout: the layout.
        protocol: a protocol, its id or its .json file; by default the layout's first, if it has one.
        rules: rule set or its name: `touchstone`, or `paper`, the definitions of the paper's columns.
        profile: thresholds or their name; by default those of the rule set.
        contacts: whether to compile the scene and count contacts in MuJoCo (`cn_mj`).

    Raises:
        UnknownNameError: the protocol, the rule set or the profile does not exist.
        DocumentError: the layout names an asset or a support that does not exist, or is inconsistent.
    """
    layout.check_references()
    target = layout.protocol if protocol is None else resolve_protocol(layout, protocol)
    return _report(evaluate_layout(layout, target, rule_set(rules, profile), navigation=True), contacts)


def _report(assessment: Assessment, contacts: bool) -> LayoutReport:
    layout, target, rules = assessment.arrangement.layout, assessment.protocol, assessment.rules
    scores = {term.metric: term.score(assessment.of(term.name)) for term in rules.terms}
    shares = {rule.metric: _feasible(assessment.drives_of(rule.name)) for rule in rules.drives}
    asset = None if assessment.missing is None else int(not assessment.lacking)
    physical = _physical(assessment)
    s_chem = _chemical_points([scores[term.metric] for term in rules.terms if term.chemical])
    proxy = consistency_proxy(assessment)
    separated = contained(assessment.arrangement, assessment.of("incompatible"))
    figures = {name: value for measure in rules.figures for name, value in measure(assessment).items()}
    return LayoutReport(
        layout=layout.id,
        layout_hash=layout.hash,
        protocol=None if target is None else target.id,
        rules=rules.name,
        profile=rules.profile.name,
        obj=len(assessment.arrangement),
        ob=len(assessment.out_of_bounds),
        cn=len(assessment.collisions),
        cn_sw=sum(collision.volume > OVERLAP_VOLUME for collision in assessment.collisions),
        cn_mj=_contact_pairs(assessment.arrangement) if contacts else None,
        asset=asset,
        missing=assessment.lacking,
        prot_nav=int(all(drive.feasible for drive in assessment.drives)) if assessment.drives else None,
        gated=Gated(**{name: _gate(asset, scores.get(name)) for name in GATED}),
        incomp_contained=worst_mean(penalised(separated, assessment.faulty)),
        store_class=in_own_class(assessment.arrangement),
        instances={term.metric: len(assessment.of(term.name)) for term in rules.terms},
        v=assessment.v,
        fitness=assessment.fitness,
        physical=physical,
        s_phys=physical.total,
        s_chem=s_chem,
        consistency_proxy=proxy,
        total_with_proxy=None if s_chem is None else physical.total + s_chem + proxy.total,
        violations=tuple(ReportedViolation(**asdict(violation)) for violation in assessment.violations.items),
        warnings=assessment.issues,
        **{**scores, **shares, **{rule.name: len(assessment.drives_of(rule.name)) for rule in rules.drives}, **figures},
    )


def aggregate(reports: Iterable[LayoutReport]) -> LayoutSummary:
    """Return the means over layouts by metric; nulls are left out of the means and counted.

    Gated scores are named `gated_flam` and so on, scores of the proxy `proxy_realism` and so on. Shares of drives are
    means over layouts under the rule set `paper`; under others the drives of all layouts are pooled.
    """
    names = (*COLUMNS, *(f"gated_{name}" for name in GATED), *(f"proxy_{name}" for name in PROXY))
    columns: dict[str, list[float | None]] = {name: [] for name in names}
    drives: dict[str, list[int]] = {name: [] for name, column in COLUMNS.items() if column.pooled_by}
    definitions = set()
    for report in reports:  # One at a time: a million reports take gigabytes.
        definitions.add((report.profile, report.rules))
        gated, proxy = report.gated, report.consistency_proxy
        values = [getattr(report, name) for name in COLUMNS]
        values += [getattr(gated, name) for name in GATED] + [getattr(proxy, name) for name in PROXY]
        for column, value in zip(columns.values(), values, strict=True):
            column.append(value)
        for name, counts in drives.items():
            counts.append(getattr(report, COLUMNS[name].pooled_by))
    rules = {name for _, name in definitions}
    pooled = PAPER.name not in rules
    return LayoutSummary(
        layouts=len(columns["obj"]),
        rules=tuple(sorted(rules)),
        profiles=tuple(sorted({profile for profile, _ in definitions})),
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


def _feasible(drives: Sequence[Transition]) -> float | None:
    return sum(drive.feasible for drive in drives) / len(drives) if drives else None


def _gate(asset: int | None, value: float | None) -> float | None:
    return None if asset is None or value is None else asset * value


def _chemical_points(scores: Iterable[float | None]) -> float | None:
    applicable = [value for value in scores if value is not None]
    return CHEMISTRY_POINTS * sum(applicable) / len(applicable) if applicable else None


def _physical(assessment: Assessment) -> PhysicalScore:
    """Return S_phys: for each of four faults, the share of the relevant objects without it, 1 for no objects."""
    placements = assessment.arrangement.placements
    desktop = {placement.id for placement in placements if placement.support not in (FLOOR, WALL)}
    standing = {placement.id for placement in placements} - desktop
    colliding = frozenset[str]().union(*(collision.ids for collision in assessment.collisions))
    misplaced = {fault.id for fault in assessment.bounds if fault.cause != "height"}
    misplaced |= assessment.blocked
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
