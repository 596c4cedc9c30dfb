"""LabGen in one call: protocol and seed to a layout that passes its own checks."""

from __future__ import annotations

from collections.abc import Iterable
from importlib import metadata
from pathlib import Path
from typing import Any

import labgym
from labgym.assets import Catalog
from labgym.errors import InfeasibleError, OptionError
from labgym.layouts.dressing import dress
from labgym.layouts.habits import Habits
from labgym.layouts.infeasibility import smallest_preset
from labgym.layouts.model import FLOOR, WALL, Layout, Placement, Provenance, Room
from labgym.layouts.optimise import optimise
from labgym.layouts.propose import ProceduralProposer, Proposer
from labgym.layouts.refine import refine
from labgym.layouts.request import Request
from labgym.layouts.rooms import resolve_room
from labgym.layouts.rules.objective import Assessment, evaluate_layout
from labgym.layouts.rules.thresholds import Profile
from labgym.layouts.rules.thresholds import profile as resolve_profile
from labgym.protocols import Protocol
from labgym.protocols import resolve as resolve_protocol

GENERATOR = 2
"""Version of the generator. It rises whenever the same arguments give another layout."""
MAX_SEED = 2**53 - 1


def generate(
    protocol: Protocol | str | Path,
    seed: int = 0,
    room: Room | str | Path | None = None,
    profile: str | Profile = "default",
    proposer: Proposer | None = None,
    catalog: Catalog | None = None,
    fixed: Iterable[Placement] = (),
) -> Layout:
    """Return a laboratory for a protocol: proposed, optimized, refined for navigation, and dressed.

    The same arguments give a layout with the same hash in any process.

    Args:
        protocol: a protocol, its id in the library, or its .json file.
        seed: 0 to 2^53 - 1, the integers that JSON represents exactly.
        room: a room, a preset, a size such as "12x9", a room file, or None for the preset "bay" (8 x 8 m, two doors).
        profile: thresholds to satisfy.
        proposer: makes the first layout; the procedural one by default.
        catalog: source of every asset; `Catalog.load()` by default.
        fixed: floor and wall objects that stay where they are, such as a sink or a pillar. One of an asset that the
            laboratory needs takes that role; the others are obstacles.

    Raises:
        UnknownNameError: no such protocol, room preset or profile.
        OptionError: a seed out of range, not a room, or a fixed object that does not stand on the floor or a wall.
        InfeasibleError: the room cannot hold the protocol; names the conflicts and the smallest preset that fits.
        SearchLimitError: the search ended at its effort limit without a layout; one may exist.
    """
    request = resolve_request(protocol, seed, room, profile, catalog, fixed)
    return generate_assessed(request, proposer)[0]


def generate_assessed(request: Request, proposer: Proposer | None = None) -> tuple[Layout, Assessment]:
    """Return a laboratory for a request, and the assessment that it passed.

    Raises:
        InfeasibleError, SearchLimitError: as `generate`.
    """
    proposer = proposer if proposer is not None else ProceduralProposer()
    layout = proposer.propose(request)
    layout = optimise(layout, request.protocol, request.profile)
    layout = refine(layout, request.protocol, request.profile)
    layout = dress(layout, request)
    assessment = _verified(layout, request)
    options: dict[str, Any] = {
        "room": request.room.name,
        "profile": request.profile.name,
        **layout.provenance.options,
    }
    provenance = Provenance(
        generator=type(proposer).__name__,
        seed=request.seed,
        options=options,
        versions={"labgym": labgym.__version__, "generator": str(GENERATOR), "ortools": _version("ortools")},
    )
    return layout.replace(provenance=provenance), assessment


def reasons(
    protocol: Protocol | str | Path,
    seed: int = 0,
    room: Room | str | Path | None = None,
    profile: str | Profile = "default",
    catalog: Catalog | None = None,
    fixed: Iterable[Placement] = (),
) -> dict[str, str]:
    """Return why each object of a generated layout is there, by placement id.

    Takes the arguments of `generate`. Accessories, which no protocol requires, are not listed.

    Raises:
        UnknownNameError, OptionError, InfeasibleError: as `generate`.
    """
    return ProceduralProposer().plan(resolve_request(protocol, seed, room, profile, catalog, fixed)).reasons()


def resolve_request(
    protocol: Protocol | str | Path,
    seed: int,
    room: Room | str | Path | None,
    profile: str | Profile,
    catalog: Catalog | None,
    fixed: Iterable[Placement],
) -> Request:
    """Return the request that the arguments of `generate` describe.

    Raises:
        UnknownNameError, OptionError: as `generate`.
    """
    if isinstance(seed, bool) or not isinstance(seed, int) or not 0 <= seed <= MAX_SEED:
        raise OptionError(f"seed must be an integer from 0 to {MAX_SEED}, got {seed!r}")
    return Request(
        protocol=resolve_protocol(protocol),
        room=resolve_room(room),
        profile=resolve_profile(profile),
        seed=seed,
        catalog=catalog if catalog is not None else Catalog.load(),
        habits=Habits.published(),
        fixed=tuple(_pinned(placement) for placement in fixed),
    )


def _pinned(placement: Placement) -> Placement:
    if placement.support not in (FLOOR, WALL):
        raise OptionError(
            f"fixed object {placement.id!r} stands on {placement.support!r}: in a new layout only objects on the floor "
            "or a wall can be fixed"
        )
    return placement.model_copy(update={"fixed": True})


def _verified(layout: Layout, request: Request) -> Assessment:
    """Return the assessment of a layout without violations and facility errors that has all that is required.

    Raises:
        InfeasibleError: it violates a rule or lacks a required asset.
    """
    protocol, profile = request.protocol, request.profile
    assessment = evaluate_layout(layout, protocol, profile, navigation=True)
    problems = [violation.message for violation in assessment.violations.items]
    problems += [issue.message for issue in assessment.errors]
    if assessment.missing:
        problems.append(f"not placed: {', '.join(assessment.missing)}")
    if problems:
        what = f"the proposed layout of protocol {protocol.id!r} in room {layout.room.name!r} could not be repaired"
        raise InfeasibleError(what, problems, smallest_preset(request), remedy="try another seed")
    return assessment


def _version(package: str) -> str:
    return metadata.version(package)
