"""The drives of each round: tasks in turn, episodes drawn at random."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from labgym.envs.labnav.tasks import task_of
from labgym.errors import LabgymError
from labgym.training.local.collection import Drive
from labgym.training.local.practice import read_floor


def check_tasks(names: Sequence[str]) -> None:
    """Check that tasks exist.

    Raises:
        UnknownNameError: a task does not exist.
    """
    for name in names:
        task_of(name)


def drawn_drives(floors: Sequence[Path], tasks: Sequence[str], count: int, seed: int, number: int) -> list[Drive]:
    """Return the drives of a round.

    Args:
        floors: files of the practice floors. tasks: to practice, each as often as the others.
        count: number of drives. seed: of the run. number: of the round.

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
    drives: list[Drive] = []
    for k in range(count):
        task = tasks[k % len(tasks)]
        file, episode = choices[task][int(rng.integers(len(choices[task])))]
        drives.append(Drive(file, task, episode, int(rng.integers(2**53))))
    # Those on one floor follow each other, so that each worker prepares few floors.
    return sorted(drives, key=lambda one: (one.floor, one.task, one.number, one.seed))


def validation_drives(floors: Sequence[Path], tasks: Sequence[str], most: int) -> list[Drive]:
    """Return the first drives of each task on each floor, at most `most` of them."""
    return [
        Drive(file, task, number, 0)
        for file in floors
        for task in tasks
        for number in range(min(most, len(read_floor(file)[1].episodes.get(task, ()))))
    ]
