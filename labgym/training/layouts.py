"""A fixed number of training layouts, so that fast environments do not wait for the generator."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache
from typing import NoReturn

from tqdm import tqdm

from labgym.counts import whole_number
from labgym.envs.training import LayoutSource, TrainingRooms, training_floor
from labgym.envs.world import keep
from labgym.errors import SearchLimitWarning, UnknownNameError
from labgym.layouts import Layout

RESIDENT_MB = 2048.0
"""Budget of a process for prepared training layouts, megabytes; with the lidar, a room takes 2 MB."""
SOURCES: dict[str, LayoutSource] = {"train": TrainingRooms(), "floors-train": training_floor}
"""The layouts of each training split."""


@dataclass(frozen=True)
class FirstLayouts:
    """The first layouts of a source of training layouts, drawn again and again.

        LabVecEnv(64, split="train", training=FirstLayouts(64), episodes_per_layout=1)

    A process generates each layout once, when it is first drawn, and keeps it prepared.

    Attributes:
        count: number of layouts.
        split: "train" or "floors-train".

    Raises:
        OptionError: the count is not a whole number of at least 1.
        UnknownNameError: the split has no training layouts.
    """

    count: int
    split: str = "train"

    def __post_init__(self) -> None:
        whole_number("layouts", self.count)
        if self.split not in SOURCES:
            raise UnknownNameError("split of training layouts", self.split, SOURCES)

    def __call__(self, number: int) -> Layout:
        """Return layout `number` modulo the count."""
        layout = _layout(self.split, number % self.count)
        keep(layout, RESIDENT_MB)
        return layout


@lru_cache(maxsize=4096)
def _layout(split: str, number: int) -> Layout:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SearchLimitWarning)  # Less furniture than the room holds is no loss here.
        layout = SOURCES[split](number)
    for bar in _bars:
        bar.update()
        if bar.n >= bar.total:
            bar.close()
    return layout


_bars: list[tqdm[NoReturn]] = []
"""Bars that count the layouts which this process generates."""


@contextmanager
def layout_progress(count: int) -> Iterator[None]:
    """Show on a terminal, on stderr, how many of `count` layouts this process has generated, until all are."""
    with tqdm(total=count, desc="training layouts", unit="layout", disable=None, leave=False) as bar:
        _bars.append(bar)
        try:
            yield
        finally:
            _bars.remove(bar)
