"""Processes of tests: started with a mark in the environment that all their descendants inherit."""

from __future__ import annotations

import os
import subprocess
import sys
import time
import uuid
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from runs.killing import hear_interrupts

ROOT = Path(__file__).resolve().parents[2]
PATIENCE = 300.0
"""Longest wait for an event, seconds."""


@dataclass
class Marked:
    """A process and its descendants."""

    arguments: Sequence[str]
    cwd: Path
    mark: str = field(default_factory=lambda: uuid.uuid4().hex)

    def __post_init__(self) -> None:
        path = os.pathsep.join([str(ROOT), str(ROOT / "tests")])
        environment = os.environ | {"LABGYM_TEST_MARK": self.mark, "PYTHONPATH": path}
        self.process = subprocess.Popen(
            [sys.executable, *self.arguments],
            cwd=self.cwd,
            env=environment,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
            preexec_fn=hear_interrupts,
        )

    def wait_for(self, event: Callable[[], bool]) -> None:
        """Wait until an event has happened, or the process has ended."""
        end = time.monotonic() + PATIENCE
        while not event() and self.process.poll() is None and time.monotonic() < end:
            time.sleep(0.01)

    def alive(self) -> list[int]:
        """Return the ids of the living processes that have the mark; zombies do not count."""
        pids = []
        for entry in Path("/proc").iterdir():
            if not entry.name.isdecimal():
                continue
            try:
                if self.mark.encode() in (entry / "environ").read_bytes():
                    pids.append(int(entry.name))
            except OSError:
                continue
        return pids

    def remaining(self, seconds: float = PATIENCE) -> list[int]:
        """Return the processes that are still alive after at most some seconds."""
        end = time.monotonic() + seconds
        while (pids := self.alive()) and time.monotonic() < end:
            time.sleep(0.05)
        return pids

    def end(self) -> str:
        """Wait for the process and return what it wrote to standard error."""
        return self.process.communicate(timeout=PATIENCE)[1]
