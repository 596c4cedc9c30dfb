from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from laboratories import small_laboratory

from labgym.errors import LabgymError, MissingDependencyError, OptionError, UnknownNameError
from labgym.eval.driving.drive import TransitionDrive, drive_layout
from labgym.eval.evaluator import evaluate
from labgym.geometry import rotate
from labgym.navigation import goal_pairs
from labgym.policies.process import PolicyProcess, PolicySource, ProcessLimits
from labgym.policies.process.box import NO_NETWORK, probe
from labgym.policies.process.family import descendants, processes
from labgym.suites import Suite
from runs.killing import hear_interrupts

HERE = Path(__file__).parent
BRIEF = Suite(name="brief", max_steps=6)
LAYOUT = small_laboratory("guards")
PAIRS = goal_pairs(LAYOUT)


@pytest.fixture(autouse=True)
def users_module(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(HERE)


def driven(name: str, limits: ProcessLimits | None = None, **options: object) -> tuple[TransitionDrive, ...]:
    process = PolicyProcess(PolicySource.named(f"misbehaving:{name}", options), limits)
    try:
        return drive_layout(process, LAYOUT, BRIEF, "policy", seed=0)
    finally:
        process.close()


def goal_x(pair: int) -> float:
    """The goal of a pair as a policy sees it: its first coordinate in the start frame."""
    (x, y, yaw), goal = PAIRS[pair].start, PAIRS[pair].goal
    return rotate(goal[0] - x, goal[1] - y, -yaw)[0]


def measured(drive: TransitionDrive) -> dict[str, object]:
    return drive.row.model_dump(exclude={"planning_ms"})


def running(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] not in "ZX"
    except FileNotFoundError:
        return False


def within(seconds: float, condition: Callable[[], bool]) -> bool:
    deadline = time.monotonic() + seconds
    while time.monotonic() < deadline:
        if condition():
            return True
        time.sleep(0.02)
    return condition()


@pytest.fixture(scope="module")
def honest() -> list[dict[str, object]]:
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(HERE)
        return [measured(drive) for drive in driven("Honest")]


WAYS = {
    "raises": "RuntimeError: no thanks",
    "raises_unprintable": "RudeError: (no message)",
    "interrupts_itself": "KeyboardInterrupt:",
    "system_exit": "SystemExit: 7",
    "os_exit": "the policy's process exited with status 3",
    "kills_itself": "the policy's process was killed by SIGKILL",
    "segfaults": "the policy's process was killed by SIGSEGV",
    "kills_its_parent": f"PermissionError: [Errno 1] Operation not permitted ({NO_NETWORK})"
    if probe().boxed
    else "the policy's process ended",
    "hangs": "act took longer than 4 s",
    "sleeps_deaf": "act took longer than 4 s",
    "three_numbers": "act returned shape (3,), expected two finite numbers in [-1, 1]",
    "nothing": "act returned shape (), expected two finite numbers in [-1, 1]",
    "text": "act returned a str, expected two numbers in [-1, 1]",
    "nan": "act returned [nan, 0.0], expected two finite numbers in [-1, 1]",
    "infinite": "act returned [inf, 0.0], expected two finite numbers in [-1, 1]",
    "many_numbers": "act returned shape (10000000,), expected two finite numbers in [-1, 1]",
    "forks_children": "RuntimeError: forked",
    "closes_its_sockets": "the policy's process closed its connection",
    "sends_garbage": "the policy's process sent garbage: status b'g' with 1633841761 bytes is not an answer",
    "sends_nan": "act returned numbers that are not finite",
    "sends_facts": "the policy's process sent an answer of another kind",
    "sends_a_pickle": "the policy's process sent garbage: an error report that is not valid",
}


@pytest.mark.cases(12)
@pytest.mark.parametrize("way", WAYS)
def test_a_policy_that_misbehaves_fails_its_episode_and_no_other(way, honest, tmp_path):
    before = descendants(os.getpid(), processes())
    limits = ProcessLimits(call_seconds=4.0 if WAYS[way].startswith("act took") else 120.0)
    drives = driven("Misbehaving", limits, way=way, goal_x=goal_x(1), folder=str(tmp_path))
    assert drives[1].row.error == WAYS[way]
    assert (drives[1].row.success, drives[1].row.steps) == (False, 2)
    assert [measured(drives[0]), measured(drives[2])] == [honest[0], honest[2]]
    assert within(60.0, lambda: descendants(os.getpid(), processes()) <= before)
    assert not Path(f"{tmp_path}-bomb").exists()


def test_a_policy_that_eats_memory_fails_its_episode_and_no_other(honest):
    drives = driven("Misbehaving", ProcessLimits(memory_gb=1.0), way="eats_memory", goal_x=goal_x(1))
    assert "GB of memory, more than the limit of 1 GB" in drives[1].row.error
    assert [measured(drives[0]), measured(drives[2])] == [honest[0], honest[2]]


def test_limits_that_are_not_reached_change_nothing(honest):
    drives = driven("Honest", ProcessLimits(call_seconds=7.0, load_seconds=50.0, memory_gb=3.0))
    assert [measured(drive) for drive in drives] == honest


@pytest.mark.slow
def test_the_whole_evaluation_goes_on_after_a_death(honest):
    options = {"way": "kills_itself", "goal_x": goal_x(0)}
    report = evaluate("misbehaving:Misbehaving", [LAYOUT], progress=False, options=options)
    assert [row.error is None for row in report.rows] == [False, True, True]
    assert report.summary.errors == 1


def test_what_a_policy_prints_is_no_output_of_the_evaluation(tmp_path):
    script = tmp_path / "script.py"
    script.write_text(
        f"import sys; sys.path[:0] = [{str(HERE)!r}, {str(HERE.parents[1])!r}]\n"
        "from test_guards import driven\n"
        "print([drive.row.error for drive in driven('Printing')])\n"
    )
    result = subprocess.run([sys.executable, script], capture_output=True, text=True, timeout=600, check=True)
    assert result.stdout == "[None, None, None]\n"
    assert result.stderr.count("raw reset") == 3
    assert result.stderr.count("program") == 3 * BRIEF.max_steps
    assert result.stderr.count("made") == 4  # it loads once to declare itself, and for each episode


def test_a_policy_with_threads_gets_a_newly_loaded_process_for_each_episode():
    drives = driven("Threaded")
    assert [drive.row.error for drive in drives] == [None] * 3
    lengths = [drive.row.path_length for drive in drives]
    assert max(lengths) == pytest.approx(min(lengths), rel=0.05)


def test_errors_of_loading_keep_their_class_and_say_what_is_wrong():
    with pytest.raises(UnknownNameError, match=r"'astr' not found; nearest: astar"):
        PolicyProcess(PolicySource.named("astr"))
    with pytest.raises(UnknownNameError, match=r"policy 'dwa' got an unexpected keyword argument 'colour'"):
        PolicyProcess(PolicySource.named("dwa", {"colour": "red"}))
    with pytest.raises(OptionError, match="radius"):
        PolicyProcess(PolicySource.named("dwa", {"radius": -1.0}))
    with pytest.raises(LabgymError, match="cannot import 'misbehaving:Missing'"):
        PolicyProcess(PolicySource.named("misbehaving:Missing"))
    source = PolicySource.named("misbehaving:SlowToLoad", {"seconds": 100.0})
    with pytest.raises(LabgymError, match=r"'misbehaving:SlowToLoad' could not be loaded: took longer than 0.5 s"):
        PolicyProcess(source, ProcessLimits(load_seconds=0.5))
    with pytest.raises(LabgymError, match=r"'misbehaving:DeadOnArrival' could not be loaded: its process ended"):
        PolicyProcess(PolicySource.named("misbehaving:DeadOnArrival"))
    with pytest.raises(LabgymError, match="observation"):
        PolicyProcess(PolicySource.named("misbehaving:LiarAboutItself"))


@pytest.mark.parametrize("value", [0.0, -1.0, float("nan"), float("inf"), "60", True])
def test_limits_are_positive_numbers(value):
    with pytest.raises(OptionError, match="call_seconds"):
        ProcessLimits(call_seconds=value)


def test_a_module_that_starts_an_evaluation_when_imported_is_refused(tmp_path, monkeypatch):
    (tmp_path / "unguarded.py").write_text(
        "from labgym.policies import Policy\n"
        "from labgym.policies.process import PolicyProcess, PolicySource\n"
        "PolicyProcess(PolicySource.named('straight'))\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(LabgymError, match="a policy cannot evaluate policies"):
        PolicyProcess(PolicySource.named("unguarded:Policy"))


@pytest.mark.cases(1)
@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGTERM, signal.SIGINT])
@pytest.mark.parametrize("hang", ["load", "act"])
def test_nothing_remains_when_the_evaluator_dies(number, hang, tmp_path):
    script = tmp_path / "script.py"
    script.write_text(
        f"import sys; sys.path[:0] = [{str(HERE)!r}, {str(HERE.parents[1])!r}]\n"
        "from test_guards import driven\n"
        f"driven('Forgetful', hang={hang!r})\n"
    )
    evaluator = subprocess.Popen(
        [sys.executable, script], stderr=subprocess.DEVNULL, start_new_session=True, preexec_fn=hear_interrupts
    )
    count = {"load": 3, "act": 4}[hang]  # host, policy and its program; its orphan
    assert within(300.0, lambda: len(descendants(evaluator.pid, processes())) == count)
    noted = descendants(evaluator.pid, processes())
    os.kill(evaluator.pid, number)
    evaluator.wait(120.0)
    assert within(60.0, lambda: not any(running(pid) for pid in noted))


def test_a_missing_package_keeps_its_class(tmp_path, monkeypatch):
    (tmp_path / "torch.py").write_text("raise ImportError('no torch here', name='torch')\n")
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(MissingDependencyError, match=r"labgym-nav\[train\]"):
        PolicyProcess(PolicySource.named("ppo"))


def test_limits_by_name():
    assert ProcessLimits.named({}) is None
    assert ProcessLimits.named({"memory_gb": 2}) == ProcessLimits(memory_gb=2)
    with pytest.raises(UnknownNameError, match=r"policy limit 'seconds' not found; .*call_seconds"):
        ProcessLimits.named({"seconds": 3})
