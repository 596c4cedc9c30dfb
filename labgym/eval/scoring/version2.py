"""The report of a layout under touchstone-v2."""

from __future__ import annotations

from collections.abc import Sequence

from labgym.eval.scoring.layout_report import LayoutReport, LayoutReport2
from labgym.layouts.rules.regulations import REGULATIONS, rulings
from labgym.layouts.rules.satisfaction import mean
from labgym.layouts.rules.thresholds import VERSION_2
from labgym.layouts.rules.touchstone2.assessment import Assessment2
from labgym.navigation.feasibility import Transition

METRICS_2 = (
    "door_nav", "fronts", "near", "ventilate", "safety", "facility", "hard_facility", "walk", "between_steps",
    "fetching", "trips", "reach",
)  # fmt: skip
"""Fields that `aggregate` averages in addition to those of version 1."""

HEADLINE = (
    "ob", "cn", "asset", "step_nav", "prot_nav", "door_nav", "flam", "store", "incomp", "glass", "fronts", "near",
    "ventilate", "safety", "facility", "reach", "v", "fitness", "s_phys", "s_chem",
)  # fmt: skip
"""The headline figures of touchstone-v2; every way to spoil a layout lowers one of them, or raises OB, CN or v."""


def version_2(report: LayoutReport, assessment: Assessment2) -> LayoutReport2:
    """Return the report under touchstone-v2.

    Args:
        report: the fields of version 1, from this assessment.
        assessment: the assessment under touchstone-v2.
    """
    entries, moves = assessment.entries or (), assessment.transitions or ()
    drives = (*moves, *entries)
    equipment, walk = assessment.equipment, assessment.workflow
    absent = (*report.missing, *assessment.unequipped)
    return LayoutReport2(
        **{
            **dict(report),
            "version": VERSION_2,
            "asset": None if report.asset is None else int(not absent),
            "missing": absent,
            "prot_nav": int(all(drive.feasible for drive in drives)) if drives else None,
            "door_nav": _feasible(entries),
            "entries": len(entries),
            "fronts": mean(assessment.fronts),
            "near": mean(assessment.near),
            "ventilate": mean(assessment.ventilation),
            "safety": 1.0 - len(assessment.unequipped) / len(equipment) if equipment else None,
            "facility": assessment.facility.total,
            "facility_rules": dict(assessment.facility.rules),
            "hard_facility": len(assessment.violations.of("facility")),
            "walk": None if walk is None else walk.length,
            "between_steps": None if walk is None else walk.between,
            "fetching": None if walk is None else walk.fetching,
            "trips": None if walk is None else walk.trips,
            "reach": assessment.reach,
            "out_of_reach": tuple(item.item for item in assessment.reaches if not item.reached),
            "regulations": {name: rulings(assessment.arrangement, name, assessment.premises) for name in REGULATIONS},
        }
    )


def _feasible(drives: Sequence[Transition]) -> float | None:
    return sum(drive.feasible for drive in drives) / len(drives) if drives else None
