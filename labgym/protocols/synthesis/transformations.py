"""The kinds of reaction that templates can write, with the defaults for what a text leaves open.

The table lists the published reagents of each slot. A reagent of the user fills a slot if it has the structure of a
class of substances that the slot takes: a ketone or an aldehyde where borohydride reduces one.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from functools import lru_cache
from typing import Annotated, ClassVar, Literal

from pydantic import Field

from labgym.artefacts import artefacts
from labgym.assets import Asset, Catalog
from labgym.assets.inference.substructures import matches
from labgym.assets.structures import standard
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
    """The reagent and the action that end a reaction."""

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


def recognize(spoken_of: frozenset[str]) -> tuple[Transformation, ...]:
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


def own_reagents(names: Iterable[str], catalog: Catalog) -> tuple[Asset, ...]:
    """Return those of some reagents that the user has added."""
    return tuple(catalog.get(name) for name in dict.fromkeys(names) if name in catalog.own)


def classes_of(asset: Asset) -> frozenset[str]:
    """Return the classes of substances to which a reagent belongs; none if its entry has no SMILES.

    Raises:
        StructureError: its SMILES is not valid.
        MissingDependencyError: RDKit is not installed.
    """
    return _classes(asset.smiles) if asset.smiles else frozenset()


def with_own_reagents(kind: Transformation, names: Iterable[str], catalog: Catalog) -> Transformation:
    """Return a kind of reaction whose slots also accept the reagents of the user that fit them.

    Args:
        names: reagents that the text names.

    Raises:
        MissingDependencyError: the text names a reagent of the user, and RDKit is not installed.
    """
    own = {asset.name: classes_of(asset) for asset in own_reagents(names, catalog)}
    if not own:
        return kind
    slots = [_accepting(slot, own, catalog) for slot in kind.slots]
    return kind.model_copy(update={"slots": tuple(slots)})


def _accepting(slot: Slot, own: dict[str, frozenset[str]], catalog: Catalog) -> Slot:
    """Return a slot that accepts the reagents of the classes that it takes.

    A class counts if a listed reagent belongs to it: "amine" in a text may mean the aromatic amine of a Sandmeyer
    reaction, but an aliphatic one does not fit there.
    """
    usual = frozenset[str]().union(*(classes_of(catalog.get(name)) for name in (slot.asset, *slot.accepts)))
    fitting = [name for name, classes in own.items() if classes & usual & set(slot.classes)]
    return slot.model_copy(update={"accepts": (*slot.accepts, *fitting)}) if fitting else slot


@lru_cache(maxsize=1024)
def _classes(smiles: str) -> frozenset[str]:
    structure = standard(smiles)
    table = transformations().structures
    return frozenset(name for name, patterns in table.items() if any(matches(structure, each) for each in patterns))
