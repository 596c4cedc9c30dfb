"""The `labgym` command: a thin layer with one module per group of commands."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from labgym import __version__
from labgym.cli.outcome import BAD_INPUT, DONE
from labgym.cli.problems import memory_problem, problem_line

__all__ = ["main"]


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit code; an error is one line on standard error, also in its imports."""
    if (problem := memory_problem()) is not None:
        print(f"labgym: error: {problem}", file=sys.stderr)
        return BAD_INPUT
    words = sys.argv[1:] if arguments is None else arguments
    if list(words) == ["--version"]:
        print(f"labgym {__version__}")
        return DONE
    try:
        from labgym.cli import app
    except (ImportError, MemoryError, SystemError) as error:
        line = problem_line(error, "labgym")
        if line is None:
            raise
        print(f"labgym: error: {line}", file=sys.stderr)
        return BAD_INPUT
    return app.main(words)
