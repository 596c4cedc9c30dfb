"""Furnishes fresh rooms and floors, and counts what breaks rules: PYTHONPATH=tests python -m outside.fresh --out ROWS.

Every preset, sizes of rooms, every family, all protocols and combinations of them occur; every third request has a
protocol with water-reactive reagents. A row of the output is one request: CPU time, and which rules it breaks.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
import warnings
from collections import Counter
from pathlib import Path
from typing import Any

from labgym.errors import LabgymError
from labgym.layouts import generate
from labgym.layouts.request import combination
from labgym.layouts.rules import rule_set
from labgym.layouts.rules.objective import evaluate_layout
from labgym.protocols import protocols

LIMITS = rule_set("touchstone")
WATER_REACTIVE = ("red_05", "red_01", "red_05", "alk_02", "pro_03", "red_05", "fgt_01", "alk_04")
PLACES: tuple[dict[str, str], ...] = (
    {"room": "bay"},
    {"family": "bay"},
    {"room": "12x9"},
    {"family": "ell"},
    {"room": "bay_large"},
    {"family": "double"},
    {"room": "two_exits"},
    {"family": "suite"},
    {"room": "10x7.5"},
    {"family": "refit"},
    {"room": "roomy"},
)


def request(k: int) -> dict[str, Any]:
    """Return the arguments of the k-th request, but its seed."""
    names = sorted(protocols())
    place = PLACES[k % len(PLACES)]
    chosen = [WATER_REACTIVE[(k // 3) % len(WATER_REACTIVE)] if k % 3 == 0 else names[(7 * k) % len(names)]]
    large = place.get("family") in ("double", "suite", "refit") or place.get("room") == "12x9"
    if large and k % 4 < 2:
        chosen.append(names[(7 * k + 11) % len(names)])
    return {"protocol": list(dict.fromkeys(chosen)), **place}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--first", type=int, default=0, help="number of the first request")
    parser.add_argument("--count", type=int, default=20)
    parser.add_argument("--seed", type=int, default=50_000, help="seed of request 0")
    parser.add_argument("--out", type=Path, required=True, help="file to which the rows are appended")
    parser.add_argument("--layouts", type=Path, help="folder for the layouts")
    arguments = parser.parse_args()
    warnings.simplefilter("ignore")
    total, rules = Counter[str](), Counter[str]()
    with arguments.out.open("a") as out:
        for k in range(arguments.first, arguments.first + arguments.count):
            case, start = request(k), time.process_time()
            row: dict[str, Any] = {"k": k, "seed": arguments.seed + k, **case}
            try:
                layout = generate(seed=arguments.seed + k, rules=LIMITS, **case)  # as the command does
            except LabgymError as error:
                row |= {"error": type(error).__name__, "message": str(error)}
                total[row["error"]] += 1
            else:
                row["cpu"] = round(time.process_time() - start, 2)
                together = combination(layout.protocols, layout.catalog)
                judged = evaluate_layout(layout, together, rules="touchstone", navigation=True)
                row |= {"objects": len(layout.placements), "v": judged.v}
                row["violations"] = [[each.kind, each.message] for each in judged.violations.items]
                row["issues"] = [[each.rule, each.severity, each.message] for each in judged.issues]
                total["layouts"] += 1
                total["clean"] += judged.v == 0
                rules.update(each.rule for each in judged.issues)
                if arguments.layouts is not None:
                    layout.save(arguments.layouts / f"{k:04d}.json")
            row.setdefault("cpu", round(time.process_time() - start, 2))
            out.write(json.dumps(row) + "\n")
            out.flush()
    sys.stdout.write(json.dumps({**total, "issues": dict(rules)}) + "\n")


if __name__ == "__main__":
    main()
