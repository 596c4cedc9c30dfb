"""The command that generates layouts."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from tyro.conf import OmitArgPrefixes

from labgym.cli.arguments import (
    THIS_PROCESS,
    Execution,
    OptionalPath,
    OptionalText,
    OptionalWholeNumber,
    ProtocolNames,
    RuleArguments,
    Texts,
)
from labgym.cli.effects import refuses_idle_flags
from labgym.cli.labbuilder import LABBUILDER, flag_library
from labgym.cli.outcome import DONE, FAILED, written
from labgym.cli.saving import Overwrite, layout_path, refuse_other_content, save
from labgym.errors import InfeasibleError, OptionError, UnrepairedError

if TYPE_CHECKING:
    from labgym.assets import Catalog
    from labgym.layouts import Floor, Method, Placement
    from labgym.layouts.request import Holdings
    from labgym.layouts.rules import RuleSet


@dataclass(frozen=True)
class SiteArguments:
    """Site of a laboratory.

    Attributes:
        seed: Random seed; the same seed gives the same layout on any machine. With --count the first one.
        room: Room preset (bay_small, bay, bay_large with two exits; tight, default, roomy, two_exits of the published
            layouts), size in meters such as 12x9, the .json file of a room, a floor or a layout, or the outline of a
            .dxf drawing or of a ROS map's .yaml file (docs/engineers.md). Default: bay.
        family: Family of floors (bay, ell, double, suite, refit) of which the seed draws one, in place of a room.
        service: Walls of the room with water, gas or exhaust, as KIND:WALL, such as exhaust:back water:left (front,
            back, left, right). What needs them stands within reach if it can, with KIND:WALL:required always. Drawings
            and floor files list service points themselves.
        clutter: Level of loose objects, such as trolleys, cartons and stools pulled out: 0 (none), 1 (tidy), 2 (busy)
            or 3 (crowded). Every goal stays reachable.
    """

    seed: int = 0
    room: OptionalText = None
    family: OptionalText = None
    service: Texts = ()
    clutter: int = 0

    def place(self) -> dict[str, Any]:
        """Return the room, the floor or the family as arguments of `resolve_request`.

        Raises:
            OptionError: services are named for something else than a room.
        """
        room, floor = _place(self.room)
        if self.service:
            from labgym.layouts.rooms import resolve_room, with_services

            drawn = resolve_room(room) if floor is None else None if floor.services else floor.as_room
            if self.family is not None or drawn is None:
                raise OptionError(
                    "--service is for a room, by name, size or file; leave out --family, or draw the points"
                )
            room, floor = None, with_services(drawn, self.service)
        return {"room": room, "floor": floor, "family": self.family}


@dataclass(frozen=True)
class ExistingArguments:
    """Pieces that exist before a laboratory is generated.

    Attributes:
        fixed: Pieces that stay where they are: a layout's .json file, a .csv table with the columns asset, x, y and
            yaw, or a .dxf drawing with blocks of furniture (docs/engineers.md).
        have: Inventory of what exists, a .csv file with columns such as item and quantity. It is used first; what
            protocols and safety require beyond it is listed as to buy, and other furniture is not added.
        only_have: With --have, refuse a laboratory for which something must be bought.
        extra: With --have, also add furniture that neither exists nor is required.
    """

    fixed: OptionalPath = None
    have: OptionalPath = None
    only_have: bool = False
    extra: bool = False

    def pieces(self, catalog: Catalog) -> Sequence[Placement]:
        """Return the fixed pieces."""
        from labgym.exchange.fixed import read_fixed

        return () if self.fixed is None else read_fixed(self.fixed, catalog, remark=_note)

    def holdings(self) -> Holdings | None:
        """Return what exists, None if nothing is known about it.

        Raises:
            OptionError: the two options about purchases exclude each other.
        """
        from labgym.exchange.inventory import read_inventory
        from labgym.layouts.request import Holdings

        if self.have is None:
            return None
        if self.only_have and self.extra:
            raise OptionError("--only-have and --extra exclude each other")
        counts = read_inventory(self.have, remark=_note).counts
        return Holdings(counts, "none" if self.only_have else "any" if self.extra else "required")


@dataclass(frozen=True)
class MethodArguments(RuleArguments):
    """Rules and phases of the generation.

    Attributes:
        proposer: What proposes the first layout: solver (constraints), sampler (fallible), llm (the configured language
            model), or a rival (docs/rivals.md): holodeck, holodeck+, sceneweaver.
        adjuster: What adjusts layouts that violate rules: rules, or llm, the configured language model.
        optimise: Phase 2, which repairs and adjusts the proposal; --no-optimise leaves it out.
        refine: Phase 3, which moves furniture until every drive of the protocol is possible; --no-refine leaves it out.
        dress: Add accessories and safety equipment: only to what the solver proposes, always, or never.
        keep: Write a layout that still violates rules or lacks required assets, and warn, instead of refusing it.
        zones: Record functional zones, and where each step is done if its hood or bench exists more than once.
        facility: Let phase 2 follow facility rules (fronts, door areas, ways out) and repair what fails; --no-facility
            runs the paper's phases, in which only phase 3 considers navigation.
        library: With --rules labbuilder, which makes layouts that the evaluator of the paper's authors scores highly
            (docs/labbuilder.md): its assets_annotated.json, or catalog, for labgym's sizes and flags.
    """

    proposer: str = "solver"
    adjuster: str = "rules"
    optimise: bool = True
    refine: bool = True
    dress: Literal["solver", "always", "never"] = "solver"
    keep: bool = False
    zones: bool = False
    facility: bool = True
    library: OptionalText = None

    def rule_set(self) -> RuleSet:
        """Return the rule set with the thresholds; of labbuilder, touchstone with its distances."""
        if self.rules != LABBUILDER:
            return super().rule_set()
        from labgym.paper.labbuilder_rules.generation import RULES

        return RULES

    def method(self) -> Method:
        """Return the method."""
        from labgym.layouts.method import Method

        return Method(
            proposer=self.proposer,
            optimise=self.optimise,
            refine=self.refine,
            adjuster=self.adjuster,
            dress=self.dress,
            on_failure="keep" if self.keep else "raise",
            zones=self.zones,
            facility=self.facility,
        )


@dataclass(frozen=True)
class BatchArguments:
    """Many laboratories in one folder.

    Attributes:
        count: Number of layouts for each protocol, with the seeds SEED to SEED+COUNT-1.
        shard: With --count, number of layouts in a shard, the unit of work and of resuming.
        fresh: With --count, move the files of the folder aside and start anew.
    """

    count: OptionalWholeNumber = None
    shard: int = 20
    fresh: bool = False


@dataclass(frozen=True)
class OutputArguments:
    """Files and explanations.

    Attributes:
        out: A .json file, or a folder for a file named after protocol, room and seed; by default the current folder.
            With --count a folder, which must be named.
        explain: Print the reason for each object.
        trace: A .json file for everything that was tried and every state of the layout; labgym trace draws it.
        overwrite: Replace a layout and a trace that exist with other content. A batch (--count) resumes; see --fresh.
    """

    out: OptionalPath = None
    explain: bool = False
    trace: OptionalPath = None
    overwrite: Overwrite = False


@refuses_idle_flags("generate")
def generate(
    protocol: ProtocolNames,
    site: OmitArgPrefixes[SiteArguments] = SiteArguments(),
    existing: OmitArgPrefixes[ExistingArguments] = ExistingArguments(),
    method: OmitArgPrefixes[MethodArguments] = MethodArguments(),
    batch: OmitArgPrefixes[BatchArguments] = BatchArguments(),
    execution: Execution = THIS_PROCESS,
    output: OmitArgPrefixes[OutputArguments] = OutputArguments(),
) -> int:
    """Generate a laboratory for one or more protocols, or with --count many laboratories for each of them.

    Several protocols share equipment and spaces, and the constraints of all hold.

    With --count, OUT receives the layout files in subfolders of 1000 and rows.jsonl, with a row for each protocol and
    seed. A protocol and seed without a layout has a row with the reason; the exit code is then 1. An interrupted
    command resumes.

    Args:
        protocol: Ids of protocols, or their .json files, at most five for one laboratory. With --count also all.
    """
    if batch.count is None:
        return _generate_one(protocol, site, existing, method, output)
    if output.out is None:
        raise OptionError("--count needs a folder for the layouts: name it with --out")
    from labgym.layouts.batch import generate_batch

    generated = generate_batch(
        protocol,
        batch.count,
        output.out,
        seed=site.seed,
        room=site.room,
        family=site.family,
        clutter=site.clutter,
        rules=method.rule_set(),
        method=method.method(),
        shard=batch.shard,
        executor=execution.options(),
        fresh=batch.fresh,
    )
    written(output.out)
    print(generated.summary)
    return FAILED if generated.infeasible else DONE


def _generate_one(
    names: Sequence[str],
    site: SiteArguments,
    existing: ExistingArguments,
    method: MethodArguments,
    output: OutputArguments,
) -> int:
    from labgym.assets import Catalog
    from labgym.layouts.generate import generate_assessed, reasons, resolve_request
    from labgym.layouts.trace import Recorder
    from labgym.protocols import resolve

    rules, phases, out = method.rule_set(), method.method(), output.out or Path()
    layout_path(out, names[0])  # a wrong name is refused before the work
    library = flag_library(method.library) if method.rules == LABBUILDER else None
    holdings, catalog = existing.holdings(), Catalog.load()
    request = resolve_request(
        [resolve(name) for name in names],
        site.seed,
        catalog=catalog,
        rules=rules,
        **site.place(),
        fixed=existing.pieces(catalog),
        holdings=holdings,
        clutter=site.clutter,
    )
    recorder = None if output.trace is None else Recorder()
    try:
        if library is not None:
            from labgym.paper.labbuilder_rules.generation import generate_by

            layout = generate_by(request, phases, library)[0]
        else:
            layout = generate_assessed(request, phases, recorder)[0]
    except UnrepairedError:
        raise  # another room would not help
    except InfeasibleError as error:
        from labgym.layouts.remedies import with_remedies

        raise with_remedies(error, request) from None
    path = layout_path(out, layout.id)
    refuse_other_content(layout, path, output.overwrite)
    _print_notes(layout.provenance.options)
    if output.explain:
        for placement, reason in reasons(request).items():
            print(f"{placement}: {reason}")
    if recorder is not None and output.trace is not None:
        save(recorder.trace(), output.trace, output.overwrite)
    return save(layout, path, output.overwrite)


def _print_notes(options: dict[str, Any]) -> None:
    """Print what a layout's provenance says about how it came about."""
    from labgym.layouts.generate import ADDED
    from labgym.layouts.interiors.proposer import EMPTY
    from labgym.layouts.phases import FAILURES, summary

    if FAILURES in options:
        print(f"labgym: warning: {summary(options[FAILURES])}", file=sys.stderr)
    if options.get("note") and "furnishing" in options:
        print(f"note: {options['furnishing']} furnishing only: {options['note']}", file=sys.stderr)
    if options.get(EMPTY):
        print(f"note: left empty: {', '.join(options[EMPTY])}", file=sys.stderr)
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


def _note(remark: str) -> None:
    print(f"note: {remark}", file=sys.stderr)


def _place(room: str | None) -> tuple[str | None, Floor | None]:
    """Return the floor in a drawing, a building model or a ROS map; other arguments unchanged, as a room."""
    if room is None or not room.lower().endswith((".dxf", ".ifc", ".yaml", ".yml")):
        return room, None
    from labgym.exchange.formats import read_floor

    return None, read_floor(room)
