"""Shards for tests, and a program that runs them in a separate process."""

from __future__ import annotations

import os
import sys
import time
from pathlib import Path

from labgym.errors import OptionError
from labgym.runs import Blob, ExecutorOptions, RunFolder, RunIdentity, Shard, ShardOutput, run_shards


def square(number: int, log: str = "", pause: float = 0.0) -> ShardOutput:
    """Return the square in a separate file; note the call in a log."""
    if log:
        with Path(log).open("a") as stream:
            stream.write(f"{number}\n")
    time.sleep(pause)
    return ShardOutput({f"shards/{number:04d}.txt": f"{number * number}\n".encode()}, {"number": number})


def die(log: str, times: int) -> ShardOutput:
    """Kill the worker, `times` times; then return."""
    with Path(log).open("a") as stream:
        stream.write("died\n")
    if len(Path(log).read_text().split()) <= times:
        os._exit(3)
    return ShardOutput({"shards/9999.txt": b"alive\n"})


def die_after(log: str, word: str) -> ShardOutput:
    """Kill the worker once a word stands in a log."""
    while not (Path(log).exists() and word in Path(log).read_text()):
        time.sleep(0.02)
    os._exit(3)


def scaled(number: int, blob: Blob) -> ShardOutput:
    """Return the number times the length of a blob, which arrives as it was sent."""
    return ShardOutput({}, [number * len(blob.content), blob.digest])


def large(log: str, megabytes: int) -> ShardOutput:
    """Return many bytes; note the worker's id first."""
    Path(log).write_text(str(os.getpid()))
    return ShardOutput({"shards/large.bin": b"x" * (megabytes << 20)})


def break_down(message: str) -> ShardOutput:
    raise ZeroDivisionError(message)


def refuse(message: str) -> ShardOutput:
    raise OptionError(message)


def spawn_and_sleep(log: str) -> ShardOutput:
    """Start a process that sleeps, note its id and this worker's, and sleep."""
    import subprocess

    child = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(600)"])
    Path(log).write_text(f"{os.getpid()} {child.pid}\n")
    time.sleep(600)
    return ShardOutput()


def squares(count: int, log: Path | str = "", pause: float = 0.0) -> list[Shard]:
    return [Shard(f"square {number}", square, (number, str(log), pause)) for number in range(count)]


def identity(**inputs: object) -> RunIdentity:
    return RunIdentity.of("test", **({"seed": 0} | inputs))


def run(folder: Path, count: int, workers: int, log: Path | str = "", pause: float = 0.0) -> bytes:
    """Run shards to the end and return the merged bytes."""
    with RunFolder.open(folder, identity()) as open_folder:
        if not open_folder.finished:
            outputs = {}
            options = ExecutorOptions(workers=workers)
            for _, output in run_shards(squares(count, log, pause), open_folder, options, progress=False):
                outputs |= output.files
            open_folder.finish({"squares.txt": [outputs[name] for name in sorted(outputs)]})
    return (folder / "squares.txt").read_bytes()


if __name__ == "__main__":
    run(Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3]), sys.argv[4], float(sys.argv[5]))
