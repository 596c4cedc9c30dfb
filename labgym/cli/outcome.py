"""How commands end: exit codes, what was written, what is wrong."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

DONE, FAILED, BAD_INPUT, INTERRUPTED = 0, 1, 2, 130


def written(path: Path) -> int:
    """Print what was written and return the exit code of success."""
    print(path)
    return DONE


def findings(messages: Sequence[str]) -> int:
    """Print what a check found, or that nothing is wrong, and return the exit code."""
    for message in messages:
        print(message)
    print(f"{len(messages)} findings" if messages else "nothing wrong")
    return FAILED if messages else DONE


def complaints(problems: Sequence[str]) -> int:
    """Print what failed on standard error and return the exit code."""
    for problem in problems:
        print(f"labgym: failed: {problem}", file=sys.stderr)
    return FAILED if problems else DONE
