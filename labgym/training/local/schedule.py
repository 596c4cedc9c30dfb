"""The drives of each round: tasks in turn or by their weights, episodes drawn at random."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from labgym.envs.labnav.tasks import task_of
from labgym.errors import LabgymError
from labgym.training.local.collection import TrainingDrive
from labgym.training.local.practice import read_floor


def check_tasks(names: Sequence[str]) -> None:
    """Check that tasks exist.

    Raises:
        UnknownNameError: a task does not exist.
    """
    for name in names:
        task_of(name)


EVEN = 0.2
"""Part of a task's weight that does not depend on its score."""


def weights_by_failure(scores: Mapping[str, float]) -> dict[str, float]:
    """Return how often tasks are practiced, in proportion: the more often, the lower their mean scores."""
    return {task: EVEN + 1.0 - score for task, score in scores.items()}


def drawn_drives(
    floors: Sequence[Path],
    tasks: Sequence[str],
    count: int,
    seed: int,
    number: int,
    weights: Mapping[str, float] | None = None,
) -> list[TrainingDrive]:
    """Return the drives of a round.

    Args:
        floors: files of the practice floors. tasks: to practice. count: number of drives.
        seed: of the run. number: of the round.
        weights: how often each task is practiced, in proportion; None practices all of them equally often.

    Raises:
        LabgymError: no floor has a drive of a task.
    """
    choices: dict[str, list[tuple[Path, int]]] = {task: [] for task in tasks}
    for file in floors:
        episodes = read_floor(file)[1].episodes
        for task in tasks:
            choices[task] += [(file, k) for k in range(len(episodes.get(task, ())))]
    for task, available in choices.items():
        if not available:
            raise LabgymError(f"none of the {len(floors)} training floors has a drive of {task}: use more floors")
    rng = np.random.default_rng([seed, number])
    drives: list[TrainingDrive] = []
    for task in _tasks(tasks, count, weights):
        file, episode = choices[task][int(rng.integers(len(choices[task])))]
        drives.append(TrainingDrive(file, task, episode, int(rng.integers(2**53))))
    # Those on one floor follow each other, so that each worker prepares few floors.
    return sorted(drives, key=lambda one: (one.floor, one.task, one.number, one.seed))


def _tasks(tasks: Sequence[str], count: int, weights: Mapping[str, float] | None) -> list[str]:
    """Return the tasks of `count` drives, as near to the weights as whole numbers of drives allow."""
    if weights is None:
        return [tasks[k % len(tasks)] for k in range(count)]
    ends = np.cumsum([weights[task] for task in tasks])
    places = (np.arange(count) + 0.5) / count * ends[-1]
    return [tasks[int(k)] for k in np.searchsorted(ends, places)]


def validation_drives(floors: Sequence[Path], tasks: Sequence[str], most: int) -> list[TrainingDrive]:
    """Return the first drives of each task on each floor, at most `most` of them."""
    return [
        TrainingDrive(file, task, number, 0)
        for file in floors
        for task in tasks
        for number in range(min(most, len(read_floor(file)[1].episodes.get(task, ()))))
    ]
