"""LabGen in one call: protocol and seed to a layout that passes its own checks."""

from __future__ import annotations

import warnings
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np

import labgym
from labgym.assets import Catalog
from labgym.counts import MAX_SEED, whole_number
from labgym.errors import OptionError, SearchLimitWarning, UnrepairedError, UnrepairedWarning
from labgym.layouts.clutter import add_clutter, check_level
from labgym.layouts.dressing import dress as dressed
from labgym.layouts.equipping import supplied
from labgym.layouts.floor import Floor, Room
from labgym.layouts.floor.changes import closed_doors
from labgym.layouts.habits import Habits
from labgym.layouts.interiors import FloorProposer
from labgym.layouts.method import DEFAULT, Method
from labgym.layouts.model import Layout
from labgym.layouts.phases import FAILURES, Phases, failures, summary
from labgym.layouts.placement import FLOOR, WALL, Placement
from labgym.layouts.records import Provenance
from labgym.layouts.request import Holdings, Request, combination
from labgym.layouts.rules.objective import Assessment, evaluate_layout
from labgym.layouts.rules.rule_sets import TOUCHSTONE, RuleSet, rule_set
from labgym.layouts.rules.thresholds import Profile
from labgym.layouts.sites import resolve_site
from labgym.layouts.trace import Recorder
from labgym.layouts.zoning import zoned
from labgym.protocols import Protocol
from labgym.protocols import resolve as resolve_protocol

GENERATOR = 4
"""Version of the generator of single rooms. It rises whenever the same arguments give another layout; since 3, rooms
are furnished as floors are, and since 4 their walls are read as those of floors."""
FURNISHER = 2
"""The same of what furnishes floors space by space."""
ADDED = "added"
"""Provenance option: assets that the proposal lacked and the phases added, with their numbers."""
CLUTTER_STREAM = 0xC1
"""Sub-stream of the seed from which clutter is drawn."""
CLUTTER_DRAWS = 8
"""Greatest number of draws of clutter: another one is taken if a draw cuts off an extinguisher or an eyewash."""


def generate(
    protocol: Protocol | str | Path | Sequence[Protocol | str | Path],
    seed: int = 0,
    room: Room | str | Path | None = None,
    profile: str | Profile | None = None,
    *,
    method: Method = DEFAULT,
    trace: Recorder | None = None,
    **request: Any,
) -> Layout:
    """Return a laboratory for one or more protocols: proposed, optimized, refined for navigation, and dressed.

    The same arguments give a layout with the same hash in any process. Rooms and floors are furnished space by space,
    along any wall.

    Args:
        protocol, seed, room, profile: as `resolve_request`.
        method: the proposer, the phases after it, and whether a layout that fails is an error.
        trace: records the state after each phase and iteration, and everything that is tried.
        request: further arguments of `resolve_request`: catalog, fixed, floor, family, holdings, clutter, rules.

    Raises:
        UnknownNameError, OptionError: as `resolve_request`.
        InfeasibleError: the room cannot hold the protocols; names the conflicts.
        SearchLimitError: the search ended at its effort limit without a layout; one may exist.
        UnrepairedError: the proposal could not be repaired, and `method.on_failure` is "raise".

    Warns:
        SearchLimitWarning: searches stopped at their effort limit, and the laboratory is not fully furnished.
        UnrepairedWarning: the layout was kept although it violates rules or lacks required assets.
    """
    layout = generate_assessed(resolve_request(protocol, seed, room, profile, **request), method, trace)[0]
    options = layout.provenance.options
    stopped = options.get("attempts", {}).get("stopped", 0)
    if stopped and options.get("furnishing", "full") != "full":
        message = f"{layout.id}: {options['furnishing']} furnishing only: {options['note']}; try another seed"
        warnings.warn(message, SearchLimitWarning, stacklevel=2)
    if FAILURES in options:
        warnings.warn(f"{layout.id}: {summary(options[FAILURES])}", UnrepairedWarning, stacklevel=2)
    return layout


def generate_assessed(
    request: Request, method: Method = DEFAULT, trace: Recorder | None = None
) -> tuple[Layout, Assessment]:
    """Return a laboratory for a request, and its assessment.

    Raises:
        InfeasibleError, SearchLimitError, UnrepairedError: as `generate`.
    """
    proposer, protocol = method.proposes_with(), request.protocol
    arranging = replace(request, rules=request.rules.furnishing)
    layout = proposer.propose(arranging)
    if method.zones and not layout.zones:
        layout = zoned(layout, protocol)
    if trace is not None:
        trace.begin(layout, protocol, request.rules)
    solved = isinstance(proposer, FloorProposer)
    phases = Phases(protocol, arranging.rules, method, trace, complete=not solved)
    proposed = layout
    layout, assessment = phases.improved(layout)
    added = _counts(layout) - _counts(proposed)
    tidy = layout
    if method.dresses(proposer):
        tidy, assessment = dressed(layout, assessment, arranging)
    if solved and method.repairs and request.holdings is None:
        tidy, assessment = phases.repaired(tidy, assessment)
    assessment = replace(assessment, rules=request.rules)
    complete = supplied(tidy, request) if method.optimise else tidy
    if complete is not tidy:
        added += Counter() if solved else _counts(complete) - _counts(tidy)
        tidy, assessment = complete, evaluate_layout(complete, protocol, request.rules, True, earlier=assessment)
    layout, assessment, is_clutter_at_fault = _cluttered(tidy, assessment, request)
    if trace is not None:
        trace.update("dress", None, tidy)
        trace.update("clutter", None, layout)
    problems = failures(assessment)
    if problems and method.on_failure == "raise":
        raise _unrepaired(assessment, request, problems, is_clutter_at_fault)
    options: dict[str, Any] = {"room": request.floor.name, "profile": request.profile.name}
    options["rules"] = request.rules.name
    options |= {"family": request.family} if request.family else {}
    options |= layout.provenance.options
    options |= method.options
    options |= {ADDED: dict(sorted(added.items()))} if added else {}
    options |= {FAILURES: problems} if problems else {}
    options |= {"inventory": _accounts(tidy, request.holdings)} if request.holdings is not None else {}
    provenance = Provenance(
        generator=type(proposer).__name__,
        seed=request.seed,
        options=options,
        versions={
            "labgym": labgym.__version__,
            "generator": str(GENERATOR),
            "furnisher": str(FURNISHER),
            "ortools": metadata.version("ortools"),
            **layout.provenance.versions,
        },
    )
    return layout.replace(provenance=provenance), assessment


def _cluttered(tidy: Layout, assessment: Assessment, request: Request) -> tuple[Layout, Assessment, bool]:
    """Return a layout with its clutter, the assessment, and whether the clutter broke a rule that the layout kept.

    The first draw that breaks none is taken; if all do, the first.
    """
    if not request.clutter:
        return tidy, assessment, False
    first = None
    for draw in range(CLUTTER_DRAWS):
        generator = np.random.default_rng([request.seed, CLUTTER_STREAM, *([draw] if draw else [])])
        layout = add_clutter(tidy, request.clutter, generator)
        judged = evaluate_layout(layout, request.protocol, request.rules, navigation=True, earlier=assessment)
        first = first or (layout, judged, True)
        if not failures(judged) or failures(assessment):
            return layout, judged, False
    assert first is not None
    return first


def _counts(layout: Layout) -> Counter[str]:
    return Counter(placement.asset for placement in layout.placements)


def _accounts(layout: Layout, holdings: Holdings) -> dict[str, dict[str, int]]:
    """Return what exists of the assets that a layout places, what must be bought, and what is not used."""
    reagents = any(layout.catalog.get(name).kind == "reagent" for name in holdings.counts)
    placed = [p.asset for p in layout.placements if reagents or layout.asset(p.id).kind != "reagent"]
    existing = {name: holdings.counts[name] for name in sorted(set(placed) & set(holdings.counts))}
    return {"existing": existing, "to_buy": holdings.missing(placed), "unused": holdings.left(placed)}


def reasons(request: Request) -> dict[str, str]:
    """Return why each object of the layout that the solver generates for a request is there, by placement id.

    Accessories and clutter, which no protocol requires, are not listed.

    Raises:
        InfeasibleError, SearchLimitError: as `generate`.
    """
    return FloorProposer().plan(request).reasons()


def resolve_request(
    protocol: Protocol | str | Path | Sequence[Protocol | str | Path],
    seed: int = 0,
    room: Room | str | Path | None = None,
    profile: str | Profile | None = None,
    catalog: Catalog | None = None,
    fixed: Iterable[Placement] = (),
    *,
    floor: Floor | str | Path | None = None,
    family: str | None = None,
    holdings: Holdings | None = None,
    clutter: int = 0,
    rules: str | RuleSet = TOUCHSTONE,
) -> Request:
    """Return the request that some arguments describe.

    Args:
        protocol: a protocol, its id in the library, or its .json file; or up to five of them, which share equipment.
        seed: 0 to 2^53 - 1, the integers that JSON represents exactly.
        room: a room, a preset, a size such as "12x9", a room file, or None for the preset "bay" (8 x 8 m, two doors).
        profile: thresholds to satisfy; by default those of the rule set.
        catalog: source of every asset; `Catalog.load()` by default.
        fixed: floor and wall objects that stay where they are, such as a sink or a pillar. One of an asset that the
            laboratory needs takes that role; the others are obstacles.
        floor: a floor of any shape or its .json file, in place of a room.
        family: name of a family of floors, of which the seed draws one, in place of a room.
        holdings: what exists. It is used first, and what may be bought besides is limited.
        clutter: level of loose objects, which are added last: 0 (none), 1 (tidy), 2 (busy) or 3 (crowded). The other
            objects are the same at every level.
        rules: rule set to satisfy, or its name: `touchstone` or `paper`.

    Raises:
        UnknownNameError: no such protocol, room preset, family, profile or rule set.
        OptionError: a seed or a level of clutter out of range, not a room, more than one of room, floor and family, or
            a fixed object that does not stand on the floor or a wall.
    """
    seed = whole_number("seed", seed, 0, MAX_SEED)
    check_level(clutter)
    several = [protocol] if isinstance(protocol, (Protocol, str, Path)) else list(protocol)
    resolved = tuple(resolve_protocol(one) for one in several)
    catalog = (catalog if catalog is not None else Catalog.load()).including(
        substance for one in resolved for substance in one.substances
    )
    site = resolve_site(seed, room, floor, family)
    pinned = tuple(_pinned(placement) for placement in fixed)
    return Request(
        protocol=combination(resolved, catalog),
        floor=site.floor,
        rules=rule_set(rules, profile),
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


def _unrepaired(
    assessment: Assessment, request: Request, problems: Mapping[str, Any], is_clutter_at_fault: bool
) -> UnrepairedError:
    """Return the error for a layout that still violates rules or lacks assets."""
    protocol, floor = request.protocol.id, assessment.arrangement.layout.floor.name
    if is_clutter_at_fault:
        what = f"clutter of level {request.clutter} on floor {floor!r} breaks a rule in each of {CLUTTER_DRAWS} draws"
        remedy = "try another seed or a lower level, or keep the layout: on_failure='keep', --keep"
        return UnrepairedError(what, [*problems["violations"], *problems["errors"]], None, remedy=remedy)
    what = f"the proposed layout of protocol {protocol!r} on floor {floor!r} could not be repaired"
    missing = [f"not placed: {', '.join(problems['missing'])}"] if problems["missing"] else []
    conflicts = list(dict.fromkeys([*problems["violations"], *problems["errors"], *missing]))
    remedy = "try another seed, or keep the layout: on_failure='keep', --keep"
    closed = len(closed_doors(request.floor))
    if assessment.unequipped and request.holdings is not None and request.holdings.purchases == "none":
        remedy = f"buy {', '.join(assessment.unequipped)}, or allow purchases"
    elif closed:
        remedy = (
            f"the robot cannot pass the closed doors between spaces ({closed}): open them in the floor; or {remedy}"
        )
    return UnrepairedError(what, conflicts, None, remedy=remedy)
