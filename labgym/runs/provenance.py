"""Versions, checkout and machine of each session of a run; never part of its identity or merged files."""

from __future__ import annotations

import json
import os
import platform
import subprocess
import sys
from collections.abc import Mapping
from datetime import UTC, datetime
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import labgym
from labgym.documents import Record

PROVENANCE_FILE = "provenance.jsonl"
"""A line for each session of a run: the start, and each resumption."""
PACKAGES = (
    "diffusers",
    "embreex",
    "gymnasium",
    "mujoco",
    "numpy",
    "onnxruntime",
    "opencv-python-headless",
    "ortools",
    "pyarrow",
    "safetensors",
    "scipy",
    "shapely",
    "stable-baselines3",
    "torch",
    "trimesh",
)
"""Packages whose versions can change results."""
INSTRUCTION_SETS = ("avx512f", "avx2", "avx", "sse4_2", "asimd", "neon")
"""Flags of /proc/cpuinfo, the widest instruction set first."""


class MachineFacts(Record):
    """The machine of a process.

    Attributes:
        name: host name. system: operating system and architecture.
        cpu: processor model; "" if unknown.
        instruction_set: the widest vector instruction set of the processor; "" if unknown.
        cores: cores that the process may use.
        threads: threads of torch if it is loaded, else of OMP_NUM_THREADS if set, else of all cores.
        torch_capability: instruction set that torch's kernels use; None while torch is not loaded.
    """

    name: str
    system: str
    cpu: str
    instruction_set: str
    cores: int
    threads: int
    torch_capability: str | None = None


class RunProvenance(Record):
    """Code and machine of a session of a run.

    Attributes:
        versions: versions of labgym, Python and the installed packages that affect results.
        commit: commit of the checkout, None outside a checkout.
        dirty: whether the checkout had uncommitted changes, None outside a checkout.
        host: the machine of the coordinator.
        started: time of the start, UTC, ISO 8601.
        kernels: numerical kernels of the policy's process: mode, and version, instruction set and threads of torch if
            the policy uses it; None for runs without a policy.
    """

    versions: dict[str, str]
    commit: str | None
    dirty: bool | None
    host: MachineFacts
    started: str
    kernels: dict[str, str | int] | None = None

    def line(self) -> str:
        """Return the record as a line of JSON."""
        return json.dumps(self.model_dump(mode="json"), ensure_ascii=False) + "\n"


def provenance(kernels: Mapping[str, str | int] | None = None) -> RunProvenance:
    """Return the provenance of a session that starts now in this process.

    Args:
        kernels: numerical kernels of the policy's process, for runs that drive one.
    """
    commit, dirty = _checkout()
    return RunProvenance(
        versions=versions(),
        commit=commit,
        dirty=dirty,
        host=host(),
        started=datetime.now(UTC).isoformat(timespec="seconds"),
        kernels=None if kernels is None else dict(kernels),
    )


@cache
def versions() -> dict[str, str]:
    """Return the versions of labgym, Python and the installed packages of `PACKAGES`."""
    installed = {"labgym": labgym.__version__, "python": platform.python_version()}
    for package in PACKAGES:
        try:
            installed[package] = version(package)
        except PackageNotFoundError:
            continue
    return installed


def host() -> MachineFacts:
    """Return the facts of this machine and process."""
    cpu, flags = _processor()
    cores = len(os.sched_getaffinity(0))
    torch = sys.modules.get("torch")
    threads = torch.get_num_threads() if torch is not None else os.environ.get("OMP_NUM_THREADS", "")
    return MachineFacts(
        name=platform.node(),
        system=f"{platform.system()} {platform.machine()}",
        cpu=cpu,
        instruction_set=next((name for name in INSTRUCTION_SETS if name in flags), ""),
        cores=cores,
        threads=int(threads) if str(threads).isdecimal() else cores,
        torch_capability=None if torch is None else str(torch.backends.cpu.get_cpu_capability()),
    )


@cache
def _processor() -> tuple[str, frozenset[str]]:
    """Return the processor's model and its flags."""
    try:
        text = Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace")
    except OSError:
        return platform.processor(), frozenset()
    fields = dict(part.split(":", 1) for part in text.split("\n\n")[0].splitlines() if ":" in part)
    fields = {name.strip(): value.strip() for name, value in fields.items()}
    flags = fields.get("flags", fields.get("Features", ""))
    return fields.get("model name", platform.processor()), frozenset(flags.split())


@cache
def _checkout() -> tuple[str | None, bool | None]:
    """Return the commit of the package's checkout and whether it has uncommitted changes; None outside a checkout."""
    root = Path(labgym.__file__).resolve().parents[1]
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
