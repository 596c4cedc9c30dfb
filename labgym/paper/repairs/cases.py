"""The cases of the damage benchmark: a generated laboratory, a kind of damage, and the number of damaged pieces."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from labgym.errors import InfeasibleError, LabgymError
from labgym.layouts import Layout, generate
from labgym.layouts.rules.rule_sets import PAPER
from labgym.paper.damage import KINDS, MAX_PIECES, Damage, damaged
from labgym.protocols import protocols

PLACES = ("room", "bay", "ell", "double", "suite", "refit")
"""Where the laboratories are: the default room, and floors of each family."""
CLUTTER = (0, 0, 1, 2)
"""Levels of clutter, equally likely."""
PIECES = tuple(range(1, MAX_PIECES + 1))
"""Numbers of damaged pieces."""
DRAWS = 6
"""Default number of cases of each kind and number of pieces: 10 kinds x 5 numbers x 6 = 300 cases."""
SEED_RANGE = 10**8
"""Seeds of laboratories lie below: they are development seeds."""
ATTEMPTS = 8
"""Laboratories that are drawn until one can be damaged in the way of a case."""


@dataclass(frozen=True)
class RepairCase:
    """A case: kind of damage, number of damaged pieces, and number of the draw."""

    kind: str
    pieces: int
    draw: int


@dataclass(frozen=True)
class Patient:
    """A laboratory before and after the damage.

    Attributes:
        place: room, or the family of the floor. protocol: id of its protocol. seed: of the laboratory.
    """

    place: str
    protocol: str
    seed: int
    sound: Layout
    damage: Damage


def cases(draws: int = DRAWS, pieces: Sequence[int] = PIECES) -> Iterator[RepairCase]:
    """Yield the cases of the benchmark, kind by kind."""
    for kind in KINDS:
        for count in pieces:
            for draw in range(draws):
                yield RepairCase(kind, count, draw)


def patient(case: RepairCase, seed: int) -> Patient:
    """Return the damaged laboratory of a case.

    Args:
        seed: random seed of the benchmark; each case draws from a separate stream.

    Raises:
        LabgymError: none of the laboratories that were drawn can be damaged in that way.
    """
    kinds, names = list(KINDS), sorted(protocols())
    for attempt in range(ATTEMPTS):
        generator = np.random.default_rng([seed, kinds.index(case.kind), case.pieces, case.draw, attempt])
        place = PLACES[int(generator.integers(len(PLACES)))]
        name = names[int(generator.integers(len(names)))]
        level = CLUTTER[int(generator.integers(len(CLUTTER)))]
        number = int(generator.integers(SEED_RANGE))
        try:
            sound = generate(name, number, family=None if place == "room" else place, clutter=level, rules=PAPER)
            return Patient(place, name, number, sound, damaged(sound, case.kind, case.pieces, generator))
        except InfeasibleError:
            continue
        except LabgymError as error:
            reason = error
    raise LabgymError(f"no laboratory for {case.pieces} pieces of damage {case.kind!r}: {reason}")
