"""Corrosives: liquid acids and bases stand below eye level."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from labgym.layouts.rules.arrangement import Arrangement
from labgym.layouts.rules.earlier import reagents
from labgym.layouts.rules.rule import Breach, FacilityRule
from labgym.layouts.rules.thresholds import CORROSIVE_HEIGHT

if TYPE_CHECKING:
    from labgym.layouts.rules.site import Site


def corrosive_liquids(arrangement: Arrangement) -> list[int]:
    """Return the rows of the liquid acids and bases."""
    assets = arrangement.assets
    return [row for row in arrangement.reagents if assets[row].hazards.corrosive and assets[row].phase == "liquid"]


def _check(site: Site) -> Iterator[Breach]:
    for row in corrosive_liquids(site.arrangement):
        bottom = float(site.arrangement.boxes.z[row, 0])
        if bottom > CORROSIVE_HEIGHT:
            reagent = site.arrangement.placements[row].id
            message = f"corrosive {reagent} stands at {bottom:.2f} m, above {CORROSIVE_HEIGHT} m"
            yield Breach((reagent,), bottom, CORROSIVE_HEIGHT, message, "use a lower shelf")


RULES = (
    FacilityRule(
        name="corrosive_height",
        requires="Liquid acids and bases stand below eye level",
        limit=f"{CORROSIVE_HEIGHT:g} m to the bottom",
        source="university chemical storage practice",
        severity="warning",
        count=lambda site: len(corrosive_liquids(site.arrangement)),
        check=_check,
        group="placing",
        looks_at=reagents,
    ),
)
