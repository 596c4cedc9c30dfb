"""A seccomp filter: system calls that Landlock does not cover and that a boxed policy must not make.

The filter lists what is denied, not what is allowed: drivers and libraries use system calls that nobody can list.
"""

from __future__ import annotations

import ctypes
import errno
import os
import platform
import struct
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

PR_SET_SECCOMP, MODE_FILTER = 22, 2
GET_ACTION_AVAILABLE = 2
ALLOW, ERRNO, KILL = 0x7FFF0000, 0x00050000, 0x80000000
LOAD_WORD, AND, EQUAL, AT_LEAST, RETURN, JUMP = 0x20, 0x54, 0x15, 0x35, 0x06, 0x05
"""Instructions of the classic BPF."""
NUMBER_AT, ARCHITECTURE_AT, ARGUMENTS_AT = 0, 4, 16
"""Places in `struct seccomp_data`, bytes."""
X32 = 0x40000000
"""First number of the x32 interface, which reaches the same calls by other numbers."""


@dataclass(frozen=True)
class Machine:
    """An architecture.

    Attributes:
        audit: its number in `struct seccomp_data`. column: of its numbers in `NUMBERS`. seccomp: number of seccomp(2).
    """

    audit: int
    column: int
    seccomp: int


MACHINES = {"x86_64": Machine(0xC000003E, 0, 317), "aarch64": Machine(0xC00000B7, 1, 277)}

NUMBERS: Mapping[str, tuple[int | None, int | None]] = {
    # Network, and sockets by name.
    "socket": (41, 198),
    "connect": (42, 203),
    "accept": (43, 202),
    "accept4": (288, 242),
    "bind": (49, 200),
    "listen": (50, 201),
    # System V and POSIX objects that outlive a process.
    "shmget": (29, 194),
    "shmat": (30, 196),
    "shmctl": (31, 195),
    "semget": (64, 190),
    "semop": (65, 193),
    "semctl": (66, 191),
    "semtimedop": (220, 192),
    "msgget": (68, 186),
    "msgsnd": (69, 189),
    "msgrcv": (70, 188),
    "msgctl": (71, 187),
    "mq_open": (240, 180),
    "mq_unlink": (241, 181),
    "mq_timedsend": (242, 182),
    "mq_timedreceive": (243, 183),
    "mq_notify": (244, 184),
    "mq_getsetattr": (245, 185),
    "add_key": (248, 217),
    "request_key": (249, 218),
    "keyctl": (250, 219),
    # Other processes.
    "ptrace": (101, 117),
    "process_vm_readv": (310, 270),
    "process_vm_writev": (311, 271),
    "kcmp": (312, 272),
    "pidfd_open": (434, 434),
    "pidfd_getfd": (438, 438),
    "pidfd_send_signal": (424, 424),
    "process_madvise": (440, 440),
    "process_mrelease": (448, 448),
    "migrate_pages": (256, 238),
    "move_pages": (279, 239),
    "perf_event_open": (298, 241),
    # Facts about files that stay: mode, owner, times, attributes.
    "chmod": (90, None),
    "fchmod": (91, 52),
    "fchmodat": (268, 53),
    "fchmodat2": (452, 452),
    "chown": (92, None),
    "fchown": (93, 55),
    "lchown": (94, None),
    "fchownat": (260, 54),
    "utime": (132, None),
    "utimes": (235, None),
    "futimesat": (261, None),
    "utimensat": (280, 88),
    "setxattr": (188, 5),
    "lsetxattr": (189, 6),
    "fsetxattr": (190, 7),
    "removexattr": (197, 14),
    "lremovexattr": (198, 15),
    "fremovexattr": (199, 16),
    "setxattrat": (463, 463),
    "removexattrat": (466, 466),
    "file_setattr": (469, 469),
    "truncate": (76, 45),
    "inotify_init": (253, None),
    "inotify_init1": (294, 26),
    "fanotify_init": (300, 262),
    "mincore": (27, 232),
    "cachestat": (451, 451),
    # The machine.
    "name_to_handle_at": (303, 264),
    "open_by_handle_at": (304, 265),
    "mount": (165, 40),
    "umount2": (166, 39),
    "pivot_root": (155, 41),
    "chroot": (161, 51),
    "unshare": (272, 97),
    "setns": (308, 268),
    "open_tree": (428, 428),
    "move_mount": (429, 429),
    "fsopen": (430, 430),
    "fspick": (433, 433),
    "mount_setattr": (442, 442),
    "open_tree_attr": (467, 467),
    "bpf": (321, 280),
    "userfaultfd": (323, 282),
    "init_module": (175, 105),
    "finit_module": (313, 273),
    "delete_module": (176, 106),
    "kexec_load": (246, 104),
    "kexec_file_load": (320, 294),
    "reboot": (169, 142),
    "swapon": (167, 224),
    "swapoff": (168, 225),
    "acct": (163, 89),
    "quotactl": (179, 60),
    "quotactl_fd": (443, 443),
    "sethostname": (170, 161),
    "setdomainname": (171, 162),
    "settimeofday": (164, 170),
    "clock_settime": (227, 112),
    "adjtimex": (159, 171),
    "clock_adjtime": (305, 266),
    "syslog": (103, 116),
    "iopl": (172, None),
    "ioperm": (173, None),
    # Calls whose arguments decide, or that libraries replace by others.
    "io_uring_setup": (425, 425),
    "io_uring_enter": (426, 426),
    "io_uring_register": (427, 427),
    "clone3": (435, 435),
    "openat2": (437, 437),
    "socketpair": (53, 199),
    "clone": (56, 220),
    "open": (2, None),
    "openat": (257, 56),
    "ioctl": (16, 29),
    "fcntl": (72, 25),
    "fadvise64": (221, 223),
    "kill": (62, 129),
    "tkill": (200, 130),
    "tgkill": (234, 131),
    "rt_sigqueueinfo": (129, 138),
    "rt_tgsigqueueinfo": (297, 240),
    "setpriority": (141, 140),
    "ioprio_set": (251, 30),
    "sched_setparam": (142, 118),
    "sched_setscheduler": (144, 119),
    "sched_setattr": (314, 274),
    "sched_setaffinity": (203, 122),
    "prlimit64": (302, 261),
    # A process that leaves its group cannot be ended together with what it starts.
    "setsid": (112, 157),
    "setpgid": (109, 154),
    # A lock on a readable file is seen by processes that may read it, too.
    "flock": (73, 32),
}
"""Numbers of system calls on x86-64 and aarch64; None where a machine lacks the call."""


@dataclass(frozen=True)
class Denial:
    """A system call that is denied for some values of an argument.

    Attributes:
        call: its name. argument: index of the argument. values: of the argument.
        mask: bits of the argument that count. others: whether all values but these are denied.
        ignored: whether the call seems to succeed.
    """

    call: str
    argument: int
    values: tuple[int, ...]
    mask: int = 0xFFFFFFFF
    others: bool = False
    ignored: bool = False


TRUNCATE_ONLY, TRUNCATE_AND_MODE = os.O_TRUNC, os.O_TRUNC | os.O_ACCMODE
NEW_NAMESPACES = 0x7E020000
FILE_SYSTEM_REQUESTS = tuple(letter << 8 for letter in (0x58, 0x66, 0x76, 0x94))
"""Families of ioctl requests that change flags, versions, projects, encryption and extents of files."""
SIGNAL_RECEIVER_REQUESTS = (0x8901, 0x8902)
SETOWN, SETSIG, SETOWN_EX, SETLEASE, NOTIFY, SET_HINT, SET_FILE_HINT = 8, 10, 15, 1024, 1026, 1036, 1038
"""Commands of fcntl(2) whose effect outlives the process or reaches others."""
SET_LOCK, SET_LOCK_WAIT, SET_FILE_LOCK, SET_FILE_LOCK_WAIT = 6, 7, 37, 38
DATAGRAM, SOCKET_KINDS = 2, 0xF
DO_NOT_NEED = 4

DENIALS = (
    # A datagram socket of a pair can be connected to a name.
    Denial("socketpair", 1, (DATAGRAM,), SOCKET_KINDS),
    Denial("clone", 0, (0,), NEW_NAMESPACES, others=True),
    # Landlock 1 and 2 let a file be cut off by a descriptor that is opened for reading.
    Denial("open", 1, (TRUNCATE_ONLY,), TRUNCATE_AND_MODE),
    Denial("openat", 2, (TRUNCATE_ONLY,), TRUNCATE_AND_MODE),
    Denial("ioctl", 1, FILE_SYSTEM_REQUESTS, 0xFF00),
    Denial("ioctl", 1, SIGNAL_RECEIVER_REQUESTS),
    Denial("fcntl", 1, (SETOWN, SETSIG, SETOWN_EX, SETLEASE, NOTIFY, SET_HINT, SET_FILE_HINT)),
    Denial("fcntl", 1, (SET_LOCK, SET_LOCK_WAIT, SET_FILE_LOCK, SET_FILE_LOCK_WAIT), ignored=True),
    Denial("fadvise64", 3, (DO_NOT_NEED,)),
    # Only of the calling thread: what a parent has, later episodes inherit.
    Denial("setpriority", 0, (0,), others=True),
    Denial("setpriority", 1, (0,), others=True),
    Denial("ioprio_set", 0, (1,), others=True),
    Denial("ioprio_set", 1, (0,), others=True),
    *(
        Denial(call, 0, (0,), others=True)
        for call in ("sched_setparam", "sched_setscheduler", "sched_setattr", "sched_setaffinity", "prlimit64")
    ),
)

MISSING = ("io_uring_setup", "io_uring_enter", "io_uring_register", "clone3", "openat2")
"""Calls that seem to be missing in the kernel, so that libraries take others."""
IGNORED = ("setsid", "setpgid", "flock")
"""Calls that seem to succeed, because programs do not expect that they fail."""

_libc = ctypes.CDLL(None, use_errno=True)


def available() -> bool:
    """Return whether this kernel and machine can filter system calls."""
    machine = MACHINES.get(platform.machine())
    if machine is None:
        return False
    action = ctypes.c_uint32(ERRNO)
    return bool(_libc.syscall(machine.seccomp, GET_ACTION_AVAILABLE, 0, ctypes.byref(action)) == 0)


def signal_denials(pid: int) -> tuple[Denial, ...]:
    """Return the denials that keep signals in a process, for kernels whose Landlock does not."""
    return (
        Denial("kill", 0, (pid,), others=True),
        Denial("tgkill", 0, (pid,), others=True),
        *(Denial(call, 0, (), others=True) for call in ("tkill", "rt_sigqueueinfo", "rt_tgsigqueueinfo")),
    )


def program(machine: Machine, further: Iterable[Denial] = ()) -> bytes:
    """Return the filter of a machine, as `struct sock_filter` one after the other.

    Args:
        machine: the architecture. further: denials besides `DENIALS`.
    """
    denials = (*DENIALS, *further)
    numbers = {name: row[machine.column] for name, row in NUMBERS.items()}
    conditional = {each.call for each in denials} | {"kill", "tkill", "tgkill", "rt_sigqueueinfo", "rt_tgsigqueueinfo"}
    denied, ignored, missing = (_instruction(RETURN, ERRNO | number) for number in (errno.EPERM, 0, errno.ENOSYS))
    code = [
        _instruction(LOAD_WORD, ARCHITECTURE_AT),
        _instruction(EQUAL, machine.audit, 1, 0),
        _instruction(RETURN, KILL),
        _instruction(LOAD_WORD, NUMBER_AT),
        _instruction(AT_LEAST, X32, 0, 1),
        missing,
    ]
    for name, number in numbers.items():
        if number is not None and name not in conditional:
            answer = missing if name in MISSING else ignored if name in IGNORED else denied
            code += [_instruction(EQUAL, number, 0, 1), answer]
    for denial in denials:
        number = numbers[denial.call]
        if number is None:
            continue
        test = [_instruction(LOAD_WORD, ARGUMENTS_AT + 8 * denial.argument), _instruction(AND, denial.mask)]
        count = len(denial.values)
        # A value that is listed skips those that follow it and one instruction more: the jump or, if the others are
        # denied, their denial.
        for index, value in enumerate(denial.values):
            beyond = count - index - 1
            test.append(_instruction(EQUAL, value, beyond + 1, 0))
        answer = ignored if denial.ignored else denied
        test += [answer] if denial.others else [_instruction(JUMP, 1), answer]
        test.append(_instruction(LOAD_WORD, NUMBER_AT))
        code += [_instruction(EQUAL, number, 0, len(test)), *test]
    return b"".join([*code, _instruction(RETURN, ALLOW)])


def install(further: Iterable[Denial] = ()) -> None:
    """Filter the system calls of this thread and its future children for good.

    `PR_SET_NO_NEW_PRIVS` must be set.

    Raises:
        OSError: the kernel refuses.
    """
    content = program(MACHINES[platform.machine()], further)
    buffer = ctypes.create_string_buffer(content, len(content))
    header = _Program(len(content) // 8, ctypes.cast(buffer, ctypes.c_void_p))
    if _libc.prctl(PR_SET_SECCOMP, ctypes.c_ulong(MODE_FILTER), ctypes.byref(header), 0, 0) != 0:
        number = ctypes.get_errno()
        raise OSError(number, f"seccomp: {os.strerror(number)}")


class _Program(ctypes.Structure):
    _fields_ = (("length", ctypes.c_ushort), ("instructions", ctypes.c_void_p))


def _instruction(code: int, value: int, when_true: int = 0, when_false: int = 0) -> bytes:
    return struct.pack("<HBBI", code, when_true, when_false, value)
