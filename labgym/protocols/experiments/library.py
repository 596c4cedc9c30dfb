"""The experiment library, and files of experiments."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from types import MappingProxyType

from labgym.artefacts import artefacts
from labgym.errors import DocumentError, UnknownNameError
from labgym.protocols.experiments.model import Experiment, ExperimentFile
from labgym.protocols.model import ReactionType

COLLECTED = "experiments-"
"""Beginning of the names of an import's files of experiments."""
OF_RUNS = ("run.json", "manifest.json", "summary.json")
"""Other documents of an import."""


def experiments() -> dict[str, Experiment]:
    """Return the published experiments by id, sorted by id; they are read once per process."""
    return dict(_published())


def of_type(reaction_type: ReactionType | None) -> list[Experiment]:
    """Return the published experiments of a reaction type, or all if it is None, sorted by id."""
    return [item for item in _published().values() if reaction_type in (None, item.reaction_type)]


def get(experiment_id: str, path: str | Path | None = None) -> Experiment:
    """Return an experiment by id.

    Args:
        experiment_id: its id.
        path: file or folder of experiments; the published library if None.

    Raises:
        UnknownNameError: no experiment has that id; the error lists those that exist.
        DocumentError: the path holds no files of experiments.
    """
    library: Mapping[str, Experiment] = _published()
    if path is not None:
        library = {experiment.id: experiment for experiment in read_experiments(path)}
    if not isinstance(experiment_id, str) or experiment_id not in library:
        raise UnknownNameError("experiment", experiment_id, library)
    return library[experiment_id]


def experiment_files(path: str | Path) -> list[Path]:
    """Return a file, the files of an import, or all JSON files in a folder in the order of their names.

    Raises:
        DocumentError: a folder without files of experiments.
    """
    path = Path(path)
    documents = sorted(path.glob("*.json")) if path.is_dir() else [path]
    collected = [file for file in documents if file.name.startswith(COLLECTED)]
    files = collected or [file for file in documents if file.name not in OF_RUNS]
    if not files:
        raise DocumentError(path, "", "holds no files of experiments (*.json)")
    return files


def read_experiments(path: str | Path) -> tuple[Experiment, ...]:
    """Return the experiments of the files that `experiment_files` returns.

    Raises:
        DocumentError: no files, a file of another kind, or an id that occurs twice.
    """
    by_id: dict[str, Experiment] = {}
    for file in experiment_files(path):
        for number, experiment in enumerate(ExperimentFile.load(file).experiments):
            if experiment.id in by_id:
                raise DocumentError(
                    file, f"experiments.{number}.id", f"{experiment.id!r} occurs twice; ids must be unique"
                )
            by_id[experiment.id] = experiment
    return tuple(by_id.values())


@lru_cache(maxsize=1)
def _published() -> MappingProxyType[str, Experiment]:
    library = read_experiments(artefacts("assets") / "experiments")
    return MappingProxyType({experiment.id: experiment for experiment in sorted(library, key=lambda item: item.id)})
