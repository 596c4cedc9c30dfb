"""The training layouts of one environment: which one an episode has, and those that stay in memory."""

from __future__ import annotations

import pickle
import zlib
from dataclasses import dataclass, field

import numpy as np

from labgym.envs.pool import AHEAD, LayoutPool, PoolAddress, check_sendable
from labgym.envs.residents import RESIDENT_MB, check_budget
from labgym.envs.stage import LayoutSenses
from labgym.envs.training import LayoutSource, source_of
from labgym.envs.world import keep, layout_of
from labgym.errors import OptionError
from labgym.layouts import Layout
from labgym.layouts.rules.thresholds import profile as resolve_profile
from labgym.protocols import Protocol

NUMBERS = 10**7
"""Number of layouts of a source."""
RESIDENT_LAYOUTS = 32
"""Number of training layouts that an environment returns to."""
TURN_EPISODES = 8
"""Largest number of successive episodes in one layout."""


@dataclass
class LayoutSequence:
    """The numbers of the layouts of one environment, turn by turn.

    A turn is up to 8 successive episodes in one layout. The layouts of the first 32 turns are new and become resident.
    Every later turn draws one of the 32 at random; if it has served `lifetime` episodes, a new layout takes its place.
    So the layout of an episode depends on `entropy`, `lifetime` and the number of episodes before alone.

    Attributes:
        source: makes the layouts; with another one, no layout is resident any more.
        entropy: drawn from the environment's generator.
        lifetime: number of episodes that a layout serves.
        place: number of new layouts so far.
        turns: number of turns so far.
        resident: number and remaining episodes of each resident layout.
        left: remaining episodes of this turn.
    """

    source: LayoutSource
    entropy: int
    lifetime: int
    place: int = 0
    turns: int = 0
    resident: list[tuple[int, int]] = field(default_factory=list)
    left: int = 0

    def numbers(self, count: int) -> list[int]:
        """Return the numbers of the next new layouts."""
        return [
            int(np.random.default_rng([self.entropy, place]).integers(NUMBERS))
            for place in range(self.place, self.place + count)
        ]

    def turn(self, source: LayoutSource) -> int:
        """Begin a turn and return the number of its layout."""
        if source != self.source:
            self.source, self.resident = source, []
        slot = len(self.resident)
        if slot < RESIDENT_LAYOUTS:
            self.resident.append((0, 0))
        else:
            slot = int(np.random.default_rng([self.entropy, self.turns, 1]).integers(RESIDENT_LAYOUTS))
        number, remaining = self.resident[slot]
        if remaining == 0:
            (number,), remaining = self.numbers(1), self.lifetime
            self.place += 1
        self.left = min(TURN_EPISODES, remaining)
        self.resident[slot] = number, remaining - self.left
        self.turns += 1
        return number


class TrainingLayouts:
    """Draws the training layouts of one environment, and keeps those of its sequence that it returns to.

    Up to 32 layouts are resident, as compressed documents of about 10 kB. Their prepared worlds stay in memory within
    `resident_mb` of the process. A layout that is not resident is generated, or taken from the pool.

    Args:
        training: "rooms", or a function that returns layout `number`.
        profile: thresholds that generated layouts satisfy.
        episodes_per_layout: number of episodes that a layout serves.
        pool: prepares the layouts in advance; None generates them when they are drawn.
        senses: what the pool prepares for the environment.
        resident_mb: budget of this process for prepared layouts, megabytes.

    Raises:
        UnknownNameError: a source of training layouts or a profile does not exist.
        OptionError: a value is out of range or of the wrong type, or `training` cannot be sent to the processes of the
            pool.
    """

    def __init__(
        self,
        training: str | LayoutSource,
        *,
        protocol: Protocol | None = None,
        profile: str = "default",
        episodes_per_layout: int = 64,
        pool: LayoutPool | PoolAddress | None = None,
        senses: LayoutSenses | None = None,
        resident_mb: float = RESIDENT_MB,
    ) -> None:
        check_budget(resident_mb)
        if episodes_per_layout < 1:
            raise OptionError(f"episodes_per_layout is {episodes_per_layout}, expected at least 1")
        resolve_profile(profile)
        source = source_of(training, protocol, profile)
        self._training, self._profile, self._lifetime = training, profile, episodes_per_layout
        self._senses = LayoutSenses() if senses is None else senses
        self._resident_mb = resident_mb
        self._client = None if pool is None else pool.connect()
        if self._client is not None:
            check_sendable(source)
        self._sequence: LayoutSequence | None = None
        self._layout: Layout | None = None
        self._documents: dict[int, bytes] = {}

    def draw(self, rng: np.random.Generator, protocol: Protocol | None, fresh: bool) -> Layout:
        """Return the layout of the next episode.

        Args:
            rng: random generator from which the sequence is drawn. fresh: begin a new sequence.
            protocol: the protocol that the layout is generated for; None to draw one.
        """
        layout, sequence = self._layout, self._sequence
        other = layout is not None and protocol and protocol != layout.protocol
        if fresh or layout is None or sequence is None or sequence.left == 0 or other:
            source = source_of(self._training, protocol, self._profile)
            if sequence is None or sequence.source != source:
                self._documents.clear()
            if fresh or sequence is None:
                sequence = self._sequence = LayoutSequence(source, int(rng.integers(2**63)), self._lifetime)
            layout = self._layout = self._of_turn(sequence, source)
        sequence.left -= 1
        return layout

    def close(self) -> None:
        """Disconnect from the pool; the next draw connects again."""
        if self._client is not None:
            self._client.close()

    def _of_turn(self, sequence: LayoutSequence, source: LayoutSource) -> Layout:
        """Return the layout of the next turn of a sequence: a resident one, from the pool, or a new one."""
        number = sequence.turn(source)
        document = self._documents.pop(number, None)
        if document is not None:
            layout: Layout = pickle.loads(zlib.decompress(document))  # noqa: S301 -- packed below
        else:
            ahead = [number, *sequence.numbers(AHEAD)]
            stage = None if self._client is None else self._client.take(source, ahead, self._senses)
            layout = source(number) if stage is None else layout_of(stage)
        if self._lifetime > TURN_EPISODES:  # Otherwise no turn returns to a layout.
            self._documents[number] = document or zlib.compress(pickle.dumps(layout), 1)
            if len(self._documents) > RESIDENT_LAYOUTS:
                resident = {known for known, remaining in sequence.resident if remaining}
                del self._documents[next(known for known in self._documents if known not in resident)]
            keep(layout, self._resident_mb)
        return layout
