"""`labgym eval`, killed at any moment and run again, leaves the files of an undisturbed run, and no process."""

from __future__ import annotations

import random
import signal
from pathlib import Path

import pytest

from labgym.suites import Suite
from runs import killing

LAYOUTS = ("val-alk_01", "val-con_01", "val-cyc_01")
SUITE = Suite(name="kills", split="val", layouts=LAYOUTS, max_steps=20)


@pytest.fixture(scope="module")
def suite(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return SUITE.save(tmp_path_factory.mktemp("suite") / "kills.json")


@pytest.fixture(scope="module")
def undisturbed(suite: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    folder = tmp_path_factory.mktemp("undisturbed") / "run"
    killing.run(words(suite, folder, workers=1))
    return killing.tree(folder)


def words(suite: Path, folder: Path, workers: int) -> tuple[str, ...]:
    return "eval", "--policy", "straight", "--suite", str(suite), "--workers", str(workers), "--out", str(folder)


@pytest.mark.cases(1)
@pytest.mark.parametrize(
    ("by", "workers"), [(signal.SIGKILL, 1), (signal.SIGTERM, 1), (signal.SIGINT, 2), (signal.SIGKILL, 2)]
)
def test_a_killed_evaluation_resumes_to_the_same_bytes(
    suite: Path, undisturbed: dict[str, str], tmp_path: Path, by: signal.Signals, workers: int
) -> None:
    folder = tmp_path / "killed"
    after = killing.lines(folder / "ledger.jsonl", random.Random(by).randint(1, 2))
    (seen,) = killing.check(words(suite, folder, workers), folder, undisturbed, (by, after))
    assert seen.finished < len(LAYOUTS)


@pytest.mark.slow
def test_a_worker_that_dies_costs_its_layout_and_not_the_evaluation(
    suite: Path, undisturbed: dict[str, str], tmp_path: Path
) -> None:
    folder = tmp_path / "worker"
    after = killing.lines(folder / "ledger.jsonl", 1)
    assert killing.kill_worker(words(suite, folder, workers=2), after, random.Random(0))
    assert killing.tree(folder) == undisturbed
