"""Reading USD in a separate process, so that no file can hang or crash the caller."""

from __future__ import annotations

import importlib.util
import io
import json
import os
import subprocess
import sys
from dataclasses import asdict, replace
from itertools import islice
from pathlib import Path

import numpy as np

from labgym.assets.meshes.model import LIMITS, Limits, MeshError, MeshPart, RawMesh
from labgym.errors import MissingDependencyError

MEMORY = 1536 * 1024**2
"""Address space that USD takes for small files, bytes: 1.2 GiB, mostly of its libraries, and room for their content."""
MEMORY_PER_BYTE = 24
"""Further address space for each byte of the files: uncompressed content, and copies of it in NumPy arrays."""
MAX_FILES = 1000
SUFFIXES = (".usd", ".usda", ".usdc", ".usdz")


def read_usd(path: Path, limits: Limits = LIMITS) -> RawMesh:
    """Return what `stage.read_stage` reads, from a process with bounded memory and time.

    Raises:
        MeshError: as `read_stage`, and if the process takes too long, takes too much memory or crashes.
        MissingDependencyError: usd-core is not installed.
    """
    if importlib.util.find_spec("pxr") is None:
        raise MissingDependencyError("usd-core", f"reading {path.name}", "usd")
    limits = replace(limits, memory=memory_for(path, limits))
    command = [sys.executable, "-P", "-m", "labgym.assets.meshes.worker", str(path), json.dumps(asdict(limits))]
    environment = {**os.environ, "PXR_WORK_THREAD_LIMIT": "1", "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    try:
        child = subprocess.run(
            command,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            timeout=limits.seconds,
            env=environment,
            check=False,
        )
    except subprocess.TimeoutExpired:
        problem = f"took more than {limits.seconds} s to read; flatten the stage; it may instance itself recursively"
        raise MeshError(path, problem) from None
    if child.stdout.startswith(b"{"):
        raise MeshError(path, str(json.loads(child.stdout)["error"]))
    if child.returncode or not child.stdout:
        how = f"signal {-child.returncode}" if child.returncode < 0 else f"exit {child.returncode}"
        problem = f"USD's reader failed on it ({how}; it may take {limits.memory // 1024**2} MiB of memory)"
        raise MeshError(path, f"{problem}; flatten and simplify the stage or export it again")
    return _unpack(child.stdout)


def memory_for(path: Path, limits: Limits = LIMITS) -> int:
    """Return the address space for reading a file: it grows with the file and the USD files below its folder, bytes."""
    others = (each for each in islice(path.resolve().parent.rglob("*"), MAX_FILES) if each.suffix in SUFFIXES)
    size = path.stat().st_size + sum(each.stat().st_size for each in others if each.is_file())
    return min(limits.memory, MEMORY + MEMORY_PER_BYTE * size)


def _unpack(content: bytes) -> RawMesh:
    with np.load(io.BytesIO(content), allow_pickle=False) as arrays:
        head = json.loads(str(arrays["head"]))
        parts = tuple(
            MeshPart(
                part["name"],
                arrays[f"vertices{k}"],
                arrays[f"faces{k}"],
                tuple(part["color"]) if part["color"] else None,
                part["material"],
            )
            for k, part in enumerate(head["parts"])
        )
    return RawMesh(parts, head["name"], head["unit"], head["up_axis"], head["metadata"])
