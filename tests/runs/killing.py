"""Kill a command at a moment of its run, run it again, and compare its folder with that of an undisturbed run.

As a program: `python tests/runs/killing.py --moments 30 --shards 10 --work FOLDER -- generate sub_01 --count 40
--shard 4 --out {out}` kills the command at random moments by SIGKILL, SIGTERM and SIGINT in turn: after a random
shard, and up to half the mean time of a shard later. It prints a line for each moment and exits 1 if one fails.
"""

from __future__ import annotations

import argparse
import hashlib
import os
import random
import shutil
import signal
import subprocess
import sys
import time
import uuid
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import psutil

from labgym.temporary import PREFIX

MARK = "LABGYM_TEST_MARK"
"""Environment variable that marks all processes of a command, whoever their parent is by now."""
APART = ("provenance.jsonl", "times.jsonl", ".lock")
"""Files that may differ between runs: when and where they ran, and how long they took."""
SIGNALS = (signal.SIGKILL, signal.SIGTERM, signal.SIGINT)
PATIENCE = 300.0
"""Seconds after which no process of a killed command may remain; on a busy machine they take some to see its end."""
LIMIT = 1200.0


Moment = float | Callable[[], bool]
"""When a command is killed: seconds after its start, or as soon as a condition holds."""


@dataclass(frozen=True)
class Kill:
    """Outcome of a killed command.

    Attributes:
        returncode: of the killed process.
        finished: lines of the ledger at the time of death.
        temporary: temporary files that it left.
        survivors: processes that remained after `PATIENCE` seconds.
    """

    returncode: int
    finished: int
    temporary: int
    survivors: tuple[str, ...]


def tree(folder: Path, apart: Sequence[str] = APART) -> dict[str, str]:
    """Return the SHA-256 of each file by its path, without the files that may differ."""
    return {
        path.relative_to(folder).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in sorted(folder.rglob("*"))
        if path.is_file() and path.name not in apart
    }


def start(words: Sequence[str], mark: str = "") -> subprocess.Popen[bytes]:
    """Start a command of labgym, or a Python file with its arguments, in a new session."""
    environment = {**os.environ, MARK: mark or uuid.uuid4().hex}
    program = () if words[0].endswith(".py") else ("-m", "labgym.cli")
    command = [sys.executable, *program, *words]
    return subprocess.Popen(
        command,
        env=environment,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        start_new_session=True,
        preexec_fn=hear_interrupts,
    )


def hear_interrupts() -> None:
    """Restore the default action of SIGINT, which a shell ignores in programs that it starts in the background."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def run(words: Sequence[str], returncode: int = 0) -> float:
    """Run a command to its end and return the seconds that it took.

    Raises:
        AssertionError: it ended with another code.
    """
    begun = time.monotonic()
    process = start(words)
    _, errors = process.communicate(timeout=LIMIT)
    assert process.returncode == returncode, f"exit code {process.returncode}: {errors.decode()[-2000:]}"
    return time.monotonic() - begun


def kill(words: Sequence[str], folder: Path, by: signal.Signals, after: Moment) -> Kill:
    """Start a command, send its main process a signal at a moment, and return the outcome."""
    mark = uuid.uuid4().hex
    process = start(words, mark)
    _wait(process, after)
    process.send_signal(by)
    died = time.monotonic()
    process.communicate(timeout=LIMIT)
    ledger = folder / "ledger.jsonl"
    finished = len(ledger.read_bytes().splitlines()) if ledger.exists() else 0
    while (remaining := _marked(mark)) and time.monotonic() - died < PATIENCE:
        time.sleep(0.1)
    survivors = tuple(f"{each.pid} {' '.join(each.cmdline())[:80]}" for each in remaining if each.is_running())
    return Kill(process.returncode, finished, len(temporary_files(folder)), survivors)


def kill_worker(words: Sequence[str], after: Moment, chooser: random.Random) -> bool:
    """Run a command to its end, but kill one of its workers at a moment; return whether one was killed.

    Raises:
        AssertionError: the command failed.
    """
    process = start(words)
    killed = False
    _wait(process, after)
    if process.poll() is None:
        workers = [each for each in psutil.Process(process.pid).children() if "spawn_main" in " ".join(each.cmdline())]
        if workers:
            chooser.choice(workers).send_signal(signal.SIGKILL)
            killed = True
    _, errors = process.communicate(timeout=LIMIT)
    assert process.returncode == 0, f"exit code {process.returncode}: {errors.decode()[-2000:]}"
    return killed


def check(
    words: Sequence[str], folder: Path, expected: dict[str, str], *kills: tuple[signal.Signals, Moment]
) -> list[Kill]:
    """Kill a command once or several times, run it to its end, and compare its folder with the expected files.

    Raises:
        AssertionError: the exit code is not the signal's, processes or temporary files remain, or a file differs.
    """
    outcomes = []
    for by, after in kills:
        outcome = kill(words, folder, by, after)
        # Killed by the signal (before Python handles it), ended by it in good order, or done before it came.
        assert outcome.returncode in (-by, 128 + by, 0), outcome
        assert not outcome.survivors, outcome
        outcomes.append(outcome)
    run(words)
    assert tree(folder) == expected
    assert not temporary_files(folder)
    return outcomes


def temporary_files(folder: Path) -> list[Path]:
    """Return the temporary files and folders below a folder and next to it."""
    nearby = [path for path in folder.parent.glob(".*") if path.name.startswith(PREFIX)]
    return nearby + [path for path in folder.rglob(".*") if path.name.startswith(PREFIX)]


def lines(path: Path, count: int, then: float = 0.0) -> Moment:
    """Return the moment some seconds after a file, such as a ledger, has got some lines."""
    since: list[float] = []

    def reached() -> bool:
        if not since and (count == 0 or (path.exists() and path.read_bytes().count(b"\n") >= count)):
            since.append(time.monotonic())
        return bool(since) and time.monotonic() - since[0] >= then

    return reached


def _wait(process: subprocess.Popen[bytes], moment: Moment) -> None:
    """Wait for a moment or for the end of a process."""
    begun = time.monotonic()
    while process.poll() is None and time.monotonic() - begun < LIMIT:
        if moment() if callable(moment) else time.monotonic() - begun >= moment:
            return
        time.sleep(0.01)


def _marked(mark: str) -> list[psutil.Process]:
    marked = []
    for process in psutil.process_iter():
        try:
            if process.environ().get(MARK) == mark and process.status() != psutil.STATUS_ZOMBIE:
                marked.append(process)
        except psutil.Error:
            continue
    return marked


def report(line: str) -> None:
    """Print a line at once."""
    sys.stdout.write(f"{line}\n")
    sys.stdout.flush()


def main() -> int:
    """Kill a command at random moments and print the outcomes."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--moments", type=int, default=30)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--shards", type=int, required=True, help="number of lines that the watched file will have")
    parser.add_argument("--watch", default="ledger.jsonl", help="file of the folder that gets a line for each shard")
    parser.add_argument("--work", type=Path, required=True)
    parser.add_argument("--workers-too", action="store_true", help="also kill a worker at as many moments")
    parser.add_argument("words", nargs="+", help="the command; {out} is its folder")
    options = parser.parse_args()
    chooser, faults = random.Random(options.seed), 0
    undisturbed = options.work / "undisturbed"
    shutil.rmtree(options.work, ignore_errors=True)
    options.work.mkdir(parents=True)
    lasted = run([word.replace("{out}", str(undisturbed)) for word in options.words])
    expected = tree(undisturbed)
    report(f"undisturbed: {lasted:.1f} s, {len(expected)} files")
    kinds = [*SIGNALS, None] if options.workers_too else list(SIGNALS)
    for number in range(options.moments):
        by, folder = kinds[number % len(kinds)], options.work / f"run-{number}"
        line, then = chooser.randrange(options.shards), chooser.uniform(0.0, 0.5 * lasted / options.shards)
        after, when = lines(folder / options.watch, line, then), f"{then:.2f} s after line {line}"
        words = [word.replace("{out}", str(folder)) for word in options.words]
        name = by.name if by is not None else "worker SIGKILL"
        try:
            if by is None:
                outcome: object = kill_worker(words, after, chooser)
                assert tree(folder) == expected
            else:
                outcome = check(words, folder, expected, (by, after))[0]
            report(f"{number} {name} {when}: {outcome}")
            shutil.rmtree(folder)
        except AssertionError as error:
            faults += 1
            report(f"{number} {name} {when}: FAULT {error}")
    report(f"{options.moments - faults} of {options.moments} equal")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
