"""Open substances: reagents that a protocol brings along, complete, because the catalog lacks them.

A substance embeds its identity, physical data and hazards. Its entry, a standard pack, follows from them without RDKit
and without a catalog, so that a document reloads anywhere. Documents come from anywhere, too: a substance carries at
least the hazards that follow from its own data, from its structure and from the published table of names.
"""

from __future__ import annotations

from functools import cached_property, lru_cache
from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import Field, model_validator

from labgym.artefacts import artefacts
from labgym.assets.compatibility import UNCLASSIFIED, rulebook
from labgym.assets.flags import FLAGS, Flag, by_rule, carried
from labgym.assets.inference.bottle import CATEGORY, PACKS, canonical_name
from labgym.assets.inference.classify import classify, storage_of
from labgym.assets.inference.prohibited import ProhibitedSubstanceError
from labgym.assets.model import Asset, Chemistry, Hazards, Phase, StorageClass
from labgym.assets.search import normalize
from labgym.assets.structures import StructureError
from labgym.documents import Document, Record
from labgym.errors import MissingDependencyError

SUFFIX = "Open"
"""End of the name of a substance whose own name the catalog has."""
Source = Literal["table", "chemicals", "opsin", "record", "user", "none"]
"""What named the structure: the published table, the packages chemicals and OPSIN, the record, the user, nothing."""
Celsius = Annotated[float, Field(ge=-273.15, le=6000.0)]
Name = Annotated[str, Field(min_length=1, max_length=200)]
WHITE_PHOSPHORUS_SMILES = "p12p3p1p23"
UNKNOWN_FLAGS: tuple[Flag, ...] = ("flammable", "volatile_or_toxic")
"""Flags of a substance of which nothing is known."""


class Traits(Record):
    """Physical data and hazards of a substance. Temperatures in degrees Celsius, density in g/mL, molar mass in g/mol.

    Attributes:
        flags: the hazard flags that it carries.
        groups: reactive groups; empty if nothing is known.
    """

    state: Phase
    molar_mass: Annotated[float, Field(gt=0.0, le=100_000.0)] | None = None
    density: Annotated[float, Field(ge=1e-4, le=25.0)] | None = None
    boiling_point: Celsius | None = None
    flash_point: Celsius | None = None
    flags: Annotated[tuple[Flag, ...], Field(max_length=20)] = ()
    groups: Annotated[tuple[Annotated[str, Field(max_length=40)], ...], Field(max_length=30)] = ()


class Substance(Traits):
    """A reagent that a protocol embeds.

    Attributes:
        name: of its entry; no asset of the catalog has it.
        names: as written, the first one is its title.
        smiles: canonical; "" if the structure is not known.
        formula: in Hill order, or "".
        source: what named the structure.
        confidence: low if two sources disagree, and for estimated hazards.
        notes: sources of the physical data and reasons of the hazards.
    """

    name: Annotated[str, Field(pattern=r"^[A-Z][A-Za-z0-9]{1,63}$")]
    names: Annotated[tuple[Name, ...], Field(min_length=1, max_length=10)]
    smiles: Annotated[str, Field(max_length=500, pattern=r"^[\x21-\x7e]*$")] = ""
    formula: Annotated[str, Field(max_length=200)] = ""
    source: Source
    confidence: Literal["high", "medium", "low"] = "low"
    notes: Annotated[str, Field(max_length=1000)] = ""

    @property
    def is_classified(self) -> bool:
        """Whether its hazards follow from a structure or the published table, rather than from precaution."""
        return bool(self.smiles or self.groups)

    @property
    def storage_class(self) -> StorageClass:
        """Class of its cabinet, which follows from its hazards."""
        if not self.is_classified:
            return "Toxic"
        return storage_of(self.groups, self.flags, self.state, self.smiles == WHITE_PHOSPHORUS_SMILES)[0]

    @cached_property
    def asset(self) -> Asset:
        """Its catalog entry: a standard pack for its state."""
        flags: dict[str, bool] = dict.fromkeys(self.flags, True)
        hazards = {flag: True for flag in flags if flag in Hazards.model_fields}
        chemistry = Chemistry(
            smiles=self.smiles or None,
            formula=self.formula or None,
            molar_mass=self.molar_mass,
            state=self.state,
            density=self.density,
            boiling_point=self.boiling_point,
            flash_point=self.flash_point,
            groups=self.groups,
            storage_class=self.storage_class,
            confidence=self.confidence,
            notes=self.notes,
            **{flag: True for flag in flags if flag not in hazards},
        )
        what = "classified from its structure" if self.smiles else "from the table of names"
        if not self.is_classified:
            what = "of unknown structure and unknown hazards"
        return Asset(
            name=self.name,
            kind="reagent",
            category=CATEGORY if self.is_classified else UNCLASSIFIED,
            subtype=next(iter(self.groups), "unknown"),
            synonyms_en=self.names,
            synonyms_zh=(f"开放试剂 {self.names[0]}",),
            description=f"{self.names[0]}, a reagent of the protocol, {what}; nothing was measured.",
            caption=f"Read the safety data sheet first. Stored as {self.storage_class}.",
            placing="desktop",
            hazards=Hazards(**hazards),
            chemistry=chemistry,
            **PACKS[self.state],
        )

    @model_validator(mode="after")
    def _states_its_hazards(self) -> Self:
        """Check that the hazards are not less than those which its data, its structure or the table imply."""
        unknown = sorted(set(self.groups) - set(rulebook().groups))
        if unknown:
            raise ValueError(f"{self.name}: {unknown[0]!r} is no reactive group")
        chemistry = self.asset.chemistry
        if chemistry is not None:
            self._carries(tuple(flag for flag, holds in by_rule(chemistry).items() if holds), (), "its data")
        listed = [entry.traits for name in self.names if (entry := listed_name(name)) is not None]
        for traits in listed:
            if traits is not None:
                self._carries(traits.flags, traits.groups, "the table of names")
        if self.smiles:
            self._carries(*implied(self.smiles, self.state), "its structure")
        elif not any(listed):
            self._carries(UNKNOWN_FLAGS, (), "an unknown structure")
            if self.groups:
                raise ValueError(f"{self.name}: without a structure its reactive groups are not known")
        return self

    def _carries(self, flags: tuple[Flag, ...], groups: tuple[str, ...], why: str) -> None:
        missing = [*(flag for flag in flags if flag not in self.flags), *(g for g in groups if g not in self.groups)]
        if missing:
            raise ValueError(
                f"{self.name} understates its hazards: {why} implies {', '.join(missing)}; stage the experiment again"
            )


@lru_cache(maxsize=4096)
def implied(smiles: str, state: Phase) -> tuple[tuple[Flag, ...], tuple[str, ...]]:
    """Return the flags and groups that follow from a structure; nothing without RDKit (extra `chem`).

    Raises:
        ValueError: not a structure, or one of a chemical weapon.
    """
    try:
        inference = classify(smiles, state)
    except MissingDependencyError:
        return (), ()
    except (StructureError, ProhibitedSubstanceError) as error:
        raise ValueError(str(error)) from None
    return tuple(inference.flags), tuple(inference.groups)


def weakened(substance: Substance, other: Asset) -> str | None:
    """Return the first hazard flag of a catalog's reagent that a substance lacks, or None."""
    flags = carried(other)
    return next((flag for flag in FLAGS if flags.get(flag) and flag not in substance.flags), None)


def entry_name(title: str, taken: Any) -> str:
    """Return the name of a substance's entry: its title in CamelCase, with a suffix if that is taken.

    Args:
        taken: container of the names that others have.
    """
    name = canonical_name(title)
    if name not in taken:
        return name
    suffixes = (f"{SUFFIX}{number}" if number > 1 else SUFFIX for number in range(1, 1000))
    return next(free for suffix in suffixes if (free := name[: 64 - len(suffix)] + suffix) not in taken)


class ListedName(Record):
    """A substance of the table: an asset of the catalog, a structure, or a mixture with traits.

    Attributes:
        names: as texts write them; case, spaces and punctuation do not count.
        asset: name of an asset of the catalog.
        smiles: its structure.
        traits: of a mixture, or of a material without one structure.
        state: of the form in which the substance is sold, if the structure does not imply it.
        sold: whether it may be used although no protocol may make it.
        note: why the table has it.
    """

    names: Annotated[tuple[Name, ...], Field(min_length=1, max_length=40)]
    asset: str = ""
    smiles: str = ""
    traits: Traits | None = None
    state: Phase | None = None
    sold: bool = False
    note: str = ""

    @model_validator(mode="after")
    def _is_one_thing(self) -> Self:
        if bool(self.asset) + bool(self.smiles) + (self.traits is not None) != 1:
            raise ValueError(f"{self.names[0]!r} needs exactly one of asset, smiles and traits")
        return self


class NameTable(Document):
    """Names of substances that name parsers and databases get wrong or do not know.

    Attributes:
        generic: words for a kind or a part of a substance, which name no single one.
    """

    SCHEMA: ClassVar[str] = "labgym.names/1"

    generic: tuple[Name, ...]
    entries: tuple[ListedName, ...]


@lru_cache(maxsize=1)
def _table() -> NameTable:
    return NameTable.load(artefacts("assets") / "chemistry" / "names.json")


@lru_cache(maxsize=1)
def _generic() -> frozenset[str]:
    return frozenset(map(normalize, _table().generic))


def is_generic(text: str) -> bool:
    """Return whether a text is a word for a kind of substance: "ester", "hydrochloride", "catalyst"."""
    return normalize(text) in _generic()


@lru_cache(maxsize=1)
def _listed() -> dict[str, ListedName]:
    by_name: dict[str, ListedName] = {}
    for entry in _table().entries:
        for name in entry.names:
            if by_name.setdefault(normalize(name), entry) is not entry:
                raise ValueError(f"names.json has {name!r} twice")
    return by_name


def listed_name(text: str) -> ListedName | None:
    """Return the entry of the published table for a name, or None."""
    return _listed().get(normalize(text))
