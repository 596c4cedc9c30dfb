"""The command that generates layouts."""

from __future__ import annotations

import sys
from pathlib import Path

from labgym import protocols
from labgym.assets import Catalog
from labgym.cli.arguments import THIS_PROCESS, Execution, OptionalPath, OptionalText, OptionalWholeNumber, ProtocolNames
from labgym.cli.outcome import DONE, FAILED, complaints, written
from labgym.errors import OptionError
from labgym.layouts import Room


def generate(
    protocol: ProtocolNames,
    seed: int = 0,
    room: OptionalText = None,
    profile: str = "default",
    out: OptionalPath = None,
    explain: bool = False,
    count: OptionalWholeNumber = None,
    shard: int = 20,
    execution: Execution = THIS_PROCESS,
    fresh: bool = False,
    have: OptionalPath = None,
) -> int:
    """Generate a laboratory for a protocol, or with --count many laboratories for one or more protocols.

    With --count, OUT receives the layout files in subfolders of 1000 and rows.jsonl, with a row for each protocol and
    seed. A protocol and seed without a layout has a row with the reason; the exit code is then 1. An interrupted
    command resumes.

    Args:
        protocol: Id of a protocol, or a protocol's .json file. With --count also several, or all.
        seed: Random seed; the same seed gives the same layout on any machine. With --count the first one.
        room: Room preset (bay_small, bay, bay_large with two exits; tight, default, roomy, two_exits of the published
            layouts), size in meters such as 12x9, a room's .json file, or the outline of a .dxf drawing or of a ROS
            map's .yaml file (docs/engineers.md). Default: bay.
        profile: Thresholds to satisfy: default, strict, paper, or code (default, and a second exit is required).
        out: A .json file, or a folder for a file named after protocol, room and seed; by default the current folder.
            With --count a folder, which must be named.
        explain: Print the reason for each object.
        count: Number of layouts for each protocol, with the seeds SEED to SEED+COUNT-1.
        shard: With --count, number of layouts in a shard, the unit of work and of resuming.
        fresh: With --count, move the files of the folder aside and start anew.
        have: Inventory of what exists, a .csv file with the columns asset and count. Exit 1 with a line for each asset
            that the protocol requires and the inventory lacks; otherwise list what the layout places in addition.
    """
    if count is None:
        if len(protocol) != 1:
            raise OptionError(f"{len(protocol)} protocols; name one, or say how many layouts of each with --count")
        return _generate_one(protocol[0], seed, room, profile, out or Path(), explain, have)
    from labgym.layouts.batch import generate_batch

    if explain:
        raise OptionError("--explain is for a single layout; leave out --count")
    if have is not None:
        raise OptionError("--have is for a single layout; leave out --count")
    if out is None:
        raise OptionError("--count needs a folder for the layouts: name it with --out")
    batch = generate_batch(
        protocol, count, out, seed, room, profile, shard=shard, executor=execution.options(), fresh=fresh
    )
    written(out)
    print(batch.summary)
    return FAILED if batch.infeasible else DONE


def _generate_one(
    protocol: str, seed: int, room: str | None, profile: str, out: Path, explain: bool, have: Path | None
) -> int:
    from labgym import layouts
    from labgym.exchange.inventory import lacking, read_inventory, to_acquire

    resolved, catalog = protocols.resolve(protocol), Catalog.load()
    inventory = None if have is None else read_inventory(have, catalog)
    if inventory is not None:
        lacks = lacking([resolved], inventory, catalog)
        if lacks:
            return complaints([lack.message for lack in lacks])
    place = _room(room)
    layout = layouts.generate(resolved, seed=seed, room=place, profile=profile)
    note = layout.provenance.options.get("note")
    if note:
        print(f"note: {layout.provenance.options['furnishing']} furnishing only: {note}", file=sys.stderr)
    if inventory is not None:
        for lack in to_acquire((placement.asset for placement in layout.placements), inventory):
            print(f"note: {lack.message}", file=sys.stderr)
    if explain:
        for placement, reason in layouts.reasons(resolved, seed=seed, room=place, profile=profile).items():
            print(f"{placement}: {reason}")
    return written(layout.save(out if out.suffix == ".json" else out / f"{layout.id}.json"))


def _room(room: str | None) -> Room | str | None:
    """Return the room in a drawing or a ROS map; other arguments unchanged."""
    if room is None or not room.lower().endswith((".dxf", ".yaml", ".yml")):
        return room
    from labgym.exchange.formats import read_floor

    return read_floor(room).room
