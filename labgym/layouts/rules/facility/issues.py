"""Issues of a layout by group: placing, equipment, and all of them."""

from __future__ import annotations

from labgym.layouts.rules.arrangement import Arrangement
from labgym.layouts.rules.facility.backs import back_issues
from labgym.layouts.rules.facility.corrosives import corrosive_issues
from labgym.layouts.rules.facility.exits import building_exit_issues, egress_issues
from labgym.layouts.rules.facility.fronts import front_issues
from labgym.layouts.rules.facility.hoods import hood_issues
from labgym.layouts.rules.facility.issue import FacilityIssue
from labgym.layouts.rules.facility.kept_clear import door_area_issues, keep_out_issues
from labgym.layouts.rules.facility.services import supply_issues
from labgym.layouts.rules.facility.showers import shower_space_issues, shower_walk_issues
from labgym.layouts.rules.thresholds import Profile


def facility_issues(arrangement: Arrangement, profile: Profile) -> tuple[FacilityIssue, ...]:
    """Return every facility rule that a layout breaks."""
    return (
        *building_exit_issues(arrangement.building, profile),
        *placing_issues(arrangement),
        *egress_issues(arrangement),
        *equipment_issues(arrangement),
    )


def placing_issues(arrangement: Arrangement) -> list[FacilityIssue]:
    """Return the issues of placing.

    They are blocked door areas, keep-outs and fronts, furniture off walls, a crowded shower, and furniture beyond the
    reach of a service.
    """
    return [
        *door_area_issues(arrangement),
        *keep_out_issues(arrangement),
        *back_issues(arrangement),
        *front_issues(arrangement),
        *shower_space_issues(arrangement),
        *supply_issues(arrangement),
    ]


def equipment_issues(arrangement: Arrangement) -> list[FacilityIssue]:
    """Return the issues of hoods, emergency showers and corrosives: all of them warnings."""
    return [*hood_issues(arrangement), *shower_walk_issues(arrangement), *corrosive_issues(arrangement)]
