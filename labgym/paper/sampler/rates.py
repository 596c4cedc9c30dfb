"""The kinds of errors that the sampler makes, and how often it makes each."""

from __future__ import annotations

from functools import lru_cache
from typing import Annotated, ClassVar

from pydantic import Field

from labgym.artefacts import artefacts
from labgym.documents import Document, Record

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
