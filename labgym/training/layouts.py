"""A fixed number of training layouts, so that fast environments do not wait for the generator."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from functools import lru_cache

from labgym.envs.training import source_of
from labgym.envs.world import keep
from labgym.errors import OptionError, SearchLimitWarning
from labgym.layouts import Layout

RESIDENT_MB = 2048.0
"""Budget of a process for prepared training layouts, megabytes; with the lidar, a room takes 2 MB."""


@dataclass(frozen=True)
class FirstLayouts:
    """The first layouts of a source of training layouts, drawn again and again.

        LabVecEnv(64, split="train", training=FirstLayouts(64), episodes_per_layout=1)

    A process generates each layout once, when it is first drawn, and keeps it prepared.

    Attributes:
        count: number of layouts.
        source: "rooms" or "floors".

    Raises:
        OptionError: the count is not a whole number of at least 1.
        UnknownNameError: there is no source of that name.
    """

    count: int
    source: str = "rooms"

    def __post_init__(self) -> None:
        if isinstance(self.count, bool) or not isinstance(self.count, int) or self.count < 1:
            raise OptionError(f"layouts is {self.count!r}, expected a whole number of at least 1")
        source_of(self.source, None, "default")

    def __call__(self, number: int) -> Layout:
        """Return layout `number` modulo the count."""
        layout = _layout(self.source, number % self.count)
        keep(layout, RESIDENT_MB)
        return layout


@lru_cache(maxsize=4096)
def _layout(source: str, number: int) -> Layout:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SearchLimitWarning)  # Less furniture than the room holds is no loss here.
        return source_of(source, None, "default")(number)
