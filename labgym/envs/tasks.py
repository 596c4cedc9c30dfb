"""Tasks: the layout, protocol and goal pair of an episode, given by arguments or drawn at random."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from labgym import protocols
from labgym.counts import is_whole
from labgym.envs.endpoints import check_drivable, free_pair, pair_between, passed_ends
from labgym.envs.residents import RESIDENT_MB, check_budget
from labgym.envs.training import ROOMS, LayoutSource, training_floor
from labgym.envs.training_layouts import TrainingLayouts
from labgym.envs.world import keep, world_of
from labgym.errors import OptionError, UnknownNameError, check_name
from labgym.layouts import Layout
from labgym.layouts.splits import PUBLISHED, load_published, manifest, published
from labgym.navigation import GoalPair, goal_pairs, resolve_protocol
from labgym.protocols import Protocol
from labgym.suites import Suite, load_suite

TRAINING_SPLITS = ("train", "floors-train")
SPLITS = (*TRAINING_SPLITS, *PUBLISHED)
OPTIONS = ("layout", "protocol", "pair", "start", "goal")


@dataclass(frozen=True)
class Task:
    """The task of one episode: drive from the start to the goal of a pair in a layout.

    Attributes:
        protocol: the protocol that has this goal pair, by default the layout's first; None if the layout has no
            protocol and both ends of the drive were passed.
        pair: the drive; its index is `NO_PAIR` if both ends were passed without a pair.
        following: the drives that come after it, each from where the robot reached the goal before.
        old_map: the layout before things moved, which agents may receive; None for the layout itself.
        announced: the drive by the old map, which agents receive; None for `pair`.
        conditions: data of conditions, by name, in place of what they would draw.
        pushable: masses, in kg, of the placements that the robot can push, by id.
    """

    layout: Layout
    protocol: Protocol | None
    pair: GoalPair
    following: tuple[GoalPair, ...] = ()
    old_map: Layout | None = None
    announced: GoalPair | None = None
    conditions: Mapping[str, Any] = field(default_factory=dict)
    pushable: Mapping[str, float] = field(default_factory=dict)

    @property
    def fixed(self) -> Layout:
        """The layout without what the robot can push."""
        return self.layout.without(self.pushable)


class TaskSource:
    """Chooses the task of each episode.

    Args:
        split: a published split (`labgym.layouts.splits.PUBLISHED`), "train" for newly generated layouts, or
            "floors-train" for newly generated floors.
        layout: a fixed layout: a `Layout`, the path of one, or the id of a published one.
        protocol: a fixed protocol: a `Protocol`, its id or the path of its file.
        training: the layouts of "train": "rooms", "empty", or a function that returns layout `number`.
        resident_mb: budget of this process for prepared layouts, which stay in memory, megabytes.
        generated: as of `TrainingLayouts`.

    Raises:
        UnknownNameError: a split, protocol or layout does not exist.
        OptionError: `layout` or `training` has another type, or `resident_mb` is below 0.
        DocumentError: a file is not a layout or a protocol.
        LabgymError: as `TrainingLayouts`.
    """

    def __init__(
        self,
        split: str,
        layout: Layout | str | Path | None = None,
        protocol: Protocol | str | Path | None = None,
        *,
        training: str | LayoutSource = ROOMS,
        resident_mb: float = RESIDENT_MB,
        **generated: Any,
    ) -> None:
        check_budget(resident_mb)
        check_name("split", split, SPLITS)
        if split != "train" and training != ROOMS:
            raise OptionError(f"split {split!r} takes no training layouts: pass split='train' with training")
        self._split = split
        self._layout = None if layout is None else resolve_layout(layout)
        self._protocol = None if protocol is None else _resolved_protocol(self._layout, protocol)
        self._resident_mb = resident_mb
        self._training: TrainingLayouts | None = None
        if split in TRAINING_SPLITS and self._layout is None:
            self._training = TrainingLayouts(
                training if split == "train" else training_floor,
                protocol=self._protocol,
                resident_mb=resident_mb,
                **generated,
            )

    def draw(self, rng: np.random.Generator, options: Mapping[str, Any], fresh: bool) -> Task:
        """Return the next task.

        Args:
            rng: random generator for everything that is not fixed.
            options: any of "layout", "protocol", "pair" (an index), "start" and "goal" (poses); the first two take
                precedence over the constructor's, and the last two over the pair's.
            fresh: generate a new layout, so that the task depends on `rng` and `options` only.

        Raises:
            UnknownNameError: an option, layout, protocol or pair does not exist.
            OptionError: the layout has no protocol or no goal pair, or the robot cannot drive from start to goal.
            DocumentError: a file is not a layout or a protocol.
        """
        for name in options:
            check_name("reset option", name, OPTIONS)
        layout = self._layout if options.get("layout") is None else resolve_layout(options["layout"])
        protocol = (
            self._protocol if options.get("protocol") is None else _resolved_protocol(layout, options["protocol"])
        )
        drives, chosen = None, layout is not None
        if layout is None:
            layout = self._drawn_layout(rng, protocol, fresh)
            drives = _drawn_drives(self._split, layout, rng) if protocol is None else None
        protocol = protocol or layout.protocol
        try:
            start, goal = passed_ends(options, layout.floor)
            index = options.get("pair")
            both = start is not None and goal is not None
            drawn = None if both and index is None else _drawn_pair(rng, layout, protocol, index, drives)
            pair = pair_between(start, goal, drawn)
            if start is not None or goal is not None:
                check_drivable(world_of(layout), pair)
        except OptionError as error:
            if chosen:
                raise
            raise OptionError(f"{error}; layout {layout.id!r} was drawn, option 'layout' chooses one") from None
        return Task(layout, protocol, pair)

    def _drawn_layout(self, rng: np.random.Generator, protocol: Protocol | None, fresh: bool) -> Layout:
        if self._training is not None:
            return self._training.draw(rng, protocol, fresh)
        candidates = _with_drives(self._split, None if protocol is None else protocol.id)
        layout = load(self._split, candidates[int(rng.integers(len(candidates)))])
        keep(layout, self._resident_mb)
        return layout

    def close(self) -> None:
        """Disconnect from the pool; the next draw connects again."""
        if self._training is not None:
            self._training.close()


def resolve_layout(layout: Layout | str | Path, protocol: Protocol | str | Path | None = None) -> Layout:
    """Return the layout that an argument names: itself, the one in a `.json` file, or the published one of that id.

    Args:
        layout: a `Layout`, a path or an id.
        protocol: a protocol, its id or its `.json` file, which becomes the layout's first; None changes nothing.

    Raises:
        UnknownNameError: no published layout, or no protocol, has that id.
        DocumentError: the file is not a layout, or the layout names an asset or a support that does not exist.
        OptionError: the argument is something else.
    """
    layout = _resolved(layout)
    return layout if protocol is None else layout.for_protocol(resolve_protocol(layout, protocol))


def resolve_layouts(
    names: Iterable[Layout | str | Path], protocol: Protocol | str | Path | None = None
) -> list[Layout]:
    """Return the layouts that arguments name: as `resolve_layout`, and all layouts of a folder.

    Raises:
        UnknownNameError, DocumentError: as `resolve_layout`.
        OptionError: as `resolve_layout`, or a folder has no layout or an unfinished batch.
    """
    return list(each_layout(names, protocol))


def each_layout(
    names: Iterable[Layout | str | Path], protocol: Protocol | str | Path | None = None
) -> Iterator[Layout]:
    """Yield what `resolve_layouts` returns, one layout at a time."""
    from labgym.layouts.batch import folder_layouts

    for name in names:
        is_folder = isinstance(name, str | Path) and Path(name).is_dir()
        members = folder_layouts(str(name)) if is_folder else (name,)
        yield from (resolve_layout(member, protocol) for member in members)


def _resolved_protocol(layout: Layout | None, protocol: Protocol | str | Path) -> Protocol:
    return protocols.resolve(protocol) if layout is None else resolve_protocol(layout, protocol)


def _resolved(layout: object) -> Layout:
    if isinstance(layout, Layout):
        layout.check_references()
        return layout
    if isinstance(layout, Path) or (isinstance(layout, str) and layout.endswith(".json")):
        return Layout.load(layout)
    if not isinstance(layout, str):
        raise OptionError(f"layout is a {type(layout).__name__}, expected a Layout, a path or a published id")
    for split in PUBLISHED:
        if layout in published(split):
            return load(split, layout)
    raise UnknownNameError(
        "layout (a .json file or a published id)", layout, (name for split in PUBLISHED for name in published(split))
    )


def _drawn_pair(
    rng: np.random.Generator,
    layout: Layout,
    protocol: Protocol | None,
    index: int | None,
    drives: Sequence[GoalPair] | None,
) -> GoalPair:
    """Return a drive of the split, or a goal pair of a protocol: that of an index, or a random one."""
    if drives is None:
        if protocol is None:
            raise OptionError(f"layout {layout.id!r} has no protocol: pass one with the argument or option 'protocol'")
        drives = _goal_pairs(layout, protocol)
    if index is None:
        index = int(rng.integers(len(drives)))
    return _numbered(layout, drives, index)


def _drawn_drives(split: str, layout: Layout, rng: np.random.Generator) -> Sequence[GoalPair] | None:
    """Return the drives of a published split of floors, a free one in an empty room, or None: those of the protocol."""
    if not layout.placements and not layout.protocols:
        return (free_pair(rng, world_of(layout)),)
    if split not in PUBLISHED:
        return None
    suite = _suite(split)
    return None if suite.drives is None else suite.pairs(layout)


@lru_cache(maxsize=8)
def _suite(split: str) -> Suite:
    """Return the suite of a published split."""
    return load_suite(split)


def goal_pair(layout: Layout, index: int, protocol: Protocol | None = None) -> GoalPair:
    """Return one of the goal pairs of a layout, for its first protocol by default.

    Raises:
        OptionError: the layout has no goal pair, or the index is no integer.
        UnknownNameError: no goal pair has that index.
    """
    return _numbered(layout, _goal_pairs(layout, protocol), index)


def _numbered(layout: Layout, pairs: Sequence[GoalPair], index: int) -> GoalPair:
    if not is_whole(index):
        raise OptionError(f"goal pair {index!r} is a {type(index).__name__}, expected an int below {len(pairs)}")
    if not 0 <= index < len(pairs):
        raise UnknownNameError(f"goal pair of layout {layout.id!r}", index, (str(pair.index) for pair in pairs))
    return pairs[int(index)]


def _goal_pairs(layout: Layout, protocol: Protocol | None) -> tuple[GoalPair, ...]:
    pairs = goal_pairs(layout, protocol)
    if not pairs:
        name = layout.protocol_id if protocol is None else protocol.id
        raise OptionError(
            f"layout {layout.id!r} has no goal pairs: protocol {name!r} stays at one place; choose another protocol"
        )
    return pairs


@lru_cache(maxsize=256)
def load(split: str, name: str) -> Layout:
    """Return a published layout; each file is read once per process."""
    return load_published(split, name)


@lru_cache(maxsize=64)
def _with_drives(split: str, protocol: str | None) -> tuple[str, ...]:
    """Return the ids of a split's layouts that have a goal pair, for one protocol id or for all.

    Raises:
        UnknownNameError: the split has no layout with a goal pair for that protocol.
    """
    drives = _suite(split).drives
    if drives is not None:
        floors = [entry for entry in manifest(split).layouts if drives[entry.id]]
        ids = tuple(entry.id for entry in floors if protocol is None or protocol in (entry.protocols or ()))
        if not ids:
            names = {name for entry in floors for name in entry.protocols or ()}
            raise UnknownNameError(f"protocol in split {split!r}", protocol or "any", names)
        return ids
    layouts = [layout for layout in (load(split, name) for name in published(split)) if goal_pairs(layout)]
    ids = tuple(layout.id for layout in layouts if protocol in (None, layout.protocol_id))
    if not ids:
        drivable = {str(layout.protocol_id) for layout in layouts}
        raise UnknownNameError(f"protocol with goal pairs in split {split!r}", protocol or "any", drivable)
    return ids
