"""The box of a foreign policy: the kernel denies files, network, other processes and whatever outlives an episode.

A process enters before it runs code of the policy, and nothing leads out. docs/policies.md says what a box is and is
not.
"""

from __future__ import annotations

import hashlib
import os
import sys
from collections.abc import Iterable, Iterator
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path
from typing import Any

import labgym
from labgym.artefacts import artefacts, user_cache
from labgym.confinement import NOT_BOXED, Protection, confine, confined, landlock, probe
from labgym.confinement.landlock import PathRule
from labgym.policies.fingerprint.sources import package_folders, search_path

__all__ = [
    "BUILT_IN_CODE", "LONGEST_LEVEL", "NOT_BOXED", "NO_NETWORK", "UNRANKED", "Grants", "Protection", "denial", "enter",
    "hidden", "is_rankable", "probe", "spared", "split", "system_rules",
]  # fmt: skip

BUILT_IN_CODE = "built-in policy"
"""What takes the place of a level where labgym's own code drives."""
HIDDEN = ("layouts", "eval")
"""Artefact folders that no policy may read: published floors, suites, rows and routes."""
SYSTEM = (
    *("/lib", "/lib32", "/lib64", "/bin", "/sbin"),
    *(f"/usr/{name}" for name in ("bin", "sbin", "lib", "lib32", "lib64", "libexec", "share/zoneinfo")),
    *(f"/usr/local/{name}" for name in ("bin", "lib", "lib64", "cuda")),
    *("/nix/store", "/etc/ld.so.cache", "/etc/localtime", "/etc/alternatives"),
    *("/proc/cpuinfo", "/proc/meminfo", "/proc/version", "/proc/sys/vm/overcommit_memory", "/proc/driver/nvidia"),
    *("/sys/devices/system", "/dev/zero", "/dev/full", "/dev/random", "/dev/urandom"),
)
"""Programs, libraries and facts about the machine that a policy may read; /etc/passwd is not among them."""
DEVICES = "/dev"
GRAPHICS = "nvidia"
"""Beginning of the names of devices that a policy may use."""
OF_INTERPRETER = ("bin", "lib", "lib64", "pyvenv.cfg")

REMEDY = "a foreign policy drives in a box without it: open files of its folder in __init__, or name them in options"
DENIED = "floors, suites and results of labgym are hidden from policies that drive"
NO_NETWORK = "a foreign policy drives in a box without network and other processes"

UNRANKED = "not boxed, and so not ranked: the policy could read published floors, use the network and leave notes"
LONGEST_LEVEL = 40
"""Longest text of a level, characters."""


@dataclass(frozen=True)
class Grants:
    """The files that a boxed process may use besides those of `system_rules`.

    Attributes:
        read: files, and folders with all that they contain. listed: folders whose names may be read, also in folders
            below, so that modules are found in them.
        private: folder in which the process may do everything; "" for none.
    """

    read: tuple[str, ...] = ()
    listed: tuple[str, ...] = ()
    private: str = ""

    def to_json(self) -> dict[str, Any]:
        """Return the grants as JSON data."""
        return asdict(self)

    @classmethod
    def from_json(cls, data: dict[str, Any]) -> Grants:
        """Return the grants of `to_json`."""
        return cls(tuple(data["read"]), tuple(data["listed"]), data["private"])

    def covers(self, path: Path) -> bool:
        """Return whether a file may be read by these grants."""
        return any(path.is_relative_to(place) for place in self.read)


def is_rankable(level: str) -> bool:
    """Return whether results of a level may be ranked: of labgym's own policies, and of boxed ones."""
    return level == BUILT_IN_CODE or level.startswith("landlock-")


def enter(grants: Grants) -> None:
    """Enter the box for good, with all future children; only the calling thread does (`labgym.confinement.confine`).

    Raises:
        BoxError: this kernel has no box.
    """
    # Before anything is denied: rules on /proc hold for the process as long as it is open.
    os.open("/proc/self", os.O_PATH)
    confine((*system_rules(), *_rules(grants)))


def denial(error: BaseException) -> str:
    """Return why the box denied what an error is about, and the remedy; "" if it did not."""
    cause: BaseException | None = error
    while cause is not None and not isinstance(cause, PermissionError):
        cause = cause.__cause__ or cause.__context__
    if not confined() or cause is None:
        return ""
    if not isinstance(cause.filename, str):
        return NO_NETWORK
    place = Path(os.path.realpath(cause.filename))
    return DENIED if any(place.is_relative_to(folder) for folder in hidden()) else REMEDY


def _rules(grants: Grants) -> Iterator[PathRule]:
    yield from (PathRule(place, landlock.READING) for place in grants.read)
    yield from (PathRule(place, landlock.READ_DIR) for place in grants.listed)
    if grants.private:
        yield PathRule(grants.private, landlock.WRITING)
    yield PathRule("/proc/self", landlock.READ_FILE | landlock.READ_DIR)


@cache
def system_rules() -> tuple[PathRule, ...]:
    """Return the rules for the interpreter with its packages, labgym with assets and weights, and the system."""
    places = [*SYSTEM, *package_folders(), *_interpreters()]
    places += _machine_code()
    places += [*map(str, (Path(labgym.__file__).parent, artefacts("assets"), artefacts("policies")))]
    devices = [str(entry) for entry in Path(DEVICES).glob(f"{GRAPHICS}*")]
    return (
        *(PathRule(place, landlock.READING) for place in spared(places)),
        *(PathRule(place, landlock.READ_DIR) for place in split(places)),
        PathRule("/dev/null", landlock.READ_FILE | landlock.WRITE_FILE),
        *(PathRule(device, landlock.DEVICE) for device in devices),
    )


@cache
def hidden() -> tuple[Path, ...]:
    """Return the folders that no policy may read, of this labgym, of those on the Python path and of installed ones."""
    roots = {Path(entry or ".").resolve() for entry in search_path()}
    # Git keeps their contents.
    names = (*HIDDEN, ".git")
    places = {root / name for root in roots if (root / "labgym" / "__init__.py").is_file() for name in names}
    roots |= {path for place in (*SYSTEM, *_interpreters()) for path in Path(place).glob("python3*/*-packages")}
    places |= {root / "labgym" / "_artefacts" / name for root in roots for name in HIDDEN}
    return tuple(sorted({path.resolve() for path in (*places, *map(artefacts, HIDDEN)) if path.is_dir()}))


def _interpreters() -> list[str]:
    return [f"{prefix}/{name}" for prefix in (sys.prefix, sys.base_prefix) for name in OF_INTERPRETER]


def _machine_code() -> list[str]:
    """Return the folders in which numba keeps the code of a labgym that the user may not write."""
    root, package = os.environ.get("NUMBA_CACHE_DIR") or user_cache().parent / "numba", Path(labgym.__file__).parent
    folders = [place for place, _, _ in os.walk(package)]
    own = [f"{root}/{Path(place).name}_{hashlib.sha1(place.encode()).hexdigest()}" for place in folders]
    return [*own, *map(str, user_cache().glob("planar-*"))]


def spared(places: Iterable[str | Path], further: Iterable[str] = ()) -> tuple[str, ...]:
    """Return places without the hidden folders: Landlock cannot subtract, so a folder with one is named by its entries.

    Places that do not exist are left out.

    Args:
        places: files and folders. further: absolute paths of further hidden files and folders, which need not exist.
    """
    secret = tuple(os.path.realpath(path) for path in (*map(str, hidden()), *further))
    kept = {path for place in places for path in _spared(os.path.realpath(place), secret)}
    # A folder contains what it contains: fewer rules are entered sooner.
    return tuple(sorted(path for path in kept if not any(str(parent) in kept for parent in Path(path).parents)))


def split(places: Iterable[str | Path]) -> tuple[str, ...]:
    """Return those of some folders, and of their subfolders, that `spared` names by their entries."""
    folders = {Path(os.path.realpath(place)) for place in places}
    return tuple(
        sorted({str(parent) for each in hidden() for parent in each.parents if folders & {parent, *parent.parents}})
    )


def _spared(place: str, secret: tuple[str, ...]) -> Iterator[str]:
    if any(place == folder or place.startswith(f"{folder}/") for folder in secret) or not os.path.exists(place):  # noqa: PTH110 - called for every entry
        return
    if not any(folder.startswith(f"{place.rstrip('/')}/") for folder in secret):
        yield place
        return
    for entry in os.scandir(place):
        target = os.path.realpath(entry.path) if entry.is_symlink() else entry.path
        # A link may lead back to a folder above.
        if not entry.is_symlink() or not any(folder.startswith(f"{target}/") for folder in secret):
            yield from _spared(target, secret)
