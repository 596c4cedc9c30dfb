"""Confinement of a process by the Linux kernel, without root: Landlock, seccomp, no capabilities, limits.

`confine` is for processes that are about to run what a stranger wrote: a policy, a robot's file.
"""

from __future__ import annotations

import os
import platform
import resource
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache

from labgym.confinement import landlock, linux, seccomp
from labgym.confinement.landlock import PathRule
from labgym.errors import LabgymError

NOT_BOXED = "not boxed"
LARGEST_FILE = 2**31
"""Largest file that a confined process may write, bytes."""


_confined = False


class BoxError(LabgymError):
    """The kernel does not let a process enter the box."""


@dataclass(frozen=True)
class Protection:
    """The protection that a kernel has.

    Attributes:
        landlock: version of Landlock, 0 without it. seccomp: whether system calls can be filtered.
    """

    landlock: int
    seccomp: bool

    @property
    def boxed(self) -> bool:
        """Whether a process can be confined."""
        return self.landlock > 0 and self.seccomp

    def __str__(self) -> str:
        return f"landlock-{self.landlock}+seccomp" if self.boxed else NOT_BOXED


@cache
def probe() -> Protection:
    """Return the protection that this kernel has."""
    return Protection(landlock.version() if platform.machine() in seccomp.MACHINES else 0, seccomp.available())


def confine(rules: Iterable[PathRule]) -> None:
    """Confine this thread and its future children for good.

    Denied from then on: files without a rule; sockets, except pairs; objects of System V, POSIX queues and keyrings;
    other processes; modes, owners, times and attributes of files; capabilities, also of root. Locks of files, sessions
    and process groups stay as they are.

    Raises:
        BoxError: this kernel has no Landlock or no seccomp.
    """
    global _confined
    level = probe()
    if not level.boxed:
        raise BoxError("this kernel has no Landlock (Linux 5.13 or later, enabled at boot) or no seccomp")
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    _, most = resource.getrlimit(resource.RLIMIT_FSIZE)
    largest = LARGEST_FILE if most == resource.RLIM_INFINITY else min(most, LARGEST_FILE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (largest, largest))
    try:
        linux.give_up_capabilities()
        landlock.restrict(rules)
        signals_stay = level.landlock >= landlock.SCOPES_VERSION
        seccomp.install(() if signals_stay else seccomp.signal_denials(os.getpid()))
    except OSError as error:
        raise BoxError(f"the box cannot be entered: {error.strerror}") from error
    _confined = True


def confined() -> bool:
    """Return whether this process is confined."""
    return _confined
