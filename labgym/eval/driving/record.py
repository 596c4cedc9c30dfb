"""The record of an evaluation: what was run, with what arguments, by which code."""

from __future__ import annotations

import contextlib
import inspect
import platform
import subprocess
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any, ClassVar

from labgym import __version__
from labgym.documents import Document, Record, files_digest
from labgym.eval.driving.bootstrap import Estimate
from labgym.eval.driving.suites import Suite
from labgym.policies import Policy
from labgym.policies.policy import Sensors

PACKAGES = ("gymnasium", "mujoco", "numpy", "scipy", "embreex", "opencv-python-headless")


class Provenance(Record):
    """By which code the numbers were made.

    Attributes:
        versions: of labgym, Python and the packages that bear on results.
        commit: of the checkout, None where the code is not in one. dirty: whether it had changes of its own.
        code: SHA-256 over the package's sources, the policy's module and the files that it names, such as weights.
    """

    versions: dict[str, str]
    commit: str | None
    dirty: bool | None
    code: str


class NavigationSummary(Document):
    """`summary.json`: one policy over one suite.

    Attributes:
        suite: the whole suite, its version included. seed: of the evaluation and of the intervals.
        policy: its label; options: the arguments given to it; privileged: whether it was given the map.
        sensors: what it was shown; None in summaries older than this field.
        layouts: hashes by id, in the suite's order. episodes: rows. expected: goal pairs of the suite.
        errors: episodes in which the policy raised. unreachable: goal pairs without a path (no SPL).
        complete: whether every episode was driven.
        metrics: by name, in the order of `navigation_metrics.METRICS`.
        arguments: of `evaluate`, given and defaulted.
    """

    SCHEMA: ClassVar[str] = "labgym.navigation-summary/1"

    suite: Suite
    policy: str
    options: dict[str, Any]
    privileged: bool
    sensors: Sensors | None = None
    seed: int
    layouts: dict[str, str]
    episodes: int
    expected: int
    errors: int
    unreachable: int
    complete: bool
    metrics: dict[str, Estimate]
    arguments: dict[str, Any]
    provenance: Provenance


class RunIdentity(Document):
    """`run.json`: what a folder of results holds, written before the first episode."""

    SCHEMA: ClassVar[str] = "labgym.navigation-run/1"

    suite: Suite
    policy: str
    options: dict[str, Any]
    seed: int
    code: str

    def differences(self, other: RunIdentity) -> tuple[str, ...]:
        """Return the names of the fields in which two runs differ.

        The code does not count, nor do the layouts of a suite given by hand: rows tell by hash which they are of.
        """
        mine, theirs = self._compared(), other._compared()
        return tuple(name for name in mine if mine[name] != theirs[name])

    def _compared(self) -> dict[str, Any]:
        suite = self.suite if self.suite.split else self.suite.model_copy(update={"layouts": None})
        return {"suite": suite, "policy": self.policy, "options": self.options, "seed": self.seed}


def provenance(policy: Policy) -> Provenance:
    """Return by which code a policy is about to be evaluated."""
    versions = {"labgym": __version__, "python": platform.python_version()}
    for package in PACKAGES:
        try:
            versions[package] = version(package)
        except PackageNotFoundError:
            continue
    commit, dirty = _checkout()
    return Provenance(versions=versions, commit=commit, dirty=dirty, code=_code_digest(policy))


@cache
def _checkout() -> tuple[str | None, bool | None]:
    """Return the commit of the checkout that holds the package and whether it has changes; None outside of one."""
    root = Path(__file__).resolve().parents[3]
    if not (root / ".git").exists():
        return None, None
    try:
        commit = _git(root, "rev-parse", "HEAD")
        changes = _git(root, "status", "--porcelain", "--untracked-files=no")
    except (OSError, subprocess.SubprocessError):
        return None, None
    return commit, bool(changes)


def _git(root: Path, *arguments: str) -> str:
    done = subprocess.run(["git", "-C", str(root), *arguments], capture_output=True, text=True, timeout=20, check=True)
    return done.stdout.strip()


def _code_digest(policy: Policy) -> str:
    package = Path(__file__).resolve().parents[2]
    files = sorted(package.rglob("*.py"))
    with contextlib.suppress(TypeError, OSError):
        files.append(Path(inspect.getfile(type(policy))))
    files.extend(policy.files())
    return files_digest(files)
