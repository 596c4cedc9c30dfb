"""Pinned kernels: equal bits on every processor."""

from __future__ import annotations

import importlib
import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from labgym.errors import OptionError, UnknownNameError
from labgym.policies import kernels
from labgym.policies.kernels import NATIVE, PINNED, kernel_facts, kernel_mode, pin_torch
from labgym.policies.process import PolicyProcess, PolicySource
from labgym.policies.random_actions import RandomPolicy

HERE = Path(__file__).parent / "kernels"
EXPECTED = json.loads((HERE / "outputs.json").read_text(encoding="utf-8"))
LEARNED = ("navdp", "iplanner", "ppo", "ppo-depth")


def outputs(*names: str) -> dict[str, Any]:
    """Return digests of the networks' outputs in a process with pinned kernels, and the kernels in force."""
    command = [sys.executable, str(HERE / "outputs.py"), *names]
    variables = {**os.environ, **PINNED.environment, "PYTHONPATH": os.pathsep.join(path for path in sys.path if path)}
    done = subprocess.run(command, env=variables, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-2000:]
    result: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return result


def same_torch(facts: dict[str, str]) -> bool:
    """Return whether torch is the version that the committed digests were made with."""
    return facts["torch"].split("+")[0] == EXPECTED["torch"]


@pytest.mark.parametrize("names", [("navdp", "ppo"), pytest.param(LEARNED, marks=pytest.mark.slow)])
def test_the_published_networks_give_the_bits_that_two_processors_gave(names: tuple[str, ...]) -> None:
    result = outputs(*names)
    if not same_torch(result["facts"]):
        pytest.skip(f"the digests are of torch {EXPECTED['torch']}, installed is {result['facts']['torch']}")
    assert {name: result[name] for name in names} == {name: EXPECTED[name] for name in names}


class Reporting(RandomPolicy):
    """Reports the kernels of its process as the name of a file."""

    def files(self) -> tuple[Path, ...]:
        """Return the report."""
        torch = importlib.import_module("torch")
        pin_torch()
        return (
            Path(f"{torch.backends.cpu.get_cpu_capability()} {torch.get_num_threads()} {kernel_facts()['onednn']}"),
        )


@pytest.mark.skipif(not kernels.runs_pinned(), reason="the processor has no AVX2")
def test_a_policys_process_runs_pinned_kernels_by_default() -> None:
    names = []
    for environment in (None, NATIVE.environment):
        process = PolicyProcess(PolicySource.copied(Reporting()), environment=environment)
        names.append(process.files()[0].name)
        process.close()
    assert names[0] == "AVX2 1 false"
    assert names[1].endswith("true")


def test_a_processor_without_avx2_runs_native_kernels_and_refuses_pinned_ones(monkeypatch: pytest.MonkeyPatch) -> None:
    assert kernel_mode("native") is NATIVE
    monkeypatch.setattr(kernels, "runs_pinned", lambda: True)
    assert kernel_mode() is PINNED
    monkeypatch.setattr(kernels, "runs_pinned", lambda: False)
    assert kernel_mode() is NATIVE
    with pytest.raises(OptionError, match="AVX2"):
        kernel_mode("pinned")
    with pytest.raises(UnknownNameError, match="native"):
        kernel_mode("fast")
