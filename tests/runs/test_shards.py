from __future__ import annotations

import os
import signal
from pathlib import Path

import pytest

from labgym.errors import DocumentError, LabgymError, OptionError
from labgym.runs import ExecutorOptions, RunFolder, Shard, run_shards
from labgym.runs.local_pool import LocalPool, WorkerLostError
from runs import examples

EXPECTED = "".join(f"{number * number}\n" for number in range(20)).encode()


def tree(folder: Path) -> dict[str, bytes]:
    return {
        path.relative_to(folder).as_posix(): path.read_bytes()
        for path in folder.rglob("*")
        if path.is_file() and path.name != "provenance.jsonl"
    }


def test_a_run_leaves_the_same_files_with_any_number_of_workers(tmp_path):
    assert examples.run(tmp_path / "one", 20, 1) == EXPECTED
    assert examples.run(tmp_path / "three", 20, 3) == EXPECTED
    assert tree(tmp_path / "one") == tree(tmp_path / "three")
    assert sorted(tree(tmp_path / "one")) == [".lock", "manifest.json", "run.json", "squares.txt"]


def test_finished_shards_do_not_run_again(tmp_path):
    log, folder = tmp_path / "log", tmp_path / "run"
    with RunFolder.open(folder, examples.identity()) as part:
        for count, _ in enumerate(run_shards(examples.squares(20, log), part, progress=False), 1):
            if count == 7:
                break
    assert examples.run(folder, 20, 1, log) == EXPECTED
    assert sorted(map(int, log.read_text().split())) == list(range(20))
    assert examples.run(folder, 20, 1, log) == EXPECTED
    assert len(log.read_text().split()) == 20


@pytest.mark.parametrize("damage", ["file", "missing", "torn", "garbage"])
def test_a_shard_whose_file_or_line_is_damaged_runs_again(tmp_path, damage):
    log, folder = tmp_path / "log", tmp_path / "run"
    with RunFolder.open(folder, examples.identity()) as part:
        for _ in run_shards(examples.squares(3, log), part, progress=False):
            pass
    ledger = folder / "ledger.jsonl"
    if damage == "file":
        (folder / "shards/0002.txt").write_bytes(b"5\n")
    elif damage == "missing":
        (folder / "shards/0002.txt").unlink()
    elif damage == "torn":
        ledger.write_bytes(ledger.read_bytes()[:-20])
    else:
        ledger.write_bytes(ledger.read_bytes().replace(b'"square 2"', b'["square 2"]'))
    log.unlink()
    assert examples.run(folder, 20, 1, log) == EXPECTED
    assert sorted(map(int, log.read_text().split())) == list(range(2, 20))


def test_a_shard_with_other_inputs_runs_again(tmp_path):
    log = tmp_path / "log"
    for text in ("a", "a", "b"):
        shards = [Shard("square 1", examples.square, (1, str(log)), inputs=[text])]
        with RunFolder.open(tmp_path / "run", examples.identity()) as folder:
            assert len(list(run_shards(shards, folder, progress=False))) == 1
    assert log.read_text().split() == ["1", "1"]


def test_two_shards_of_one_name_are_an_error(tmp_path):
    with pytest.raises(LabgymError, match="two shards have the name 'square 0'"):
        list(run_shards([*examples.squares(1), *examples.squares(1)], None, progress=False))


@pytest.mark.parametrize("workers", [1, 2])
def test_an_error_of_a_shard_reaches_the_caller_and_finished_shards_are_kept(tmp_path, workers):
    log, folder = tmp_path / "log", tmp_path / "run"
    shards = [*examples.squares(3, log), Shard("bad", examples.refuse, ("no such room",))]
    with (
        pytest.raises(OptionError, match="no such room"),
        RunFolder.open(folder, examples.identity()) as part,
    ):
        for _ in run_shards(shards, part, ExecutorOptions(workers=workers), progress=False):
            pass
    examples.run(folder, 3, 1, log)
    ran = sorted(map(int, log.read_text().split()))
    assert set(ran) == {0, 1, 2}
    assert len(ran) <= 2 + workers  # At most the shard that the other worker ran at the error runs again.


@pytest.mark.parametrize("deaths", [1, 2])
def test_a_worker_that_dies_is_replaced(tmp_path, deaths):
    log = tmp_path / "deaths"
    shards = [Shard("deadly", examples.die, (str(log), deaths)), *examples.squares(6)]
    with RunFolder.open(tmp_path / "run", examples.identity()) as folder:
        outputs = {
            shard.name: output
            for shard, output in run_shards(shards, folder, ExecutorOptions(workers=2), progress=False)
        }
    assert outputs["deadly"].files == {"shards/9999.txt": b"alive\n"}
    assert len(outputs) == 7
    assert len(log.read_text().split()) == deaths + 1


def test_a_shard_that_kills_three_workers_is_an_error_and_the_others_are_kept(tmp_path):
    log = tmp_path / "deaths"
    shards = [*examples.squares(2), Shard("deadly", examples.die, (str(log), 99))]
    with (
        pytest.raises(LabgymError, match="3 workers died while they ran shard 'deadly'"),
        RunFolder.open(tmp_path / "run", examples.identity()) as folder,
    ):
        list(run_shards(shards, folder, ExecutorOptions(workers=2), progress=False))
    assert len(log.read_text().split()) == 3
    with RunFolder.open(tmp_path / "run", examples.identity()) as folder:
        # Both squares began before it, one at most still ran when the third worker died.
        assert any(folder.output(f"square {number}") is not None for number in range(2))
        assert folder.output("deadly") is None


def test_a_worker_that_is_killed_while_it_writes_a_result_is_replaced(tmp_path):
    log = tmp_path / "pid"
    pool = LocalPool(1)
    slow = pool.submit(examples.large, str(log), 1)
    assert len(slow.result().files["shards/large.bin"]) == 1 << 20
    pipe = next(iter(pool._alive))._pipe
    receive, killed = pipe.recv, []

    def after_a_part():
        assert len(os.read(pipe.fileno(), 1000)) > 0  # The rest of the message does not fit into the pipe's buffer.
        killed.append(int(log.read_text()))
        os.kill(killed[0], signal.SIGKILL)
        return receive()

    pipe.recv = after_a_part
    with pytest.raises(WorkerLostError):
        pool.submit(examples.large, str(log), 50).result(60)
    assert pool.submit(os.getpid).result(60) not in killed
    pool.shutdown()


def test_an_exception_of_a_worker_has_the_traceback_of_the_worker():
    shards = [Shard(str(number), examples.break_down, ("division",)) for number in range(2)]
    with pytest.raises(ZeroDivisionError, match="division") as error:
        list(run_shards(shards, None, ExecutorOptions(workers=2), progress=False))
    assert "in break_down" in "".join(error.value.__notes__)


def test_a_result_that_cannot_be_pickled_is_an_error_and_the_worker_lives():
    pool = LocalPool(1)
    pid = pool.submit(os.getpid).result(60)
    with pytest.raises(Exception, match="pickle"):
        pool.submit(eval, "lambda: 0").result(60)
    assert pool.submit(os.getpid).result(60) == pid
    pool.shutdown()


def test_a_worker_with_other_data_is_refused():
    def pids() -> set[str]:
        options = ExecutorOptions(workers=2)
        with pytest.raises(LabgymError, match="another process id") as error:
            list(run_shards(examples.squares(2), None, options, guard={"process id": process_id}, progress=False))
        return {str(error.value)}

    assert "install the same version of labgym" in pids().pop()


def process_id() -> str:
    """A digest that differs in every process."""
    return str(os.getpid())


@pytest.mark.parametrize("path", ["../out.txt", "/tmp/out.txt", "run.json", "ledger.jsonl", ""])
def test_a_shard_cannot_write_outside_its_folder(tmp_path, path):
    with (
        RunFolder.open(tmp_path / "run", examples.identity()) as folder,
        pytest.raises(LabgymError, match="leaves the run's folder"),
    ):
        folder.put("bad", None, {path: b""})


def test_only_a_bounded_number_of_shards_is_taken_from_the_source(tmp_path):
    taken = []

    def source():
        for shard in examples.squares(100):
            taken.append(shard.name)
            yield shard

    outputs = run_shards(source(), None, ExecutorOptions(workers=2), progress=False)
    for _ in range(10):
        next(outputs)
    assert len(taken) <= 10 + 2
    outputs.close()


def test_a_merged_file_that_was_changed_is_noticed(tmp_path):
    folder = tmp_path / "run"
    examples.run(folder, 20, 1)
    (folder / "squares.txt").write_bytes(EXPECTED.replace(b"81", b"18"))
    with pytest.raises(DocumentError, match=r"squares.txt: was changed.*--fresh"):
        examples.run(folder, 20, 1)
