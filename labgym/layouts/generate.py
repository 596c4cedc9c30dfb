"""LabGen in one call: protocol and seed to a layout that passes its own checks."""

from __future__ import annotations

from importlib import metadata
from typing import Any

import labgym
from labgym.errors import InfeasibleError, OptionError
from labgym.layouts.dressing import dress
from labgym.layouts.infeasibility import smallest_preset
from labgym.layouts.model import Layout, Provenance, Room
from labgym.layouts.optimise import optimise
from labgym.layouts.propose import ProceduralProposer, Proposer
from labgym.layouts.refine import refine
from labgym.layouts.rooms import resolve_room
from labgym.layouts.rules.objective import evaluate_layout
from labgym.layouts.rules.thresholds import Profile
from labgym.layouts.rules.thresholds import profile as resolve_profile
from labgym.protocols import Protocol, get

MAX_SEED = 2**53 - 1


def generate(
    protocol: Protocol | str,
    seed: int = 0,
    room: Room | str | None = None,
    profile: str | Profile = "default",
    proposer: Proposer | None = None,
) -> Layout:
    """Return a laboratory for a protocol: proposed, optimised, refined for navigation, and dressed.

    The same arguments give a layout with the same hash in any process.

    Args:
        protocol: a protocol, or the id of one of the library.
        seed: 0 to 2^53 - 1, what JSON carries exactly.
        room: a room, the name of a preset, or None for the default preset.
        profile: thresholds to satisfy.
        proposer: what makes the first layout; the procedural one by default.

    Raises:
        UnknownNameError: no such protocol, room preset or profile.
        OptionError: a seed out of range, or a room that is none.
        InfeasibleError: the room cannot hold the protocol; names what clashes and the smallest preset that fits.
    """
    if isinstance(seed, bool) or not isinstance(seed, int) or not 0 <= seed <= MAX_SEED:
        raise OptionError(f"seed must be an integer from 0 to {MAX_SEED}, got {seed!r}")
    if isinstance(protocol, str):
        protocol = get(protocol)
    thresholds, room = resolve_profile(profile), resolve_room(room)
    proposer = proposer if proposer is not None else ProceduralProposer()
    layout = proposer.propose(protocol, room, thresholds, seed)
    layout = optimise(layout, protocol, thresholds)
    layout = refine(layout, protocol, thresholds)
    layout = dress(layout, protocol, thresholds, seed)
    _verify(layout, protocol, thresholds)
    options: dict[str, Any] = {"room": room.name, "profile": thresholds.name, **layout.provenance.options}
    provenance = Provenance(
        generator=type(proposer).__name__,
        seed=seed,
        options=options,
        versions={"labgym": labgym.__version__, "ortools": _version("ortools")},
    )
    return layout.replace(provenance=provenance)


def _verify(layout: Layout, protocol: Protocol, profile: Profile) -> None:
    """A layout leaves only without hard violations and with everything that the protocol requires."""
    assessment = evaluate_layout(layout, protocol, profile, navigation=True)
    problems = [violation.message for violation in assessment.violations.items]
    if assessment.missing:
        problems.append(f"not placed: {', '.join(assessment.missing)}")
    if problems:
        what = f"no valid layout found for protocol {protocol.id!r} in room {layout.room.name!r}"
        raise InfeasibleError(what, problems, smallest_preset(protocol, profile))


def _version(package: str) -> str:
    return metadata.version(package)
