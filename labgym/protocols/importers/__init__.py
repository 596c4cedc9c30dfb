"""Importers: experiments from other file formats, one module per format."""

from __future__ import annotations

from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import Any, Literal, get_args

from labgym.errors import OptionError
from labgym.protocols.experiments import Experiment, Rejection

Format = Literal["chemtrans", "openexp", "ord", "xdl"]


def read(path: str | Path, format: str, product: str = "") -> Iterator[Experiment | Rejection]:  # noqa: A002
    """Return the records of a file, or of a folder of files.

    Args:
        path: file or folder.
        format: "openexp" (ReactXT), "chemtrans" (also ChemActor), "ord" (Open Reaction Database) or "xdl" (chemical
            description language).
        product: name of the product of XDL files that do not name it; "{stem}" stands for the file's name without its
            suffix. Other formats state their products.

    Raises:
        OptionError: the path does not exist, the format is not known, or a product is given for another format.
        DocumentError: a single file cannot be read; raised during iteration.
        MissingDependencyError: the format needs an extra that is not installed.
    """
    if format not in get_args(Format):
        raise OptionError(f"format {format[:40]!r} is not known; choose one of {', '.join(get_args(Format))}")
    if product and format != "xdl":
        raise OptionError(f"product {product[:40]!r} applies to the format xdl only, not to {format}; leave it out")
    if not Path(path).exists():
        raise OptionError(f"{path}: no such file or folder; name what to import")
    module = import_module(f"labgym.protocols.importers.{format}")
    options: dict[str, Any] = {"product": product} if format == "xdl" else {}
    records: Iterator[Experiment | Rejection] = module.read(Path(path), **options)
    return records
