"""Policies reach their process by name, by value and through a server."""

from __future__ import annotations

import subprocess
import sys
import threading
from pathlib import Path

import numpy as np
import pytest
from laboratories import small_laboratory

from labgym.errors import LabgymError
from labgym.eval.driving.drive import drive_layout
from labgym.policies import EpisodeStart, Policy, make_policy
from labgym.policies.http.server import NavigationServer
from labgym.policies.process import PolicyProcess, PolicySource
from labgym.suites import Suite

TESTS = Path(__file__).resolve().parents[2]
BRIEF = Suite(name="brief", max_steps=4)
LAYOUT = small_laboratory("sources")
SCRIPT = f"""
import sys
sys.path.append({str(TESTS)!r})
import numpy as np
from labgym.eval import evaluate
from labgym.policies import Policy
from laboratories import small_laboratory

speed = 0.25

class Mine(Policy):
    name = "mine"

    def __init__(self):
        self.episodes = 0

    def reset(self, episode):
        self.episodes += 1

    def act(self, observation):
        if self.episodes != 1:
            raise RuntimeError("it remembers")
        raise RuntimeError(f"speed {{speed}}")

print("started")
policy = Mine()
print({{row.error for row in evaluate(policy, [small_laboratory("script")], progress=False).rows}}, policy.episodes)
"""


def test_a_script_without_a_main_guard_evaluates_its_own_class(tmp_path):
    """Class and variable travel by value; the script does not run again in the policy's process."""
    (tmp_path / "script.py").write_text(SCRIPT)
    result = subprocess.run([sys.executable, "script.py"], cwd=tmp_path, capture_output=True, text=True, timeout=600)
    assert result.stdout == "started\n{'RuntimeError: speed 0.25'} 0\n", result.stderr


def test_a_class_of_the_working_folder_is_found(tmp_path, monkeypatch):
    (tmp_path / "folder_policy.py").write_text(
        "from labgym.policies import Policy\n"
        "class Mine(Policy):\n"
        "    def reset(self, episode): pass\n"
        "    def act(self, observation): return [open('speed.txt').read(), 0]\n"
    )
    (tmp_path / "speed.txt").write_text("0.5")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [*sys.path, ""])
    process = PolicyProcess(PolicySource.named("folder_policy:Mine"))
    try:
        process.reset(EpisodeStart(goal=(1.0, 0.0), rng=np.random.default_rng(0)))
        assert process.act({}).tolist() == [0.5, 0.0]
    finally:
        process.close()


def test_an_object_travels_with_its_state_and_stays_as_it_is():
    class Counting(Policy):
        def __init__(self) -> None:
            self.weights = np.array([0.125, -0.5])
            self.calls = 3

        def reset(self, episode: EpisodeStart) -> None:
            self.calls += 1

        def act(self, observation: object) -> np.ndarray:
            return self.weights * self.calls

    policy = Counting()
    process = PolicyProcess(PolicySource.copied(policy))
    try:
        for _ in range(2):
            process.reset(EpisodeStart(goal=(1.0, 0.0), rng=np.random.default_rng(0)))
            assert process.act({}).tolist() == [0.5, -2.0]
    finally:
        process.close()
    assert policy.calls == 3


def test_a_server_drives_through_its_process():
    with NavigationServer(lambda: make_policy("straight"), port=0) as server:
        threading.Thread(target=server.serve_forever, args=(0.02,), daemon=True).start()
        process = PolicyProcess(PolicySource.named(server.url, {"step_timeout": 60.0}))
        try:
            assert (process.exclusive, process.privileged, process.observation) == (True, False, "rgbd")
            rows = [drive.row for drive in drive_layout(process, LAYOUT, BRIEF, "server", 0)]
        finally:
            process.close()
            server.shutdown()
    assert [(row.error, row.steps) for row in rows] == [(None, 4)] * 3


def test_a_policy_without_privileges_is_not_sent_the_map():
    process = PolicyProcess(PolicySource.named("straight"))
    truth = object()
    try:
        with pytest.raises(Exception, match="not privileged"):
            process.reset(EpisodeStart(goal=(1.0, 0.0), rng=np.random.default_rng(0), truth=truth))  # type: ignore[arg-type]
    finally:
        process.close()


def test_no_separate_process_is_sent_the_world():
    process = PolicyProcess(PolicySource.named("straight"))
    assert not process.foresees
    try:
        with pytest.raises(LabgymError, match="must not receive the world"):
            process.reset(EpisodeStart(goal=(1.0, 0.0), rng=np.random.default_rng(0), world=object()))  # type: ignore[arg-type]
    finally:
        process.close()
