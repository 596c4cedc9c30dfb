"""Landlock: a process gives up for good the files, signals and sockets that no rule grants (man 7 landlock)."""

from __future__ import annotations

import ctypes
import os
import stat
from collections.abc import Iterable
from dataclasses import dataclass

CREATE_RULESET, ADD_RULE, RESTRICT_SELF = 444, 445, 446
"""Numbers of the system calls, equal on all architectures."""
VERSION_FLAG = 1
PATH_BENEATH = 1

EXECUTE, WRITE_FILE, READ_FILE, READ_DIR = 1 << 0, 1 << 1, 1 << 2, 1 << 3
MAKE_CHAR, MAKE_SOCK, MAKE_BLOCK = 1 << 6, 1 << 9, 1 << 11
REFER, TRUNCATE, IOCTL_DEV = 1 << 13, 1 << 14, 1 << 15
OF_FILES = EXECUTE | WRITE_FILE | READ_FILE | TRUNCATE | IOCTL_DEV
"""Rights that a rule on a file may grant; the others are of folders."""
RIGHTS = {1: (1 << 13) - 1, 2: REFER, 3: TRUNCATE, 5: IOCTL_DEV}
"""Rights on files by the version of the interface that introduced them."""
READING = READ_FILE | READ_DIR | EXECUTE
WRITING = ~(MAKE_CHAR | MAKE_SOCK | MAKE_BLOCK | IOCTL_DEV)
DEVICE = READ_FILE | WRITE_FILE | IOCTL_DEV

NETWORK = 0b11
"""Bind and connect of TCP, which no rule grants (version 4)."""
SCOPES = 0b11
"""Abstract sockets and signals, which stay among the restricted processes (version 6)."""
NETWORK_VERSION, SCOPES_VERSION = 4, 6

_libc = ctypes.CDLL(None, use_errno=True)


class _Ruleset(ctypes.Structure):
    _fields_ = (("files", ctypes.c_uint64), ("network", ctypes.c_uint64), ("scopes", ctypes.c_uint64))


class _PathBeneath(ctypes.Structure):
    _pack_ = 1
    _fields_ = (("rights", ctypes.c_uint64), ("parent", ctypes.c_int32))


@dataclass(frozen=True)
class PathRule:
    """Rights on a file, or on a folder and all that it contains.

    Attributes:
        path: of the file or folder; links are followed. rights: the sum of rights.
    """

    path: str
    rights: int


def version() -> int:
    """Return the version of the kernel's Landlock, 0 without it."""
    number = int(_libc.syscall(CREATE_RULESET, None, ctypes.c_size_t(0), ctypes.c_uint32(VERSION_FLAG)))
    return max(number, 0)


def restrict(rules: Iterable[PathRule]) -> None:
    """Deny this process and its future children all rights on files but those of rules, and TCP, signals, sockets.

    Files that are open keep their rights. `PR_SET_NO_NEW_PRIVS` must be set. Paths that do not exist are left out.

    Raises:
        OSError: the kernel refuses.
    """
    known = version()
    handled = sum(rights for number, rights in RIGHTS.items() if number <= known)
    attributes = _Ruleset(handled, NETWORK if known >= NETWORK_VERSION else 0, SCOPES if known >= SCOPES_VERSION else 0)
    size = 24 if known >= SCOPES_VERSION else 16 if known >= NETWORK_VERSION else 8
    ruleset = _checked(_libc.syscall(CREATE_RULESET, ctypes.byref(attributes), ctypes.c_size_t(size), 0))
    try:
        for rule in rules:
            _add(ruleset, rule.path, rule.rights & handled)
        _checked(_libc.syscall(RESTRICT_SELF, ruleset, 0))
    finally:
        os.close(ruleset)


def _add(ruleset: int, path: str, rights: int) -> None:
    try:
        handle = os.open(path, os.O_PATH | os.O_CLOEXEC)
    except OSError:
        return
    try:
        if not stat.S_ISDIR(os.fstat(handle).st_mode):
            rights &= OF_FILES
        attributes = _PathBeneath(rights, handle)
        _checked(_libc.syscall(ADD_RULE, ruleset, PATH_BENEATH, ctypes.byref(attributes), 0))
    finally:
        os.close(handle)


def _checked(result: int) -> int:
    if result < 0:
        number = ctypes.get_errno()
        raise OSError(number, f"Landlock: {os.strerror(number)}")
    return int(result)
