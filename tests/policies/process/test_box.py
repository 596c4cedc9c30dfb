"""A foreign policy reads what it was given, leaves nothing and reaches nobody; as root and as another user."""

from __future__ import annotations

import json
import os
import signal
import socket
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from laboratories import small_laboratory
from policies.process import probes
from policies.process.tricks import TRICKS, WITHOUT_A_BOX

from labgym import confinement
from labgym.artefacts import artefacts
from labgym.errors import LabgymError
from labgym.eval.driving.drive import drive_layout
from labgym.policies import EpisodeStart
from labgym.policies.policy import PolicyError
from labgym.policies.process import PolicyProcess, PolicySource, box
from labgym.policies.process.box import Grants, Protection, probe
from labgym.suites import Suite

HERE = Path(__file__).parent
NOBODY = 65534
USERS = [None, *([NOBODY] if os.geteuid() == 0 else [])]
needs_box = pytest.mark.skipif(
    not probe().boxed, reason="this kernel has no Landlock or no seccomp: nothing is denied, and runs say 'not boxed'"
)


def in_child(work: Callable[[], object]) -> object:
    """Return what some work returns in a forked process, or the name of the error that it raises."""
    reading, writing = os.pipe()
    child = os.fork()
    if child == 0:
        try:
            answer = ["value", work()]
        except BaseException as error:  # noqa: BLE001 - whatever it raises is the answer
            answer = ["error", type(error).__name__, getattr(error, "errno", None)]
        os.write(writing, json.dumps(answer, default=str).encode())
        os.kill(os.getpid(), signal.SIGKILL)  # no code of pytest runs at the end
    os.close(writing)
    with os.fdopen(reading) as stream:
        text = stream.read()
    os.waitpid(child, 0)
    return json.loads(text) if text else ["died"]


@pytest.fixture
def outside(tmp_path: Path) -> Iterator[probes.Outside]:
    """A policy's folder, a secret, a process, and servers that a probe may try to reach."""
    tmp_path.chmod(0o755)
    for parent in tmp_path.parents[:2]:
        parent.chmod(0o755)
    folder, place = tmp_path / "policy", f"{tmp_path}/s"
    folder.mkdir()
    folder.with_name("private").mkdir()
    for open_folder in (folder, folder.with_name("private")):
        open_folder.chmod(0o777)
    (folder / "table.json").write_text("{}")
    (tmp_path / "secret").write_text("secret")
    tcp, unix, abstract = socket.create_server(("127.0.0.1", 0)), socket.socket(socket.AF_UNIX), socket.socket(1)
    datagram = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
    for server, address in ((unix, place), (abstract, f"\0{place}")):
        server.bind(address)
        server.listen()
    datagram.bind(f"\0{place}-datagram")
    sleeper = os.fork()
    if sleeper == 0:
        signal.pause()
        os._exit(0)
    yield probes.Outside(folder, tmp_path / "secret", sleeper, tcp.getsockname()[1], place)
    os.kill(sleeper, signal.SIGKILL)
    os.waitpid(sleeper, 0)
    for server in (tcp, unix, abstract, datagram):
        server.close()


def tried(name: str, outside: probes.Outside, boxed: bool, user: int | None) -> object:
    """Return the answer of a probe in a process of a user, in a box or not."""

    box.system_rules()  # once for all processes

    def work() -> object:
        grants = Grants(read=(str(outside.folder),), private=str(outside.private))
        if user is not None:
            os.setgroups([])
            os.setgid(user)
            os.setuid(user)
        if boxed:
            box.enter(grants)
        return {**probes.PROBES, **TRICKS}[name](outside)

    return in_child(work)


@needs_box
@pytest.mark.parametrize("user", USERS)
@pytest.mark.parametrize("name", probes.PROBES)
def test_the_box_denies(name: str, user: int | None, outside: probes.Outside) -> None:
    answer = tried(name, outside, boxed=True, user=user)
    assert answer[0] == "error", answer
    assert answer[1] in ("PermissionError", "OSError", "StopIteration"), answer
    assert outside.own.read_text() == "{}"


@needs_box
@pytest.mark.parametrize("user", USERS)
def test_the_box_denies_tricks(user: int | None, outside: probes.Outside) -> None:
    answers = {name: tried(name, outside, boxed=True, user=user) for name in TRICKS}
    expected = ("PermissionError", "OSError", "FileNotFoundError")
    assert {
        name: answer for name, answer in answers.items() if answer[:1] != ["error"] or answer[1] not in expected
    } == {}
    assert outside.own.read_text() == "{}"


def test_tricks_get_something_without_a_box(outside: probes.Outside) -> None:
    answers = {name: tried(name, outside, boxed=False, user=None) for name in WITHOUT_A_BOX}
    assert {name: answer for name, answer in answers.items() if answer[0] != "value" or not answer[1]} == {}


IN_A_CONTAINER = {"keyring", "io_uring", "message_queue", "attribute", "flags", "namespace", "system_v", "users"}
"""Probes that a container or a file system may deny by itself."""


OF_THE_OWNER = {"ptrace", "memory", "environment", "priority", "write_artefacts", "write_labgym"}


@pytest.mark.parametrize("name", sorted(probes.PROBES.keys() - IN_A_CONTAINER))
def test_the_probes_get_something_without_a_box(name: str, outside: probes.Outside) -> None:
    if os.geteuid() != 0 and name in OF_THE_OWNER:
        pytest.skip("may be denied to ordinary users")
    assert tried(name, outside, boxed=False, user=None)[0] == "value"


@needs_box
def test_the_private_folder_the_own_files_and_programs_are_granted(tmp_path: Path) -> None:
    folder, private = tmp_path / "policy", tmp_path / "private"
    folder.mkdir()
    private.mkdir()
    (folder / "w.bin").write_bytes(b"weights")

    def work() -> object:
        import subprocess

        box.enter(Grants(read=(str(folder),), private=str(private)))
        (private / "a").mkdir()
        (private / "a" / "b").write_text("x")
        (private / "a" / "b").rename(private / "c")
        (private / "c").unlink()
        one, two = socket.socketpair()
        one.sendall(b"x")
        program = [sys.executable, "-c", "import numpy, json; print(json.dumps(1))"]
        return [
            (folder / "w.bin").read_text(),
            two.recv(1).decode(),
            subprocess.run(program, capture_output=True, text=True, check=True).stdout,
            bool(list(artefacts("policies").iterdir())),
            len(list(Path("/proc/self/fd").iterdir())) > 0,
            os.urandom(2) != b"",
        ]

    assert in_child(work) == ["value", ["weights", "x", "1\n", True, True, True]]


@needs_box
def test_programs_that_a_boxed_process_starts_are_boxed(tmp_path: Path) -> None:
    def work() -> object:
        import subprocess

        box.enter(Grants())
        code = "import socket, pathlib\ntry: socket.socket()\nexcept PermissionError: print(pathlib.Path.cwd())"
        return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False).returncode

    assert in_child(work) == ["value", 0]


def test_a_kernel_without_a_box_says_so_and_lets_nobody_in(monkeypatch: pytest.MonkeyPatch) -> None:
    assert str(Protection(0, seccomp=True)) == str(Protection(3, seccomp=False)) == "not boxed"
    assert str(Protection(3, seccomp=True)) == "landlock-3+seccomp"
    monkeypatch.setattr(confinement, "probe", lambda: Protection(0, seccomp=True))
    with pytest.raises(LabgymError, match="no Landlock"):
        box.enter(Grants())


def test_published_floors_are_subtracted_from_a_folder_that_contains_them() -> None:
    root = artefacts("layouts").parent
    places = box.spared([root])
    assert str(root / "labgym") in places
    assert str(root) not in places
    hidden = [str(artefacts(name)) for name in ("layouts", "eval")]
    assert not any(place.startswith(folder) or folder.startswith(f"{place}/") for place in places for folder in hidden)


def start(x: float = 1.0) -> EpisodeStart:
    return EpisodeStart(goal=(x, 0.0), rng=np.random.default_rng(0))


@needs_box
def test_no_note_reaches_the_next_episode(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(HERE)
    (tmp_path / "table.json").write_text("{}")
    process = PolicyProcess(PolicySource.named("hostile:Noting", {"folder": str(tmp_path)}))
    try:
        for _ in range(3):
            process.reset(start())
            assert process.act({}).tolist() == [0.5, 0.0]
    finally:
        process.close()
    assert (tmp_path / "table.json").read_text() == "{}"


def test_notes_arrive_without_a_box(tmp_path: Path) -> None:
    (tmp_path / "table.json").write_text("{}")
    notes = probes.Notes(str(tmp_path))
    try:
        in_child(notes.leave)
        _, arrived = in_child(notes.read)
    finally:
        for path in notes.paths():
            path.unlink(missing_ok=True)
        number = probes.libc.shmget(probes.KEY, 4096, 0)
        if number >= 0:
            probes.libc.shmctl(number, 0, None)
    assert {"content", "time", "shared memory"} - set(arrived) <= {"time"}
    assert len(arrived) >= 5


@needs_box
def test_a_policy_that_looks_up_published_floors_fails_with_the_reason(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(HERE)
    process = PolicyProcess(PolicySource.named("hostile:LookingUp"))
    try:
        with pytest.raises(PolicyError, match="floors, suites and results of labgym are hidden"):
            process.reset(start())
    finally:
        process.close()


def reset_often(process: PolicyProcess) -> None:
    for _ in range(40):
        process.reset(start())


def test_a_policy_that_declares_something_else_when_it_drives_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(HERE)
    process = PolicyProcess(PolicySource.named("hostile:TwoFaced"))
    try:
        with pytest.raises(PolicyError, match="declares another observation"):
            reset_often(process)
    finally:
        process.close()


def test_the_process_states_its_level(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(HERE)
    levels = {}
    for name in ("straight", "hostile:Plain"):
        process = PolicyProcess(PolicySource.named(name))
        levels[name] = process.box
        process.close()
    assert levels == {"straight": "built-in policy", "hostile:Plain": str(probe())}


@needs_box
@pytest.mark.parametrize("policy", ["labgym.policies.astar:AStarPolicy", "labgym.policies.online_map:OnlineMapPolicy"])
def test_a_policy_of_labgym_drives_alike_in_a_box(policy: str) -> None:
    name = {"AStarPolicy": "astar", "OnlineMapPolicy": "online_map"}[policy.rpartition(":")[2]]
    layout, suite, rows = small_laboratory("boxed"), Suite(name="brief", max_steps=12), []
    for each in (name, policy):
        process = PolicyProcess(PolicySource.named(each))
        try:
            drives = drive_layout(process, layout, suite, "policy", seed=0)
            rows.append([(drive.row.model_dump(exclude={"planning_ms"}), drive.route) for drive in drives])
        finally:
            process.close()
    assert rows[0] == rows[1]
    assert rows[0][0][0]["error"] is None


@needs_box
def test_the_private_folder_is_gone_after_the_episode(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(HERE)
    process = PolicyProcess(PolicySource.named("hostile:Telling"))
    try:
        with pytest.raises(PolicyError, match="labgym-box-") as told:
            process.reset(start())
    finally:
        process.close()
    place = Path(str(told.value).split()[-1])
    assert place.name == "tmp"
    assert not place.parent.exists()
