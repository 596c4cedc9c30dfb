"""What a hostile policy tries: each probe returns what it got, or raises an OSError."""

from __future__ import annotations

import contextlib
import ctypes
import mmap
import os
import resource
import signal
import socket
import sys
from collections.abc import Callable
from pathlib import Path

from labgym.artefacts import artefacts

libc = ctypes.CDLL(None, use_errno=True)
KEY = 0x6C6162
ADD_KEY, IO_URING_SETUP, PIDFD_OPEN = {"x86_64": (248, 425, 434), "aarch64": (217, 425, 434)}[os.uname().machine]
USER_KEYRING = -4
PTRACE_SEIZE = 0x4206


def checked(result: int) -> int:
    """Return the result of a call of the C library, or raise its error."""
    if result < 0:
        raise OSError(ctypes.get_errno(), os.strerror(ctypes.get_errno()))
    return result


class Outside:
    """What a test prepares for the probes.

    Attributes:
        folder: of the policy, readable in the box. secret: a file elsewhere.
        pid: of a process outside. port: of a TCP server. socket: path of a server on a socket, and its abstract name.
    """

    def __init__(self, folder: Path, secret: Path, pid: int, port: int, place: str) -> None:
        self.folder, self.secret, self.pid, self.port, self.socket = folder, secret, pid, port, place

    @property
    def private(self) -> Path:
        """The folder in which the box allows everything."""
        return self.folder.with_name("private")

    @property
    def own(self) -> Path:
        """A file of the policy."""
        return self.folder / "table.json"


def layouts(_: Outside) -> object:
    return next(artefacts("layouts").rglob("*.json")).read_bytes()[:9]


def suites(_: Outside) -> object:
    return next(artefacts("eval").rglob("*.json")).read_bytes()[:9]


def results(_: Outside) -> object:
    return next((artefacts("eval") / "leaderboard").rglob("*.json")).read_bytes()[:9]


def another_file(outside: Outside) -> object:
    return outside.secret.read_text()


def users(_: Outside) -> object:
    return Path("/etc/passwd").read_bytes()[:9]


def write_tmp(_: Outside) -> object:
    return _written(Path("/tmp"))


def write_shared_memory(_: Outside) -> object:
    return _written(Path("/dev/shm"))


def write_own_folder(outside: Outside) -> object:
    return _written(outside.folder)


def write_artefacts(_: Outside) -> object:
    return _written(artefacts("policies"))


def write_labgym(_: Outside) -> object:
    return _written(artefacts("assets").parent / "labgym")


def _written(folder: Path) -> object:
    path = folder / f".labgym-probe-{os.getpid()}"
    path.write_text("note")
    path.unlink()
    return "written"


def own_file(outside: Outside) -> object:
    with outside.own.open("a") as stream:
        stream.write("note")
    return "written"


def cut_off(outside: Outside) -> object:
    os.close(os.open(outside.own, os.O_RDONLY | os.O_TRUNC))
    return "empty"


def mode(outside: Outside) -> object:
    return outside.own.chmod(0o640) or "changed"


def times(outside: Outside) -> object:
    return os.utime(outside.own, (1, 1)) or "changed"


def attribute(outside: Outside) -> object:
    return os.setxattr(outside.own, "user.note", b"1") or "set"


def flags(outside: Outside) -> object:
    import fcntl

    with outside.own.open("rb") as stream:
        content = bytearray(8)
        fcntl.ioctl(stream, 0x80086601, content)  # FS_IOC_GETFLAGS
        content[0] |= 0x40  # no dump
        fcntl.ioctl(stream, 0x40086602, bytes(content))
    return "set"


def system_v(_: Outside) -> object:
    return checked(libc.shmget(KEY, 4096, 0o1600))


def message_queue(_: Outside) -> object:
    return checked(libc.mq_open(b"/labgym-probe", os.O_CREAT | os.O_RDWR, 0o600, None))


def keyring(_: Outside) -> object:
    return checked(libc.syscall(ADD_KEY, b"user", b"labgym-probe", b"note", 4, USER_KEYRING))


def kill(outside: Outside) -> object:
    return os.kill(outside.pid, signal.SIGCONT) or "signalled"


def ptrace(outside: Outside) -> object:
    return checked(libc.ptrace(PTRACE_SEIZE, outside.pid, None, None)) or "traced"


def memory(outside: Outside) -> object:
    return Path(f"/proc/{outside.pid}/maps").read_bytes()[:9]


def environment(outside: Outside) -> object:
    return Path(f"/proc/{outside.pid}/environ").read_bytes()[:9]


def limits(outside: Outside) -> object:
    return resource.prlimit(outside.pid, resource.RLIMIT_NOFILE, resource.prlimit(0, resource.RLIMIT_NOFILE))


def priority(outside: Outside) -> object:
    return os.setpriority(os.PRIO_PROCESS, outside.pid, 1) or "changed"


def processor(outside: Outside) -> object:
    return os.sched_setaffinity(outside.pid, os.sched_getaffinity(0)) or "changed"


def handle(outside: Outside) -> object:
    return checked(libc.syscall(PIDFD_OPEN, outside.pid, 0))


def tcp(outside: Outside) -> object:
    return socket.socket().connect(("127.0.0.1", outside.port)) or "connected"


def udp(_: Outside) -> object:
    return socket.socket(socket.AF_INET, socket.SOCK_DGRAM).sendto(b"note", ("127.0.0.1", 9))


def unix(outside: Outside) -> object:
    return socket.socket(socket.AF_UNIX).connect(outside.socket) or "connected"


def abstract(outside: Outside) -> object:
    return socket.socket(socket.AF_UNIX).connect(f"\0{outside.socket}") or "connected"


def pair_to_a_name(outside: Outside) -> object:
    one, _ = socket.socketpair(socket.AF_UNIX, socket.SOCK_DGRAM)
    return one.connect(f"\0{outside.socket}-datagram") or "connected"


def io_uring(_: Outside) -> object:
    return checked(libc.syscall(IO_URING_SETUP, 1, ctypes.create_string_buffer(120)))


def namespace(_: Outside) -> object:
    return checked(libc.unshare(0x10000000)) or "unshared"


PROBES: dict[str, Callable[[Outside], object]] = {
    probe.__name__: probe
    for probe in (
        *(layouts, suites, results, another_file, users),
        *(write_tmp, write_shared_memory, write_own_folder, write_artefacts, write_labgym),
        *(own_file, cut_off, mode, times, attribute, flags, system_v, message_queue, keyring),
        *(kill, ptrace, memory, environment, limits, priority, processor, handle),
        *(tcp, udp, unix, abstract, pair_to_a_name, io_uring, namespace),
    )
}


shared = mmap.mmap(-1, 8)


class Notes:
    """Ways of leaving a note in one episode and reading it in the next: `leave` and `read`."""

    def __init__(self, folder: str) -> None:
        self.folder = Path(folder)

    def paths(self) -> tuple[Path, ...]:
        return tuple(Path(place) / "labgym-note" for place in ("/tmp", "/dev/shm", "/var/tmp", self.folder))

    def leave(self) -> None:
        """Leave a note in every way."""
        table = self.folder / "table.json"
        shared[0] = 1
        sys.modules["labgym"].note = True  # type: ignore[attr-defined]
        for way in (
            *(lambda path=path: path.write_text("note") for path in self.paths()),
            lambda: (Path(os.environ.get("TMPDIR", "/tmp")) / "labgym-note").write_text("note"),
            lambda: table.write_text("note"),
            lambda: os.utime(table, (1, 1)),
            lambda: table.chmod(0o606),
            lambda: os.setxattr(table, "user.note", b"1"),
            lambda: system_v(None),  # type: ignore[arg-type]
            lambda: os.lseek(2, 12345, os.SEEK_SET),
            lambda: os.set_blocking(0, False),
            lambda: os.setpriority(os.PRIO_PROCESS, os.getppid(), 3),
            lambda: resource.prlimit(os.getppid(), resource.RLIMIT_NOFILE, (777, 7777)),
        ):
            with contextlib.suppress(OSError):
                way()

    def read(self) -> list[str]:
        """Return the ways in which a note has arrived."""
        table, notes = self.folder / "table.json", []
        notes += [str(path) for path in self.paths() if path.exists()]
        found = {
            "private folder": (Path(os.environ.get("TMPDIR", "/nowhere")) / "labgym-note").exists(),
            "content": table.read_text() != "{}",
            "time": table.stat().st_mtime == 1,
            "mode": table.stat().st_mode & 0o777 == 0o606,
            "attribute": "user.note" in os.listxattr(table),
            "shared memory": shared[0] == 1,
            "module": hasattr(sys.modules["labgym"], "note"),
            "System V": libc.shmget(KEY, 4096, 0) >= 0,
            "position": os.lseek(2, 0, os.SEEK_CUR) == 12345 if os.fstat(2).st_mode & 0o100000 else False,
            "blocking": not os.get_blocking(0),
            "priority": os.getpriority(os.PRIO_PROCESS, 0) == 3,
            "limit": resource.getrlimit(resource.RLIMIT_NOFILE)[0] == 777,
        }
        return notes + [name for name, arrived in found.items() if arrived]
