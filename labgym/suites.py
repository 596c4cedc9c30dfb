"""Suites: sets of layouts with the rules of their episodes."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, ClassVar, Literal, Self

from pydantic import Field, model_validator

from labgym.artefacts import artefacts
from labgym.counts import whole_number
from labgym.documents import Document, Record, canonical_hash
from labgym.errors import OptionError, UnknownNameError
from labgym.layouts import Layout, load_published, published
from labgym.layouts.splits import PublishedSplit
from labgym.navigation import GoalPair, goal_pairs
from labgym.navigation.goals import ANYWHERE

ALIASES = {"lab30": "test"}
"""Other names of suites: lab30 is the suite of the 30 published test layouts."""

MAX_REPEATS = 1000
Name = Annotated[str, Field(pattern=r"^[a-z0-9][a-z0-9_-]{0,63}$")]


class Arrival(Record):
    """An episode ends when the robot is within `distance` meters of its goal and slower than `speed` m/s."""

    distance: Annotated[float, Field(gt=0.0, le=5.0)]
    speed: Annotated[float, Field(gt=0.0, le=5.0)]


class Stuck(Record):
    """An episode ends when the robot has moved less than `distance` meters over the last `steps` control steps."""

    steps: Annotated[int, Field(ge=2, le=10_000)]
    distance: Annotated[float, Field(gt=0.0, le=5.0)]


class Jitter(Record):
    """Random displacement of the start of every episode, so that one chaotic episode does not decide a table.

    Attributes:
        distance: radius of the disc around the pair's start in which positions are drawn, meters.
        angle: largest deviation of the heading in both directions, degrees.
        seed: random seed of the starts; they do not depend on the seed of the evaluation.
    """

    distance: Annotated[float, Field(ge=0.0, le=1.0)] = 0.02
    angle: Annotated[float, Field(ge=0.0, le=180.0)] = 2.0
    seed: Annotated[int, Field(ge=0, le=2**53)] = 0


Coordinate = Annotated[float, Field(ge=-1000.0, le=1000.0)]


class SuiteDrive(Record):
    """A drive of a layout.

    Attributes:
        start, goal: poses (x, y, yaw) in the room frame, meters and radians.
        start_location, goal_location: names of the two places.
    """

    start: tuple[Coordinate, Coordinate, Coordinate]
    goal: tuple[Coordinate, Coordinate, Coordinate]
    start_location: Annotated[str, Field(max_length=100)] = ANYWHERE
    goal_location: Annotated[str, Field(max_length=100)] = ANYWHERE

    @classmethod
    def of(cls, pair: GoalPair) -> Self:
        """Return the drive of a pair."""
        return cls(
            start=pair.start, goal=pair.goal, start_location=pair.start_location, goal_location=pair.goal_location
        )


Drives = Annotated[tuple[SuiteDrive, ...], Field(max_length=1000)]


class Suite(Document):
    """An evaluation suite: every drive of every layout, in order, each `repeats` times.

    Attributes:
        name, version: reports print both; the version rises with every change that changes results.
        description: one sentence.
        split: the published split of the layouts; None for layouts passed by hand.
        layouts: ids of layouts of the split; None includes all of them.
        drives: the drives of each layout, by its id; None for the goal pairs of its first protocol.
        max_steps: control steps after which an episode is truncated.
        success_distance: an episode succeeds when the robot's center comes within this distance of the goal, meters;
            with `arrival`, when it is within this distance at the end.
        control_dt: duration of a control step, seconds.
        repeats: number of episodes per drive.
        jitter: displacement of every episode's start; None starts every episode at the drive's start.
        arrival, stuck: further rules that end an episode; None if only success ends it.
        metrics: "touchstone", or "navdp" for the metrics of the NavDP benchmark. Suites with `arrival`, `stuck` or
            another control step must use "navdp", whose metrics have separate names, so that tables never mix both.
    """

    SCHEMA: ClassVar[str] = "labgym.suite/1"

    name: Name
    version: Annotated[int, Field(ge=1)] = 1
    description: Annotated[str, Field(max_length=500)] = ""
    split: PublishedSplit | None = None
    layouts: Annotated[tuple[str, ...], Field(max_length=10_000)] | None = None
    drives: Annotated[dict[str, Drives], Field(max_length=10_000)] | None = None
    max_steps: Annotated[int, Field(ge=1, le=100_000)] = 600
    success_distance: Annotated[float, Field(gt=0.0, le=5.0)] = 0.5
    control_dt: Annotated[float, Field(ge=0.025, le=1.0)] = 0.1
    repeats: Annotated[int, Field(ge=1, le=MAX_REPEATS)] = 1
    jitter: Jitter | None = None
    arrival: Arrival | None = None
    stuck: Stuck | None = None
    metrics: Literal["touchstone", "navdp"] = "touchstone"

    @model_validator(mode="after")
    def _check_rules(self) -> Self:
        if self.metrics == "touchstone" and (self.arrival or self.stuck or self.control_dt != 0.1):
            raise ValueError("metrics touchstone excludes arrival and stuck and requires control_dt 0.1")
        if self.metrics == "navdp" and not self.arrival:
            raise ValueError("metrics navdp requires arrival")
        if self.drives is not None and set(self.drives) != set(self.layouts or ()):
            raise ValueError("drives must name exactly the suite's layouts")
        return self

    @property
    def label(self) -> str:
        """Name and version, as rows have them."""
        return f"{self.name}/{self.version}"

    @property
    def title(self) -> str:
        """Name and version, as tables print them: "lab30 (test/3)" for the suite of the published test layouts."""
        other = next((other for other, name in ALIASES.items() if name == self.name == self.split), None)
        return self.label if other is None else f"{other} ({self.label})"

    def repeated(self, repeats: int | None = None, jitter: Jitter | None = None) -> Suite:
        """Return the suite with other repeats, another jitter or both, and a name that says so.

        Raises:
            OptionError: `repeats` is not between 1 and 1000.
        """
        repeats = self.repeats if repeats is None else repeats
        jitter = self.jitter if jitter is None else jitter
        if (repeats, jitter) == (self.repeats, self.jitter):
            return self
        whole_number("repeats", repeats, most=MAX_REPEATS)
        name = f"{self.name[:40]}-{repeats}x" + ("" if jitter is None else f"-{canonical_hash(dict(jitter))[:6]}")
        return self.model_copy(update={"name": name, "repeats": repeats, "jitter": jitter})

    def first(self, layouts: Sequence[Layout], count: int = 1) -> Suite:
        """Return the suite with the first drives of each layout only, and a name that says so.

        Args:
            layouts: the suite's layouts. count: number of drives.

        Raises:
            OptionError: `count` is not a positive whole number.
            LabgymError: as `pairs`.
        """
        whole_number("count", count)
        drives = {layout.id: tuple(map(SuiteDrive.of, self.pairs(layout)[:count])) for layout in layouts}
        name = f"{self.name[:40]}-first" + ("" if count == 1 else str(count))
        return self.model_copy(update={"name": name, "layouts": tuple(drives), "drives": drives})

    def pairs(self, layout: Layout) -> tuple[GoalPair, ...]:
        """Return the drives of a layout, numbered from 0.

        Raises:
            LabgymError: the suite takes the goal pairs of the layout's protocol, and it has none or does not place one
                of its locations.
        """
        if self.drives is None:
            return goal_pairs(layout)
        drives = self.drives[layout.id]
        return tuple(
            GoalPair(index, one.start, one.goal, one.start_location, one.goal_location)
            for index, one in enumerate(drives)
        )

    def check_layouts(self, layouts: Sequence[Layout]) -> None:
        """Check that layouts passed by hand are the suite's, in its order.

        Raises:
            OptionError: the suite has a published split, or other layouts.
        """
        if self.split is not None:
            raise OptionError(f"suite {self.name!r} has the layouts of split {self.split!r}; leave out layouts")
        ids = [layout.id for layout in layouts]
        if self.layouts is not None and list(self.layouts) != ids:
            missing, other = sorted(set(self.layouts) - set(ids)), sorted(set(ids) - set(self.layouts))
            problem = (
                f"{missing[0]!r} is missing" if missing else f"{other[0]!r} is not in it" if other else "the order"
            )
            raise OptionError(f"layouts are not those of suite {self.name!r}: {problem}")

    def load_layouts(self) -> tuple[Layout, ...]:
        """Return the suite's layouts in order.

        Raises:
            OptionError: the suite has no split; its layouts have to be passed.
            UnknownNameError: a layout is not in the split.
            DocumentError: a layout's file is broken.
        """
        if self.split is None:
            raise OptionError(f"suite {self.name!r} has no published layouts: pass its layouts (--layouts)")
        ids = published(self.split) if self.layouts is None else self.layouts
        return tuple(load_published(self.split, layout_id) for layout_id in ids)


def suite_names() -> tuple[str, ...]:
    """Return the sorted names of the suites in the package."""
    return tuple(sorted(path.stem for path in _folder().glob("*.json")))


def load_suite(name: str | Path) -> Suite:
    """Return a suite by name, or from a file if the name ends in `.json`.

    Raises:
        UnknownNameError: no suite has that name.
        DocumentError: the file cannot be read as a suite.
    """
    if str(name).endswith(".json"):
        return Suite.load(name)
    name = ALIASES.get(str(name), name)
    if name not in suite_names():
        raise UnknownNameError("suite", name, (*suite_names(), *ALIASES))
    return Suite.load(_folder() / f"{name}.json")


def suite_of(layouts: Sequence[Layout]) -> Suite:
    """Return a suite of layouts passed by hand, with the rules of the published suites."""
    return Suite(name="layouts", layouts=tuple(layout.id for layout in layouts))


def _folder() -> Path:
    return artefacts("eval") / "suites"
