"""Spoils and repairs laboratories, judged from outside: PYTHONPATH=tests python -m outside.repaired --out ROWS FILE...

Each case takes the next kind of fault and the next layout that has something of the kind: the drawn spoilings, wet
fittings and cabinets of water-reactives side by side, two drawn faults together, a building without an exit, a fault of
fixed objects, and the damage of the benchmark. A row of the output is one case. It passes if v = 0, the safety checker
finds nothing and the exit code is 0; without an exit, or with a fault of fixed objects (`INCURABLE`), if the exit code
is 1. A case is dishonest if the exit code is 0 with v > 0 or a finding.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
import time
from collections import Counter
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from outside.safety_checker import faults
from spoiling import DRAWN

from labgym.errors import LabgymError
from labgym.layouts import Layout
from labgym.layouts.moves import Place, apply, replaced
from labgym.layouts.repairs import repair_layout
from labgym.layouts.request import combination
from labgym.layouts.rules import evaluate_layout
from labgym.layouts.rules.safety.hazards import water_reactive
from labgym.layouts.rules.supplies import WET
from labgym.paper.damage import KINDS, damaged
from labgym.protocols import Protocol

INCURABLE = ("no_exit", "fixed_fault")
"""Kinds of faults that no repair cures."""
PIECES = 2
"""Pieces that are damaged."""
NEIGHBOR_GAP_M = 0.05
Draw = Callable[[Layout, Protocol, np.random.Generator], Layout]


def at_water(layout: Layout, _: Protocol, generator: np.random.Generator) -> Layout:
    """Put a cabinet that holds water-reactives next to a wet fitting, or the fitting next to the cabinet."""
    holding = {p.support for p in layout.placements if water_reactive(layout.asset(p.id))} & layout.by_id.keys()
    fittings = [p.id for p in layout.placements if layout.asset(p.id).subtype in WET and p.support == "floor"]
    if not holding or not fittings:
        return layout
    pair = [str(generator.choice(sorted(holding))), str(generator.choice(fittings))]
    mover, other = pair if generator.random() < 0.5 else pair[::-1]
    box, size = layout.box(other), layout.asset(mover).size
    along = (box.width + size.width) / 2.0 + NEIGHBOR_GAP_M
    x, y = box.x + along * math.cos(box.yaw), box.y + along * math.sin(box.yaw)
    return apply(layout, Place(mover, round(x, 4), round(y, 4), box.yaw))


def two(layout: Layout, protocol: Protocol, generator: np.random.Generator) -> Layout:
    """Draw two faults of different kinds."""
    for name in generator.permutation(sorted(DRAWN))[:2]:
        layout = DRAWN[str(name)].draw(layout, protocol, generator)
    return layout


def no_exit(layout: Layout, _: Protocol, __: np.random.Generator) -> Layout:
    """Wall up the doors that lead out, which no moved object cures."""
    data = layout.to_json()
    outer = {(way.wall, way.opening.position) for way in layout.floor.doorways if way.exit}
    for k, wall in enumerate(data["floor"]["walls"]):
        wall["openings"] = [one for one in wall["openings"] if (k, one["position"]) not in outer]
    return Layout.parse(data, "no exit")


def fixed_fault(layout: Layout, protocol: Protocol, generator: np.random.Generator) -> Layout:
    """Draw a fault and fix what takes part in it."""
    harmed = misplaced_or_skewed(layout, protocol, generator)
    moved = [one.id for one in harmed.placements if one != layout.by_id.get(one.id)]
    changed = {item: harmed.placement(item).model_copy(update={"fixed": True}) for item in moved}
    return harmed if harmed is layout else replaced(harmed, changed)


def misplaced_or_skewed(layout: Layout, protocol: Protocol, generator: np.random.Generator) -> Layout:
    """Draw an object where it does not belong, or skewed furniture."""
    name = ("misplaced", "skewed_furniture")[int(generator.integers(2))]
    return DRAWN[name].draw(layout, protocol, generator)


def hurt(kind: str, layout: Layout, _: Protocol, generator: np.random.Generator) -> Layout:
    """Return a layout with damage of a kind."""
    return damaged(layout, kind, PIECES, generator).layout


def kinds() -> dict[str, Draw]:
    """Return all kinds of faults by name."""
    spoilings: dict[str, Draw] = {name: one.draw for name, one in DRAWN.items()}
    own: dict[str, Draw] = {"at_water": at_water, "two": two, "no_exit": no_exit, "fixed_fault": fixed_fault}
    return {**spoilings, **own, **{name: partial(hurt, name) for name in KINDS}}


def spoilt(k: int, seed: int, paths: list[Path]) -> tuple[str, str, Layout, Layout]:
    """Return the kind of a case, the name of its layout, the layout, and the spoilt layout.

    Raises:
        LabgymError: no layout has anything of the kind.
    """
    drawn = kinds()
    kind = list(drawn)[k % len(drawn)]
    for turn in range(len(paths)):
        path = paths[(k + turn) % len(paths)]
        layout = Layout.load(path)
        protocol = combination(layout.protocols, layout.catalog)
        try:
            harmed = drawn[kind](layout, protocol, np.random.default_rng([seed, k]))
        except LabgymError:
            continue
        if harmed is not layout:
            return kind, path.stem, layout, harmed
    raise LabgymError(f"no layout can be spoilt in the way {kind!r}")


def case(k: int, seed: int, paths: list[Path]) -> dict[str, Any]:
    """Return the row of a case."""
    kind, name, sound, harmed = spoilt(k, seed, paths)
    start = time.process_time()
    result = repair_layout(harmed)
    seconds = time.process_time() - start
    after = result.layout
    judged = evaluate_layout(after, combination(after.protocols, after.catalog), navigation=True)
    found = [str(fault) for fault in faults(after.to_json())]
    return {
        "k": k,
        "kind": kind,
        "layout": name,
        "floor": sound.floor.name,
        "objects": len(harmed.placements),
        "cpu": round(seconds, 1),
        "v": [result.before.v, judged.v],
        "fitness": [round(result.before.fitness, 4), round(judged.fitness, 4)],
        "changes": [change.text for change in result.changes],
        "problems": list(result.problems),
        "checker": found,
        "sound": [str(fault) for fault in faults(sound.to_json())],
        "exit": 1 if result.problems else 0,
        "passed": bool(judged.v and result.problems)
        if kind in INCURABLE
        else not (judged.v or found or result.problems),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("layouts", nargs="+", type=Path)
    parser.add_argument("--first", type=int, default=0, help="number of the first case")
    parser.add_argument("--count", type=int, default=60)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", type=Path, required=True, help="file to which the rows are appended")
    arguments = parser.parse_args()
    total = Counter[str]()
    with arguments.out.open("a") as out:
        for k in range(arguments.first, arguments.first + arguments.count):
            row = case(k, arguments.seed, arguments.layouts)
            out.write(json.dumps(row) + "\n")
            out.flush()
            total["cases"] += 1
            total["passed"] += row["passed"]
            total["v = 0"] += not row["v"][1]
            total["checker clean"] += not row["checker"]
            total["dishonest"] += not row["exit"] and bool(row["v"][1] or row["checker"])
    sys.stdout.write(json.dumps(total) + "\n")


if __name__ == "__main__":
    main()
