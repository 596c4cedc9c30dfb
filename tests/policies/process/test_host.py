"""What a foreign policy tries beyond its box: the host, the protocol, and files of the run beside its own."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from labgym.artefacts import artefacts
from labgym.confinement import probe
from labgym.policies import EpisodeStart
from labgym.policies.fingerprint.sources import MODULES
from labgym.policies.policy import PolicyError
from labgym.policies.process import PolicyProcess, PolicySource, box
from labgym.policies.process.family import descendants, processes
from labgym.policies.process.hosts import close_hosts
from labgym.policies.process.places import OwnPlaces, known_files
from labgym.policies.process.room import PrivateRoom, remove_left_rooms

HERE = Path(__file__).parent
needs_box = pytest.mark.skipif(not probe().boxed, reason="this kernel has no Landlock or no seccomp")


@pytest.fixture(autouse=True)
def users_module(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(HERE)


def errors(name: str, episodes: int) -> list[str]:
    """Return the errors of the episodes of a policy, "" where there is none."""
    process, texts = PolicyProcess(PolicySource.named(f"hostile:{name}")), []
    try:
        for _ in range(episodes):
            try:
                process.reset(EpisodeStart(goal=(1.0, 0.0), rng=np.random.default_rng(0)))
                texts.append("")
            except PolicyError as error:
                texts.append(str(error))
    finally:
        process.close()
    return texts


def test_a_policy_that_declares_itself_reusable_gets_a_new_process_for_each_episode() -> None:
    assert errors("Forging", 3) == ["", "", ""]


def test_processes_that_start_others_without_end_do_not_outlive_the_episode() -> None:
    process = PolicyProcess(PolicySource.named("hostile:Chasing"))
    try:
        for _ in range(2):
            process.reset(EpisodeStart(goal=(1.0, 0.0), rng=np.random.default_rng(0)))
            time.sleep(0.1)
        process._process.stop()  # type: ignore[union-attr]
        table = processes()
        hosts = {pid for pid in descendants(os.getpid(), table) if not table[pid].ended}
        assert {pid for pid in hosts if table[pid].parent != os.getpid()} == set()
    finally:
        process.close()


def test_an_episode_does_not_learn_that_another_failed_and_does_not_command_the_terminal(
    capfd: pytest.CaptureFixture[str],
) -> None:
    close_hosts()  # a host prints where it printed when it began
    assert errors("Failing", 3) == [r"RuntimeError: printed b'\x00'"] * 3
    close_hosts()
    printed = capfd.readouterr().err
    assert printed.count("Traceback (most recent call last)") == 1
    assert printed.count("]0;titleseen\n") == 3
    assert "\x1b" not in printed
    assert "\x07" not in printed


def test_a_policy_does_not_get_the_users_secrets(monkeypatch: pytest.MonkeyPatch) -> None:
    close_hosts()  # a host has the variables with which it began
    for name in ("OPENAI_API_KEY", "HF_TOKEN", "DATABASE_PASSWORD"):
        monkeypatch.setenv(name, "labgym-secret")
    assert errors("Confiding", 1) == ["RuntimeError: knows False"]
    close_hosts()


def test_the_host_imports_no_module_of_a_policys_folder(tmp_path: Path) -> None:
    marks, code = tmp_path / "marks", "import pathlib\npathlib.Path({!r}).open('a').write(__name__ + ' ')\n"
    for name in ("numpy", "torch"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "__init__.py").write_text(code.format(str(marks)))
    for name in ("json", "sitecustomize", "mujoco", "extra"):
        (tmp_path / f"{name}.py").write_text(code.format(str(marks)))
    shutil.copytree(HERE, tmp_path, dirs_exist_ok=True, ignore=shutil.ignore_patterns("test_*", "__pycache__"))
    (tmp_path / "extra-1.dist-info").mkdir()
    groups = "\n".join(f"[{name}]\nx = extra:x\n" for name in ("gymnasium.envs", "torch.backends", "numba_extensions"))
    (tmp_path / "extra-1.dist-info" / "entry_points.txt").write_text(groups)
    (tmp_path / "extra-1.dist-info" / "METADATA").write_text("Metadata-Version: 2.1\nName: extra\nVersion: 1\n")
    script = (
        "from labgym.cli.arguments import allow_local_modules; allow_local_modules()\n"
        "from labgym.policies.process import PolicyProcess, PolicySource\n"
        "import gymnasium\n"
        "process = PolicyProcess(PolicySource.named('hostile:Plain')); print(process.box); process.close()\n"
    )
    variables = {**os.environ, "PYTHONPATH": str(artefacts("assets").parent)}
    command = [sys.executable, "-P", "-c", script]
    run = subprocess.run(command, cwd=tmp_path, env=variables, capture_output=True, text=True, check=False)
    assert run.stdout.strip() == str(probe()), run.stderr
    assert not marks.exists(), marks.read_text()


def test_modules_of_the_working_folder_are_named_without_being_on_the_python_path(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "onlyhere.py").write_text("from labgym.policies.straight import StraightPolicy\n")
    monkeypatch.setenv(MODULES, str(tmp_path))
    process = PolicyProcess(PolicySource.named("onlyhere:StraightPolicy"))
    process.close()
    assert process.name == "straight"
    assert "onlyhere" not in sys.modules
    assert str(tmp_path) not in sys.path


@needs_box
def test_files_of_the_run_are_hidden_also_in_the_folder_of_the_policy(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shutil.copytree(HERE, tmp_path / "own", ignore=shutil.ignore_patterns("test_*", "__pycache__"))
    monkeypatch.syspath_prepend(tmp_path / "own")
    (tmp_path / "own" / "runs" / "fresh").mkdir(parents=True)
    for place in ("runs/fresh/secret.txt", "runs/table.txt"):
        (tmp_path / "own" / place).write_text("learned")
    names = {}
    for place in ("runs/fresh/secret.txt", "runs/table.txt"):
        source = PolicySource.named("hostile:Opening", {"path": place})
        process = PolicyProcess(replace(source, hidden=(str(tmp_path / "own" / "runs" / "fresh"),)))
        names[place] = process.name
        process.close()
    assert names == {"runs/fresh/secret.txt": "Opening", "runs/table.txt": "learned"}


def test_what_the_first_load_declares_carries_nothing_to_the_others(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "carrying.py").write_text("x = 1\n")
    (tmp_path / "w.bin").write_bytes(b"w")
    monkeypatch.syspath_prepend(tmp_path)
    first = OwnPlaces(PolicySource.named("carrying:P")).grants
    own = [str(tmp_path / name) for name in ("carrying.py", "w.bin")]
    declared = (own[1], "/a note", own[0], f"{tmp_path}/note", "/etc/hostname", own[1], "a\0b")
    assert known_files(first, declared) == tuple(own)


def test_floors_in_other_installations_and_in_the_history_are_hidden(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    checkout, base = tmp_path / "checkout", tmp_path / "base"
    for folder in (checkout / "labgym", checkout / "layouts", checkout / ".git"):
        folder.mkdir(parents=True)
    (checkout / "labgym" / "__init__.py").touch()
    installed = base / "lib" / "python3.11" / "site-packages" / "labgym" / "_artefacts"
    for name in ("layouts", "assets"):
        (installed / name).mkdir(parents=True)
    monkeypatch.syspath_prepend(checkout)
    monkeypatch.setattr(sys, "base_prefix", str(base))
    box.hidden.cache_clear()
    try:
        places = box.spared([checkout, base / "lib"])
    finally:
        box.hidden.cache_clear()
    assert places == (str(installed / "assets"), str(checkout / "labgym"))


def test_rooms_that_a_killed_host_left_are_removed_by_the_next(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    child = os.fork()
    if child == 0:
        PrivateRoom(quiet=False)
        os.kill(os.getpid(), signal.SIGKILL)
    os.waitpid(child, 0)
    (left,) = tmp_path.iterdir()
    room = PrivateRoom(quiet=False)
    remove_left_rooms()
    assert left.exists()  # it may be new
    for place in tmp_path.iterdir():
        os.utime(place, (0.0, 0.0))
    remove_left_rooms()
    assert list(tmp_path.iterdir()) == [room.private.parent]
    room.remove()
    assert list(tmp_path.iterdir()) == []
