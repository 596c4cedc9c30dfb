"""The kinds of errors that the sampler makes, how often it makes each, and the draws that decide."""

from __future__ import annotations

import hashlib
from collections import Counter
from functools import lru_cache
from typing import Annotated, ClassVar
from zlib import crc32

import numpy as np
from pydantic import Field

from labgym.artefacts import artefacts
from labgym.documents import Document, Record
from labgym.layouts.request import Request

Rate = Annotated[float, Field(ge=0.0, le=1.0)]


class Rates(Record):
    """Probability of each kind of error, independently for each piece, item or reagent that can suffer it.

    The laboratory as a whole:

    Attributes:
        thing_forgotten: a required reagent, instrument or floor instrument is left out. Long lists lose entries.
        place_forgotten: a location that a step visits is left out; its instruments stand elsewhere.
        safety_forgotten: shower, eyewash or waste station is left out. No step uses them.
        space_confused: furniture stands in a space of another use, as if the floor were one room.

        position_rounded: the position along a wall is a multiple of 0.25 m. Models write round numbers.
        width_misjudged: a piece counts as 15 to 45% narrower than it is, so that the next one overlaps it.
        neighbors_overlooked: earlier pieces are ignored: in corners and between rows, pieces overlap.
        fixed_overlooked: a fixed piece or a column is not noticed, and furniture may stand in it.
        depth_misjudged: a piece counts as 15 to 45% shallower than it is, so that its back sticks through the wall.
        door_overlooked: furniture may stand in the area inside a door.
        clearance_forgotten: the depth in front of a piece is not kept free, neither its own nor that of others.
        opposite: a piece stands in the open, facing another one so closely that nobody can work there. "Opposite the
            hood" is taken literally.
        turned: a piece faces its wall, or along it. Models confuse the signs and axes of rotations.
        distance_forgotten: a cabinet or a source of heat is placed without regard to the distance that hazards require.

        classes_mixed: the reagents of a cabinet share the first one instead, as if one chemical store were enough.
        reagent_left_out: a reagent stands where a step first uses it, not in a cabinet.
        cabinet_confused: a reagent stands in a cabinet of another storage class.
        item_misjudged: an item counts as 30 to 60% smaller than it is, so that the next one overlaps it.
        over_edge: an item stands with its middle near the front edge of its surface, and hangs over. Models confuse the
            middle and the corner of a box.
        height_misjudged: the height of an item's bottom is that of its middle, so that it hovers by half its height.
        glass_at_edge: glassware stands near the front edge, within easy reach.
    """

    thing_forgotten: Rate = 0.0
    place_forgotten: Rate = 0.0
    safety_forgotten: Rate = 0.0
    space_confused: Rate = 0.0
    position_rounded: Rate = 0.0
    width_misjudged: Rate = 0.0
    neighbors_overlooked: Rate = 0.0
    fixed_overlooked: Rate = 0.0
    depth_misjudged: Rate = 0.0
    door_overlooked: Rate = 0.0
    clearance_forgotten: Rate = 0.0
    opposite: Rate = 0.0
    turned: Rate = 0.0
    distance_forgotten: Rate = 0.0
    classes_mixed: Rate = 0.0
    reagent_left_out: Rate = 0.0
    cabinet_confused: Rate = 0.0
    item_misjudged: Rate = 0.0
    over_edge: Rate = 0.0
    height_misjudged: Rate = 0.0
    glass_at_edge: Rate = 0.0

    @classmethod
    def calibrated(cls) -> Rates:
        """Return the calibrated rates.

        Raises:
            DocumentError: the file is missing or invalid.
        """
        return calibration().rates

    def scaled(self, factors: dict[str, float]) -> Rates:
        """Return the rates with the groups of `GROUPS` multiplied by factors, at most 1 each."""
        changed = {
            name: round(min(1.0, getattr(self, name) * factors[group]), 6)
            for group, names in GROUPS.items()
            for name in names
            if group in factors
        }
        return self.model_copy(update=changed)


GROUPS: dict[str, tuple[str, ...]] = {
    "bounds": ("depth_misjudged", "over_edge", "height_misjudged"),
    "collisions": ("position_rounded", "width_misjudged", "neighbors_overlooked", "item_misjudged"),
    "navigation": ("clearance_forgotten", "opposite", "turned"),
}
"""The rates that the calibration multiplies, by one factor a group; all others are assumptions."""


class Figure(Record):
    """A figure of the calibration.

    Attributes:
        name: `ob` and `cn` (mean number a layout), `step_nav` (share of transitions with a path), and others.
        paper: as the paper prints it; None if it does not. fitted: whether the rates were fitted to it.
        reached: mean over the layouts of the calibration. low, high: 95% interval of this mean over seeds.
        deviation: standard deviation between layouts; None for pooled shares.
    """

    name: str
    paper: float | None
    fitted: bool
    reached: float
    low: float
    high: float
    deviation: float | None = None


class SamplerFile(Document):
    """The sampler's rates, and the calibration that they come from.

    Attributes:
        date: day of the figures.
        command: repeats the calibration and compares the result with this file.
        fits: what was fitted, and to what. leaves: what was not.
        layouts: number of layouts of the calibration.
        assumed: the rates before the calibration, of which it multiplied those of `GROUPS`.
        factors: by which each group was multiplied.
        rates: the result, which the proposer uses.
        figures: reached with these rates.
    """

    SCHEMA: ClassVar[str] = "labgym.sampler/1"

    date: str
    command: str
    fits: str
    leaves: str
    layouts: int
    assumed: Rates
    factors: dict[str, float]
    rates: Rates
    figures: tuple[Figure, ...]


@lru_cache
def calibration() -> SamplerFile:
    """Return the published calibration, read once.

    Raises:
        DocumentError: the file is missing or invalid.
    """
    return SamplerFile.load(artefacts("assets") / "layouts" / "sampler.json")


STREAM = 0x5A
"""Sub-stream of the seed from which the sampler draws."""


class Slips:
    """The errors of one proposal.

    Every decision has a separate random number, drawn from the seed, the protocols, the kind of error and what it
    concerns. A higher rate therefore keeps the errors of a lower one and adds others, and the rates of two kinds do not
    influence each other's draws.

    Attributes:
        counts: number of errors made so far by kind.
    """

    def __init__(self, request: Request, rates: Rates) -> None:
        digest = hashlib.sha256(request.protocol.id.encode()).digest()[:8]
        self.rates = rates
        self.counts: Counter[str] = Counter()
        self._entropy = [request.seed, STREAM, int.from_bytes(digest, "big")]

    def generator(self, kind: str, subject: str, draw: int = 0) -> np.random.Generator:
        """Return the random numbers of one decision."""
        return np.random.default_rng([*self._entropy, crc32(kind.encode()), crc32(subject.encode()), draw])

    def happens(self, kind: str, subject: str) -> bool:
        """Decide whether an error is made, and count it if so.

        Args:
            kind: field of `Rates`.
            subject: what the error would concern: the id of a piece, the name of a reagent.
        """
        rate: float = getattr(self.rates, kind)
        happens = float(self.generator(kind, subject).random()) < rate
        self.counts[kind] += happens
        return happens

    def between(self, kind: str, subject: str, limits: tuple[float, float]) -> float:
        """Return the size of an error, between two limits."""
        return float(self.generator(kind, subject, 1).uniform(*limits))

    def choice(self, kind: str, subject: str, count: int) -> int:
        """Return which of several an error takes, 0 to count - 1."""
        return int(self.generator(kind, subject, 2).integers(count))


def errors_of(slips: Slips) -> dict[str, int]:
    """Return the number of errors by kind, for the kinds that occurred."""
    return {kind: count for kind, count in sorted(slips.counts.items()) if count}
