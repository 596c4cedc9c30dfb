"""The sources of training layouts: functions of a number."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from labgym.errors import OptionError, UnknownNameError
from labgym.layouts import Layout
from labgym.layouts.floor import Room
from labgym.layouts.places import layout_at
from labgym.layouts.splits import train_layout
from labgym.protocols import Protocol

LayoutSource = Callable[[int], Layout]
"""Returns training layout `number`, from 0 to 10^7 - 1; equal numbers give equal layouts in any process."""


@dataclass(frozen=True)
class TrainingRooms:
    """Rooms of the presets; a layout's number draws protocol, preset and seed, as `train_layout`.

    Attributes:
        protocol: the protocol of every room; None to draw one for each.
        profile: thresholds that the rooms satisfy.
    """

    protocol: Protocol | None = None
    profile: str = "default"

    def __call__(self, number: int) -> Layout:
        """Return training room `number`.

        Raises:
            InfeasibleError: none of the rooms drawn holds its protocol.
        """
        return train_layout(np.random.default_rng(number), self.protocol, self.profile)


def training_floor(number: int) -> Layout:
    """Return layout `number` of the split "floors-train": a bay, an L, or a suite of two or three rooms, with clutter.

    Raises:
        InfeasibleError: no seed of this place gives a layout.
    """
    return layout_at("floors-train", number)


EMPTY_ROOMS = 64
"""Number of different empty rooms."""
EMPTY_SIDES = (4.0, 12.0)
"""Least and greatest side of an empty room, meters."""


@lru_cache(maxsize=EMPTY_ROOMS)
def _empty_room(number: int) -> Layout:
    width, depth = np.random.default_rng([number, EMPTY_ROOMS]).uniform(*EMPTY_SIDES, size=2).round(1).tolist()
    return Layout(id=f"empty-{number}", floor=Room(name="empty", width=width, depth=depth).floor, placements=())


def empty_room(number: int) -> Layout:
    """Return room `number` modulo `EMPTY_ROOMS`: four walls, no furniture, no protocol, drives between free poses."""
    return _empty_room(number % EMPTY_ROOMS)


ROOMS, EMPTY = "rooms", "empty"
"""The names of `TrainingRooms` and `empty_room` as the argument `training`."""


def source_of(training: str | LayoutSource, protocol: Protocol | None, profile: str) -> LayoutSource:
    """Return the source that the argument `training` of an environment stands for.

    Args:
        training: "rooms", "empty", or a source.
        protocol: the protocol that layouts are generated for; None to draw one for each.
        profile: thresholds that generated layouts satisfy.

    Raises:
        UnknownNameError: no source has that name.
        OptionError: neither a name nor a function, or a function together with a protocol or a profile.
    """
    if training == ROOMS:
        return TrainingRooms(protocol, profile)
    if isinstance(training, str) and training != EMPTY:
        raise UnknownNameError("source of training layouts", training, (ROOMS, EMPTY))
    source = empty_room if training == EMPTY else training
    if not callable(source):
        raise OptionError(
            f"training is a {type(training).__name__}, expected 'rooms', 'empty' or a function of a number"
        )
    if protocol is not None or profile != "default":
        raise OptionError(
            "only training='rooms' takes a protocol or a profile: other layouts come with their protocols"
        )
    return source
