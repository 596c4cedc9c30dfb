"""Publication of the splits of floors: `python -m labgym.eval.publication`.

It makes the first floors of floors-val, floors-seen and floors-test with the splits' own seeds, checks each of them,
and writes `layouts/SPLIT/` and `eval/suites/SPLIT.json`; with `--secret-file` it makes the floors of floors-sealed, and
writes their hashes alone. A published split never changes: a new generator publishes under a new name. With `--check`
it checks the published files and writes nothing.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from pathlib import Path

from labgym.artefacts import artefacts
from labgym.eval.driving.floor_suites import commitment_to, floor_suite, suite_floors
from labgym.eval.outside import WrittenPlan, findings
from labgym.layouts import Layout
from labgym.layouts.request import combination
from labgym.layouts.rules.objective import evaluate_layout
from labgym.layouts.rules.rule_sets import RULE_SETS
from labgym.layouts.sealed import COMMITMENT, SEALED, SEALED_FLOORS, read_secret
from labgym.layouts.splits import publish
from labgym.navigation import ShortestPaths
from labgym.navigation.drives import SHORTEST
from labgym.runs import ExecutorOptions, Shard, ShardOutput, run_shards
from labgym.suites import Suite, SuiteDrive, load_suite

COUNTS = {"floors-val": 30, "floors-seen": 30, "floors-test": 102}
"""Numbers of published floors, the same of each of the three families of a split."""
SHORTER = 1e-6
"""Rounding of path lengths, meters."""


def faults(layout: Layout, drives: Sequence[SuiteDrive]) -> list[str]:
    """Return what is wrong with a floor and its drives, one sentence each.

    Checked are polygons of the written file (`labgym.eval.outside`), the violations under each rule set
    for all of its protocols together, and an exact path of at least 2 m for every drive.
    """
    written = json.loads(json.dumps(layout.to_json()))
    problems = [f"{one.kind}: {', '.join(one.who)} ({one.value:.4f})" for one in findings(WrittenPlan(written))]
    protocol = combination(layout.protocols, layout.catalog)
    for rules in RULE_SETS.values():
        assessment = evaluate_layout(layout, protocol, rules=rules, navigation=True)
        if assessment.v:
            problems.append(f"{assessment.v} violations under {rules.name}")
    paths = ShortestPaths(layout)
    for number, drive in enumerate(drives):
        path = paths.path(drive.start, drive.goal)
        if path is None or path.length < SHORTEST - SHORTER:
            problems.append(f"drive {number}: {'no path' if path is None else f'{path.length:.3f} m'}")
    return [f"{layout.id}: {problem}" for problem in problems] + ([] if drives else [f"{layout.id}: no drive"])


def check_floor(path: str, drives: Sequence[SuiteDrive]) -> ShardOutput:
    """Return the faults of a layout's file and of its drives."""
    return ShardOutput({"faults.json": json.dumps(faults(Layout.load(path), drives)).encode()})


def check_floors(suite: Suite, folder: Path, executor: ExecutorOptions) -> list[str]:
    """Return the faults of all floors of a suite, whose files are in a folder."""
    every = suite.drives or {}
    shards = [Shard(name, check_floor, (str(folder / f"{name}.json"), drives)) for name, drives in every.items()]
    run = run_shards(shards, None, executor, "checks", "floor")
    return [fault for _, output in run for fault in json.loads(output.files["faults.json"])]


def check_published(split: str, executor: ExecutorOptions) -> list[str]:
    """Return the faults of the published floors of a split."""
    return check_floors(load_suite(split), artefacts("layouts") / split, executor)


def publish_floors(split: str, out: Path, executor: ExecutorOptions) -> list[str]:
    """Make the floors of a split in a folder of their run, publish them with their suite, and return their faults."""
    suite = floor_suite(split, COUNTS[split], out, executor=executor)
    problems = check_floors(suite, out / "layouts", executor)
    publish(split, suite_floors(suite, out), artefacts("layouts"))
    described = f"Drives on the {COUNTS[split]} published floors of {split}."
    published = suite.model_copy(update={"split": split, "description": described})
    published.save(artefacts("eval") / "suites" / f"{split}.json")
    return problems


def publish_sealed(secret: bytes, out: Path, executor: ExecutorOptions) -> list[str]:
    """Make the sealed floors in a folder of their run, publish their hashes, and return their faults."""
    suite = floor_suite(SEALED, SEALED_FLOORS, out, secret=secret, executor=executor)
    problems = check_floors(suite, out / "layouts", executor)
    commitment = commitment_to(secret, suite, suite_floors(suite, out))
    commitment.save(artefacts("layouts") / SEALED / COMMITMENT)
    return problems


def main(arguments: Sequence[str] | None = None) -> int:
    """Publish splits of floors, or check the published ones; return 1 if a floor has a fault."""
    parser = argparse.ArgumentParser(prog="python -m labgym.eval.publication", description=__doc__)
    parser.add_argument("--split", choices=[*COUNTS], help="by default all")
    parser.add_argument("--check", action="store_true", help="check the published files")
    parser.add_argument("--secret-file", type=Path, help="secret of floors-sealed, which is then published alone")
    parser.add_argument("--out", type=Path, default=Path("runs/publication"), help="folder of the runs, which resume")
    parser.add_argument("--workers", type=int, default=1)
    options = parser.parse_args(arguments)
    executor = ExecutorOptions(workers=options.workers)
    if options.secret_file is not None:
        problems = publish_sealed(read_secret(options.secret_file), options.out / SEALED, executor)
    else:
        problems = []
        for split in [options.split] if options.split else [*COUNTS]:
            out = options.out / split
            problems += check_published(split, executor) if options.check else publish_floors(split, out, executor)
    for problem in problems:
        sys.stderr.write(f"{problem}\n")
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
