"""Optional pieces: how many of them one laboratory has at most."""

from __future__ import annotations

from collections.abc import Iterator

from labgym.layouts.rules.earlier import kinds
from labgym.layouts.rules.rule import Breach, FacilityRule
from labgym.layouts.rules.site import Site

OPTIONAL_PIECES: dict[str, int] = {
    "IceMachine": 1,
    "UltraLowFreezer": 1,
    "NoticeBoard": 1,
    "Whiteboard": 2,
    "Clock": 4,
    "WaterPurifier": 2,
    "DryingRack": 2,
    "LabRefrigerator": 2,
}
"""Greatest number of optional pieces by role in one laboratory, which is the whole floor (assumption)."""


def surplus(site: Site) -> dict[str, tuple[str, ...]]:
    """Return the optional pieces beyond their greatest number: the last placements of each role."""
    placed: dict[str, list[str]] = {}
    for placement, asset in zip(site.arrangement.placements, site.arrangement.assets, strict=True):
        if asset.role in OPTIONAL_PIECES:
            placed.setdefault(asset.role, []).append(placement.id)
    return {
        role: tuple(own[OPTIONAL_PIECES[role] :]) for role, own in placed.items() if len(own) > OPTIONAL_PIECES[role]
    }


def _check(site: Site) -> Iterator[Breach]:
    for role, extra in surplus(site).items():
        limit = OPTIONAL_PIECES[role]
        message = f"{limit + len(extra)} {role} in one laboratory, at most {limit} are useful"
        yield Breach(extra, float(limit + len(extra)), float(limit), message, f"remove {', '.join(extra)}")


OPTIONAL = FacilityRule(
    name="optional_pieces",
    requires="Optional pieces are shared: one ice machine for a laboratory, not one for each room",
    limit="by role (`OPTIONAL_PIECES`)",
    source="planning practice (assumption)",
    severity="warning",
    count=lambda site: len({asset.role for asset in site.arrangement.assets} & OPTIONAL_PIECES.keys()),
    check=_check,
    looks_at=kinds,
)
RULES = (OPTIONAL,)
