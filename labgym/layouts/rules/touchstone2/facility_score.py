"""The score of the facility rules, and the rules of them that are hard."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from labgym.layouts.placement import FLOOR
from labgym.layouts.rules.arrangement import Arrangement
from labgym.layouts.rules.facility import FacilityIssue
from labgym.layouts.rules.facility.backs import one_sided
from labgym.layouts.rules.safety.rules import RULES
from labgym.layouts.rules.safety.site import Site
from labgym.layouts.rules.supplies import SOURCES, Supplies, supplies_of

HARD = frozenset({"egress", "door_area", "shower_clear", "no_exit"})
"""Facility rules that count in v(L): ways out, door areas, the shower's clear space. A missing second exit counts where
the profile makes it an error, and so do the safety rules of severity `error`."""

SAFETY = frozenset(rule.name for rule in RULES)
"""Names of the safety rules."""


def is_hard(issue: FacilityIssue) -> bool:
    """Return whether an issue counts in v(L) of touchstone-v2."""
    return issue.rule in HARD or (issue.severity == "error" and issue.rule in ("second_exit", *SAFETY))


@dataclass(frozen=True)
class FacilityScore:
    """How well a layout meets the facility rules.

    Attributes:
        rules: share of objects without an issue by rule, in [0, 1]; only rules that apply to something.
    """

    rules: Mapping[str, float]

    @property
    def total(self) -> float | None:
        """Mean over the rules that apply, None if none does."""
        return sum(self.rules.values()) / len(self.rules) if self.rules else None


def facility_score(site: Site, issues: tuple[FacilityIssue, ...]) -> FacilityScore:
    """Return the share of the objects that a rule applies to and that keep it, for each facility rule.

    Objects are doors, exits, rooms, pieces of furniture, hoods, showers or reagents, by the rule. Several issues of one
    object count once: the object is the first id of an issue, or, of a rule about doors and rooms, the issue itself.
    """
    shares = {}
    for rule, count in applicable(site).items():
        if count:
            own = [issue for issue in issues if issue.rule == rule and _counts(issue)]
            broken = len({issue.ids[:1] or issue.message for issue in own}) if rule in BY_OBJECT | SAFETY else len(own)
            shares[rule] = 1.0 - min(broken / count, 1.0)
    return FacilityScore(shares)


def _counts(issue: FacilityIssue) -> bool:
    """Whether an issue concerns one of the objects that are counted: not the front of a movable object."""
    return issue.rule != "front_clearance" or issue.severity == "error"


BY_OBJECT = frozenset(
    {
        "back_to_wall", "front_clearance", "shower_clear", "supply", "hood_door", "hood_opposite_desk",
    }
)  # fmt: skip
"""Facility rules whose issues name the object first; the others are about doors, exits, keep-outs and rooms."""


def applicable(site: Site) -> dict[str, int]:
    """Return the number of objects that each facility rule and each safety rule applies to."""
    arrangement, building = site.arrangement, site.arrangement.building
    on_floor = [row for row, placement in enumerate(arrangement.placements) if placement.support == FLOOR]
    hooded = len(arrangement.hoods)
    return {
        "egress": sum(entrance.exit for entrance in building.entrances),
        "door_area": len(building.entrances),
        "keep_out": len(arrangement.layout.floor.keep_outs),
        "front_clearance": len(arrangement.workplaces),
        "back_to_wall": sum(one_sided(arrangement, row) for row in on_floor),
        "shower_clear": len(arrangement.showers),
        "supply": _supplied(arrangement, on_floor),
        "no_exit": len(building.workplaces),
        "second_exit": len(building.workplaces),
        "exit_width": len({(entrance.label, entrance.width) for entrance in building.entrances}),
        "hood_door": hooded,
        "hood_opposite_desk": hooded,
        **{rule.name: rule.count(site) for rule in RULES},
    }


def _supplied(arrangement: Arrangement, rows: list[int]) -> int:
    """Number of pieces that need a service of which the floor has points."""
    floor = arrangement.layout.floor
    if not floor.services:
        return 0
    described = Supplies.of(floor, floor.spaces[0]).described
    return sum(
        any(kind in described and kind in SOURCES for kind in supplies_of(arrangement.assets[row])) for row in rows
    )
