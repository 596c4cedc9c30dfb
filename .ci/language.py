"""Check that docstrings, comments, messages and pages avoid phrases that read like a literal translation.

`make lint` runs it on all files. It prints a line for each fault and exits with 1 if there is one.
"""

from __future__ import annotations

import ast
import io
import re
import sys
import tokenize
from collections.abc import Iterator
from pathlib import Path

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

ROOTS = ("catalogue", "metre", "colour", "centre", "behaviour", "grey", "neighbour")
"""Parts of British spellings: only lines with one of them are searched."""

BRITISH = re.compile(
    r"(?<![\w`./_-])(catalogues?|(?:milli|centi|micro)?metres?|coloured|colours?|centres?|behaviours?|greys?|neighbours?)"
    r"(?![\w_(`:]|\.\w|=)",
    re.IGNORECASE,
)
"""British spellings, apart from names in code."""

VALUES = ("| `labgym:", "how: file (its texts")
"""Beginnings of lines with texts and values of files, which keep their spelling."""


def sources() -> list[Path]:
    """Return the package's modules and the pages that readers see."""
    names = ("README.md", "CONTRIBUTING.md", "CHANGELOG.md", "Makefile")
    pages = [*(ROOT / name for name in names), *ROOT.glob("docs/**/*.md")]
    return sorted([*ROOT.glob("labgym/**/*.py"), *ROOT.glob("labgym/**/*.j2"), *pages, *ROOT.glob("policies/**/*.md")])


def strings_and_comments(text: str, tree: ast.Module) -> Iterator[tuple[int, str]]:
    """Yield the lines of a module's strings and its comments, each with its line number."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            for offset, line in enumerate(node.value.splitlines()):
                yield node.lineno + offset, line
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type == tokenize.COMMENT:
            yield token.start[0], token.string


def docstrings(tree: ast.Module) -> Iterator[tuple[int, str]]:
    """Yield the docstrings of a module, its classes and its functions, each with a line number."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            text = ast.get_docstring(node)
            if text:
                yield getattr(node, "lineno", 1), text


def faults(path: Path) -> Iterator[str]:
    """Yield a line for each avoided phrase, clause as a docstring's beginning and British spelling in a file."""
    name, text = path.relative_to(ROOT).as_posix() if path.is_relative_to(ROOT) else path.name, path.read_text("utf-8")
    if path.suffix == ".py":
        tree = ast.parse(text)
        lines, documented = [*strings_and_comments(text, tree)], [*docstrings(tree)]
        # The documentation in USD files keeps its spelling.
        spelled = [] if "usd" in path.parts else [(line, row) for line, doc in documented for row in doc.splitlines()]
    else:
        lines, documented = [*enumerate(text.splitlines(), 1)], []
        spelled = lines
    lower = text.lower()
    candidates = [phrase for phrase in PHRASES if phrase in lower]
    for number, line in lines:
        for phrase in candidates:
            if phrase in line.lower() and PATTERNS[phrase].search(line):
                yield f"{name}:{number}: {phrase!r} ({PHRASES[phrase]}): {line.strip()[:100]}"
    for number, doc in documented:
        if re.match(r"(What|Who)\b", doc):
            yield f"{name}:{number}: a docstring begins with a clause: {doc.splitlines()[0]}"
    for number, line in spelled:
        british = any(root in line.lower() for root in ROOTS) and not line.strip().startswith(VALUES)
        if british and (match := BRITISH.search(line)):
            yield f"{name}:{number}: British spelling {match[0]!r}: {line.strip()[:100]}"


def main() -> int:
    """Check the package and the pages; return 1 if there is a fault."""
    lines = [line for path in sources() for line in faults(path)]
    sys.stderr.write("".join(f"{line}\n" for line in lines))
    return 1 if lines else 0


if __name__ == "__main__":
    sys.exit(main())
