"""Jobs of submitit as processes of this machine: what Slurm does, without Slurm."""

from __future__ import annotations

import hashlib
from pathlib import Path

import pytest

from labgym.errors import OptionError
from labgym.runs import Blob, ExecutorOptions, RunFolder, Shard, executors, run_shards
from runs import examples

pytest.importorskip("submitit")

from labgym.runs import slurm


@pytest.fixture(autouse=True)
def processes(monkeypatch):
    """Let submitit start processes in place of Slurm jobs; everything else is as with Slurm."""
    monkeypatch.setattr(slurm, "POLL_SECONDS", 0.05)
    monkeypatch.setenv("PYTHONPATH", str(Path(__file__).parents[1]), prepend=":")
    local = lambda options, folder: slurm.slurm_workers(options.workers, options.slurm, folder, "local")  # noqa: E731
    monkeypatch.setitem(executors.EXECUTORS, "slurm", local)


def test_jobs_leave_the_bytes_of_one_process(tmp_path):
    outputs = {}
    with RunFolder.open(tmp_path / "run", examples.identity()) as run:
        options = ExecutorOptions("slurm", workers=3)
        for _, output in run_shards(examples.squares(6), run, options, progress=False):
            outputs |= output.files
        run.finish({"squares.txt": [outputs[name] for name in sorted(outputs)]})
    assert (tmp_path / "run/squares.txt").read_bytes() == b"0\n1\n4\n9\n16\n25\n"
    assert not (tmp_path / "run" / slurm.FOLDER).exists()


def test_an_error_of_a_shard_arrives_as_itself(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    shards = [Shard("one", examples.refuse, ("no such thing",))]
    with pytest.raises(OptionError, match="no such thing"):
        list(run_shards(shards, None, ExecutorOptions("slurm"), progress=False))


@pytest.mark.slow
def test_a_lost_job_is_submitted_again_and_its_logs_are_kept(tmp_path):
    with RunFolder.open(tmp_path / "run", examples.identity()) as run:
        shard = Shard("once", examples.die, (str(tmp_path / "log"), 1))
        ((_, output),) = run_shards([shard], run, ExecutorOptions("slurm"), progress=False)
    assert output.files == {"shards/9999.txt": b"alive\n"}
    assert any((tmp_path / "run" / slurm.FOLDER).glob("*.err"))


def test_an_unknown_parameter_is_named(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(OptionError, match="colour"):
        list(run_shards(examples.squares(1), None, ExecutorOptions("slurm", slurm={"colour": 1})))


def test_options_of_another_executor_are_refused():
    with pytest.raises(OptionError, match="requires --scheduler"):
        ExecutorOptions("dask")
    with pytest.raises(OptionError, match="has no scheduler"):
        ExecutorOptions("local", scheduler="tcp://127.0.0.1:1")
    with pytest.raises(OptionError, match="takes no parameters"):
        ExecutorOptions("local", slurm={"timeout_min": 1})
    with pytest.raises(OptionError, match="expected one of local, dask, slurm"):
        ExecutorOptions("cloud")  # type: ignore[arg-type]


def test_a_blob_arrives_on_every_worker_as_it_was_sent(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    blob = Blob(bytes(range(256)) * 1000)
    shards = [Shard(f"{number}", examples.scaled, (number, blob)) for number in range(2)]
    outputs = list(run_shards(shards, None, ExecutorOptions("slurm", workers=2), progress=False))
    expected = hashlib.sha256(blob.content).hexdigest()
    assert sorted(output.record for _, output in outputs) == [[256_000 * number, expected] for number in range(2)]
