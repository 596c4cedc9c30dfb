"""Glass screens that stand in a laboratory and are on no map."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from functools import lru_cache
from typing import Any

from labgym.assets import Asset, Catalog
from labgym.assets.model import Shape, Size
from labgym.counts import check_switch
from labgym.envs.checks import finite, positive
from labgym.errors import OptionError
from labgym.layouts import Layout, Placement
from labgym.layouts.placement import WALL

FRAMED, FRAMELESS = "GlassScreenFramed", "GlassScreen"
"""Names of the assets."""
THICKNESS = 0.03
"""Depth of a screen, meters: a sheet of 12 mm and its holders."""
MOST = 32
"""Greatest number of panes of an episode."""
WIDEST, HIGHEST = 3.4, 3.0
"""Greatest sides of a pane, meters."""


@dataclass(frozen=True)
class GlassPane:
    """A glass screen.

    Attributes:
        x, y: its middle in the room frame, meters. yaw: direction of its normal is yaw + 90 degrees, radians.
        width, height: meters. framed: whether a metal frame surrounds the glass.
    """

    x: float
    y: float
    yaw: float
    width: float = 1.2
    height: float = 2.0
    framed: bool = False

    def __post_init__(self) -> None:
        finite(self, "x", "y", "yaw")
        positive(self, "width", "height")
        if self.width > WIDEST or self.height > HIGHEST:
            raise OptionError(f"pane is {self.width:g} x {self.height:g} m, at most {WIDEST:g} x {HIGHEST:g} m")
        check_switch("pane: framed", self.framed)


def panes_of(value: Any) -> tuple[GlassPane, ...]:
    """Return panes from mappings of their fields.

    Raises:
        OptionError: something else, too many of them, or a value out of range.
    """
    if isinstance(value, str | Mapping) or not isinstance(value, Sequence) or len(value) > MOST:
        raise OptionError(f"panes are {str(value)[:60]!r}, expected a list of at most {MOST} mappings")
    names = {each.name for each in fields(GlassPane)}
    for each in value:
        complete = isinstance(each, Mapping) and {"x", "y", "yaw"} <= set(each) <= names
        if not complete and not isinstance(each, GlassPane):
            raise OptionError(f"pane is {str(each)[:60]!r}, expected a mapping of {', '.join(sorted(names))}")
    return tuple(each if isinstance(each, GlassPane) else GlassPane(**each) for each in value)


def plain(panes: Sequence[GlassPane]) -> list[dict[str, Any]]:
    """Return panes as plain data."""
    return [asdict(pane) for pane in panes]


def with_panes(layout: Layout, panes: Sequence[GlassPane]) -> Layout:
    """Return a layout in which panes stand."""
    if not panes:
        return layout
    first = 1 + sum(placement.asset in (FRAMED, FRAMELESS) for placement in layout.placements)
    added = tuple(
        Placement(
            id=f"{_asset(pane)}_{number}",
            asset=_asset(pane),
            position=(pane.x, pane.y, 0.0),
            yaw=math.remainder(pane.yaw, 2.0 * math.pi),
            support=WALL,
            size=Size(width=pane.width, depth=THICKNESS, height=pane.height),
        )
        for number, pane in enumerate(panes, first)
    )
    return layout.replace(placements=(*layout.placements, *added), catalog=_with_glass(layout.catalog))


def _asset(pane: GlassPane) -> str:
    return FRAMED if pane.framed else FRAMELESS


@lru_cache(maxsize=8)
def _with_glass(catalog: Catalog) -> Catalog:
    """Return a catalog with the glass screens."""
    return catalog if FRAMELESS in catalog else Catalog((*catalog.assets, *_screens()))


def _screens() -> tuple[Asset, ...]:
    return tuple(
        Asset(
            name=name,
            kind="facility",
            category="building",
            subtype="screen",
            description="Sheet of glass that stands upright.",
            caption="Divides a laboratory.",
            size=Size(width=1.2, depth=THICKNESS, height=2.0),
            mass=60.0,
            placing="wall",
            shape=Shape(name="glass_screen", parameters={"frame": framed}),
        )
        for name, framed in ((FRAMED, True), (FRAMELESS, False))
    )
