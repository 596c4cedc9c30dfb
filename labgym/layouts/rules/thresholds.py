"""Every threshold of the layout rules and its source; a report names the profile that it used."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

from labgym.errors import check_name
from labgym.layouts.floor.fields import CALIFORNIA, NFPA_45

Severity = Literal["warning", "error"]

ROOM_TOLERANCE = 0.010
"""A footprint may reach this far beyond the room's interior, meters: skirting and plaster tolerances."""

SURFACE_TOLERANCE = 0.005
"""A footprint may hang this far over its support's surface, meters."""

HEIGHT_TOLERANCE = 0.005
"""A bottom may be this far above or below what carries it, meters."""

WALL_TOLERANCE = 0.020
"""The back of a wall-mounted object may be this far from the wall, meters: the depth of its brackets."""

CONTAINMENT_TOLERANCE = 0.001
"""A stored reagent may reach this far into the cabinet's wall without being a collision, meters."""

PENETRATION = 0.001
"""Two solids collide when they overlap by more than this on every axis, meters."""

OVERLAP_VOLUME = 1e-4
"""Additional minimum volume of SceneWeaver's collision count, cubic meters."""

WORST = 3
"""Separation scores are the mean of this many worst instances (LabBuilder, LabTouchstone appendix, metrics 1 and 3)."""


CORROSIVE_HEIGHT = 1.5
"""Corrosive liquids stand below eye level, meters (university chemical storage practice)."""


EGRESS_WIDTH = 0.90
"""Clear width of a way out, meters (OSHA 1910.36(g)(2) and NFPA 101 ask 0.71 to 0.91 m; 0.90 m is an assumption)."""

PROTRUSION = 0.10
"""An object on a wall may protrude this far into a way, meters (4 in: ADA 307.2, IBC 1003.3.3)."""

LOOSE = frozenset({"seat", "trolley", "carton", "drum", "floor_sign"})
"""Subtypes of floor objects that people push aside to use furniture: they obstruct door areas, but no fronts."""

MOVABLE = LOOSE | {"container", "spill", "fire"}
"""Subtypes of floor objects that a person pushes aside or picks up: loose objects, bins, spill kits, extinguishers."""

SHOWER_RADIUS = 0.41
"""Radius that stays clear around the center of an emergency shower, meters (16 in: ANSI/ISEA Z358.1-2014, 4.1.4)."""

WATER_REACH = 2.44
"""Distance of a sink from a water point with its drain, meters: a trap arm of 2 in with a slope of 1:48 is at most 8 ft
long (IPC 704.1 and table 909.1; UPC table 1002.2 allows 1.52 m)."""

GAS_REACH = 1.83
"""Distance of a burner or a gas cylinder from a gas point, meters: connectors have at most 6 ft (IFGC 411.1.3.1)."""

EXHAUST_REACH = 3.0
"""Distance of a fume hood from an exhaust point, meters (assumption: one offset of the duct below the ceiling)."""

ONE_SIDED = 1.2
"""Furniture from this depth on is used from both sides, meters; shallower pieces have their back against a wall."""

BACK_GAP = 0.15
"""Greatest distance between a wall and the back of furniture that stands against it, meters: space for pipes."""


@dataclass(frozen=True)
class Band:
    """A separation rule: satisfaction is 1 from `d_min` on and 0 below `d_low`, meters."""

    d_min: float
    d_low: float

    def satisfaction(self, distance: float) -> float:
        """Map a surface-to-surface distance in meters to [0, 1] (LabTouchstone appendix, metric 1)."""
        if distance >= self.d_min:
            return 1.0
        return distance / self.d_min if distance >= self.d_low else 0.0


@dataclass(frozen=True)
class Profile:
    """The thresholds that the paper leaves open.

    Attributes:
        heat: flammable reagent to a hot surface, bath or oven.
        flame: flammable reagent to an open flame.
        incompatible: two incompatible reagents.
        glass: distance to the edge at which glassware is safe (D_safe), meters.
        pairs: rule set that says which reagents are incompatible, see `labgym.assets.incompatible`.
        second_exit: severity of a missing second exit; a layout with an error is not generated.
        second_exit_area: largest laboratory with one exit, square meters.
        second_exit_source: where that limit comes from.
    """

    name: str
    heat: Band
    flame: Band
    incompatible: Band
    glass: float
    pairs: Literal["segregation", "boolean"]
    second_exit: Severity = "warning"
    second_exit_area: float = NFPA_45
    second_exit_source: str = "NFPA 45, class B"


DEFAULT = Profile(
    name="default",
    # Fire-code practice keeps combustibles 0.91 m (36 in) from heating appliances; rounded up.
    heat=Band(d_min=1.0, d_low=0.3),
    # Laboratory practice: 3.05 m (10 ft) from ignition sources; New York City laboratories: 0.61 m (2 ft) at least.
    flame=Band(d_min=3.0, d_low=0.6),
    # Separate benches. IFC 5003.9.8 asks 6.1 m or a partition, small containers exempt.
    incompatible=Band(d_min=1.0, d_low=0.3),
    # Prudent Practices: apparatus 0.15 m (6 in) behind the plane of a hood's sash.
    glass=0.15,
    pairs="segregation",
)
STRICT = replace(
    DEFAULT,
    name="strict",
    # Every heat source counts as the ignition source of the 3.05 m (10 ft) rule; at least 0.91 m, rounded up.
    heat=Band(d_min=3.0, d_low=1.0),
    flame=Band(d_min=3.0, d_low=1.0),
    # The upper end of the 0.15-0.20 m that hood guides give.
    glass=0.20,
)
# LabBuilder prints no thresholds: the closest guess, from its scores and its boolean hazard flags.
PAPER = replace(
    DEFAULT,
    name="paper",
    # One bench module apart.
    incompatible=Band(d_min=0.5, d_low=0.15),
    glass=0.30,
    pairs="boolean",
)
CODE = replace(
    DEFAULT,
    name="code",
    # Stricter than the default, whose limit is also that of the families of floors.
    second_exit="error",
    second_exit_area=CALIFORNIA,
    second_exit_source="24 CCR",
)
PROFILES = {one.name: one for one in (DEFAULT, STRICT, PAPER, CODE)}


def profile(name: str | Profile) -> Profile:
    """Return the thresholds of that name; a `Profile` is returned unchanged.

    Raises:
        UnknownNameError: no profile has that name.
    """
    if isinstance(name, Profile):
        return name
    check_name("profile", name, PROFILES)
    return PROFILES[name]
