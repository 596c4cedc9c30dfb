"""Exit signs: on floors of several spaces each door that leads out has one; a sign elsewhere misleads."""

from __future__ import annotations

import math
from collections.abc import Iterator

from labgym.geometry import OrientedBox
from labgym.layouts.rules.building import Entrance
from labgym.layouts.rules.earlier import standing
from labgym.layouts.rules.rule import Breach, FacilityRule
from labgym.layouts.rules.site import Site

EXIT_SIGN = "ExitSign"
ABOVE_M = 2.03
"""Greatest height of a sign's bottom over the top of its exit, meters (NFPA 101, 7.10.1.9: 6 ft 8 in)."""
OFF_WALL_M = 0.3
"""Greatest distance of a sign from the face of the wall, meters: it hangs on that wall."""


def marks(sign: OrientedBox, way_out: Entrance) -> bool:
    """Return whether a sign marks an exit: on its wall, no farther aside than the exit is wide (NFPA 101, 7.10.1.9)."""
    opening = way_out.opening
    across, ahead = opening.to_local(sign.x, sign.y)
    aside, above = abs(across) - (way_out.width + sign.width) / 2.0, sign.z0 - opening.z1
    faces = math.cos(sign.yaw - opening.yaw) > math.cos(math.pi / 4.0)
    return faces and aside <= way_out.width + 1e-6 and abs(ahead) <= OFF_WALL_M and above <= ABOVE_M


def exits_to_mark(site: Site) -> list[Entrance]:
    """Return the exits that need a sign; none in a laboratory of one space without signs, all of which is in sight."""
    several = len(site.arrangement.layout.floor.spaces) > 1
    needed = several or bool(site.arrangement.by_role.get(EXIT_SIGN))
    return [way for way in site.arrangement.building.entrances if way.exit] if needed else []


def unmarked_exits(site: Site) -> list[Entrance]:
    """Return the exits that need a sign and have none."""
    signs = [site.arrangement.box(row) for row in site.arrangement.by_role.get(EXIT_SIGN, ())]
    return [way for way in exits_to_mark(site) if not any(marks(sign, way) for sign in signs)]


def stray_signs(site: Site) -> list[str]:
    """Return the ids of the exit signs that mark no exit."""
    exits, arrangement = exits_to_mark(site), site.arrangement
    rows = arrangement.by_role.get(EXIT_SIGN, ())
    return [
        arrangement.placements[row].id for row in rows if not any(marks(arrangement.box(row), one) for one in exits)
    ]


def _check(site: Site) -> Iterator[Breach]:
    for way in unmarked_exits(site):
        message = f"{way.label} has no sign over it or within its width of {way.width:.2f} m"
        yield Breach((), 0.0, 1.0, message, f"hang an {EXIT_SIGN} over it")
    for sign in stray_signs(site):
        yield Breach((sign,), None, 0.0, f"{sign} marks no exit and misleads", "hang it over an exit, or remove it")


EXIT_SIGNS = FacilityRule(
    name="exit_sign",
    requires="On a floor of several spaces, each exit is marked by a sign; no sign hangs elsewhere",
    limit=f"the width of the exit to its side, {ABOVE_M:g} m above it",
    source="OSHA 29 CFR 1910.37(b)(2) and (b)(5); NFPA 101, 7.10.1.2 and 7.10.1.9",
    count=lambda site: len(exits_to_mark(site)),
    check=_check,
    looks_at=lambda site, row: standing(site, row) if site.arrangement.assets[row].role == EXIT_SIGN else None,
)
RULES = (EXIT_SIGNS,)
