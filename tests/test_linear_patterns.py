"""Every regular expression over text of users takes linear time: patterns are found by walking the modules."""

from __future__ import annotations

import ast
import functools
import importlib
import pkgutil
import random
import re
import re._parser as sre  # type: ignore[import-not-found]
import signal
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

import labgym

PACKAGES = ("protocols", "assets", "exchange", "llm", "quantities", "units", "errors", "documents", "table")
LENGTH = 4_000
SUSPECT_S = 0.04
"""CPU seconds from which the growth is measured; a linear pattern takes milliseconds, a quadratic one seconds."""
LIMIT_S = 1.0
"""CPU seconds after which a search is ended."""
MAX_RATIO = 3.0
"""Largest growth of the time from half the length to `LENGTH`; linear is 2, quadratic 4."""
METHODS = ("search", "match", "fullmatch", "finditer")
ALIASES = {"findall": "finditer", "sub": "finditer", "subn": "finditer", "split": "finditer"}
FRAGMENTS = (
    *(" ", "\n", "a", "A", "1", "(", ")", "[", "-", ",", ".", "/", ":", "_", "'", "%", "{", "<", "&", "=", "µ", "°"),
    *("a ", " a", "1 ", "1.", "1,", "1-", "1/", "1:", ",1", "a,", "a.", "a-", "(a", "a(", "((", "a)", "Aa", "A1", "; "),
    *("yl ", "yl-", "methyl ", "methyl-", "acetyl the ", "the ", "of the ", "and ", "in a ", "add to ", "make ", "H2"),
    *(
        "1 g ",
        "1 mL of ",
        "2 x ",
        "0.0 ",
        "1:1 ",
        "C6",
        "(C",
        "ab cd ",
        "甲",
        "一",
        "酸",
        "，",
        "（",
        "得",
        "0°",
        "<a ",
    ),
)
CATEGORIES = {"DIGIT": "1", "SPACE": " ", "WORD": "a", "NOT_SPACE": "a", "NOT_WORD": " ", "NOT_DIGIT": "a"}


class _TooSlowError(Exception):
    pass


def _modules() -> Iterator[Any]:
    for package in PACKAGES:
        module = importlib.import_module(f"labgym.{package}")
        yield module
        for info in pkgutil.walk_packages(getattr(module, "__path__", []), f"{module.__name__}."):
            yield importlib.import_module(info.name)


def _patterns_in(value: Any, depth: int = 0) -> Iterator[re.Pattern[Any]]:
    """Yield the patterns in a value, its containers and its attributes."""
    if isinstance(value, re.Pattern):
        yield value
    elif depth < 6:
        parts: list[Any] = []
        if isinstance(value, dict):
            parts = [*value, *value.values()]
        elif isinstance(value, list | tuple | set | frozenset) and len(value) < 5000:
            parts = [*value]
        elif type(value).__module__.startswith("labgym"):
            slots = [getattr(value, name, None) for name in getattr(type(value), "__slots__", ())]
            parts = [*getattr(value, "__dict__", {}).values(), *slots]
        for part in parts:
            yield from _patterns_in(part, depth + 1)


def _named() -> Iterator[tuple[str, str, re.Pattern[Any]]]:
    """Yield module, name and pattern for each pattern of a module, a class, or a cached function without arguments."""
    for module in _modules():
        for name, value in [*vars(module).items()]:
            if isinstance(value, type):
                values = [*vars(value).values()] if value.__module__ == module.__name__ else []
            elif isinstance(value, functools._lru_cache_wrapper):
                own = value.__module__ == module.__name__
                simple = own and not value.__wrapped__.__code__.co_argcount
                values = [value()] if simple else []
            else:
                values = [value]
            for each in values:
                for pattern in _patterns_in(each):
                    yield module.__name__, name, pattern


def _sources() -> Iterator[Path]:
    root = Path(labgym.__file__).parent
    for package in PACKAGES:
        yield from (root / package).rglob("*.py") if (root / package).is_dir() else (root / f"{package}.py",)


def _inline() -> Iterator[tuple[str, str, str]]:
    """Yield place, pattern and method of each call such as re.search("...", text)."""
    for path in _sources():
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.args:
                named = isinstance(node.func.value, ast.Name) and node.func.value.id == "re"
                method = ALIASES.get(node.func.attr, node.func.attr)
                if named and method in METHODS and isinstance(node.args[0], ast.Constant):
                    text: Any = node.args[0].value
                    yield f"{path.stem}:{node.lineno}", text, method


def _compiled_while_reading() -> Iterator[re.Pattern[Any]]:
    """Yield the patterns that functions compile while descriptions and amounts are read."""
    from labgym.protocols.synthesis.reading import read

    for module in _modules():
        for value in vars(module).values():
            if isinstance(value, functools._lru_cache_wrapper) and "pattern" in value.__name__:
                value.cache_clear()
    seen: list[re.Pattern[Any]] = []
    compiling: Callable[..., re.Pattern[Any]] = re._compile  # type: ignore[attr-defined]

    def record(pattern: Any, flags: Any) -> re.Pattern[Any]:
        compiled = compiling(pattern, flags)
        seen.append(compiled)
        return compiled

    re._compile = record  # type: ignore[attr-defined]
    try:
        read("Heat 1 g of phenol in 10 mL of acetone at 1 bar and 50 C for 1 h, add 2 x 5 mL of 2 M HCl, filter.")
        read("苯酚(1 g)溶于丙酮(10 mL)，50℃加热1小时，加入水，过滤。")
    finally:
        re._compile = compiling  # type: ignore[attr-defined]
    yield from seen


def _methods(path: str | None = None) -> dict[str, set[str]]:
    """Return the methods by which each name of a pattern is used in one source file, or in all."""
    used: dict[str, set[str]] = {}
    call = re.compile(r"(\w+)(?:\(\))?\.(search|match|fullmatch|finditer|findall|sub|subn|split)\(")
    for source in _sources() if path is None else (Path(path),):
        for match in call.finditer(source.read_text(encoding="utf-8")):
            used.setdefault(match[1], set()).add(ALIASES.get(match[2], match[2]))
    return used


def _collected() -> list[tuple[str, Any, int, tuple[str, ...]]]:
    """Return place, text, flags and methods of each pattern; the methods are all four where none is called by name."""
    used = _methods()
    rows: dict[tuple[Any, int], tuple[str, set[str]]] = {}
    for module, name, pattern in _named():
        where, methods = rows.setdefault((pattern.pattern, pattern.flags), (f"{module[7:]}.{name}", set()))
        private = _methods(importlib.import_module(module).__file__) if name.startswith("_") else used
        methods |= private.get(name, set()) or set(METHODS)
    for where, text, method in _inline():
        rows.setdefault((text, re.compile(text).flags), (where, set()))[1].add(method)
    for number, pattern in enumerate(_compiled_while_reading()):
        rows.setdefault((pattern.pattern, pattern.flags), (f"compiled-{number}", set(METHODS)))
    return [(where, text, flags, tuple(sorted(methods))) for (text, flags), (where, methods) in rows.items()]


def _literals(parsed: Any) -> Iterator[str]:
    run = ""
    for operation, value in parsed:
        kind = str(operation)
        if kind == "LITERAL":
            run += chr(value)
            continue
        if run:
            yield run
        run = ""
        if kind.endswith("_REPEAT"):
            yield from _literals(value[2])
        elif kind == "SUBPATTERN":
            yield from _literals(value[3])
        elif kind == "BRANCH":
            for branch in value[1]:
                yield from _literals(branch)
        elif kind.startswith("ASSERT"):
            yield from _literals(value[1])
        elif kind == "ATOMIC_GROUP":
            yield from _literals(value)
        elif kind == "IN":
            yield from (chr(item) for what, item in value if str(what) == "LITERAL")
    if run:
        yield run


def _example(parsed: Any, rng: random.Random) -> str:
    """Return a text that matches a parsed pattern, or nearly does."""
    parts = []
    for operation, value in parsed:
        kind = str(operation)
        if kind == "LITERAL":
            parts.append(chr(value))
        elif kind in ("ANY", "NOT_LITERAL") or (kind == "IN" and str(value[0][0]) == "NEGATE"):
            parts.append("x")
        elif kind == "IN":
            what, item = value[rng.randrange(len(value))]
            range_start = chr(item[0]) if str(what) == "RANGE" else ""
            category = CATEGORIES.get(str(item).removeprefix("CATEGORY_"), "a") if str(what) == "CATEGORY" else ""
            parts.append(range_start or category or chr(item))
        elif kind.endswith("_REPEAT"):
            least, most, inner = value
            count = min(int(most), int(least) + rng.randrange(3))
            parts.extend(_example(inner, rng) for _ in range(count))
        elif kind == "SUBPATTERN":
            parts.append(_example(value[3], rng))
        elif kind == "BRANCH":
            parts.append(_example(value[1][rng.randrange(len(value[1]))], rng))
        elif kind == "ATOMIC_GROUP":
            parts.append(_example(value, rng))
    return "".join(parts)


def _fragments(text: str) -> list[tuple[str, str, str]]:
    """Return beginnings, repeated parts and ends of adversarial texts for a pattern."""
    rng, parsed = random.Random(0), sre.parse(text)
    literals = sorted(set(_literals(parsed)), key=lambda word: (len(word), word))
    words = rng.sample(literals, min(len(literals), 10))
    rows = [("", part, "~") for part in (*FRAGMENTS, *words)]
    for example in sorted({_example(parsed, rng) for _ in range(3)} - {""}):
        short, half = example[:-1], example[: len(example) // 2]
        rows += [("", part, "~") for part in (example, short, half, f"{example} ") if part]
        rows += [(head, part, "~") for head in (example, short, half) for part in (" ", "1", "a ")]
    return rows


def _text(row: tuple[str, str, str], length: int) -> str:
    head, part, end = row
    return (head + part * (length // len(part) + 1))[: length - len(end)] + end


def _seconds(pattern: re.Pattern[Any], method: str, text: str | bytes) -> float:
    start = time.process_time()
    result = getattr(pattern, method)(text)
    if method == "finditer":
        for _ in result:
            pass
    return time.process_time() - start


def _faults(where: str, text: str | bytes, flags: int, methods: tuple[str, ...]) -> Iterator[str]:
    """Yield a line for each text on which a pattern is slow."""
    pattern = re.compile(text, flags)

    def end(*_: Any) -> None:
        raise _TooSlowError

    def encode(string: str) -> str | bytes:
        return string.encode() if isinstance(text, bytes) else string

    rows = _fragments(text.decode("latin-1") if isinstance(text, bytes) else text)
    previous = signal.signal(signal.SIGPROF, end)
    try:
        for row in rows:
            whole = encode(_text(row, LENGTH))
            for method in methods:
                signal.setitimer(signal.ITIMER_PROF, LIMIT_S)
                try:
                    if _seconds(pattern, method, whole) > SUSPECT_S:
                        signal.setitimer(signal.ITIMER_PROF, 20.0 * LIMIT_S)
                        part = encode(_text(row, LENGTH // 2))
                        short = min(_seconds(pattern, method, part) for _ in range(3))
                        long = min(_seconds(pattern, method, whole) for _ in range(3))
                        if long >= max(SUSPECT_S, MAX_RATIO * short):
                            yield f"{where}.{method} on {row}: {short}, {long} s"
                except _TooSlowError:
                    yield f"{where}.{method} takes over {LIMIT_S} s for {LENGTH} characters of {row}"
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, previous)


def test_every_pattern_of_modules_classes_containers_and_functions_takes_linear_time_on_adversarial_text() -> None:
    collected = _collected()
    places = {where.partition(":")[0] for where, *_ in collected}
    assert {
        "protocols.synthesis.reading._AHEAD",
        "protocols.synthesis.unlisted._formula",
        "quantities._SINGLE",
    } <= places
    assert {
        "protocols.rules.machines.SETTINGS",
        "protocols.language.concepts.lexicon",
        "protocols.refusals._patterns",
    } <= places
    assert any(where.startswith("compiled-") for where in places)
    assert len(collected) > 300
    faults = [fault for row in collected for fault in _faults(*row)]
    assert not faults, "\n".join(faults)


@pytest.mark.parametrize("text", [r"(\w+\s?)+:", r"\d+.*\d+.*x"])
def test_a_pattern_that_is_not_linear_is_found(text: str) -> None:
    assert next(_faults("example", text, 0, METHODS), "")
