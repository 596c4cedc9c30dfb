"""Every loader answers damaged and hostile files with a LabgymError of one line, in bounded memory and time.

`make test` reads 5 cases a loader, `make test-all` 40, `make fuzz` (or `pytest tests/fuzz --fuzz-cases 10000`) 10 000.
`--fuzz-seed N` makes other cases. The case of a failure is kept in a folder that the failure names; it is made again,
alone, by the same seed and `--fuzz-first K --fuzz-cases 1`.

A loader runs in a separate process. A case may take 10 s of processor time and, in all, less than 1 GB of memory
(750 MiB more than the process takes after its imports). A case that stands still for ten minutes is a hang.
"""

from __future__ import annotations

import json
import math
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from fuzz.harness import MAX_GROWTH, MIB, memory
from fuzz.target import Target
from fuzz.targets import TARGETS

HANG = 600.0
TESTS = Path(__file__).resolve().parents[1]


class Zygote:
    """The process that has imported labgym and forks for every loader."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        paths = [str(TESTS.parent), str(TESTS), os.environ.get("PYTHONPATH", "")]
        # One thread, as in the process that labgym starts to read USD: threads do not survive the fork for a loader.
        threads = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "PXR_WORK_THREAD_LIMIT": "1"}
        environment = {**os.environ, "PYTHONPATH": os.pathsep.join(paths), **threads}
        self._log = (folder / "log").open("w")
        command = [sys.executable, "-m", "fuzz.harness"]
        self._process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self._log, text=True, env=environment
        )

    def run(self, target: str, seed: int, first: int, end: int) -> list[str]:
        """Read cases and return what is wrong, a line for each failure; a process that dies is replaced."""
        folder = self.folder / "".join(char if char.isalnum() else "-" for char in target)
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
        faults: list[str] = []
        while first < end and len(faults) < 5:
            problem = self._once({"target": target, "seed": seed, "first": first, "end": end, "folder": str(folder)})
            if not problem:
                break
            stopped = int((folder / "case").read_text())
            faults.append(f"case {stopped}: {problem}; {folder}/case-{stopped}")
            if not (folder / f"case-{stopped}").exists():
                break  # the cases cannot be made
            first = stopped + 1
        failures = folder / "failures.jsonl"
        for line in failures.read_text().splitlines() if failures.exists() else ():
            failure = json.loads(line)
            faults.append(f"case {failure['case']}: {failure['fault']}; {folder}/case-{failure['case']}")
        return faults

    def _once(self, command: dict[str, object]) -> str:
        """Let a process read cases; return "" if it has read them all, else what ended it."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.write(json.dumps(command) + "\n")
        self._process.stdin.flush()
        child = json.loads(self._process.stdout.readline())["pid"]
        problem = self._watched(child, Path(str(command["folder"])))
        status = json.loads(self._process.stdout.readline())["status"]
        if status and not problem:
            lines = (Path(str(command["folder"])) / "log").read_text(errors="replace").splitlines()
            problem = f"the process ended with status {status}: {' | '.join(lines[-6:])}"
        return problem

    def _watched(self, child: int, folder: Path) -> str:
        """Wait for a process; kill it if it takes too much memory or stands still, and return that problem."""
        baseline, before, since = 0, "", time.monotonic()
        while (resident := memory("VmRSS", child)) != 0:
            case = (folder / "case").read_text() if (folder / "case").exists() else ""
            if case != before:
                baseline = baseline or resident
                before, since = case, time.monotonic()
            problem = ""
            if case and resident - baseline > 2 * MAX_GROWTH:
                problem = f"took more than {2 * MAX_GROWTH // MIB} MiB of memory"
            elif time.monotonic() - since > 3 * HANG or (case and time.monotonic() - since > HANG):
                problem = f"did not end within {HANG:g} s"
            if problem:
                os.kill(child, signal.SIGKILL)
                return problem
            time.sleep(0.02)
        return ""

    def close(self) -> None:
        """End the process."""
        assert self._process.stdin is not None
        self._process.stdin.close()
        self._process.wait()
        self._log.close()


@pytest.fixture(scope="module")
def zygote(tmp_path_factory: pytest.TempPathFactory, request: pytest.FixtureRequest) -> Iterator[Zygote]:
    place = request.config.getoption("--fuzz-out")
    folder = Path(place).absolute() if place else tmp_path_factory.mktemp("fuzz")
    folder.mkdir(parents=True, exist_ok=True)
    process = Zygote(folder)
    yield process
    process.close()


@pytest.mark.parametrize("target", TARGETS, ids=lambda target: target.name)
def test_every_case_is_read_or_refused_in_one_line(
    zygote: Zygote, target: Target, request: pytest.FixtureRequest
) -> None:
    seed, first, cases = (request.config.getoption(f"--fuzz-{name}") for name in ("seed", "first", "cases"))
    cases = math.ceil(target.share * cases)
    faults = zygote.run(target.name, seed, first, first + cases)
    assert not faults, "\n".join([f"{len(faults)} of {cases} cases (seed {seed}):", *faults])
