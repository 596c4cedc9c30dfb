"""Machine code on disk that cannot be used or written is compiled again."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from labgym.artefacts import artefacts

pytest.importorskip("numba")

KERNEL = """
from kinds import kind
from labgym.machine_code import entry

@entry
def doubled(people):
    return 2 * people.count

print(doubled(kind(4)), sum(doubled.stats.cache_hits.values()))
"""


def run(folder: Path, kind: str) -> str:
    """Return what a kernel prints whose argument is of a class: its result, and how often the cache had its code."""
    (folder / "kernel.py").write_text(KERNEL)
    (folder / "kinds.py").write_text(
        f"from typing import NamedTuple\n\nclass {kind}(NamedTuple):\n    count: int\n\nkind = {kind}\n"
    )
    variables = {**os.environ, "PYTHONPATH": str(artefacts("assets").parent), "NUMBA_CACHE_DIR": str(folder / "cache")}
    command = [sys.executable, str(folder / "kernel.py")]
    return subprocess.run(command, env=variables, capture_output=True, text=True, check=True).stdout


def test_code_whose_argument_was_a_removed_class_is_compiled_again(tmp_path: Path) -> None:
    answers = [run(tmp_path, kind) for kind in ("People", "People", "Crowd", "Crowd")]
    assert answers == ["8 0\n", "8 1\n", "8 0\n", "8 1\n"]
