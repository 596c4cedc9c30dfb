"""The provenance of an evaluation: the machine and the kernels that drove, apart from the evaluation's identity."""

from __future__ import annotations

import os
from datetime import UTC, datetime, timedelta
from importlib.metadata import version
from pathlib import Path

import pytest

from labgym.documents import read_json
from labgym.eval.driving.evaluation import TransitionEvaluation
from labgym.eval.evaluator import evaluate
from labgym.policies.kernels import runs_pinned
from labgym.runs import RunProvenance
from labgym.runs.manifest import RunManifest
from labgym.suites import Suite

torch = pytest.importorskip("torch")
SUITE = Suite(name="short", split="val", layouts=("val-alk_01",), max_steps=2)


def sessions(folder: Path, policy: str, kernels: str | None = None) -> list[RunProvenance]:
    """Drive a few steps and return the provenance in the folder."""
    evaluate(policy, SUITE, out=folder, progress=False, kernels=kernels)
    return [one for one in TransitionEvaluation.read(folder).provenance if isinstance(one, RunProvenance)]


@pytest.mark.skipif(not runs_pinned(), reason="the processor has no AVX2")
def test_provenance_records_torch_kernels_instruction_set_threads_cores_and_time(tmp_path: Path) -> None:
    begin = datetime.now(UTC) - timedelta(seconds=1)
    (session,) = sessions(tmp_path / "run", "ppo")
    assert session.kernels == {
        "kernels": "pinned/1",
        "threads": 1,
        "torch": str(torch.__version__),
        "torch_capability": "AVX2",
        "torch_threads": 1,
        "onednn": "false",
    }
    assert session.versions["torch"] == version("torch")
    assert session.host.cores == len(os.sched_getaffinity(0))
    assert session.host.instruction_set in Path("/proc/cpuinfo").read_text().split()
    assert session.host.threads >= 1
    assert begin <= datetime.fromisoformat(session.started) <= datetime.now(UTC)


def test_native_kernels_are_recorded_as_torch_reports_them(tmp_path: Path) -> None:
    (session,) = sessions(tmp_path / "run", "ppo", "native")
    assert session.kernels is not None
    assert session.kernels["kernels"] == "native"
    assert session.kernels["torch_capability"] == torch.backends.cpu.get_cpu_capability()


def test_each_session_has_a_line_and_none_counts_in_the_identity_or_the_manifest(tmp_path: Path) -> None:
    sessions(tmp_path / "run", "straight")
    first, second = sessions(tmp_path / "run", "straight")
    assert first.host == second.host
    assert first.kernels == second.kernels
    identity = read_json(tmp_path / "run" / "run.json")
    assert not {"host", "versions", "started"} & identity["inputs"].keys()
    manifest = RunManifest.read(tmp_path / "run")
    assert manifest is not None
    assert "provenance.jsonl" not in manifest.files
