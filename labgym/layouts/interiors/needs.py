"""The furniture that a floor must hold: what protocols, safety and habit require, with its contents."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from labgym.errors import InfeasibleError
from labgym.layouts.brief import Content, Proximity, Separation, Unit
from labgym.layouts.interiors.distances import dry_separations, handling_distances, proximities_of, separations_of
from labgym.layouts.interiors.filling import Names
from labgym.layouts.interiors.refusals import check_holdings
from labgym.layouts.interiors.safeguards import marked
from labgym.layouts.interiors.surfaces import stock_surfaces
from labgym.layouts.pieces import WallPiece, further_pieces, pieces, supplied_with, unit_of, with_fixed
from labgym.layouts.request import Request
from labgym.layouts.stocking import Cabinet, plan_cabinets

EXTRA_BENCHES = 6
"""Most benches that are added because the instruments do not fit on the others."""
EXTRA_HOODS = 3
"""Most hoods that are added because the apparatus of several protocols does not fit in the others."""
SECOND_HOOD = "FumeHood1200"
BENCHES = ("LabBench1800", "LabBench", "LabBench1200")
GROUPS = ("separations", "front clearance")
"""Groups of constraints that can be lifted."""


@dataclass(frozen=True)
class Needs:
    """The furniture that a floor must hold.

    Attributes:
        required: units in the order in which they are placed in the layout. further: pieces for more than that.
        contents: what each required unit holds.
        separations: distances that units must keep. wished, proximities: those that they keep if a plan is found.
    """

    required: tuple[Unit, ...]
    further: tuple[Unit, ...]
    contents: Mapping[str, tuple[Content, ...]]
    separations: tuple[Separation, ...]
    wished: tuple[Separation, ...] = ()
    proximities: tuple[Proximity, ...] = ()


def needs_of(request: Request, generator: np.random.Generator, hoods: int = EXTRA_HOODS) -> Needs:
    """Return the furniture that protocols, safety and habit require, and its contents.

    Args:
        hoods: most hoods that are added because the apparatus does not fit in the others.

    Raises:
        InfeasibleError: something fits on no surface or shelf.
    """
    cabinets = _cabinets(request)
    units = [unit_of(request, piece) for piece in pieces(request, cabinets, "required")]
    units = with_fixed(request, units)
    contents = _stocked(request, cabinets, units, hoods if request.holdings is None else 0, generator)
    check_holdings(request, units, contents)
    further = [unit_of(request, piece) for level in ("reduced", "full") for piece in further_pieces(request, level)]
    present = {unit.id for unit in units}
    if request.holdings is not None:
        further = [unit for unit in further if request.holdings.adds(unit.asset.name, (u.asset.name for u in units))]
    handling = handling_distances(request, units, contents)
    required = marked(request, [supplied_with(unit, contents.get(unit.id, ())) for unit in units], contents)
    separations = (*separations_of(cabinets, contents, request.profile), *handling.least, *dry_separations(required))
    return Needs(
        required=required,
        further=tuple(unit for unit in further if unit.id not in present),
        contents=contents,
        separations=separations,
        wished=handling.wished,
        proximities=proximities_of(request, units),
    )


def relaxed(needs: Needs, lifted: frozenset[str]) -> Needs:
    """Return the furniture without some groups of constraints."""
    if "separations" in lifted:
        needs = replace(needs, separations=(), wished=(), proximities=())
    if "front clearance" in lifted:
        needs = replace(needs, required=tuple(replace(unit, front=0.0) for unit in needs.required))
    return needs


def separations_on(request: Request) -> tuple[Separation, ...]:
    """Return the distances that the required furniture of a request must keep.

    Raises:
        InfeasibleError: something fits on no surface or shelf.
    """
    return needs_of(request, np.random.default_rng(request.seed)).separations


def _cabinets(request: Request) -> tuple[Cabinet, ...]:
    """Return the cabinets with the variants of the floor; fixed ones stay what they are."""
    fixed = {placement.id for placement in request.fixed}
    return tuple(
        cabinet if cabinet.id in fixed else replace(cabinet, asset=request.furniture.instead(cabinet.asset))
        for cabinet in plan_cabinets(request)
    )


def _stocked(
    request: Request, cabinets: Sequence[Cabinet], units: list[Unit], hoods: int, generator: np.random.Generator
) -> dict[str, tuple[Content, ...]]:
    """Return the contents of each unit; add hoods and benches to the units as long as instruments have no place.

    Args:
        hoods: most hoods that are added.

    Raises:
        InfeasibleError: something fits on no surface or shelf.
    """
    benches = 0
    while True:
        surfaces = stock_surfaces(request, cabinets, units, generator)
        if surfaces.unhooded and hoods:
            hoods -= 1
            units.append(unit_of(request, _further_hood(request, units)))
            continue
        if not surfaces.homeless:
            return surfaces.contents
        if benches == EXTRA_BENCHES:
            names = ", ".join(surfaces.homeless)
            raise InfeasibleError(request.protocol.id, [f"no work surface has space for {names}"], None)
        benches += 1
        asset = request.catalog.get(_bench(request, units))
        name = Names({unit.id for unit in units}).next(asset)
        units.append(unit_of(request, WallPiece(name, asset, "surface for instruments")))


def _further_hood(request: Request, units: Sequence[Unit]) -> WallPiece:
    """Return one more hood: a small one if it is the second, else one like the first."""
    number = sum(unit.asset.fume_hood for unit in units)
    asset = request.catalog.get(SECOND_HOOD if number == 1 else request.habits.default_home)
    return WallPiece(Names({unit.id for unit in units}).next(asset), asset, "hood for further apparatus")


def _bench(request: Request, units: Sequence[Unit]) -> str:
    """Return the bench for more instruments: the first of the usual ones that exists, else the first."""
    existing = {} if request.holdings is None else request.holdings.left(unit.asset.name for unit in units)
    return next((name for name in BENCHES if name in existing), BENCHES[0])
