"""Mutation run: small changes of central modules, each of which a test must notice.

`python .ci/mutants.py [--each 6] [--seed 0] [MODULE ...]` works in a copy of the tree and prints a table. A mutant is
killed if one of the module's test paths fails or ends at the time limit. Not part of `make test`.
"""

from __future__ import annotations

import argparse
import ast
import copy
import os
import random
import shutil
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
TABLE = Path(__file__).with_suffix(".txt")
"""A line for each module: its path, then the test paths that must notice a change, fastest first."""
LIMIT_S = 900
"""Seconds for the tests of one mutant."""
COMPARED = {ast.Lt: ast.LtE, ast.LtE: ast.Lt, ast.Gt: ast.GtE, ast.GtE: ast.Gt, ast.Eq: ast.NotEq, ast.NotEq: ast.Eq}
SIGNED = {ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult}


@dataclass(frozen=True)
class Mutant:
    """A changed module: the kind of the change, its line, and the new source."""

    kind: str
    line: int
    source: str


def changed(node: ast.AST) -> Iterator[tuple[str, ast.AST]]:
    """Yield the kinds of changes of a node, with the node that replaces it."""
    new = copy.deepcopy(node)
    match node:
        case ast.Constant(value=bool() as value):
            new.value = not value
            yield "constant", new
        case ast.Constant(value=int() | float() as value):
            new.value = value * 1.2 if isinstance(value, float) and value else value + 1
            yield "constant", new
        case ast.Compare(ops=[op]) if type(op) in COMPARED:
            new.ops = [COMPARED[type(op)]()]
            yield "comparison", new
        case ast.BinOp(op=op) if type(op) in SIGNED:
            new.op = SIGNED[type(op)]()
            yield "sign", new
        case ast.If() | ast.IfExp() | ast.While():
            new.test = ast.UnaryOp(ast.Not(), node.test)
            yield "negation", new
        case ast.Return(value=value) if value is not None and not isinstance(value, ast.Constant):
            new.value = ast.Constant(None)
            yield "return", new
        case ast.Expr(value=ast.Call()):
            yield "dropped call", ast.Pass()


def mutants(source: str) -> list[Mutant]:
    """Return all mutants of a module; annotations, docstrings, error messages and `__all__` stay as they are."""
    tree = ast.parse(source)
    places: dict[Any, tuple[ast.AST, str, int | None]] = {}
    for parent in ast.walk(tree):
        for name, value in ast.iter_fields(parent):
            for index, child in enumerate(value if isinstance(value, list) else [value]):
                if isinstance(child, ast.AST):
                    places[child] = (parent, name, index if isinstance(value, list) else None)
    found = []
    for node in list(ast.walk(tree)):
        if node is tree or unchanged(node, places):
            continue
        parent, name, index = places[node]
        for kind, new in changed(node):
            ast.copy_location(new, node)
            put(parent, name, index, new)
            found.append(Mutant(kind, node.lineno, ast.unparse(ast.fix_missing_locations(tree))))
            put(parent, name, index, node)
    return found


def unchanged(node: ast.AST, places: dict[Any, tuple[ast.AST, str, int | None]]) -> bool:
    """Whether a node only types, documents or words something."""
    while node in places:
        parent, name, _ = places[node]
        if name in ("annotation", "returns") or isinstance(parent, ast.Raise | ast.JoinedStr | ast.Assert):
            return True
        if isinstance(parent, ast.If) and getattr(parent.test, "id", "") == "TYPE_CHECKING":
            return True
        node = parent
    return False


def put(parent: ast.AST, name: str, index: int | None, node: ast.AST) -> None:
    """Put a node in its parent's field."""
    if index is None:
        setattr(parent, name, node)
    else:
        getattr(parent, name)[index] = node


def survives(tree: Path, tests: list[str]) -> bool:
    """Whether every test passes in a copy of the tree."""
    command = [sys.executable, "-m", "pytest", "-q", "-x", "-p", "no:cacheprovider", *tests]
    environment = {**os.environ, "PYTHONPATH": str(tree)}
    try:
        done = subprocess.run(command, cwd=tree, env=environment, capture_output=True, check=False, timeout=LIMIT_S)
    except subprocess.TimeoutExpired:
        return False
    return done.returncode == 0


def main() -> int:
    """Run the mutants of the table's modules, or of those that are named; print survivors and shares."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("modules", nargs="*", help="only these of the table")
    parser.add_argument("--each", type=int, default=6, help="mutants of a module, a third of them constants")
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    lines = [line.split() for line in TABLE.read_text(encoding="utf-8").splitlines() if line]
    chosen = [line for line in lines if not options.modules or line[0] in options.modules]
    killed: Counter[str] = Counter()
    made: Counter[str] = Counter()
    with tempfile.TemporaryDirectory() as folder:
        tree = Path(folder) / "tree"
        tracked = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
        for name in tracked.splitlines():
            (tree / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, tree / name)
        for module, *tests in chosen:
            source = (ROOT / module).read_text(encoding="utf-8")
            if not survives(tree, tests):
                sys.exit(f"{module}: its tests fail without a change")
            generator, all_mutants = random.Random(f"{options.seed} {module}"), mutants(source)
            constants = [one for one in all_mutants if one.kind == "constant"]
            others = [one for one in all_mutants if one.kind != "constant"]
            count = min(len(constants), options.each // 3)
            drawn = generator.sample(constants, count)
            drawn += generator.sample(others, min(len(others), options.each - count))
            for mutant in drawn:
                (tree / module).write_text(mutant.source, encoding="utf-8")
                alive = survives(tree, tests)
                made[mutant.kind] += 1
                killed[mutant.kind] += not alive
                print(f"{'SURVIVED' if alive else 'killed'} {module}:{mutant.line} {mutant.kind}", flush=True)
            (tree / module).write_text(source, encoding="utf-8")
    print("\n| kind | mutants | killed |\n|---|--:|--:|")
    for kind in sorted(made):
        print(f"| {kind} | {made[kind]} | {killed[kind]} |")
    print(f"| all | {made.total()} | {killed.total()} |")
    return 0


if __name__ == "__main__":
    sys.exit(main())
