"""Work on a stranger's file ends within its limits, and its process has neither files nor network."""

from __future__ import annotations

import os
import signal
import socket
import struct
import time
from pathlib import Path

import pytest

from labgym.confinement import probe, seccomp
from labgym.confinement.trial import TrialError, answer_of

MEBIBYTE = 2**20


def test_the_answer_is_that_of_the_work() -> None:
    assert answer_of(lambda: {"bodies": 3, "mass": 1.5}, 64 * MEBIBYTE, 30.0) == {"bodies": 3, "mass": 1.5}


@pytest.mark.parametrize(
    ("work", "reason"),
    [
        (lambda: time.sleep(60), "longer than 2 s"),
        (lambda: len(bytearray(300 * MEBIBYTE)), "64 MiB of memory"),
        (lambda: os.kill(os.getpid(), signal.SIGSEGV), "crashes"),
        (lambda: os._exit(3), "crashes"),
    ],
)
def test_a_limit_or_a_crash_is_an_error_of_the_caller(work, reason) -> None:
    with pytest.raises(TrialError, match=reason):
        answer_of(work, 64 * MEBIBYTE, 2.0)


@pytest.mark.skipif(not probe().boxed, reason="this kernel has no Landlock or no seccomp")
def test_the_work_has_no_files_and_no_network(tmp_path: Path) -> None:
    (tmp_path / "a").write_text("a")

    def denied() -> list[str]:
        kinds = []
        for attempt in (
            lambda: (tmp_path / "a").read_text(),
            lambda: (tmp_path / "b").write_text("b"),
            socket.socket,
            lambda: os.kill(os.getppid(), 0),
        ):
            try:
                attempt()
            except PermissionError as error:
                kinds.append(type(error).__name__)
        return kinds

    assert answer_of(denied, 64 * MEBIBYTE, 30.0) == ["PermissionError"] * 4


def run(code: bytes, audit: int, number: int, arguments: tuple[int, ...]) -> int:
    """Return the action of a filter for a system call: an interpreter of the instructions that it uses."""
    words = {0: number, 4: audit} | {16 + 8 * index: value & 0xFFFFFFFF for index, value in enumerate(arguments)}
    instructions = list(struct.iter_unpack("<HBBI", code))
    place = value = 0
    while True:
        kind, when_true, when_false, constant = instructions[place]
        place += 1
        if kind == seccomp.LOAD_WORD:
            value = words[constant]
        elif kind == seccomp.AND:
            value &= constant
        elif kind == seccomp.EQUAL:
            place += when_true if value == constant else when_false
        elif kind == seccomp.AT_LEAST:
            place += when_true if value >= constant else when_false
        elif kind == seccomp.JUMP:
            place += constant
        else:
            return constant


@pytest.mark.parametrize("name", seccomp.MACHINES)
def test_the_filter_denies_by_number_and_argument_on_both_machines(name: str) -> None:
    machine = seccomp.MACHINES[name]
    code = seccomp.program(machine, seccomp.signal_denials(4711))

    def action(call: str, *arguments: int) -> int:
        number = seccomp.NUMBERS[call][machine.column]
        assert number is not None
        return run(code, machine.audit, number, (*arguments, *[0] * (6 - len(arguments)))) & 0xFFFF0000

    allow, deny = seccomp.ALLOW, seccomp.ERRNO
    assert action("socket", 2, 1, 0) == action("connect") == action("keyctl") == action("ptrace") == deny
    assert action("socketpair", 1, 1) == action("socketpair", 1, 0x80001) == allow
    assert action("socketpair", 1, 2) == action("socketpair", 1, 0x80002) == deny
    assert action("openat", 0, 0, os.O_RDONLY) == action("openat", 0, 0, os.O_WRONLY | os.O_TRUNC) == allow
    assert action("openat", 0, 0, os.O_RDONLY | os.O_TRUNC) == deny
    assert action("clone", 0x11) == allow
    assert action("clone", 0x10000011) == action("clone", 0x00020011) == deny
    assert action("kill", 4711) == action("tgkill", 4711) == action("prlimit64", 0) == allow
    assert action("kill", 1) == action("kill", 0) == action("tkill", 4711) == action("prlimit64", 1) == deny
    assert action("ioctl", 3, 0x541B) == action("ioctl", 3, 0x5401) == allow
    assert action("ioctl", 3, 0x40086602) == action("ioctl", 3, 0x8901) == deny
    assert action("fcntl", 3, 3) == allow
    assert action("fcntl", 3, 8) == deny
    succeeding = [action(*call) for call in (("flock", 3, 2), ("setsid",), ("setpgid", 0, 0), ("fcntl", 3, 6))]
    assert succeeding == [deny] * 4
    assert run(code, machine.audit, seccomp.NUMBERS["setsid"][machine.column], (0,) * 6) == seccomp.ERRNO
    assert run(code, machine.audit, seccomp.NUMBERS["fcntl"][machine.column], (3, 6, 0, 0, 0, 0)) == seccomp.ERRNO
    assert action("fcntl", 3, 5) == allow
    assert action("setpriority", 0, 0) == allow
    assert action("setpriority", 0, 7) == action("setpriority", 1, 0) == deny
    assert run(code, machine.audit, 0, (0,) * 6) == allow
    assert run(code, 0x40000003, 0, (0,) * 6) == seccomp.KILL
    assert run(code, machine.audit, seccomp.X32 + 41, (0,) * 6) & 0xFFFF0000 == deny
