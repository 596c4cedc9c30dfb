"""The kinds of reaction that templates can write, with the defaults for what a text leaves open."""

from __future__ import annotations

import re
from functools import lru_cache
from typing import Annotated, ClassVar, Literal

from pydantic import Field

from labgym.artefacts import artefacts
from labgym.documents import Document, Record
from labgym.protocols.model import ReactionType


class Slot(Record):
    """A role in the reaction that one reagent fills.

    Attributes:
        role: name of the role.
        asset, amount: the default reagent and its amount.
        when: whether the reagent is charged into the flask first or added afterwards.
        accepts: assets that can fill the slot.
        classes: classes of substances that can fill it.
        optional: whether the slot stays empty unless the text names a reagent for it.
    """

    role: str
    asset: str
    amount: str
    when: Literal["charge", "add"]
    accepts: tuple[str, ...] = ()
    classes: tuple[str, ...] = ()
    optional: bool = False


class Solvent(Record):
    """The default solvent."""

    asset: str
    amount: str


class Quench(Record):
    """How the reaction is ended."""

    action: Literal["Quench", "Acidify", "Basify"]
    asset: str
    amount: str


class Transformation(Record):
    """A kind of reaction.

    Attributes:
        like: a published protocol of the kind.
        signs: assets and concepts; a text that names one of them means this kind.
        cues: sets of assets, concepts and classes; a text that names a complete set may mean this kind.
        action, temperature, duration: action and conditions of the reaction, degrees Celsius and minutes.
        add_temperature: temperature at which the second half of the reagents is added, if different.
        extras: instruments of the reaction beyond vessel, stirrer and bath.
        workup: operations after the quench as "extract:EthylAcetate"; purify: the last of them.
    """

    id: str
    name: str
    type: ReactionType
    like: str
    signs: tuple[str, ...]
    cues: tuple[tuple[str, ...], ...]
    slots: Annotated[tuple[Slot, ...], Field(min_length=1)]
    solvent: Solvent | None
    action: Literal["Stir", "Heat", "Reflux", "Distill"]
    temperature: float
    duration: float
    add_temperature: float | None
    extras: tuple[str, ...]
    quench: Quench | None
    workup: tuple[str, ...]
    purify: str
    analysis: str
    product: str


class Unwritten(Record):
    """Names of reactions without a template: a pattern over English, and Chinese words."""

    english: str
    chinese: tuple[str, ...]

    def first_in(self, text: str) -> str:
        """Return the first of the names that occurs in a text, or ""."""
        match = re.search(rf"(?<![A-Za-z])(?:{self.english})(?![A-Za-z])", text, re.IGNORECASE)
        return match[0] if match else next((word for word in self.chinese if word in text), "")


class Transformations(Document):
    """The table.

    Attributes:
        stand_ins: which asset stands in for a class of substances that a text names.
        structures: SMARTS patterns of each class, of which one must match.
    """

    SCHEMA: ClassVar[str] = "labgym.transformations/1"

    stand_ins: dict[str, str]
    structures: dict[str, tuple[str, ...]]
    unwritten: Unwritten
    transformations: tuple[Transformation, ...]


@lru_cache(maxsize=1)
def transformations() -> Transformations:
    """Return the published table; it is read once per process."""
    return Transformations.load(artefacts("assets") / "synthesis" / "transformations.json")


def recognise(spoken_of: frozenset[str]) -> tuple[Transformation, ...]:
    """Return the kinds of reaction that a text may mean, best first, by the assets, concepts and classes in it.

    A kind with a sign goes before one without; then the kind with the largest complete set of cues; of several, the
    one with more such sets, then the first of the table.
    """
    ranked: list[tuple[tuple[int, int, int], Transformation]] = []
    for kind in transformations().transformations:
        sizes = [len(cue) for cue in kind.cues if spoken_of.issuperset(cue)]
        rank = (len(spoken_of.intersection(kind.signs)), max(sizes, default=0), len(sizes))
        if sizes or rank[0]:
            ranked.append((rank, kind))
    return tuple(kind for _, kind in sorted(ranked, key=lambda item: item[0], reverse=True))
