"""Docstrings, comments, messages and pages avoid the phrases that read like a literal translation."""

from __future__ import annotations

import ast
import io
import re
import tokenize
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]

PHRASES = {
    "mend": "fix",
    "mends": "fixes",
    "mended": "fixed",
    "told": "reported, or a verb of its own",
    "wants": "requires, needs",
    "so many": "a number, or the name of the variable",
    "one's own": "your own, or a local one",
    "beside": "next to; besides: in addition to",
    "what it is for": "purpose",
    "nothing wrong": "no faults",
    "where there is none": "if there is none",
    "where there are none": "if there are none",
    "there is none": "name what is missing: without a limit, if no path exists",
    "there are none": "name what is missing: without notes",
    "of its own": "separate, its",
    "of their own": "separate, their",
    "no such thing": "does not count",
    "whoever": "any",
    "made again": "regenerated",
    "lest": "so that not",
    "thereof": "of it",
}
"""Phrases to avoid, each with what to write instead."""

PATTERNS = {phrase: re.compile(rf"(?<![\w/.-]){re.escape(phrase)}(?![\w-])", re.IGNORECASE) for phrase in PHRASES}

BRITISH = re.compile(
    r"(?<![\w`./_-])(catalogues?|(?:milli|centi|micro)?metres?|coloured|colours?|centres?|behaviours?|greys?|neighbours?)"
    r"(?![\w_(`:]|\.\w|=)",
    re.IGNORECASE,
)
"""British spellings, apart from names in code."""

ALLOWED: dict[str, frozenset[str]] = {}
"""Phrases that a file uses in another sense, by the file's path."""


def sources() -> list[Path]:
    """Return the package's modules and the pages that readers see."""
    names = ("README.md", "CHANGELOG.md", "CONTRIBUTING.md", "Makefile")
    pages = [*(ROOT / each for each in names), *ROOT.glob("docs/**/*.md")]
    return sorted([*ROOT.glob("labgym/**/*.py"), *ROOT.glob("labgym/**/*.j2"), *pages, *ROOT.glob("policies/**/*.md")])


def prose(path: Path) -> Iterator[tuple[int, str]]:
    """Yield the lines of a page, or the strings and comments of a module, each with its line number."""
    text = path.read_text(encoding="utf-8")
    if path.suffix != ".py":
        yield from enumerate(text.splitlines(), 1)
        return
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            for offset, line in enumerate(node.value.splitlines()):
                yield node.lineno + offset, line
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type == tokenize.COMMENT:
            yield token.start[0], token.string


def docstrings(path: Path) -> Iterator[tuple[int, str]]:
    """Yield the docstrings of a module, its classes and its functions, each with a line number."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            text = ast.get_docstring(node)
            if text:
                yield getattr(node, "lineno", 1), text


def name(path: Path) -> str:
    return path.relative_to(ROOT).as_posix()


@pytest.mark.parametrize("path", sources(), ids=name)
def test_a_text_says_it_in_plain_english(path):
    allowed = ALLOWED.get(name(path), frozenset())
    hits = [
        f"{name(path)}:{number}: {phrase!r} ({PHRASES[phrase]}): {line.strip()[:100]}"
        for number, line in prose(path)
        for phrase, pattern in PATTERNS.items()
        if phrase not in allowed and pattern.search(line)
    ]
    assert not hits, "\n".join(hits)


@pytest.mark.parametrize("path", sorted(ROOT.glob("labgym/**/*.py")), ids=name)
def test_no_docstring_begins_with_a_clause(path):
    hits = [
        f"{name(path)}:{line}: {text.splitlines()[0]}"
        for line, text in docstrings(path)
        if re.match(r"(What|Who)\b", text)
    ]
    assert not hits, "\n".join(hits)


SPELLED = [path for path in sources() if path.suffix != ".py" or "usd" not in path.parts]
"""Files with checked spelling; the documentation in USD files is not changed for it."""


@pytest.mark.parametrize("path", SPELLED, ids=name)
def test_docstrings_and_pages_have_american_spelling(path):
    lines = docstrings(path) if path.suffix == ".py" else prose(path)
    values = ("| `labgym:", "how: file (its texts")  # texts and values of files, which keep their spelling
    hits = [
        f"{name(path)}:{number}: {match[0]!r}: {line.strip()[:100]}"
        for number, text in lines
        for line in text.splitlines()
        if not line.strip().startswith(values)
        for match in [BRITISH.search(line)]
        if match
    ]
    assert not hits, "\n".join(hits)
