"""Which drive an episode is: a layout, a protocol and one of its goal pairs, chosen or drawn."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from labgym import protocols
from labgym.errors import OptionError, UnknownNameError
from labgym.layouts import Layout
from labgym.layouts.splits import load_published, published, train_layout
from labgym.navigation import GoalPair, goal_pairs
from labgym.protocols import Protocol

SPLITS = ("train", "val", "test")
PUBLISHED = ("val", "test")
OPTIONS = ("layout", "protocol", "pair")


@dataclass(frozen=True)
class Task:
    """One episode's drive.

    Attributes:
        protocol: whose drive it is, usually the one that the layout was made for.
    """

    layout: Layout
    protocol: Protocol
    pair: GoalPair


class TaskSource:
    """Chooses the drive of each episode.

    Args:
        split: where layouts are drawn from: "val" or "test" among the published ones, "train" newly generated ones.
        layout: a fixed layout in place of drawn ones: a `Layout`, a path of one, or the id of a published one.
        protocol: a fixed protocol, or its id, in place of any.
        profile: thresholds that generated layouts meet.
        episodes_per_layout: drives in a generated layout before the next is drawn.

    Raises:
        UnknownNameError: a split, protocol or layout does not exist.
        OptionError: a layout is none of what it may be, or there is nothing to draw from.
        DocumentError: a layout's file cannot be read as one.
    """

    def __init__(
        self,
        split: str,
        layout: Layout | str | Path | None,
        protocol: Protocol | str | None,
        profile: str,
        episodes_per_layout: int,
    ) -> None:
        if split not in SPLITS:
            raise UnknownNameError("split", split, SPLITS)
        if episodes_per_layout < 1:
            raise OptionError(f"episodes_per_layout is {episodes_per_layout}, expected at least 1")
        self._split, self._profile = split, profile
        self._layout = None if layout is None else resolve_layout(layout)
        self._protocol = None if protocol is None else resolve_protocol(protocol)
        self._episodes_per_layout = episodes_per_layout
        self._generated: Layout | None = None
        self._episodes_left = 0

    def draw(self, rng: np.random.Generator, options: Mapping[str, Any], fresh: bool) -> Task:
        """Return the next drive.

        Args:
            rng: what is not chosen is drawn from it.
            options: any of "layout", "protocol" and "pair" (index), over what the source was made with.
            fresh: forget what was drawn before, so that the drive depends on `rng` and `options` alone.

        Raises:
            UnknownNameError, OptionError, DocumentError: as for the constructor; also an unknown option or pair.
        """
        for name in options:
            if name not in OPTIONS:
                raise UnknownNameError("reset option", name, OPTIONS)
        protocol = self._protocol if options.get("protocol") is None else resolve_protocol(options["protocol"])
        layout = self._layout if options.get("layout") is None else resolve_layout(options["layout"])
        if layout is None:
            layout = self._drawn_layout(rng, protocol, fresh)
        if protocol is None and layout.protocol is None:
            raise OptionError(
                f"layout {layout.id!r} names no protocol; pass one with the argument or option 'protocol'"
            )
        protocol = protocol or resolve_protocol(layout.protocol)
        return Task(layout, protocol, _chosen_pair(rng, layout, protocol, options.get("pair")))

    def _drawn_layout(self, rng: np.random.Generator, protocol: Protocol | None, fresh: bool) -> Layout:
        if self._split in PUBLISHED:
            candidates = _with_drives(self._split, None if protocol is None else protocol.id)
            return load(self._split, candidates[int(rng.integers(len(candidates)))])
        last = self._generated
        if fresh or last is None or self._episodes_left == 0 or (protocol and protocol.id != last.protocol):
            last = self._generated = train_layout(rng, protocol, self._profile)
            self._episodes_left = self._episodes_per_layout
        self._episodes_left -= 1
        return last


def resolve_protocol(given: Protocol | str | None) -> Protocol:
    """Return the protocol that is meant: itself, or the one of that id.

    Raises:
        UnknownNameError: there is no protocol of that id, or none is given.
    """
    return given if isinstance(given, Protocol) else protocols.get(str(given))


def resolve_layout(given: Layout | str | Path) -> Layout:
    """Return the layout that is meant: itself, the one in a `.json` file, or the published one of that id.

    Raises:
        UnknownNameError: no published layout has that id.
        DocumentError: the file cannot be read as a layout, or the layout names what does not exist.
        OptionError: it is something else.
    """
    if isinstance(given, Layout):
        given.check_references()
        return given
    if isinstance(given, Path) or (isinstance(given, str) and given.endswith(".json")):
        return Layout.load(given)
    if not isinstance(given, str):
        raise OptionError(f"layout is a {type(given).__name__}, expected a Layout, a path to one, or a published id")
    for split in PUBLISHED:
        if given in published(split):
            return load(split, given)
    raise UnknownNameError("layout", given, (name for split in PUBLISHED for name in published(split)))


def _chosen_pair(rng: np.random.Generator, layout: Layout, protocol: Protocol, index: object) -> GoalPair:
    """Return the goal pair of an index, one drawn where it is None."""
    pairs = goal_pairs(layout, protocol)
    if not pairs:
        raise OptionError(
            f"protocol {protocol.id!r} asks for no drive in layout {layout.id!r}; choose another protocol"
        )
    if index is None:
        return pairs[int(rng.integers(len(pairs)))]
    if isinstance(index, bool) or not isinstance(index, int | np.integer) or not 0 <= index < len(pairs):
        raise UnknownNameError(f"goal pair of layout {layout.id!r}", index, (str(pair.index) for pair in pairs))
    return pairs[int(index)]


@lru_cache(maxsize=256)
def load(split: str, name: str) -> Layout:
    """Return a published layout, read once in a process."""
    return load_published(split, name)


@lru_cache(maxsize=64)
def _with_drives(split: str, protocol: str | None) -> tuple[str, ...]:
    """Return the ids of a split's layouts that have a goal pair, of one protocol or of any.

    Raises:
        UnknownNameError: the split has no layout of that protocol with a drive.
    """
    layouts = [load(split, name) for name in published(split)]
    found = tuple(
        layout.id
        for layout in layouts
        if protocol in (None, layout.protocol) and layout.protocol and goal_pairs(layout)
    )
    if not found:
        drivable = {layout.protocol for layout in layouts if layout.protocol and goal_pairs(layout)}
        raise UnknownNameError(f"protocol with a layout to drive in of split {split!r}", protocol or "any", drivable)
    return found
