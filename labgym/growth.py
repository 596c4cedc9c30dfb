"""How the cost of the main tasks grows with the size of a laboratory or of a suite, on this machine."""

from __future__ import annotations

import itertools
import math
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from labgym.envs import LabPointNavEnv
from labgym.envs.labnav.episodes import LabNavEpisodes, published_episodes
from labgym.layouts import Layout, generate
from labgym.layouts.clutter import add_clutter
from labgym.layouts.moves import Move, apply, may_move
from labgym.layouts.repairs import repair_layout
from labgym.layouts.rules import evaluate_layout
from labgym.scenes import to_mjcf
from labgym.table import Table

FLOORS = (("bay", 0), ("suite", 3), ("suite", 1), ("suite", 2))
"""Families and seeds of the floors: one, four, five and nine spaces with 120 to 721 objects."""
EPISODES = (300, 1000, 3000, 10_000)
"""Numbers of LabNav episodes in the suites that are read."""
PROTOCOL = "sub_01"
CROWDED = 3
"""Level of clutter."""
MOVED_SHARE = 0.03
"""Share of the objects that are moved before a repair."""
MOVED_DISTANCE_M = 0.6
STEPS = 100
"""Control steps that are timed together."""
REPEATS = 3
ENOUGH_SECONDS = 0.5
"""A task is not repeated once it has taken this much processor time, seconds."""

Work = Callable[[], object]


@dataclass(frozen=True)
class Growth:
    """Cost of a task at several sizes.

    Attributes:
        name: the task. unit: of the sizes, such as "objects".
        sizes: ascending. seconds: processor time of each, seconds.
    """

    name: str
    unit: str
    sizes: tuple[int, ...]
    seconds: tuple[float, ...]

    @property
    def exponent(self) -> float:
        """Exponent b of the power law a * size ** b that fits the seconds best, by least squares of the logarithms."""
        return float(np.polyfit(np.log(self.sizes), np.log(self.seconds), 1)[0])


def tasks() -> dict[str, Callable[[], Growth]]:
    """Return the measurement of each task by its name."""
    on_floors: dict[str, Callable[[int], Work]] = {
        "generate": _generation,
        "clutter of level 3": _clutter,
        "score without ways": lambda index: lambda: evaluate_layout(_unseen(index), _floor(index).protocol),
        "score with ways": lambda index: (
            lambda: evaluate_layout(_unseen(index), _floor(index).protocol, navigation=True)
        ),
        "repair, 3% of the objects moved": _repair,
        "MJCF": lambda index: lambda: to_mjcf(_unseen(index)),
        "make and first reset": lambda index: lambda: _environment(index),
        f"{STEPS} control steps, MuJoCo": _steps,
    }
    return {
        **{name: _measurement(name, prepare) for name, prepare in on_floors.items()},
        "read a LabNav suite": _suite_reading,
    }


def growth() -> Iterator[Growth]:
    """Yield the cost of every task at every size."""
    for measure in tasks().values():
        yield measure()


def cpu_seconds(work: Work) -> float:
    """Return the least processor time of a call over up to `REPEATS` calls, seconds."""
    times: list[float] = []
    while len(times) < REPEATS and sum(times) < ENOUGH_SECONDS:
        begin = time.process_time()
        work()
        times.append(time.process_time() - begin)
    return min(times)


def growth_table(rows: Sequence[Growth]) -> Table:
    """Return costs as a table."""
    return Table(
        title="Growth of cost with size on this machine",
        columns=("Work", "Sizes", "CPU seconds", "Exponent"),
        rows=tuple(
            (
                row.name,
                f"{' '.join(map(str, row.sizes))} {row.unit}",
                " ".join(f"{seconds:.3g}" for seconds in row.seconds),
                f"{row.exponent:.2f}",
            )
            for row in rows
        ),
        notes=(
            f"Least processor time of up to {REPEATS} calls; scores, clutter, MJCF and resets on layouts in no cache.",
            "Cost grows with size to the power of the exponent: 1 is linear.",
        ),
    )


def _measurement(name: str, prepare: Callable[[int], Work]) -> Callable[[], Growth]:
    def measure() -> Growth:
        sizes = tuple(len(_floor(index).placements) for index in range(len(FLOORS)))
        prepare(0)()  # imports and compilation are not timed
        return Growth(name, "objects", sizes, tuple(cpu_seconds(prepare(index)) for index in range(len(FLOORS))))

    return measure


@cache
def _floor(index: int) -> Layout:
    family, seed = FLOORS[index]
    return generate(PROTOCOL, seed, family=family)


_counter = itertools.count(1)


def _unseen(index: int) -> Layout:
    """Return a floor with one object moved by a new multiple of 0.2 mm, so that no cache knows the layout."""
    layout = _floor(index)
    return apply(layout, Move(layout.placements[-1].id, 0.0002 * next(_counter), 0.0))


def _generation(index: int) -> Work:
    family, seed = FLOORS[index]
    return lambda: generate(PROTOCOL, seed, family=family)


def _clutter(index: int) -> Work:
    return lambda: add_clutter(_unseen(index), CROWDED, np.random.default_rng(0))


def _repair(index: int) -> Work:
    layout = _floor(index)
    rng = np.random.default_rng(0)
    movable = [placement.id for placement in layout.placements if may_move(layout, placement.id)]
    chosen = rng.choice(movable, max(1, round(MOVED_SHARE * len(layout.placements))), replace=False)
    for item, angle in zip(map(str, chosen), rng.uniform(0.0, 2.0 * math.pi, len(chosen)), strict=True):
        move = Move(item, MOVED_DISTANCE_M * math.cos(angle), MOVED_DISTANCE_M * math.sin(angle))
        layout = apply(layout, move)
    return lambda: repair_layout(layout, layout.protocol)


def _environment(index: int) -> LabPointNavEnv:
    env = LabPointNavEnv(layout=_unseen(index))
    env.reset(seed=0, options={"pair": 0})
    return env


def _steps(index: int) -> Work:
    env, forward = _environment(index), np.array([0.3, 0.2], np.float32)

    def steps() -> None:
        env.reset(seed=0, options={"pair": 0})
        for _ in range(STEPS):
            env.step(forward)

    return steps


def _suite_reading() -> Growth:
    published = published_episodes("people", 2)
    with TemporaryDirectory() as folder:
        paths = [_suite_file(published, count, Path(folder)) for count in EPISODES]
        LabNavEpisodes.load(paths[0])
        seconds = tuple(cpu_seconds(lambda path=path: LabNavEpisodes.load(path)) for path in paths)  # type: ignore[misc]
    return Growth("read a LabNav suite", "episodes", EPISODES, seconds)


def _suite_file(published: LabNavEpisodes, count: int, folder: Path) -> Path:
    """Write a suite that repeats published episodes and return its path."""
    episodes = published.episodes
    many = tuple(episodes[k % len(episodes)].model_copy(update={"number": k}) for k in range(count))
    return published.model_copy(update={"episodes": many}).save(folder / f"{count}.json")
