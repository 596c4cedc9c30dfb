"""Files that a policy's process opens: those of loading belong to its identity, others must not be read afterwards.

Python reports every file that its own code opens, also for libraries written in Python (NumPy, PyTorch, PyYAML). Files
that compiled libraries or child processes open are not seen: `Policy.files` names them.
"""

from __future__ import annotations

import os
import site
import sys
import sysconfig
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path
from typing import Any

import labgym
from labgym.artefacts import FOLDERS, artefacts
from labgym.errors import OptionError
from labgym.policies.fingerprint.sources import loaded_file, source_files
from labgym.policies.policy import Policy

MAX_FILES = 1_000
"""Largest number of files in the identity of a policy."""
SYSTEM = ("/proc", "/sys", "/dev", "/etc", "/usr", "/bin", "/sbin", "/lib", "/lib32", "/lib64", "/run")
"""Folders of the operating system."""
CACHES = ("__pycache__", "torchinductor", ".triton", "matplotlib", "fontconfig", "numba")
"""Beginnings of the names of folders in which libraries keep what they compiled."""
SOURCES = (".py", ".pyc", ".pyi", ".so")
"""Suffixes of modules; which of them is opened depends on what is compiled already."""


class Reads:
    """The files that this process has opened since `begin`.

    Args:
        private: folder of this process, whose files do not count.

    Attributes:
        sources: files that count as the source of the policy's class, once `files_of` was called.
    """

    def __init__(self, private: Path | None = None) -> None:
        self._private = private
        self.sources: tuple[Path, ...] = ()
        self._opened: dict[str, None] = {}
        self._written: set[str] = set()
        self._known: frozenset[Path] = frozenset()

    def begin(self) -> None:
        """Record from now on; Python has no way to end it."""
        sys.addaudithook(self._audit)

    def files_of(self, policy: Policy, options: Iterable[object] = ()) -> tuple[Path, ...]:
        """Return the files of a policy that has just been loaded, absolute; those that it does not state come last.

        Args:
            policy: states files by `files`.
            options: of the policy; texts among them may name files.

        Raises:
            OptionError: there are too many.
        """
        stated = [Path(path).absolute() for path in policy.files()]
        named = [Path(text).absolute() for text in options if isinstance(text, str) and _is_file(text)]
        others = {*self._taken(), *_modules(), *(path for path in named if _counts(path))}
        self.sources = tuple(_sources(type(policy)))
        own = {path.resolve() for path in (*stated, *self.sources)}
        others = {path for path in others if path.resolve() not in own}
        if len(stated) + len(others) > MAX_FILES:
            raise OptionError(
                f"policy {policy.name!r} reads {len(stated) + len(others)} files while it loads; at most {MAX_FILES} "
                "can be in its identity: pack them into fewer"
            )
        files = (*stated, *sorted(others, key=lambda path: (path.name, path)))
        self._known = frozenset({*own, *(path.resolve() for path in files)})
        return files

    def know(self, files: Iterable[str]) -> tuple[Path, ...]:
        """Return the files of a policy that was loaded before, which it may read while it drives."""
        self._opened.clear()
        known = tuple(map(Path, files))
        self._known = frozenset(path.resolve() for path in known)
        return known

    def unknown(self) -> Path | None:
        """Return a file that was opened since the last call and is not in the identity, or None."""
        if not self._opened:
            return None
        return next((path for path in sorted(self._taken()) if path.resolve() not in self._known), None)

    def _taken(self) -> set[Path]:
        """Return the files that were opened for reading, exist and count, and forget them."""
        paths = [Path(text) for text in self._opened]
        if self._private is not None:
            paths = [path for path in paths if not path.is_relative_to(self._private)]
        self._opened.clear()
        return {path for path in paths if path.suffix not in SOURCES and _is_file(str(path)) and _counts(path)}

    def _audit(self, event: str, arguments: tuple[Any, ...]) -> None:
        if event == "open":
            path, _, flags = arguments
            if isinstance(path, str | bytes) and isinstance(flags, int):
                self._note(_absolute(path), flags)
        elif event == "os.rename":
            source, target = (_absolute(path) for path in arguments[:2])
            if source in self._written:
                self._written.add(target)

    def _note(self, path: str, flags: int) -> None:
        """Record a file that is about to be opened; a file that this process makes does not count."""
        if path in self._written or path in self._opened:
            return
        if flags & os.O_TRUNC or not os.path.exists(path):  # noqa: PTH110 - called for every file
            self._written.add(path)
        elif flags & os.O_ACCMODE != os.O_WRONLY:
            self._opened[path] = None


def _sources(kind: type) -> Iterator[Path]:
    """Yield the files that count as the source of a class: its modules, and the files that they name."""
    for base in kind.__mro__[:-1]:
        file = loaded_file(base.__module__)
        if file is not None and _counts(file):
            yield from source_files(file, base.__module__).values()


def _modules() -> set[Path]:
    """Return the source files of the imported modules that are not installed."""
    files = {getattr(module, "__file__", None) for module in list(sys.modules.values())}
    paths = [Path(file) for file in files if isinstance(file, str) and _is_file(file)]
    return {path.absolute() for path in paths if _counts(path)}


def _counts(path: Path) -> bool:
    """Return whether a file is the policy's own, and not of the system, of an installed package or of a cache."""
    # As texts: it is called for every module of a process.
    place = os.path.realpath(path)
    return not place.startswith(_roots()) and not any(part.startswith(CACHES) for part in place.split("/"))


@cache
def _roots() -> tuple[str, ...]:
    """Return the folders of the system, the interpreter, its packages and labgym, each with a separator at its end."""
    paths = sysconfig.get_paths()
    roots = [*SYSTEM, *(paths[key] for key in ("stdlib", "platstdlib", "purelib", "platlib"))]
    roots += [sys.prefix, sys.base_prefix, *site.getsitepackages(), site.getusersitepackages()]
    own = [Path(labgym.__file__).parent, *map(artefacts, FOLDERS)]
    return tuple(os.path.join(os.path.realpath(root), "") for root in (*roots, *map(str, own)))  # noqa: PTH118 - texts


def _absolute(path: str | bytes | os.PathLike[str]) -> str:
    return os.path.abspath(os.fsdecode(path))  # noqa: PTH100 - called for every file that is opened


def _is_file(text: str) -> bool:
    try:
        return os.path.isfile(text)  # noqa: PTH113 - takes any text
    except ValueError:
        return False
