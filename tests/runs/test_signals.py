from __future__ import annotations

import os
import random
import signal
from pathlib import Path

import pytest

from labgym.temporary import PREFIX
from runs import examples
from runs.processes import Marked

SIGNALS = [signal.SIGTERM, signal.SIGINT, signal.SIGHUP, signal.SIGKILL]


@pytest.mark.cases(2)
@pytest.mark.parametrize("number", SIGNALS, ids=lambda number: number.name)
def test_no_process_outlives_the_coordinator(tmp_path, number):
    log = tmp_path / "pids"
    program = f"""
from runs.examples import spawn_and_sleep
from labgym.runs import ExecutorOptions, Shard, run_shards
if __name__ == "__main__":
    shards = [Shard(str(i), spawn_and_sleep, ({str(log)!r} + str(i),)) for i in range(2)]
    list(run_shards(shards, None, ExecutorOptions(workers=2), progress=False))
"""
    (tmp_path / "program.py").write_text(program)
    run = Marked(["program.py"], tmp_path)
    run.wait_for(lambda: all(Path(f"{log}{index}").exists() for index in range(2)))
    assert len(run.alive()) >= 5  # The coordinator, two workers, and a process that each worker has started.
    os.kill(run.process.pid, number)
    assert run.remaining() == []
    run.end()


@pytest.mark.cases(3)
@pytest.mark.parametrize("workers", [1, 2])
@pytest.mark.parametrize("number", SIGNALS, ids=lambda number: number.name)
def test_a_run_that_is_killed_resumes_to_the_same_bytes(tmp_path, number, workers):
    expected = examples.run(tmp_path / "undisturbed", 30, 1)
    log, folder, generator = tmp_path / "log", tmp_path / "run", random.Random(number * 10 + workers)
    for lines in sorted(generator.sample(range(30), 2)):
        run = Marked(["-m", "runs.examples", str(folder), "30", str(workers), str(log), "0.01"], tmp_path)
        run.wait_for(lambda: (folder / "ledger.jsonl").exists() and count(folder / "ledger.jsonl") >= lines)  # noqa: B023
        run.process.send_signal(number)
        run.end()
        assert run.remaining() == []
        finished = count(folder / "ledger.jsonl")
        assert (folder / "squares.txt").exists() or finished >= lines
    assert examples.run(folder, 30, workers, log) == expected
    assert len(log.read_text().split()) <= 30 + 2 * workers  # Only shards that were running at a kill ran twice.
    assert [path for path in folder.rglob("*") if path.name.startswith(PREFIX)] == []
    files = {path.name: path.read_bytes() for path in folder.iterdir() if path.name != "provenance.jsonl"}
    assert files == {
        path.name: path.read_bytes() for path in (tmp_path / "undisturbed").iterdir() if path.name != "provenance.jsonl"
    }


def count(path: Path) -> int:
    return path.read_bytes().count(b"\n") if path.exists() else 0


@pytest.mark.slow  # test_cli.py has Ctrl-C
@pytest.mark.parametrize(("number", "code"), [(signal.SIGTERM, 143), (signal.SIGHUP, 129), (signal.SIGINT, 130)])
def test_a_signal_ends_a_command_like_ctrl_c_in_one_line_with_its_code(tmp_path, number, code):
    run = evaluation(tmp_path)
    run.process.send_signal(number)
    message = run.end()
    assert run.process.returncode == code
    assert message.splitlines()[-1].startswith("labgym: interrupted")
    assert message.splitlines()[-1].endswith("; finished work is kept")
    assert "Traceback" not in message


def evaluation(folder: Path) -> Marked:
    """Return a command that has begun its work: labgym eval, once its folder has an identity."""
    out = folder / f"out-{len(list(folder.iterdir()))}"
    run = Marked(["-m", "labgym.cli", "eval", "--policy", "straight", "--out", str(out)], folder)
    run.wait_for((out / "run.json").exists)
    return run
