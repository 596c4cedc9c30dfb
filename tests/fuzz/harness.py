"""The process that runs cases: it imports labgym once and forks for every loader.

Commands come as lines of JSON on standard input, answers go to standard output. A loader's process writes, in its
folder, `case` (number of the case in work), `failures.jsonl` and, at the end, `summary.json`; the files of a case are
in `case-N/` while it is read, and stay there if it fails.
"""

from __future__ import annotations

import importlib
import json
import os
import resource
import shutil
import signal
import sys
import time
import traceback
import warnings
from pathlib import Path
from random import Random
from typing import Any

from labgym.errors import LabgymError

MIB = 1024**2
MAX_GROWTH = 750 * MIB
"""Memory that a loader may take in addition to what it takes after the import: with that, less than 1 GB in all."""
MAX_CPU = 10.0
"""Seconds of processor time for a case."""


def main() -> None:
    """Serve commands until standard input ends."""
    from fuzz.targets import TARGETS

    targets = {target.name: target for target in TARGETS}
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)
    for line in sys.stdin:
        command = json.loads(line)
        target = targets[command["target"]]
        for module in target.imports:
            importlib.import_module(module)
        child = os.fork()
        if child == 0:
            _run(target, command["seed"], command["first"], command["end"], Path(command["folder"]))
        print(json.dumps({"pid": child}), file=answers, flush=True)
        _, status = os.waitpid(child, 0)
        print(json.dumps({"status": status}), file=answers, flush=True)


def _run(target: Any, seed: int, first: int, end: int, folder: Path) -> None:
    """Run cases in this process, which then ends."""
    log = os.open(folder / "log", os.O_WRONLY | os.O_CREAT | os.O_APPEND)
    os.dup2(log, 1)
    os.dup2(log, 2)
    warnings.simplefilter("ignore")
    code = 1
    try:
        os.chdir(folder)
        _cases(target, seed, first, end, folder)
        code = 0
    except BaseException:  # noqa: BLE001 - the log is all that remains of it
        traceback.print_exc()
    finally:
        sys.stderr.flush()
        os._exit(code)


def _cases(target: Any, seed: int, first: int, end: int, folder: Path) -> None:
    (folder / "case").write_text(str(first))
    make = target.prepare()
    accepted = refused = 0
    baseline = memory("VmRSS")
    for number in range(first, end):
        place = folder / f"case-{number}"
        files = make(Random(f"{seed} {target.name} {number}") if number else None)
        place.mkdir()
        for name, content in files.items():
            (place / name).parent.mkdir(parents=True, exist_ok=True)
            (place / name).write_bytes(content)
        (folder / "case").write_text(str(number))
        fault, was_accepted = (_isolated if target.isolated else _measured)(target.read, place, baseline)
        if number == 0 and not was_accepted:
            fault = f"the unchanged file is refused: {fault}"
        if fault and (number == 0 or not fault.startswith("LabgymError")):
            with (folder / "failures.jsonl").open("a") as stream:
                stream.write(json.dumps({"case": number, "fault": fault}) + "\n")
        else:
            shutil.rmtree(place)
        accepted, refused = accepted + was_accepted, refused + (not was_accepted)
    usage = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    cpu = sum(each.ru_utime + each.ru_stime for each in usage)
    (folder / "summary.json").write_text(json.dumps({"accepted": accepted, "refused": refused, "cpu": cpu}))


def _measured(read: Any, place: Path, baseline: int) -> tuple[str, bool]:
    """Return the fault of the reader with a case ("" if it has none), and whether the case was accepted."""
    fault, accepted = "", False
    Path("/proc/self/clear_refs").write_text("5")  # resets the peak
    begun = _cpu()
    try:
        read(place)
        accepted = True
    except LabgymError as error:
        message = str(error)
        fault = f"LabgymError: {message}"
        if len(message.splitlines()) != 1:
            fault = f"the message has {len(message.splitlines())} lines: {message!r}"
    except BaseException as error:  # noqa: BLE001 - whatever it is, it is a defect
        fault = f"{type(error).__name__}: {error}\n{traceback.format_exc()}"
    seconds, growth = _cpu() - begun, memory("VmHWM") - baseline
    if seconds > MAX_CPU:
        fault = f"took {seconds:.1f} s of processor time, at most {MAX_CPU:g} s are allowed"
    if growth > MAX_GROWTH:
        fault = f"took {growth // MIB} MiB of memory, at most {MAX_GROWTH // MIB} MiB are allowed"
    return fault, accepted


def _isolated(read: Any, place: Path, baseline: int) -> tuple[str, bool]:
    """Return the same of a case that is read in a separate process, whose crash labgym reports as an error."""
    reading, writing = os.pipe()
    child = os.fork()
    if child == 0:
        signal.alarm(600)
        os.write(writing, json.dumps(_measured(read, place, baseline)).encode()[:60_000])
        os._exit(0)
    os.close(writing)
    with os.fdopen(reading, "rb") as stream:
        answer = stream.read()
    _, status = os.waitpid(child, 0)
    if os.WIFSIGNALED(status) and os.WTERMSIG(status) == signal.SIGALRM:
        return "did not end within 600 s", False
    if not answer:
        return "LabgymError: the process that read it crashed", False
    fault, accepted = json.loads(answer)
    return str(fault), bool(accepted)


def _cpu() -> float:
    children = resource.getrusage(resource.RUSAGE_CHILDREN)
    return time.process_time() + children.ru_utime + children.ru_stime


def memory(kind: str, process: int | str = "self") -> int:
    """Return the resident memory of a process in bytes: "VmRSS", or its peak "VmHWM"; 0 if it has ended."""
    try:
        lines = Path(f"/proc/{process}/status").read_text().splitlines()
    except OSError:
        return 0
    return next((1024 * int(line.split()[1]) for line in lines if line.startswith(kind)), 0)


if __name__ == "__main__":
    main()
