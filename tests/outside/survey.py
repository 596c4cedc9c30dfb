"""Checks many generated floors from outside: PYTHONPATH=tests python -m outside.survey --seed 1 --out rows.jsonl.

Every family, every level of clutter and many protocols occur. A row of the output is one floor.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections import Counter
from pathlib import Path

from outside.simulator import simulator_findings

from labgym.errors import InfeasibleError
from labgym.eval.outside import WrittenPlan, findings
from labgym.layouts import generate
from labgym.protocols import protocols
from labgym.scenes import to_mjcf

FAMILIES = ("bay", "ell", "double", "suite", "refit")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, required=True, help="first seed")
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--out", type=Path, required=True)
    arguments = parser.parse_args()
    names, total = sorted(protocols()), Counter[str]()
    with arguments.out.open("w") as out:
        for k in range(arguments.count):
            family, clutter = FAMILIES[k % 5], (k // 5) % 4
            chosen = [names[(7 * k) % len(names)]] + ([names[(7 * k + 11) % len(names)]] if k % 6 == 0 else [])
            case = {"family": family, "clutter": clutter, "seed": arguments.seed + k, "protocols": chosen}
            try:
                layout = generate(chosen, arguments.seed + k, family=family, clutter=clutter)
            except InfeasibleError as error:
                total["infeasible"] += 1
                out.write(json.dumps({**case, "infeasible": str(error)}) + "\n")
                continue
            plan = WrittenPlan(json.loads(json.dumps(layout.to_json())))
            wrong = findings(plan) + simulator_findings(plan, to_mjcf(layout, visible=False).compile())
            total["floors"] += 1
            total["clean"] += not wrong
            total.update(finding.kind for finding in wrong)
            rows = [[finding.kind, *finding.who, round(finding.value, 4)] for finding in wrong]
            out.write(json.dumps({**case, "objects": len(plan.items), "findings": rows}) + "\n")
            out.flush()
    sys.stdout.write(json.dumps(total) + "\n")


if __name__ == "__main__":
    main()
