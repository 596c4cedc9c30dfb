from __future__ import annotations

import signal
from pathlib import Path

import pytest

from labgym.policies.data import DataOptions, make_dataset
from runs import killing

PROGRAM = str(Path(__file__).with_name("tiny_training.py"))
WATCHED = {"iplanner": "history.jsonl", "navdp": "history.jsonl", "ppo": "times.jsonl"}
"""File that gets a line for each unit of training that a kill does not lose."""


@pytest.fixture(scope="module")
def data(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("data")
    make_dataset(folder, DataOptions(samples=8, seed=3, layout=2, drive=2), progress=False)
    return folder


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "by"), [("iplanner", signal.SIGTERM), ("navdp", signal.SIGKILL), ("ppo", signal.SIGKILL)]
)
def test_a_killed_training_ends_with_the_same_files(kind: str, by: signal.Signals, data: Path, tmp_path: Path) -> None:
    killing.run((PROGRAM, kind, str(tmp_path / "whole"), str(data)))
    folder = tmp_path / "killed"
    words = (PROGRAM, kind, str(folder), str(data))
    moment = killing.lines(folder / WATCHED[kind], 2)
    (seen,) = killing.check(words, folder, killing.tree(tmp_path / "whole"), (by, moment))
    assert seen.returncode == -by  # A program without labgym's command line is killed by either signal.
