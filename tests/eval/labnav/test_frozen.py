"""What LabNav consists of stays as it was when its version was published, on floors that no file holds.

Three floors follow from a fixed secret. Frozen are these floors, the properties of all levels, an episode of each task
at level 2, and a drive of it with the people on its way. Whoever changes one of them on purpose raises
`labgym.eval.labnav.publication.VERSION`, draws the suites and drives the rows again.
"""

from __future__ import annotations

import json
import math
import os
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from labgym.documents import canonical_hash
from labgym.envs.labnav.drawing import draw_floor
from labgym.envs.labnav.episodes import LabNavEpisode
from labgym.envs.labnav.tasks import FIGURE_TASKS, task_of
from labgym.envs.state import State
from labgym.eval.labnav.drive import drive_floor
from labgym.eval.labnav.leg import nearest_person
from labgym.eval.labnav.publication import VERSION
from labgym.eval.labnav.results import DriveTerms
from labgym.layouts import Layout
from labgym.layouts.places import furnished_with
from labgym.layouts.sealed import FRESH, sealed_seeds
from labgym.policies import make_policy

FILE = Path(__file__).parent / "data" / "frozen.json"
SECRET = bytes(range(32))
FLOORS = 3
SECONDS = 30.0
EVERY = 20
"""Control steps between the poses of a drive that are compared."""
WRITES = os.environ.get("LABGYM_GOLDEN") == "1"
DIGITS = 6


@lru_cache(maxsize=FLOORS)
def floor(index: int) -> Layout:
    _, _, layout = furnished_with(FRESH, index, sealed_seeds(SECRET, index))
    return layout


@lru_cache(maxsize=len(FIGURE_TASKS))
def episode(task: str) -> tuple[Layout, LabNavEpisode]:
    """Return the first episode of a task on the first floor that has one."""
    for index in range(FLOORS):
        episodes, _ = draw_floor(floor(index), task, 2, 1, 14)
        if episodes:
            return floor(index), episodes[0]
    raise AssertionError(f"none of the floors has an episode of {task}")


def driven(task: str) -> dict[str, Any]:
    """Return poses, the distance of the nearest person, and the results of a drive of `astar`."""
    layout, one = episode(task)
    poses: list[list[float]] = []

    def watch(state: State) -> None:
        if state.steps % EVERY == 0:
            near = nearest_person(state) if state.presences else math.inf
            poses.append([round(value, DIGITS) for value in (*state.pose, min(near, 100.0))])

    (drive,) = drive_floor(
        make_policy("astar"), layout, (one,), DriveTerms(task, 2, "astar", "frozen", 0, SECONDS), watch
    )
    row = drive.row
    results = [row.score, row.path_length, row.time, row.shortest]
    return {"poses": poses, "ending": row.ending, "results": [round(value, DIGITS) for value in results]}


def frozen(key: str, value: Any) -> Any:
    """Return the frozen value of a key; write it first where LABGYM_GOLDEN=1 asks for it."""
    stored = json.loads(FILE.read_text(encoding="utf-8")) if FILE.exists() else {}
    if WRITES:
        FILE.parent.mkdir(exist_ok=True)
        stored = {**stored, key: value}
        FILE.write_text(json.dumps(stored, indent=0, sort_keys=True) + "\n", encoding="utf-8")
    return stored[key]


def test_floors_are_those_of_the_version() -> None:
    assert frozen("version", VERSION) == VERSION
    hashes = [floor(index).hash for index in range(FLOORS)]
    assert frozen("floors", hashes) == hashes


@pytest.mark.parametrize("task", FIGURE_TASKS)
def test_levels_are_those_of_the_version(task: str) -> None:
    levels = [repr(task_of(task).level(number)) for number in (1, 2, 3)]
    assert frozen(f"levels of {task}", levels) == levels


@pytest.mark.parametrize("task", FIGURE_TASKS)
def test_an_episode_is_that_of_the_version(task: str) -> None:
    own = canonical_hash(episode(task)[1].model_dump(mode="json"))
    assert frozen(f"episode of {task}", own) == own


@pytest.mark.parametrize("task", FIGURE_TASKS)
def test_a_drive_is_that_of_the_version(task: str) -> None:
    own = driven(task)
    expected = frozen(f"drive of {task}", own)
    assert own["ending"] == expected["ending"]
    np.testing.assert_allclose(own["poses"], expected["poses"], atol=2e-6, rtol=0)
    np.testing.assert_allclose(own["results"], expected["results"], atol=2e-6, rtol=0)
