"""Further ways out of the box, past what `probes` tries: links, locks, parents, caches and unusual system calls.

Each returns what it got, something true, or raises an OSError.
"""

from __future__ import annotations

import ctypes
import fcntl
import os
import socket
import struct
import time
from collections.abc import Callable
from pathlib import Path

from policies.process.probes import Outside, checked, libc

from labgym.artefacts import artefacts

ROOT = artefacts("assets").parent
NUMBERS = {
    "x86_64": {"pidfd_getfd": 438, "userfaultfd": 323, "process_vm_readv": 310, "handle": 303, "bpf": 321, "perf": 298},
    "aarch64": {
        "pidfd_getfd": 438,
        "userfaultfd": 282,
        "process_vm_readv": 270,
        "handle": 264,
        "bpf": 280,
        "perf": 241,
    },
}[os.uname().machine]
X32_SOCKET = 0x40000000 + 41


def by_the_root_link(_: Outside) -> object:
    return list(Path(f"/proc/self/root{artefacts('layouts')}").iterdir())


def by_the_link_of_the_working_folder(_: Outside) -> object:
    os.chdir(ROOT)
    return list(Path("/proc/self/cwd/layouts").iterdir())


def by_a_link_in_a_folder(outside: Outside) -> object:
    return (outside.private / "link").symlink_to(outside.secret) or (outside.private / "link").read_text()


def by_a_hard_link(outside: Outside) -> object:
    return os.link(outside.secret, outside.private / "hard") or (outside.private / "hard").read_text()


def own_file_by_a_hard_link(outside: Outside) -> object:
    return os.link(outside.own, outside.private / "own") or (outside.private / "own").write_text("note")


def own_file_moved(outside: Outside) -> object:
    return outside.own.rename(outside.private / "moved")


def own_file_exchanged(outside: Outside) -> object:
    (outside.private / "new").write_text("note")
    return (outside.private / "new").replace(outside.own)


def parents_memory(_: Outside) -> object:
    return os.open(f"/proc/{os.getppid()}/mem", os.O_RDONLY)


def parents_descriptors(_: Outside) -> object:
    return list(Path(f"/proc/{os.getppid()}/fd").iterdir())


def parents_threads(_: Outside) -> object:
    return list(Path(f"/proc/{os.getppid()}/task").iterdir())


def parents_descriptor_by_number(_: Outside) -> object:
    return checked(libc.syscall(NUMBERS["pidfd_getfd"], os.getppid(), 0, 0))


def parents_pages(_: Outside) -> object:
    buffer = ctypes.create_string_buffer(8)
    vector = struct.pack("QQ", ctypes.addressof(buffer), 8)
    return checked(libc.syscall(NUMBERS["process_vm_readv"], os.getppid(), vector, 1, vector, 1, 0))


def lock_on_an_own_file(outside: Outside) -> object:
    return _excludes(outside, lambda stream: fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB))


def lock_of_records(outside: Outside) -> object:
    def lock(stream: object) -> None:
        fcntl.lockf(stream, fcntl.LOCK_SH | fcntl.LOCK_NB)  # type: ignore[arg-type]
        held = fcntl.fcntl(stream, fcntl.F_GETLK, struct.pack("hhqqi4x", fcntl.F_WRLCK, 0, 0, 0, 0))  # type: ignore[call-overload]
        if struct.unpack("hhqqi4x", held)[0] not in (fcntl.F_UNLCK, fcntl.F_WRLCK):
            raise BlockingIOError

    return _excludes(outside, lock)


def _excludes(outside: Outside, lock: Callable[[object], None]) -> bool:
    """Return whether a lock of this process excludes another one."""
    with outside.own.open() as stream:
        lock(stream)
        child = os.fork()
        if child == 0:
            with outside.own.open() as other:
                try:
                    lock(other)
                except BlockingIOError:
                    os._exit(1)
            os._exit(0)
        if os.waitpid(child, 0)[1]:
            return True
    raise PermissionError("nobody is excluded")


def own_session(_: Outside) -> object:
    child = os.fork()
    if child == 0:
        os.setsid()
        os._exit(int(os.getpgid(0) == os.getpid()))
    if os.waitpid(child, 0)[1]:
        return True
    raise PermissionError("the group stays")


def user_faults(_: Outside) -> object:
    return checked(libc.syscall(NUMBERS["userfaultfd"], 0)) or True


def user_faults_by_the_device(_: Outside) -> object:
    return os.open("/dev/userfaultfd", os.O_RDWR)


def filter_of_the_kernel(_: Outside) -> object:
    return checked(libc.syscall(NUMBERS["bpf"], 0, ctypes.create_string_buffer(64), 64))


def counters_of_the_processor(_: Outside) -> object:
    return checked(libc.syscall(NUMBERS["perf"], ctypes.create_string_buffer(128), 0, -1, -1, 0))


def handle_of_a_file(_: Outside) -> object:
    handle = ctypes.create_string_buffer(struct.pack("Ii", 128, 0), 136)
    return checked(libc.syscall(NUMBERS["handle"], -100, b"/tmp", handle, ctypes.create_string_buffer(8), 0)) or True


def watch_of_a_file(outside: Outside) -> object:
    return checked(libc.inotify_init()) or outside


def pages_in_memory(_: Outside) -> object:
    page = ctypes.create_string_buffer(8192)
    start = (ctypes.addressof(page) + 4095) & ~4095
    return checked(libc.mincore(ctypes.c_void_p(start), 4096, ctypes.create_string_buffer(1))) or True


def semaphores(_: Outside) -> object:
    return checked(libc.semget(0x6C6163, 1, 0o1600)) or True


def queues_of_posix(_: Outside) -> object:
    return list(Path("/dev/mqueue").iterdir()) or True


def shared_memory_of_posix(_: Outside) -> object:
    return list(Path("/dev/shm").iterdir()) or True


def terminal(_: Outside) -> object:
    return os.open("/dev/tty", os.O_RDWR)


def assets_changed(_: Outside) -> object:
    return os.open(ROOT / "assets" / ".note", os.O_WRONLY | os.O_CREAT)


def machine_code_changed(_: Outside) -> object:
    return os.open(ROOT / "labgym" / "navigation" / "__pycache__" / ".note", os.O_WRONLY | os.O_CREAT)


def source_changed(_: Outside) -> object:
    return os.open(ROOT / "labgym" / "__init__.py", os.O_RDWR)


def history(_: Outside) -> object:
    return os.open(ROOT / ".git", os.O_RDONLY)


def packets_to_a_name(outside: Outside) -> object:
    one, _ = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    return one.connect(f"\0{outside.socket}") or True


def stream_to_a_name(outside: Outside) -> object:
    one, _ = socket.socketpair()
    return one.sendto(b"note", f"\0{outside.socket}")


def socket_by_another_number(_: Outside) -> object:
    return checked(libc.syscall(X32_SOCKET, socket.AF_UNIX, socket.SOCK_STREAM, 0)) or True


def clock(_: Outside) -> object:
    return time.clock_settime(time.CLOCK_REALTIME, time.time()) or True


TRICKS: dict[str, Callable[[Outside], object]] = {
    trick.__name__: trick
    for trick in (
        *(by_the_root_link, by_the_link_of_the_working_folder, by_a_link_in_a_folder, by_a_hard_link),
        *(own_file_by_a_hard_link, own_file_moved, own_file_exchanged, lock_on_an_own_file, lock_of_records),
        *(parents_memory, parents_descriptors, parents_threads, parents_descriptor_by_number, parents_pages),
        *(own_session, user_faults, user_faults_by_the_device, filter_of_the_kernel, counters_of_the_processor),
        *(handle_of_a_file, watch_of_a_file, pages_in_memory, semaphores, queues_of_posix, shared_memory_of_posix),
        *(terminal, assets_changed, machine_code_changed, source_changed, history),
        *(packets_to_a_name, stream_to_a_name, socket_by_another_number, clock),
    )
}
WITHOUT_A_BOX = (
    *("by_the_root_link", "by_the_link_of_the_working_folder", "by_a_link_in_a_folder", "by_a_hard_link"),
    *("own_file_by_a_hard_link", "own_file_exchanged", "lock_on_an_own_file", "lock_of_records", "own_session"),
    *("parents_threads", "watch_of_a_file", "pages_in_memory", "shared_memory_of_posix"),
)
"""Those that succeed for every user without a box, and so show that the others are tried rightly."""
