"""The record of an evaluation: policy, suite, arguments, results and code."""

from __future__ import annotations

import platform
import subprocess
from collections.abc import Iterable
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any, ClassVar

from labgym import __version__
from labgym.documents import Document, Record, files_digest
from labgym.eval.driving.intervals import Estimate
from labgym.eval.driving.suites import Suite
from labgym.policies.policy import Sensors

PACKAGES = ("gymnasium", "mujoco", "numpy", "scipy", "embreex", "opencv-python-headless")


class EvaluationProvenance(Record):
    """The code that produced an evaluation.

    Attributes:
        versions: versions of labgym, Python and the packages that affect results.
        commit: commit of the checkout, None outside a checkout.
        dirty: whether the checkout had uncommitted changes, None outside a checkout.
        code: SHA-256 of the package's sources, the policy's module and the policy's files, such as weights.
    """

    versions: dict[str, str]
    commit: str | None
    dirty: bool | None
    code: str


class NavigationSummary(Document):
    """`summary.json`: one policy over one suite.

    Attributes:
        suite: the whole suite with its version.
        policy: label of the policy. options: its arguments. privileged: whether it received the true map.
        sensors: the policy's observation; None in summaries older than this field.
        seed: random seed of the evaluation.
        layouts: hashes by layout id, in the suite's order.
        episodes: number of rows. expected: number of episodes of the suite.
        errors: episodes in which the policy raised an exception. unreachable: episodes without a path (no SPL).
        complete: whether every episode was driven.
        metrics: estimates by name, in the order of `navigation_metrics.METRICS`.
        definitions: version of the metrics' definitions.
        arguments: further arguments of `evaluate`, defaults included.
        provenance: the code that produced the results.
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
    definitions: str = "navigation-v1"
    arguments: dict[str, Any]
    provenance: EvaluationProvenance


class EvaluationIdentity(Document):
    """`run.json`: identity of the evaluation stored in a folder, written before the first episode.

    Attributes:
        code: SHA-256 of the sources and of the policy's files.
        catalog: digest of the catalog that defines the layouts' assets; None in folders older than this field.
    """

    SCHEMA: ClassVar[str] = "labgym.navigation-run/1"

    suite: Suite
    policy: str
    options: dict[str, Any]
    seed: int
    code: str
    catalog: str | None = None

    def differences(self, other: EvaluationIdentity) -> tuple[str, ...]:
        """Return the names of the fields in which two evaluations differ.

        The layouts of a suite of layouts passed by hand are not compared: each row names its layout by hash.
        """
        mine, theirs = self._compared(), other._compared()
        return tuple(name for name in mine if mine[name] != theirs[name])

    def _compared(self) -> dict[str, Any]:
        suite = self.suite if self.suite.split else self.suite.model_copy(update={"layouts": None})
        return {**dict(self), "suite": suite}


def provenance(policy_files: Iterable[Path]) -> EvaluationProvenance:
    """Return the provenance of an evaluation by the present code.

    Args:
        policy_files: the policy's module and the files that it reads.
    """
    versions = {"labgym": __version__, "python": platform.python_version()}
    for package in PACKAGES:
        try:
            versions[package] = version(package)
        except PackageNotFoundError:
            continue
    commit, dirty = _checkout()
    return EvaluationProvenance(versions=versions, commit=commit, dirty=dirty, code=_code_digest(policy_files))


@cache
def _checkout() -> tuple[str | None, bool | None]:
    """Return the commit of the package's checkout and whether it has uncommitted changes; None outside a checkout."""
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
    command = ["git", "-C", str(root), *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=20, check=True).stdout.strip()


def _code_digest(policy_files: Iterable[Path]) -> str:
    package = Path(__file__).resolve().parents[2]
    return files_digest([*sorted(package.rglob("*.py")), *policy_files])
