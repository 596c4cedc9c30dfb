"""Importers: experiments from other file formats, one module per format."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from labgym.protocols.experiments import Experiment, Rejection
from labgym.protocols.importers.records import Format, ImportSource

__all__ = ["Format", "ImportSource", "read"]


def read(path: str | Path, format: Format, product: str = "") -> Iterator[Experiment | Rejection]:  # noqa: A002
    """Return the records of a file, or of a folder of files.

    Args:
        path, format, product: as `ImportSource`.

    Raises:
        OptionError: as `ImportSource`.
        DocumentError: a single file cannot be read, or a folder holds no file of the format; raised during iteration.
        MissingDependencyError: the format needs an extra that is not installed.
    """
    source = ImportSource(Path(path), format, product)
    return (record for file in source.files() for record in source.records(file))
