"""Kernel modes: the numerical libraries of a policy's process, pinned so that every processor gives the same bits.

torch, NumPy and OpenBLAS choose their kernels by the processor's instruction set, and some also by its caches
or its maker. Kernels differ in the last bit, and driving amplifies it: a learned policy's score would depend on the
machine. The pinned mode selects kernels that every x86-64 processor with AVX2 and FMA has and that sum in a fixed
order. docs/policies.md describes the comparison.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import MappingProxyType
from typing import Any

from labgym.errors import OptionError, UnknownNameError

VARIABLE = "LABGYM_KERNELS"
"""Environment variable that holds the name of the mode in a policy's process."""
REQUIRED_FLAGS = ("avx2", "fma")
"""Flags of a processor that runs the pinned kernels."""


@dataclass(frozen=True)
class KernelMode:
    """A choice of numerical kernels.

    Attributes:
        kind: "pinned" or "native".
        name: part of a run's identity; its number rises when the mode's results change.
        environment: environment variables of the policy's process, set before it imports anything.
    """

    kind: str
    name: str
    environment: Mapping[str, str]


PINNED = KernelMode(
    "pinned",
    "pinned/1",
    MappingProxyType(
        {
            VARIABLE: "pinned/1",
            # ATen's own kernels.
            "ATEN_CPU_CAPABILITY": "avx2",
            # MKL: the one branch that Intel supports on every maker's processors; it sums in a fixed order.
            "MKL_CBWR": "COMPATIBLE",
            # NumPy: names since 2.4 (X86_V4), then those of earlier releases; unknown names are ignored.
            "NPY_DISABLE_CPU_FEATURES": (
                "X86_V4 AVX512_ICL AVX512_SPR AVX512F AVX512CD AVX512_SKX AVX512_CLX AVX512_CNL AVX512_KNL AVX512_KNM"
            ),
            "OPENBLAS_CORETYPE": "Haswell",
            "OMP_NUM_THREADS": "1",
            "OPENBLAS_NUM_THREADS": "1",
            "MKL_NUM_THREADS": "1",
        }
    ),
)
"""The default. oneDNN and NNPACK have no variable that fixes their order of sums; `pin_torch` turns them off."""

NATIVE = KernelMode("native", "native", MappingProxyType({VARIABLE: "native"}))
"""The fastest kernels of the processor; results differ between processors."""

MODES = {mode.kind: mode for mode in (PINNED, NATIVE)}
"""Modes by the name that users give."""


def kernel_mode(name: str | None = None) -> KernelMode:
    """Return a kernel mode.

    Args:
        name: "pinned" or "native"; None is "pinned" where the processor has AVX2 and FMA, else "native".

    Raises:
        UnknownNameError: no mode has that name.
        OptionError: the processor cannot run the pinned kernels.
    """
    if name is None:
        return PINNED if runs_pinned() else NATIVE
    if name not in MODES:
        raise UnknownNameError("kernel mode", name, sorted(MODES))
    if name == "pinned" and not runs_pinned():
        raise OptionError("the pinned kernels require an x86-64 processor with AVX2 and FMA; use kernels 'native'")
    return MODES[name]


@cache
def runs_pinned() -> bool:
    """Return whether the processor has the instructions of the pinned kernels."""
    try:
        text = Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace")
    except OSError:
        return False
    flags = next((line.split(":", 1)[1].split() for line in text.splitlines() if line.startswith("flags")), [])
    return all(flag in flags for flag in REQUIRED_FLAGS)


def pin_torch() -> None:
    """Turn off oneDNN and NNPACK and limit torch to one thread, if torch is loaded and this process is pinned.

    oneDNN splits sums by the size of the caches, even if its instruction set is limited.
    """
    torch: Any = sys.modules.get("torch")
    pinned = os.environ.get(VARIABLE) == PINNED.name
    if pinned and hasattr(torch, "backends") and torch.backends.mkldnn.enabled:
        torch.backends.mkldnn.set_flags(False)
        torch.backends.nnpack.set_flags(False)
        torch.set_num_threads(1)


def kernel_facts() -> dict[str, str | int]:
    """Return the kernels in force in this process: the mode, and for a loaded torch its instructions and threads.

    Keys: `kernels`, the name of the mode; `threads`, if OMP_NUM_THREADS is set; with torch also `torch` (version),
    `torch_capability` (instruction set), `torch_threads` and `onednn` ("true" or "false"), and `cuda`,
    the name of the GPU that it uses, if it does.
    """
    facts: dict[str, str | int] = {"kernels": os.environ.get(VARIABLE, NATIVE.name)}
    threads = os.environ.get("OMP_NUM_THREADS", "")
    if threads.isdecimal():
        facts["threads"] = int(threads)
    torch: Any = sys.modules.get("torch")
    if hasattr(torch, "backends"):
        facts["torch"] = str(torch.__version__)
        facts["torch_capability"] = str(torch.backends.cpu.get_cpu_capability())
        facts["torch_threads"] = int(torch.get_num_threads())
        facts["onednn"] = str(torch.backends.mkldnn.enabled).lower()
        if torch.cuda.is_initialized():
            facts["cuda"] = str(torch.cuda.get_device_name())[:100]
    return facts
