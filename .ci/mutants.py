"""Mutation run: small changes of central modules, each of which a test must notice.

`python .ci/mutants.py [--each 8] [--seed 0] [--again] [MODULE ...]` works in a copy of the tree and prints a table.
Each test runs once without a change; a mutant then runs the tests that execute its line, fast ones first, for at most
`BUDGET_S`. It is killed if one of them fails or if they end at the time limit. A line that no test executes survives.
A mutant of a function gets its new code in a fork of the process that has imported everything; others import anew.
Results are appended to a file, so that a run goes on where the last one ended. Not part of `make test`.
"""

from __future__ import annotations

import argparse
import ast
import copy
import functools
import gc
import hashlib
import importlib
import itertools
import json
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import CodeType, FrameType, FunctionType
from typing import Any

import pytest
from hypothesis import Phase, settings

ROOT = Path(__file__).parents[1]
TABLE = Path(__file__).with_suffix(".txt")
"""A line for each module: its path, then the test files, or single tests, that must notice a change."""
EQUIVALENT = Path(__file__).with_name("mutants_equivalent.txt")
"""A line for each mutant that changes nothing a user can see: module, scope, change and reason, separated by " | "."""
BUDGET_S = 10.0
"""CPU seconds, without a change, of the tests that a mutant runs."""
UNPATCHED, RAISED = 77, 99
"""Exit codes of trials that cannot be made by a new code, and of those that end by an exception of their own."""
LIMIT_S, LIMIT_FACTOR = 40.0, 10.0
"""Seconds for the tests of one mutant: these, and this many times their CPU time without a change."""
COMPARED = {ast.Lt: ast.LtE, ast.LtE: ast.Lt, ast.Gt: ast.GtE, ast.GtE: ast.Gt, ast.Eq: ast.NotEq, ast.NotEq: ast.Eq}
SIGNED = {ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult}
PRELOADED = ("numpy", "scipy.ndimage", "scipy.optimize", "cv2", "gymnasium", "mujoco", "pydantic", "shapely")
"""Packages that every mutant would import again."""
COMPILED = ("entry", "inner")
"""Decorators of compiled functions; they are taken off: interpreted ones give the same results, and can be traced."""


@dataclass(frozen=True)
class Mutant:
    """A changed module.

    Attributes:
        kind, line: of the change. lines: of the statement that it is in; none if an import executes it.
        owner: the outermost function around it, "" if an import executes it.
        scope: the function or class around it. change: the text before and after.
        put: puts the new node in the module's tree, and the old one back.
    """

    kind: str
    line: int
    lines: range
    owner: str
    scope: str
    change: str
    put: Callable[[bool], ast.AST]

    @functools.cached_property
    def source(self) -> str:
        """The new module."""
        text = ast.unparse(ast.fix_missing_locations(self.put(True)))
        self.put(False)
        return text

    @property
    def digest(self) -> str:
        """Return the name of the mutant in the results."""
        return hashlib.sha256(self.source.encode()).hexdigest()[:12]


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
        for kind, new in changed(node):
            ast.copy_location(new, node)
            around = [node, *ancestors(node, places)]
            text = f"{shown(node)} -> {shown(new)}"
            change = functools.partial(changed_tree, tree, places[node], node, new)
            found.append(Mutant(kind, node.lineno, *executed(around), scope(around), text, change))
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


def ancestors(node: ast.AST, places: dict[Any, tuple[ast.AST, str, int | None]]) -> Iterator[ast.AST]:
    """Yield the nodes around a node, the nearest first."""
    while node in places:
        node = places[node][0]
        yield node


def scope(around: Sequence[ast.AST]) -> str:
    """Return the names of the classes and functions around a node, or "module"."""
    names = [node.name for node in around[1:] if isinstance(node, ast.FunctionDef | ast.ClassDef)]
    return ".".join(reversed(names)) or "module"


def executed(around: Sequence[ast.AST]) -> tuple[range, str]:
    """Return the lines of the innermost statement around a node, without its body, and the outermost function.

    Both are empty if an import executes the statement.
    """
    statement = next(node for node in around if isinstance(node, ast.stmt))
    owners = [index for index, node in enumerate(around) if isinstance(node, ast.FunctionDef) and node is not statement]
    if not owners:
        return range(0), ""
    body = getattr(statement, "body", None)
    last = body[0].lineno - 1 if isinstance(body, list) else statement.end_lineno
    lines = range(statement.lineno, max(last or 0, statement.lineno) + 1)
    return lines, scope([ast.Pass(), *around[owners[-1] :]])


def shown(node: ast.AST) -> str:
    """Return a node on one line: of a statement with a body its condition."""
    text = ast.unparse(node.test if isinstance(node, ast.If | ast.While) else node)
    return " ".join(text.split())


def changed_tree(
    tree: ast.AST, place: tuple[ast.AST, str, int | None], node: ast.AST, new: ast.AST, is_new: bool
) -> ast.AST:
    """Return a tree after putting a new node, or the old one, in its place."""
    parent, name, index = place
    if index is None:
        setattr(parent, name, new if is_new else node)
    else:
        getattr(parent, name)[index] = new if is_new else node
    return tree


def drawn(module: str, source: str, each: int, seed: int) -> list[Mutant]:
    """Return `each` random mutants of a module, a quarter or more of them constants if it has so many."""
    generator, all_mutants = random.Random(f"{seed} {module}"), mutants(source)
    constants = [one for one in all_mutants if one.kind == "constant"]
    others = [one for one in all_mutants if one.kind != "constant"]
    count = min(len(constants), max(each // 3, each - len(others)))
    return generator.sample(constants, count) + generator.sample(others, min(len(others), each - count))


def interpreted(source: str) -> str:
    """Return a module without the decorators of compiled functions, its lines as before."""
    marks = tuple(f"@{name}" for name in COMPILED)
    return "".join("\n" if line.rstrip() in marks else line for line in source.splitlines(keepends=True))


class Tracer:
    """Records which lines of some modules are executed between `start` and `end`, and the CPU seconds.

    Args:
        modules: names of the modules by their paths.
    """

    def __init__(self, modules: dict[str, str]) -> None:
        self._modules = modules
        self._lines: dict[str, set[int]] = {}
        self._begin = 0.0

    def start(self) -> None:
        """Begin to record."""
        self._lines, self._begin = {}, sum(os.times()[:4])
        sys.settrace(self._call)

    def end(self) -> dict[str, Any]:
        """Return the seconds and the lines by module since the start."""
        sys.settrace(None)
        lines = {self._modules[path]: sorted(lines) for path, lines in self._lines.items()}
        return {"seconds": sum(os.times()[:4]) - self._begin, "lines": lines}

    def _call(self, frame: FrameType, *_: object) -> Callable[..., Any] | None:
        return self._line if frame.f_code.co_filename in self._modules else None

    def _line(self, frame: FrameType, *_: object) -> Callable[..., Any]:
        self._lines.setdefault(frame.f_code.co_filename, set()).add(frame.f_lineno)
        return self._line


def forked(action: Callable[[], int], limit: float) -> int:
    """Return the exit code of an action in a child process; 124 if it is killed after `limit` seconds."""
    child = os.fork()
    if not child:
        os.setsid()
        null = os.open(os.devnull, os.O_RDWR)
        for stream in (0, 1, 2):
            os.dup2(null, stream)
        code = RAISED
        try:
            code = int(action())
        finally:
            os._exit(code)
    end = time.monotonic() + limit
    while time.monotonic() < end:
        done, status = os.waitpid(child, os.WNOHANG)
        if done:
            return os.waitstatus_to_exitcode(status)
        time.sleep(0.05)
    os.killpg(child, signal.SIGKILL)
    os.waitpid(child, 0)
    return 124


class Quick:
    """A plugin of pytest: the first failure ends the process; Hypothesis looks for no smaller example."""

    @pytest.hookimpl
    def pytest_collection_finish(self) -> None:
        """Load settings of Hypothesis."""
        phases = (Phase.explicit, Phase.generate)
        settings.register_profile("mutants", settings.default, phases=phases, derandomize=True, database=None)
        settings.load_profile("mutants")

    @pytest.hookimpl
    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """End the process at a failure."""
        if report.failed:
            os._exit(1)


OPTIONS = ("-q", "-x", "-p", "no:cacheprovider", "-s", "--tb=no", "--assert=plain")


class Trial(Quick):
    """A plugin of pytest that tries mutants of functions in forks of the process that has collected the tests.

    Args:
        tree: a copy of the tree. table: test files by module, relative to it.
        draws: mutants by module. results: file to which verdicts are appended. traces: file of what tests execute.
    """

    def __init__(
        self, tree: Path, table: dict[str, list[str]], draws: dict[str, list[Mutant]], results: Path, traces: Path
    ) -> None:
        self._tree, self._table, self._draws, self._results, self._file = tree, table, draws, results, traces
        self._traces: dict[str, dict[str, Any]] = {}
        if traces.exists():
            self._traces = json.loads(traces.read_text(encoding="utf-8"))

    @pytest.hookimpl
    def pytest_runtestloop(self, session: pytest.Session) -> bool:
        """Trace the test files and try the mutants."""
        items = {item.nodeid: item for item in session.items}
        for module, drawn in self._draws.items():
            for file in self._table[module]:
                self._trace(file, [item for item in session.items if belongs(item.nodeid, file)])
            functions = self._functions(module)
            for mutant in drawn:
                tests, seconds = self.tests(module, mutant)
                if mutant.owner or not tests:
                    action = functools.partial(
                        self._patched, functions, module, mutant, [items[name] for name in tests]
                    )
                    self.verdict(module, mutant, tests, seconds, action)
        return True

    def _trace(self, file: str, items: Sequence[pytest.Item]) -> None:
        """Run the tests of a file without a change."""
        paths = [self._tree / name for name in (file.partition("::")[0], *self._table)]
        digest = hashlib.sha256(b"".join(path.read_bytes() for path in paths)).hexdigest()
        if self._traces.get(file, {}).get("digest") == digest:
            return
        path, tests = self._tree.with_name("trace.json"), {}

        def action() -> int:
            tracer = Tracer({str(self._tree / module): module for module in self._table})
            for item, following in itertools.zip_longest(items, items[1:]):
                tracer.start()
                item.ihook.pytest_runtest_protocol(item=item, nextitem=following)
                tests[item.nodeid] = tracer.end()
            path.write_text(json.dumps({"digest": digest, "tests": tests}), encoding="utf-8")
            return 0

        if forked(action, 3600.0) != 0:
            sys.exit(f"{file}: a test fails without a change")
        self._traces[file] = json.loads(path.read_text(encoding="utf-8"))
        self._file.write_text(json.dumps(self._traces), encoding="utf-8")
        print(f"{file}: {sum(test['seconds'] for test in self._traces[file]['tests'].values()):.1f} s", flush=True)

    def tests(self, module: str, mutant: Mutant) -> tuple[list[str], float]:
        """Return the tests that execute a mutant, fast ones first, and their CPU seconds.

        What an import executes may matter to every test: those that execute a function of the module come first.
        """
        ranked = []
        for file in self._table[module]:
            for test, trace in self._traces[file]["tests"].items():
                lines = trace["lines"].get(module, [])
                if not mutant.lines or not set(lines).isdisjoint(mutant.lines):
                    ranked.append((not lines, trace["seconds"], test))
        chosen, total = [], 0.0
        for _, seconds, test in sorted(ranked):
            if total + seconds <= BUDGET_S:
                chosen.append(test)
                total += seconds
        return chosen, total

    def _functions(self, module: str) -> dict[str, list[FunctionType]]:
        """Return the functions of a module by name, wherever they are kept."""
        path, functions = str(self._tree / module), {}
        for thing in gc.get_objects():
            if isinstance(thing, FunctionType) and thing.__code__.co_filename == path:
                functions.setdefault(thing.__code__.co_qualname, []).append(thing)
        return functions

    def _patched(
        self, functions: dict[str, list[FunctionType]], module: str, mutant: Mutant, items: Sequence[pytest.Item]
    ) -> int:
        """Give a mutant's function its new code and run tests; return `UNPATCHED` if that is not possible."""
        codes = [compile(mutant.source, str(self._tree / module), "exec")]
        found = []
        while codes:
            inner = [constant for constant in codes.pop().co_consts if isinstance(constant, CodeType)]
            found += [code for code in inner if code.co_qualname == mutant.owner]
            codes += inner
        inside = [name for name in functions if name.startswith(f"{mutant.owner}.<locals>")]
        if len(found) != 1 or len(functions.get(mutant.owner, ())) != 1 or inside:
            return UNPATCHED
        function = functions[mutant.owner][0]
        if function.__code__.co_freevars != found[0].co_freevars:
            return UNPATCHED
        function.__code__ = found[0]
        for item, following in itertools.zip_longest(items, items[1:]):
            item.ihook.pytest_runtest_protocol(item=item, nextitem=following)
        return 0

    def fresh(self) -> None:
        """Try the other mutants, in processes that import the changed module."""
        self._traces = json.loads(self._file.read_text(encoding="utf-8"))
        for module, drawn in self._draws.items():
            for mutant in drawn:
                if mutant.digest not in verdicts(self._results):
                    tests, seconds = self.tests(module, mutant)
                    action = functools.partial(pytest.main, [*OPTIONS, *tests], [Quick()])
                    self.verdict(module, mutant, tests, seconds + 20.0, action)

    def verdict(
        self, module: str, mutant: Mutant, tests: Sequence[str], seconds: float, action: Callable[[], int]
    ) -> None:
        """Run the tests on a mutant and append what came out."""
        path, verdict, start = self._tree / module, "no test", time.monotonic()
        if tests:
            source = path.read_text(encoding="utf-8")
            path.write_text(mutant.source, encoding="utf-8")
            code = forked(action, LIMIT_S + LIMIT_FACTOR * seconds)
            path.write_text(source, encoding="utf-8")
            if code == UNPATCHED:
                return
            if code == RAISED:
                sys.exit(f"{module}:{mutant.line} {mutant.change}: its trial raised an exception")
            verdict = {0: "survived", 124: "killed (time)"}.get(code, "killed")
        row = {"module": module, "digest": mutant.digest, "kind": mutant.kind, "line": mutant.line}
        row |= {"scope": mutant.scope, "change": mutant.change, "verdict": verdict, "tests": len(tests)}
        with self._results.open("a", encoding="utf-8") as stream:
            stream.write(json.dumps(row | {"seconds": round(time.monotonic() - start, 1)}) + "\n")
        print(f"{verdict}: {module}:{mutant.line} {mutant.scope} | {mutant.change} | {len(tests)} tests", flush=True)


def belongs(test: str, file: str) -> bool:
    """Whether a test is that of the table, or one of its file or of its parameters."""
    return test == file or test.startswith((f"{file}::", f"{file}["))


@functools.lru_cache(maxsize=1)
def equivalent() -> set[tuple[str, str, str]]:
    """Return module, scope and change of the mutants that change nothing."""
    lines = EQUIVALENT.read_text(encoding="utf-8").splitlines() if EQUIVALENT.exists() else []
    return {tuple(line.split(" | ")[:3]) for line in lines if line}  # type: ignore[misc]


def is_equivalent(row: dict[str, Any]) -> bool:
    """Whether a verdict is on a mutant that changes nothing."""
    return (row["module"], row["scope"], row["change"]) in equivalent()


def report(table: Sequence[str], rows: Sequence[dict[str, Any]]) -> str:
    """Return the table of the verdicts: a row for each module, then for all and for constants."""

    def counted(name: str, rows: Sequence[dict[str, Any]]) -> str:
        killed = sum(row["verdict"].startswith("killed") for row in rows)
        alive = [row for row in rows if not row["verdict"].startswith("killed")]
        idle = sum(is_equivalent(row) for row in alive)
        share = f"{100.0 * killed / (len(rows) - idle):.0f}%" if len(rows) > idle else "-"
        return f"| {name} | {len(rows)} | {killed} | {len(alive) - idle} | {idle} | {share} |"

    named = [(f"`{name.removeprefix('labgym/')}`", [row for row in rows if row["module"] == name]) for name in table]
    named += [
        (f"all: {kind}", [row for row in rows if row["kind"] == kind]) for kind in sorted({r["kind"] for r in rows})
    ]
    lines = ["| module | mutants | killed | survived | equivalent | killed of the rest |", "|---|--:|--:|--:|--:|--:|"]
    return "\n".join([*lines, *(counted(name, found) for name, found in named), counted("all", rows)])


def main() -> int:
    """Run the mutants of the table's modules, or of those that are named; print survivors and shares."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("modules", nargs="*", help="only these of the table")
    parser.add_argument("--each", type=int, default=8, help="mutants of a module, a quarter of them constants")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--results", type=Path, default=Path(tempfile.gettempdir()) / "labgym_mutants.jsonl")
    parser.add_argument("--again", action="store_true", help="run those again that survived, except equivalent ones")
    options = parser.parse_args()
    results = options.results.resolve()
    traces = results.with_suffix(".traces.json")
    table = {line.split()[0]: line.split()[1:] for line in TABLE.read_text(encoding="utf-8").splitlines() if line}
    chosen = {module: table[module] for module in options.modules or table}
    if options.again:
        rows = [
            row
            for row in verdicts(results).values()
            if row["verdict"].startswith("killed") or is_equivalent(row) or row["module"] not in chosen
        ]
        results.write_text("".join(json.dumps(row) + "\n" for row in rows), encoding="utf-8")
    sources = {module: interpreted((ROOT / module).read_text(encoding="utf-8")) for module in table}
    draws = {module: drawn(module, sources[module], options.each, options.seed) for module in chosen}
    with tempfile.TemporaryDirectory() as folder:
        tree = Path(folder).resolve() / "tree"
        tracked = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
        for name in tracked.splitlines():
            (tree / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, tree / name)
        for module, source in sources.items():
            (tree / module).write_text(source, encoding="utf-8")
        os.chdir(tree)
        os.environ |= {"PYTHONPATH": str(tree), "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
        sys.path.insert(0, str(tree))
        for name in PRELOADED:
            importlib.import_module(name)
        known, left = verdicts(results), {}
        for module, found in draws.items():
            left[module] = [mutant for mutant in found if mutant.digest not in known]
        files = sorted({file for module, found in left.items() if found for file in table[module]})
        trial = Trial(tree, table, {module: found for module, found in left.items() if found}, results, traces)
        if files:
            sys.stdout.flush()
            if not (child := os.fork()):
                os._exit(pytest.main([*OPTIONS, *files], [trial]))
            os.waitpid(child, 0)
            trial.fresh()
    known = verdicts(results)
    rows = [known[one.digest] for found in draws.values() for one in found if one.digest in known]
    print(report(list(chosen), rows))
    return 0


def verdicts(results: Path) -> dict[str, dict[str, Any]]:
    """Return the latest row of each mutant by its digest."""
    lines = results.read_text(encoding="utf-8").splitlines() if results.exists() else []
    return {row["digest"]: row for row in map(json.loads, lines)}


if __name__ == "__main__":
    sys.exit(main())
