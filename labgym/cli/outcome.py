"""Ends of commands: exit codes, and the lines that report files, findings and failures."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

DONE, FAILED, BAD_INPUT = 0, 1, 2
SIGNALED = 128
"""Exit code after a signal, minus the signal's number."""


def written(path: Path) -> int:
    """Print the path of a file or folder that was written and return the exit code of success."""
    print(path)
    return DONE


def findings(faults: Sequence[str], advice: Sequence[str] = ()) -> int:
    """Print advice, faults and how many there are of each; return the exit code, which depends on the faults alone."""
    for line in (*advice, *faults):
        print(line)
    counts = _counted(len(faults), "fault")
    print(f"{counts}, {_counted(len(advice), 'piece')} of advice" if advice else counts)
    return FAILED if faults else DONE


def complaints(problems: Sequence[str]) -> int:
    """Print failures on standard error and return the exit code."""
    for problem in problems:
        print(f"labgym: failed: {problem}", file=sys.stderr)
    return FAILED if problems else DONE


def _counted(count: int, noun: str) -> str:
    return f"{count or 'no'} {noun}{'' if count == 1 else 's'}"
