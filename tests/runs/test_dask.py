"""A real scheduler and real workers on loopback, as separate processes."""

from __future__ import annotations

import hashlib
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from labgym.errors import LabgymError, OptionError
from labgym.runs import Blob, ExecutorOptions, RunFolder, Shard, run_shards
from labgym.runs.executors import check_address
from labgym.runs.ledger import LEDGER_FILE
from runs import examples

pytest.importorskip("distributed")

ROOT = Path(__file__).parents[2]
EXPECTED = "".join(f"{number * number}\n" for number in range(30)).encode()


class Cluster:
    """A scheduler and its workers, as processes."""

    def __init__(self, folder: Path, package: Path = ROOT) -> None:
        self._folder = folder
        self._package = package
        self.workers: list[subprocess.Popen[bytes]] = []
        log = folder / "scheduler.log"
        self._scheduler = self._start("scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard", log=log)
        self.address = self._address(log)

    def add_worker(self, *options: str) -> subprocess.Popen[bytes]:
        log = self._folder / f"worker-{len(self.workers)}.log"
        arguments = (self.address, "--nthreads", "1", "--no-nanny", "--no-dashboard", *options)
        self.workers.append(self._start("worker", *arguments, log=log))
        return self.workers[-1]

    def close(self) -> None:
        for process in (*self.workers, self._scheduler):
            process.kill()
            process.wait()

    def _start(self, *arguments: str, log: Path) -> subprocess.Popen[bytes]:
        paths = os.pathsep.join([str(self._package), str(ROOT / "tests"), *sys.path])
        with log.open("wb") as stream:
            return subprocess.Popen(
                [sys.executable, "-m", "distributed.cli.dask_" + arguments[0], *arguments[1:]],
                stdout=stream,
                stderr=stream,
                cwd=self._folder,
                env={**os.environ, "PYTHONPATH": paths},
            )

    def _address(self, log: Path) -> str:
        deadline = time.monotonic() + 300
        while time.monotonic() < deadline:
            if match := re.search(r"tcp://127\.0\.0\.1:\d+", log.read_text()):
                return match[0]
            time.sleep(0.05)
        raise AssertionError(log.read_text())


@pytest.fixture(scope="module")
def cluster(tmp_path_factory) -> Iterator[Cluster]:
    running = Cluster(tmp_path_factory.mktemp("cluster"))
    running.add_worker()
    running.add_worker()
    yield running
    running.close()


@contextmanager
def alone(folder: Path, *options: str, package: Path = ROOT) -> Iterator[Cluster]:
    """A cluster of one worker with options."""
    running = Cluster(folder, package)
    running.add_worker(*options)
    try:
        yield running
    finally:
        running.close()


def dask(cluster: Cluster) -> ExecutorOptions:
    return ExecutorOptions("dask", scheduler=cluster.address)


def test_a_cluster_that_loses_and_gains_a_worker_leaves_the_bytes_of_one_process(tmp_path, cluster):
    log, folder = tmp_path / "log", tmp_path / "run"
    outputs = {}
    with RunFolder.open(folder, examples.identity()) as run:
        shards = examples.squares(30, log, 0.1)
        for count, (_, output) in enumerate(run_shards(shards, run, dask(cluster), progress=False), 1):
            outputs |= output.files
            if count == 4:
                cluster.workers[0].send_signal(signal.SIGKILL)
            if count == 12:
                cluster.add_worker()
        run.finish({"squares.txt": [outputs[name] for name in sorted(outputs)]})
    assert (folder / "squares.txt").read_bytes() == EXPECTED
    assert set(map(int, log.read_text().split())) == set(range(30))


def test_an_error_of_a_shard_arrives_as_itself(cluster):
    with pytest.raises(OptionError, match="no such thing"):
        list(run_shards([Shard("one", examples.refuse, ("no such thing",))], None, dask(cluster), progress=False))


@pytest.mark.slow
def test_a_shard_that_kills_every_worker_is_an_error_and_finished_shards_are_kept(tmp_path):
    folder = tmp_path / "run"
    with alone(tmp_path) as cluster, RunFolder.open(folder, examples.identity()) as run:
        for _ in range(4):
            cluster.add_worker()
        # Results that a worker still holds die with it: the shard waits until the first one has arrived.
        shards = [*examples.squares(1), Shard("deadly", examples.die_after, (str(folder / LEDGER_FILE), "square 0"))]
        with pytest.raises(LabgymError, match="gave up on a shard"):
            list(run_shards(shards, run, dask(cluster), progress=False))
        assert run.output("square 0") is not None


def test_a_worker_of_other_code_is_refused(tmp_path):
    other = tmp_path / "other"
    shutil.copytree(ROOT / "labgym", other / "labgym", ignore=shutil.ignore_patterns("__pycache__"))
    (other / "assets").symlink_to(ROOT / "assets")
    with (other / "labgym/errors.py").open("a") as stream:
        stream.write("# changed\n")
    with alone(tmp_path, package=other) as cluster, pytest.raises(LabgymError, match="another code"):
        list(run_shards(examples.squares(1), None, dask(cluster), progress=False))


def test_a_worker_with_several_threads_is_refused(tmp_path):
    with alone(tmp_path, "--nthreads", "2") as cluster, pytest.raises(OptionError, match="2 threads, expected 1"):
        list(run_shards(examples.squares(1), None, dask(cluster), progress=False))


@pytest.mark.parametrize(
    "address, problem",
    [
        ("tcp://10.0.0.5:8786", "has no TLS"),
        ("tcp://example.org:8786", "has no TLS"),
        ("tcp://[::2]:8786", "has no TLS"),
        ("127.0.0.1:8786", "expected an address"),
        ("http://127.0.0.1:8786", "expected an address"),
        ("tcp://127.0.0.1", "expected an address"),
        ("tcp://127.0.0.1:99999", "expected an address"),
        ("tcp://[", "expected an address"),
        ("", "expected an address"),
    ],
)
def test_only_loopback_goes_without_tls(address, problem):
    with pytest.raises(OptionError, match=problem):
        check_address(address)


def test_loopback_addresses_need_no_tls():
    assert check_address("tcp://127.0.0.1:8786") == "tcp"
    assert check_address("tcp://localhost:8786") == "tcp"
    assert check_address("tcp://[::1]:8786") == "tcp"
    assert check_address("tls://10.0.0.5:8786") == "tls"


def test_tls_without_certificates_names_the_setting():
    with pytest.raises(OptionError, match="DASK_DISTRIBUTED__COMM__TLS__CA_FILE"):
        list(run_shards(examples.squares(1), None, ExecutorOptions("dask", scheduler="tls://127.0.0.1:1")))


def test_a_scheduler_that_does_not_answer_is_one_line(monkeypatch):
    monkeypatch.setattr("labgym.runs.dask_cluster.CONNECT_SECONDS", 1)
    with pytest.raises(OptionError, match="does not answer"):
        list(run_shards(examples.squares(1), None, ExecutorOptions("dask", scheduler="tcp://127.0.0.1:9")))


def test_a_blob_arrives_on_every_worker_as_it_was_sent(cluster):
    blob = Blob(bytes(range(256)) * 1000)
    shards = [Shard(f"{number}", examples.scaled, (number, blob)) for number in range(6)]
    outputs = list(run_shards(shards, None, dask(cluster), progress=False))
    expected = hashlib.sha256(blob.content).hexdigest()
    assert sorted(output.record for _, output in outputs) == [[256_000 * number, expected] for number in range(6)]
