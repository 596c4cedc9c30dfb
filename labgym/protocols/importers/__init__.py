"""Experiments from the file formats of others, each read by a module of that name."""

from __future__ import annotations

from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import Literal, get_args

from labgym.errors import OptionError
from labgym.protocols.experiments import Experiment, Rejection

Format = Literal["chemtrans", "openexp", "ord", "xdl"]


def read(path: str | Path, format: str) -> Iterator[Experiment | Rejection]:  # noqa: A002
    """Return the records of a file, or of a folder of files, of a format.

    Args:
        format: "openexp" (ReactXT), "chemtrans" (also ChemActor), "ord" (Open Reaction Database) or "xdl" (chemical
            description language).

    Raises:
        OptionError: nothing is there, or no such format.
        DocumentError: the file as a whole cannot be read; raised when iteration gets there.
        MissingDependencyError: the format needs an extra that is not installed.
    """
    if format not in get_args(Format):
        raise OptionError(f"format {format[:40]!r} is not known; choose one of {', '.join(get_args(Format))}")
    if not Path(path).exists():
        raise OptionError(f"{path}: no such file or folder; name what to import")
    module = import_module(f"labgym.protocols.importers.{format}")
    records: Iterator[Experiment | Rejection] = module.read(Path(path))
    return records
