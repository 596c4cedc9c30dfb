"""The published experiments, and files of experiments."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from types import MappingProxyType

from labgym.artefacts import artefacts
from labgym.errors import DocumentError, UnknownNameError
from labgym.protocols.experiments.model import Experiment, ExperimentFile


def experiments() -> dict[str, Experiment]:
    """Return the published experiments by id, sorted by id; read once a process."""
    return dict(_published())


def get(experiment_id: str) -> Experiment:
    """Return a published experiment by id.

    Raises:
        UnknownNameError: there is none of that id; lists those there are.
    """
    library = _published()
    if not isinstance(experiment_id, str) or experiment_id not in library:
        raise UnknownNameError("experiment", experiment_id, library)
    return library[experiment_id]


def read_experiments(path: str | Path) -> tuple[Experiment, ...]:
    """Return the experiments of a file, or of all JSON files in a folder in the order of their names.

    Raises:
        DocumentError: nothing there, a file that is no file of experiments, or an id that occurs twice.
    """
    path = Path(path)
    files = sorted(path.glob("*.json")) if path.is_dir() else [path]
    if not files:
        raise DocumentError(path, "", "holds no files of experiments (*.json)")
    found: dict[str, Experiment] = {}
    for file in files:
        for number, experiment in enumerate(ExperimentFile.load(file).experiments):
            if experiment.id in found:
                raise DocumentError(file, f"experiments.{number}.id", f"{experiment.id!r} occurs twice; ids are unique")
            found[experiment.id] = experiment
    return tuple(found.values())


@lru_cache(maxsize=1)
def _published() -> MappingProxyType[str, Experiment]:
    library = read_experiments(artefacts("assets") / "experiments")
    return MappingProxyType({experiment.id: experiment for experiment in sorted(library, key=lambda item: item.id)})
