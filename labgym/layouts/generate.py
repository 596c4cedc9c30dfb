"""LabGen in one call: protocol and seed to a layout that passes its own checks."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Sequence
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np

import labgym
from labgym.assets import Catalog
from labgym.errors import InfeasibleError, OptionError, SearchLimitWarning
from labgym.layouts.clutter import add_clutter, check_level
from labgym.layouts.combination import combination
from labgym.layouts.dressing import dress
from labgym.layouts.floor import Floor
from labgym.layouts.habits import Habits
from labgym.layouts.holdings import Holdings
from labgym.layouts.infeasibility import smallest_preset
from labgym.layouts.interiors import FloorProposer
from labgym.layouts.model import FLOOR, WALL, Layout, Placement, Provenance, Room
from labgym.layouts.optimise import optimise_assessed
from labgym.layouts.propose import LIMIT_WORDS, ProceduralProposer, Proposer
from labgym.layouts.refinement import refine_assessed
from labgym.layouts.request import Request
from labgym.layouts.rules.objective import Assessment, evaluate_layout
from labgym.layouts.rules.thresholds import Profile
from labgym.layouts.rules.thresholds import profile as resolve_profile
from labgym.layouts.sites import resolve_site
from labgym.protocols import Protocol
from labgym.protocols import resolve as resolve_protocol

GENERATOR = 2
"""Version of the generator of single rooms. It rises whenever the same arguments give another layout."""
FURNISHER = 1
"""The same of what furnishes floors space by space."""
CLUTTER_STREAM = 0xC1
"""Sub-stream of the seed from which clutter is drawn."""
MAX_SEED = 2**53 - 1


def generate(
    protocol: Protocol | str | Path | Sequence[Protocol | str | Path],
    seed: int = 0,
    room: Room | str | Path | None = None,
    profile: str | Profile = "default",
    proposer: Proposer | None = None,
    catalog: Catalog | None = None,
    fixed: Iterable[Placement] = (),
    floor: Floor | str | Path | None = None,
    family: str | None = None,
    holdings: Holdings | None = None,
    clutter: int = 0,
) -> Layout:
    """Return a laboratory for one or more protocols: proposed, optimized, refined for navigation, and dressed.

    The same arguments give a layout with the same hash in any process. One protocol in a room is furnished by the roles
    of its four walls; a floor, a family, or several protocols are furnished space by space, along any wall.

    Args:
        protocol: a protocol, its id in the library, or its .json file; or up to five of them, which share equipment.
        seed: 0 to 2^53 - 1, the integers that JSON represents exactly.
        room: a room, a preset, a size such as "12x9", a room file, or None for the preset "bay" (8 x 8 m, two doors).
        profile: thresholds to satisfy.
        proposer: makes the first layout; the procedural one by default.
        catalog: source of every asset; `Catalog.load()` by default.
        fixed: floor and wall objects that stay where they are, such as a sink or a pillar. One of an asset that the
            laboratory needs takes that role; the others are obstacles.
        floor: a floor of any shape or its .json file, in place of a room.
        family: name of a family of floors, of which the seed draws one, in place of a room.
        holdings: what exists. It is used first, and what may be bought besides is limited. A room is then furnished
            space by space, too.
        clutter: level of loose objects, which are added last: 0 (none), 1 (tidy), 2 (busy) or 3 (crowded). The other
            objects are the same at every level.

    Raises:
        UnknownNameError: no such protocol, room preset, family or profile.
        OptionError: a seed or a level of clutter out of range, not a room, more than one of room, floor and family, or
            a fixed object that does not stand on the floor or a wall.
        InfeasibleError: the room cannot hold the protocols; names the conflicts and the smallest preset that fits.
        SearchLimitError: the search ended at its effort limit without a layout; one may exist.

    Warns:
        SearchLimitWarning: searches stopped at their effort limit, and the laboratory is not fully furnished.
    """
    request = resolve_request(protocol, seed, room, profile, catalog, fixed, floor, family, holdings, clutter)
    layout = generate_assessed(request, proposer)[0]
    options = layout.provenance.options
    stopped = options.get("attempts", {}).get("stopped", 0) or LIMIT_WORDS in options.get("note", "")
    if stopped and options["furnishing"] != "full":
        message = f"{layout.id}: {options['furnishing']} furnishing only: {options['note']}; try another seed"
        warnings.warn(message, SearchLimitWarning, stacklevel=2)
    return layout


def generate_assessed(request: Request, proposer: Proposer | None = None) -> tuple[Layout, Assessment]:
    """Return a laboratory for a request, and the assessment that it passed.

    Raises:
        InfeasibleError, SearchLimitError: as `generate`.
    """
    proposer = proposer if proposer is not None else default_proposer(request)
    layout = proposer.propose(request)
    layout, assessment = optimise_assessed(layout, request.protocol, request.profile)
    layout, assessment = refine_assessed(layout, assessment, request.protocol)
    tidy, assessment = dress(layout, assessment, request)
    layout = add_clutter(tidy, request.clutter, np.random.default_rng([request.seed, CLUTTER_STREAM]))
    if request.clutter:
        assessment = evaluate_layout(layout, request.protocol, request.profile, navigation=True, earlier=assessment)
    _verify(assessment, request)
    options: dict[str, Any] = {"room": request.floor.name, "profile": request.profile.name}
    options |= {"family": request.family} if request.family else {}
    options |= layout.provenance.options
    options |= {"inventory": _accounts(tidy, request.holdings)} if request.holdings is not None else {}
    version = {"generator": str(GENERATOR)} if request.style is None else {"furnisher": str(FURNISHER)}
    provenance = Provenance(
        generator=type(proposer).__name__,
        seed=request.seed,
        options=options,
        versions={"labgym": labgym.__version__, **version, "ortools": _version("ortools")},
    )
    return layout.replace(provenance=provenance), assessment


def _accounts(layout: Layout, holdings: Holdings) -> dict[str, dict[str, int]]:
    """Return what exists of the assets that a layout places, what must be bought, and what is not used."""
    reagents = any(layout.catalog.get(name).kind == "reagent" for name in holdings.counts)
    placed = [p.asset for p in layout.placements if reagents or layout.asset(p.id).kind != "reagent"]
    existing = {name: holdings.counts[name] for name in sorted(set(placed) & set(holdings.counts))}
    return {"existing": existing, "to_buy": holdings.missing(placed), "unused": holdings.left(placed)}


def default_proposer(request: Request) -> ProceduralProposer | FloorProposer:
    """Return the proposer for a request: by the roles of four walls, or space by space."""
    return ProceduralProposer() if request.style is None else FloorProposer()


def reasons(
    protocol: Protocol | str | Path | Sequence[Protocol | str | Path],
    seed: int = 0,
    room: Room | str | Path | None = None,
    profile: str | Profile = "default",
    catalog: Catalog | None = None,
    fixed: Iterable[Placement] = (),
    floor: Floor | str | Path | None = None,
    family: str | None = None,
    holdings: Holdings | None = None,
) -> dict[str, str]:
    """Return why each object of a generated layout is there, by placement id.

    Takes the arguments of `generate`. Accessories and clutter, which no protocol requires, are not listed.

    Raises:
        UnknownNameError, OptionError, InfeasibleError: as `generate`.
    """
    request = resolve_request(protocol, seed, room, profile, catalog, fixed, floor, family, holdings)
    return default_proposer(request).plan(request).reasons()


def resolve_request(
    protocol: Protocol | str | Path | Sequence[Protocol | str | Path],
    seed: int,
    room: Room | str | Path | None,
    profile: str | Profile,
    catalog: Catalog | None,
    fixed: Iterable[Placement],
    floor: Floor | str | Path | None = None,
    family: str | None = None,
    holdings: Holdings | None = None,
    clutter: int = 0,
) -> Request:
    """Return the request that the arguments of `generate` describe.

    Raises:
        UnknownNameError, OptionError: as `generate`.
    """
    if isinstance(seed, bool) or not isinstance(seed, int) or not 0 <= seed <= MAX_SEED:
        raise OptionError(f"seed must be an integer from 0 to {MAX_SEED}, got {seed!r}")
    check_level(clutter)
    several = [protocol] if isinstance(protocol, (Protocol, str, Path)) else list(protocol)
    resolved = tuple(resolve_protocol(one) for one in several)
    catalog = catalog if catalog is not None else Catalog.load()
    site = resolve_site(seed, room, floor, family, always=len(resolved) > 1 or holdings is not None)
    pinned = tuple(_pinned(placement) for placement in fixed)
    return Request(
        protocol=combination(resolved, catalog),
        floor=site.floor,
        profile=resolve_profile(profile),
        seed=seed,
        catalog=catalog,
        habits=Habits.published(),
        fixed=pinned,
        several=resolved if len(resolved) > 1 else (),
        style=site.style,
        family=family or "",
        holdings=None if holdings is None else holdings.including(placement.asset for placement in pinned),
        clutter=clutter,
    )


def _pinned(placement: Placement) -> Placement:
    if placement.support not in (FLOOR, WALL):
        raise OptionError(
            f"fixed object {placement.id!r} stands on {placement.support!r}: in a new layout only objects on the floor "
            "or a wall can be fixed"
        )
    return placement.model_copy(update={"fixed": True})


def _verify(assessment: Assessment, request: Request) -> None:
    """Check that a layout has no violation and no facility error, and all that is required.

    Raises:
        InfeasibleError: it violates a rule or lacks a required asset.
    """
    problems = [violation.message for violation in assessment.violations.items]
    problems += [issue.message for issue in assessment.errors]
    if assessment.missing:
        problems.append(f"not placed: {', '.join(assessment.missing)}")
    if problems:
        protocol, floor = request.protocol.id, assessment.arrangement.layout.floor.name
        what = f"the proposed layout of protocol {protocol!r} on floor {floor!r} could not be repaired"
        smallest = smallest_preset(request) if request.style is None else None
        raise InfeasibleError(what, problems, smallest, remedy="try another seed")


def _version(package: str) -> str:
    return metadata.version(package)
