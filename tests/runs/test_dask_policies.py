"""Evaluations on a Dask cluster: policies and their files reach workers that have labgym and nothing else."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from labgym.eval import evaluate
from labgym.suites import Suite
from runs.test_dask import cluster, dask  # noqa: F401

pytest.importorskip("distributed")

SUITE = Suite(name="short", split="val", layouts=("val-sub_02", "val-alk_01"), max_steps=30)
MODULE = """
from pathlib import Path
import numpy as np
from labgym.policies import Policy
from gains import FORWARD

class Steady(Policy):
    def __init__(self, file):
        self._path = Path(file)
        self._turn = float(self._path.read_text())

    def reset(self, episode):
        pass

    def act(self, observation):
        return np.array([FORWARD, self._turn])

    def files(self):
        return (self._path,)
"""


@pytest.fixture
def project(tmp_path, monkeypatch):
    """A folder with a policy, a module that it imports and its weights; the workers run elsewhere."""
    (tmp_path / "steady.py").write_text(MODULE)
    (tmp_path / "gains.py").write_text("FORWARD = 0.5\n")
    (tmp_path / "turn.txt").write_text("0.25")
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    yield tmp_path
    for name in ("steady", "gains"):
        sys.modules.pop(name, None)


def rows(folder: Path) -> dict[str, bytes]:
    return {
        name: (folder / name).read_bytes()
        for name in ("episodes.jsonl", "routes.jsonl", "actions.jsonl", "summary.json")
    }


@pytest.mark.slow
def test_a_policy_of_the_working_folder_drives_on_the_cluster_as_here(project, cluster):  # noqa: F811
    settings = {"options": {"file": "turn.txt"}, "progress": False}
    evaluate("steady:Steady", SUITE, out="here", **settings)
    evaluate("steady:Steady", SUITE, out="there", executor=dask(cluster), **settings)
    assert rows(Path("here")) == rows(Path("there"))


def test_an_object_of_a_class_of_the_working_folder_drives_on_the_cluster(project, cluster):  # noqa: F811
    from steady import Steady

    evaluate(Steady("turn.txt"), SUITE, out="here", progress=False)
    report = evaluate(Steady("turn.txt"), SUITE, executor=dask(cluster), progress=False)
    assert report.rows == evaluate(Steady("turn.txt"), SUITE, progress=False).rows
