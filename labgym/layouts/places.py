"""The splits of floors as endless, seeded sequences of furnished laboratories.

The place `index` of a split decides everything about its layout: family and ranges of the floor, seed, protocols and
level of clutter. The seeds of the splits are disjoint, also from those of the published rooms. `floors-train` is this
sequence; the published splits are its first places, as files that stay when the generator changes.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from types import MappingProxyType

import numpy as np

from labgym.artefacts import artefacts
from labgym.counts import whole_number
from labgym.documents import read_json
from labgym.errors import InfeasibleError, OptionError, check_name
from labgym.layouts.clutter import add_clutter
from labgym.layouts.floors import SPLITS, FloorDraw, Population, population_of
from labgym.layouts.generate import generate_assessed, resolve_request
from labgym.layouts.model import Layout
from labgym.layouts.request import combination
from labgym.layouts.rules.objective import evaluate_layout
from labgym.layouts.rules.rule_sets import PAPER
from labgym.layouts.style import Style
from labgym.protocols import Protocol

FIRST_SEEDS = {
    "floors-train": 3 * 10**9,
    "floors-seen": 4 * 10**9,
    "floors-test": 5 * 10**9,
    "floors-val": 6 * 10**9,
}
"""First seed of each split; a split has the next `SPLIT_SEEDS`. Seeds below 10^9 are for development; those of
`floors-sealed` and `floors-fresh` follow from a secret (`labgym.layouts.sealed`)."""
SPLIT_SEEDS = 10**9
"""Number of seeds of a split."""
FIRST_SEALED_SEED = 10**10
"""Least seed of the sealed split."""
DEVELOPMENT_SEEDS = 10**9
"""Seeds below this are for development."""
PLACES = 10**7
"""Number of places of a split, and the difference between the seeds of one place's attempts."""
LAST_DEVELOPMENT_SEED = DEVELOPMENT_SEEDS - 40 * PLACES
"""Greatest first seed for development: all attempts of all places stay below the seeds of the splits."""
ATTEMPTS = 32
"""Number of seeds that a place has: the next one is taken if a floor does not hold its protocols."""
AREA = 50.0
"""Floor area for each protocol beyond the first, square meters (assumption: half of a large laboratory)."""
MOST = 5
"""Most protocols of one floor."""
TRAINING, TESTING = (1.0, 1.0, 3.0, 5.0), (0.0, 1.0, 6.0, 13.0)
CLUTTER = {name: TRAINING if name == "floors-train" else TESTING for name in SPLITS}
"""Shares of the levels of clutter 0 to 3. Training shows all; the others are floors in use, where loose things narrow
the ways: a way of 0.90 m, which the rules ask for without them, is not hard to drive (assumption)."""
DENSITY = 1.5
"""Loose objects of a floor as a multiple of those of `labgym generate --clutter` at the same level: 1.5 per 10 square
meters on busy floors and 3 on crowded ones (assumption: floors in daily use)."""
MADE_UNDER = PAPER
"""Rule set that the generator satisfies in rooms of the splits. Another would change training layouts."""
FLOORS_MADE_UNDER = replace(PAPER, paths="exact")
"""Rule set that the generator satisfies in floors of the splits, which are then checked under the default one."""
CONTENT, STYLE, SCATTER = range(3)
"""Sub-streams of a seed: protocols and clutter level; style; positions of the clutter."""


@lru_cache(maxsize=1)
def published_protocols() -> MappingProxyType[str, Protocol]:
    """Return the library's protocols by id as they were when the rooms were published; read once per process.

    The rooms of `test` embed one each. A correction of the library changes no split.

    Raises:
        DocumentError: a room's file or its protocol is broken.
    """
    files = sorted((artefacts("layouts") / "test").glob("test-*.json"))
    embedded = [(file, read_json(file)["protocols"][0]) for file in files]
    return MappingProxyType({data["id"]: Protocol.parse(data, file) for file, data in embedded})


@dataclass(frozen=True)
class SplitPlace:
    """The arguments of one layout of a split.

    Attributes:
        split, index: the split, and the number of the place in it.
        seed: seed of the floor, the furniture and the clutter.
        population: family of the floor, and its ranges.
        floor: the floor before it is furnished.
        protocols: ids of one to five protocols, more on larger floors; as published with the layouts
            (`published_protocols`), so that a correction of the library changes no split.
        clutter: level of clutter, 0 to 3.
    """

    split: str
    index: int
    seed: int
    population: Population
    floor: FloorDraw
    protocols: tuple[str, ...]
    clutter: int

    @classmethod
    def of(cls, split: str, index: int, seed: int) -> SplitPlace:
        """Return the place of a split with a seed.

        Raises:
            UnknownNameError: there is no such split.
            OptionError: the index is out of range.
            InfeasibleError: the rules of the family refuse every draw.
        """
        population = population_of(split, index)
        if index >= PLACES:
            raise OptionError(f"index {index} is beyond the {PLACES} places of split {split!r}")
        generator = np.random.default_rng([seed, CONTENT])
        floor = population.draw(seed)
        most = min(MOST, 1 + int(float(floor.parameters["area"]) / AREA))
        count = int(generator.integers(max(1, most - 1), most + 1))
        moving = [name for name, protocol in published_protocols().items() if protocol.moves]
        chosen = tuple(str(name) for name in generator.choice(moving, count, replace=False))
        shares = np.array(CLUTTER[split])
        level = int(generator.choice(len(shares), p=shares / shares.sum()))
        return cls(split, index, seed, population, floor, chosen, level)

    @property
    def name(self) -> str:
        """Split and number, such as floors-test/17."""
        return f"{self.split}/{self.index}"

    @property
    def development(self) -> bool:
        """Whether the seed is one for development."""
        return self.seed < DEVELOPMENT_SEEDS

    def tidy(self) -> Layout:
        """Return the furnished layout without clutter.

        Raises:
            InfeasibleError: the floor does not hold the protocols.
        """
        chosen = [published_protocols()[name] for name in self.protocols]
        request = resolve_request(chosen, self.seed, floor=self.floor.floor, rules=FLOORS_MADE_UNDER)
        style = Style.of(self.floor.style).varied(np.random.default_rng([self.seed, STYLE]))
        layout, _ = generate_assessed(replace(request, style=style, family=self.population.family))
        options = {**layout.provenance.options, **({} if self.development else {"place": self.name})}
        provenance = layout.provenance.model_copy(update={"options": options})
        name = f"{self.split}-development-{self.seed}" if self.development else f"{self.split}-{self.index:04d}"
        return layout.replace(id=name, provenance=provenance)

    def check(self, layout: Layout) -> None:
        """Check that a layout holds all of its protocols together by the rule set `touchstone`, with drives and ways.

        Raises:
            InfeasibleError: a rule is broken; names the first violation.
        """
        protocol = combination(layout.protocols, layout.catalog)
        assessment = evaluate_layout(layout, protocol, navigation=True)
        if assessment.v:
            first = next(iter(assessment.violations.items))
            raise InfeasibleError(
                f"place {self.name} with seed {self.seed}", [first.message], None, "take another seed"
            )

    def cluttered(self, tidy: Layout) -> Layout:
        """Return the tidy layout with its clutter."""
        return add_clutter(tidy, self.clutter, np.random.default_rng([self.seed, SCATTER]), density=DENSITY)

    def layout(self) -> Layout:
        """Return the layout. Raises as `tidy`."""
        return self.cluttered(self.tidy())


def check_numbers(limits: Mapping[str, tuple[int, int, int]]) -> None:
    """Check whole numbers: the value, the least and the greatest, by name.

    Raises:
        OptionError: one is out of range.
    """
    for name, (value, least, most) in limits.items():
        whole_number(name, value, least, most)


def seed_of(split: str, index: int, first: int | None = None, attempt: int = 0) -> int:
    """Return the seed of a place of a split.

    Args:
        split: floors-train, floors-val, floors-seen or floors-test.
        index: place in the split, from 0.
        first: first seed of the sequence; None for the split's own, a seed below 10^9 for development.
        attempt: number of earlier seeds of this place that gave no layout.

    Raises:
        UnknownNameError: there is no such split, or its seeds are sealed.
    """
    check_name("split of floors", split, FIRST_SEEDS)
    return (FIRST_SEEDS[split] if first is None else first) + index + attempt * PLACES


def place_at(split: str, index: int, first: int | None = None, attempt: int = 0) -> SplitPlace:
    """Return a place of a split. Arguments as `seed_of`.

    Raises:
        UnknownNameError: there is no such split, or its seeds are sealed.
        OptionError: the index is out of range.
        InfeasibleError: the rules of the family refuse every draw.
    """
    population_of(split, index)
    return SplitPlace.of(split, index, seed_of(split, index, first, attempt))


def furnished(split: str, index: int, first: int | None = None) -> tuple[SplitPlace, Layout, Layout]:
    """Return a place of a split with its tidy layout and that with its clutter. Arguments as `seed_of`.

    They are those of the first seed whose floor holds its protocols among its clutter.

    Raises:
        UnknownNameError, OptionError: as `place_at`.
        InfeasibleError: no seed of the place gives a layout.
    """
    population_of(split, index)
    return furnished_with(split, index, (seed_of(split, index, first, attempt) for attempt in range(ATTEMPTS)))


def furnished_with(split: str, index: int, seeds: Iterable[int]) -> tuple[SplitPlace, Layout, Layout]:
    """Return what `furnished` returns, of the first of `seeds`.

    Raises:
        UnknownNameError, OptionError: as `SplitPlace.of`.
        InfeasibleError: none of them gives a layout.
    """
    last = InfeasibleError(f"place {index} of split {split!r}", ["no seed"], None)
    for seed in seeds:
        try:
            place = SplitPlace.of(split, index, seed)
            tidy = place.tidy()
            layout = place.cluttered(tidy)
            place.check(layout)
            return place, tidy, layout
        except InfeasibleError as error:
            last = error
    raise last


def layout_at(split: str, index: int, first: int | None = None) -> Layout:
    """Return the layout at a place of a split, with its clutter. Arguments and errors as `furnished`."""
    _, _, layout = furnished(split, index, first)
    return layout
