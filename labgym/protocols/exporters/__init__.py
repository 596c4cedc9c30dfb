"""Exporters: experiments and protocols in other file formats, one module per format."""

from __future__ import annotations

from importlib import import_module
from typing import Literal, get_args

from labgym.errors import OptionError
from labgym.protocols.experiments import Experiment
from labgym.protocols.exporters.source import as_experiment

__all__ = ["SUFFIXES", "ExportFormat", "as_experiment", "export"]

ExportFormat = Literal["autoprotocol", "ord", "xdl"]
SUFFIXES: dict[ExportFormat, str] = {"autoprotocol": ".autoprotocol.json", "ord": ".ord.json", "xdl": ".xdl"}
"""Suffixes of the files of each format."""


def export(experiment: Experiment, format: ExportFormat) -> str:  # noqa: A002
    """Return an experiment as the text of a file.

    Args:
        experiment: what is exported; of a protocol, what `as_experiment` returns.
        format: "ord" (Open Reaction Database), "xdl" (chemical description language) or "autoprotocol".

    Raises:
        OptionError: the format is not known.
    """
    if format not in get_args(ExportFormat):
        choices = ", ".join(get_args(ExportFormat))
        raise OptionError(f"format {str(format)[:40]!r} is not known; choose one of {choices}")
    text: str = import_module(f"labgym.protocols.exporters.{format}").written(experiment.unrolled())
    return text
