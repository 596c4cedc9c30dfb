"""The command that generates layouts."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from labgym import protocols
from labgym.assets import Catalog
from labgym.cli.arguments import (
    THIS_PROCESS,
    Execution,
    OptionalPath,
    OptionalText,
    OptionalWholeNumber,
    ProtocolNames,
    Texts,
)
from labgym.cli.effects import refuses_idle_flags
from labgym.cli.outcome import DONE, FAILED, written
from labgym.cli.saving import Overwrite, layout_path, refuse_other_content, save
from labgym.errors import InfeasibleError, OptionError, SearchLimitWarning, UnrepairedError, UnrepairedWarning
from labgym.layouts import Floor
from labgym.layouts.failures import FAILURES, summary
from labgym.layouts.generate import ADDED
from labgym.layouts.method import Method
from labgym.layouts.trace import Recorder

if TYPE_CHECKING:
    from labgym.layouts.holdings import Holdings
    from labgym.layouts.rules import RuleSet


@refuses_idle_flags("generate")
def generate(
    protocol: ProtocolNames,
    seed: int = 0,
    room: OptionalText = None,
    family: OptionalText = None,
    profile: str = "default",
    out: OptionalPath = None,
    explain: bool = False,
    count: OptionalWholeNumber = None,
    shard: int = 20,
    execution: Execution = THIS_PROCESS,
    fresh: bool = False,
    have: OptionalPath = None,
    only_have: bool = False,
    extra: bool = False,
    fixed: OptionalPath = None,
    clutter: int = 0,
    proposer: str = "solver",
    adjuster: str = "rules",
    optimise: bool = True,
    refine: bool = True,
    dress: Literal["solver", "always", "never"] = "solver",
    keep: bool = False,
    zones: bool = False,
    trace: OptionalPath = None,
    facility: bool = True,
    service: Texts = (),
    rules: str = "touchstone",
    overwrite: Overwrite = False,
) -> int:
    """Generate a laboratory for one or more protocols, or with --count many laboratories for each of them.

    Several protocols share equipment and spaces, and the constraints of all hold.

    With --count, OUT receives the layout files in subfolders of 1000 and rows.jsonl, with a row for each protocol and
    seed. A protocol and seed without a layout has a row with the reason; the exit code is then 1. An interrupted
    command resumes.

    Args:
        protocol: Ids of protocols, or their .json files, at most five for one laboratory. With --count also all.
        seed: Random seed; the same seed gives the same layout on any machine. With --count the first one.
        room: Room preset (bay_small, bay, bay_large with two exits; tight, default, roomy, two_exits of the published
            layouts), size in meters such as 12x9, the .json file of a room, a floor or a layout, or the outline of a
            .dxf drawing or of a ROS map's .yaml file (docs/engineers.md). Default: bay.
        family: Family of floors (bay, ell, double, suite, refit) of which the seed draws one, in place of a room.
        profile: Thresholds to satisfy: default, strict, paper, or code (default, and a second exit is required).
        out: A .json file, or a folder for a file named after protocol, room and seed; by default the current folder.
            With --count a folder, which must be named.
        explain: Print the reason for each object.
        count: Number of layouts for each protocol, with the seeds SEED to SEED+COUNT-1.
        shard: With --count, number of layouts in a shard, the unit of work and of resuming.
        fresh: With --count, move the files of the folder aside and start anew.
        fixed: Pieces that stay where they are: a layout's .json file, a .csv table with the columns asset, x, y and
            yaw, or a .dxf drawing with blocks of furniture (docs/engineers.md).
        have: Inventory of what exists, a .csv file with the columns asset and count. It is used first; what protocols
            and safety require beyond it is listed as to buy, and other furniture is not added.
        only_have: With --have, refuse a laboratory for which something must be bought.
        extra: With --have, also add furniture that neither exists nor is required.
        clutter: Level of loose objects, such as trolleys, cartons and stools pulled out: 0 (none), 1 (tidy), 2 (busy)
            or 3 (crowded). Every goal stays reachable.
        proposer: What proposes the first layout: solver (constraints), sampler (fallible), llm (the configured language
            model), or a rival (docs/rivals.md): holodeck, holodeck+, sceneweaver.
        adjuster: What adjusts layouts that violate rules: rules, or llm, the configured language model.
        optimise: Phase 2, which repairs and adjusts the proposal; --no-optimise leaves it out.
        refine: Phase 3, which moves furniture until every drive of the protocol is possible; --no-refine leaves it out.
        dress: Add accessories and safety equipment: only to what the solver proposes, always, or never.
        keep: Write a layout that still violates rules or lacks required assets, and warn, instead of refusing it.
        zones: Record functional zones, and where each step is done if its hood or bench exists more than once.
        service: Walls of the room with water, gas or exhaust, as KIND:WALL, such as exhaust:back water:left (front,
            back, left, right). What needs them stands within reach if it can, with KIND:WALL:required always. Drawings
            and floor files list service points themselves.
        trace: A .json file for everything that was tried and every state of the layout; labgym trace draws it.
        facility: Let phase 2 follow facility rules (fronts, door areas, ways out) and repair what fails; --no-facility
            runs the paper's phases, in which only phase 3 considers navigation.
        rules: Rule set to satisfy: touchstone, under which the safety equipment that a proposal lacks is added, too, or
            paper.
        overwrite: Replace a layout and a trace that exist with other content. A batch (--count) resumes; see --fresh.
    """
    from labgym.layouts.rules import rule_set

    chosen_rules = rule_set(rules, profile)
    method = Method(proposer, optimise, refine, adjuster, dress, "keep" if keep else "raise", zones, facility)
    if count is None:
        layout_path(out or Path(), protocol[0])  # a wrong name is refused before the work
        holdings = _holdings(have, only_have, extra)
        return _generate_one(
            protocol,
            seed,
            room,
            family,
            chosen_rules,
            out or Path(),
            explain,
            holdings,
            fixed,
            clutter,
            method,
            trace,
            service,
            overwrite,
        )
    from labgym.layouts.batch import generate_batch

    if out is None:
        raise OptionError("--count needs a folder for the layouts: name it with --out")
    batch = generate_batch(
        protocol,
        count,
        out,
        seed,
        room,
        shard=shard,
        executor=execution.options(),
        fresh=fresh,
        family=family,
        clutter=clutter,
        method=method,
        rules=chosen_rules,
    )
    written(out)
    print(batch.summary)
    return FAILED if batch.infeasible else DONE


def _generate_one(
    names: Sequence[str],
    seed: int,
    room: str | None,
    family: str | None,
    rules: RuleSet,
    out: Path,
    explain: bool,
    holdings: Holdings | None,
    fixed: Path | None,
    clutter: int,
    method: Method,
    trace: Path | None,
    service: Sequence[str],
    overwrite: bool,
) -> int:
    from labgym import layouts
    from labgym.exchange.fixed import read_fixed

    resolved, catalog = [protocols.resolve(name) for name in names], Catalog.load()
    place, floor = _place(room)
    if service:
        from labgym.layouts.rooms import resolve_room, with_services

        drawn = resolve_room(place) if floor is None else None if floor.services else floor.as_room
        if family is not None or drawn is None:
            raise OptionError("--service is for a room, by name, size or file; leave out --family, or draw the points")
        place, floor = None, with_services(drawn, service)
    pieces = () if fixed is None else read_fixed(fixed, catalog, remark=_note)
    request: dict[str, Any] = {"seed": seed, "room": place, "rules": rules, "floor": floor, "family": family}
    request |= {"catalog": catalog, "fixed": pieces, "holdings": holdings}
    recorder = None if trace is None else Recorder()
    try:
        with warnings.catch_warnings():
            # the notes below say the same
            warnings.simplefilter("ignore", SearchLimitWarning)
            warnings.simplefilter("ignore", UnrepairedWarning)
            layout = layouts.generate(resolved, **request, clutter=clutter, **asdict(method), trace=recorder)
    except UnrepairedError:
        raise  # another room would not help
    except InfeasibleError as error:
        from labgym.layouts.generate import resolve_request
        from labgym.layouts.remedies import with_remedies

        raise with_remedies(error, resolve_request(resolved, **request)) from None
    path = layout_path(out, layout.id)
    refuse_other_content(layout, path, overwrite)
    _print_notes(layout.provenance.options)
    if explain:
        why = layouts.reasons(resolved, **request)
        for placement, reason in why.items():
            print(f"{placement}: {reason}")
    if recorder is not None and trace is not None:
        save(recorder.trace(), trace, overwrite)
    return save(layout, path, overwrite)


def _print_notes(options: dict[str, Any]) -> None:
    """Print what a layout's provenance says about how it came about."""
    if FAILURES in options:
        print(f"labgym: warning: {summary(options[FAILURES])}", file=sys.stderr)
    if options.get("note") and "furnishing" in options:
        print(f"note: {options['furnishing']} furnishing only: {options['note']}", file=sys.stderr)
    stopped = options.get("attempts", {}).get("stopped", 0)
    if stopped:
        print(f"note: {stopped} attempts reached the solver's effort limit before one succeeded", file=sys.stderr)
    inventory = options.get("inventory", {})
    lists = {
        "note: added what the proposal lacked": options.get(ADDED),
        "to buy": inventory.get("to_buy"),
        "not used": inventory.get("unused"),
    }
    for words, counts in lists.items():
        if counts:
            print(f"{words}: {', '.join(f'{count} {name}' for name, count in counts.items())}", file=sys.stderr)


def _holdings(have: Path | None, only_have: bool, extra: bool) -> Holdings | None:
    """Return what the options say about what exists."""
    from labgym.exchange.inventory import read_inventory
    from labgym.layouts.holdings import Holdings

    if have is None:
        return None
    if only_have and extra:
        raise OptionError("--only-have and --extra exclude each other")
    return Holdings(read_inventory(have, remark=_note).counts, "none" if only_have else "any" if extra else "required")


def _note(remark: str) -> None:
    print(f"note: {remark}", file=sys.stderr)


def _place(room: str | None) -> tuple[str | None, Floor | None]:
    """Return the floor in a drawing or a ROS map; other arguments unchanged, as a room."""
    if room is None or not room.lower().endswith((".dxf", ".yaml", ".yml")):
        return room, None
    from labgym.exchange.formats import read_floor

    return None, read_floor(room)
