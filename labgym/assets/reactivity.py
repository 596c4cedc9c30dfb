"""Reactions of two reagents on contact: a matrix over reactive groups, each cell with hazard and source.

The matrix is about mixing. It is stricter and finer than the segregation rules of `labgym.assets.compatibility`, which
decide what layouts keep apart. It is over groups: a mild member of a group gets the answer of the group.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated, ClassVar, Literal, Self, get_args

from pydantic import Field, model_validator

from labgym.artefacts import artefacts
from labgym.assets.compatibility import rulebook
from labgym.assets.flags import Flag, carried
from labgym.assets.model import Asset
from labgym.documents import Document, Record
from labgym.errors import check_name

Severity = Literal["compatible", "caution", "incompatible", "dangerous"]
"""Compatible; caution (warms, or reacts slowly or when heated); incompatible (much heat, pressure or fumes);
dangerous (toxic or flammable gas, fire or explosion)."""
SEVERITIES: tuple[Severity, ...] = get_args(Severity)
Chart = Literal["cameo", "epa"]
TRAITS: tuple[Flag, ...] = ("flammable", "oxidizer", "water_reactive", "peroxide_former")
"""Hazard flags with their own cells, in addition to the groups."""
Text = Annotated[str, Field(min_length=1)]
Pair = tuple[str, str]


class ReactivityEntry(Record):
    """Group pairs that share an answer.

    Attributes:
        products: hazardous gases and other products.
        charts: published charts that rate all these pairs as reacting.
        source: further source.
        cells: the pairs, by their first group.
    """

    severity: Severity
    hazard: Text
    products: tuple[Text, ...] = ()
    charts: tuple[Chart, ...] = ()
    source: str = ""
    cells: Annotated[dict[str, tuple[str, ...]], Field(min_length=1)]

    @model_validator(mode="after")
    def _has_a_source(self) -> Self:
        if not self.charts and not self.source:
            raise ValueError(f"{self.hazard!r} has neither charts nor source")
        return self

    def pairs(self) -> Iterator[Pair]:
        """Yield the group pairs as written."""
        for first, seconds in self.cells.items():
            for second in seconds:
                yield first, second


class UnlistedPairs(Record):
    """The answer for pairs without an entry."""

    hazard: Text
    source: Text


class Reactivity(Document):
    """The matrix as stored: entries, and the answer for the rest.

    Attributes:
        charts: names of published charts of reactive groups.
        groups: numbers of the groups, or of the nearest ones, in the charts.
        kinds: groups that are a kind of another; if a reagent has both, the entries of the narrower one apply.
        entries: pairs that react, and pairs that do not although a chart says so.
        rest: the answer for pairs without an entry.
    """

    SCHEMA: ClassVar[str] = "labgym.reactivity/1"

    charts: dict[Chart, Text]
    groups: dict[str, dict[Chart, Annotated[int, Field(ge=1)]]]
    kinds: dict[str, str]
    rest: UnlistedPairs
    entries: tuple[ReactivityEntry, ...]

    @model_validator(mode="after")
    def _kinds_are_groups(self) -> Self:
        for narrow, wide in self.kinds.items():
            if narrow not in self.groups or wide not in self.groups:
                raise ValueError(f"kinds: {narrow} or {wide} is not a group")
        return self

    @model_validator(mode="after")
    def _covers_each_pair_once(self) -> Self:
        labels = self.groups.keys() | set(TRAITS)
        pairs: set[Pair] = set()
        for entry in self.entries:
            for a, b in entry.pairs():
                pair = _sorted(a, b)
                if not {a, b} <= labels or pair in pairs:
                    fault = "is in two entries" if pair in pairs else "names an unknown group or trait"
                    raise ValueError(f"the pair {a} and {b} ({entry.hazard!r}) {fault}")
                pairs.add(pair)
        return self


_ELEMENT = re.compile(r"[A-Z][a-z]?")
_MADE_OF: dict[str, tuple[str, ...]] = {
    "ammonia": ("N", "H"),
    "bromine": ("Br",),
    "carbon dioxide": ("C",),
    "carbon monoxide": ("C",),
    "chloramines": ("Cl", "N"),
    "chlorine": ("Cl",),
    "chlorine azide": ("Cl", "N"),
    "chlorine dioxide": ("Cl",),
    "chloroacetylene": ("Cl", "C"),
    "cyanogen bromide": ("Br", "N", "C"),
    "cyanogen chloride": ("Cl", "N", "C"),
    "diborane": ("B", "H"),
    "dimethyl sulfide": ("S", "C"),
    "hydrogen": ("H",),
    "hydrogen azide": ("N", "H"),
    "hydrogen bromide": ("Br", "H"),
    "hydrogen chloride": ("Cl", "H"),
    "hydrogen cyanide": ("C", "N", "H"),
    "hydrogen fluoride": ("F", "H"),
    "hydrogen sulfide": ("S", "H"),
    "iodine": ("I",),
    "nitrogen": ("N",),
    "nitrogen oxides": ("N",),
    "nitrogen tribromide": ("N", "Br"),
    "nitrogen trichloride": ("N", "Cl"),
    "nitrosyl chloride": ("N", "Cl"),
    "oxygen": ("O",),
    "silanes": ("Si", "H"),
    "sulfur dioxide": ("S",),
    "thiols": ("S", "H"),
}
"""Elements of a product other than oxygen, which air and water contain."""


@dataclass(frozen=True)
class ReactivityCell:
    """The answer for a pair of groups."""

    severity: Severity
    hazard: str
    products: tuple[str, ...]
    source: str


@dataclass(frozen=True)
class ReactingGroup:
    """A reagent and the group or trait of it that reacts."""

    asset: str
    group: str


@dataclass(frozen=True)
class Reaction:
    """A cell that applies to two reagents, in the order of their names."""

    first: ReactingGroup
    second: ReactingGroup
    cell: ReactivityCell

    @property
    def rank(self) -> int:
        """Rank of the severity, from 0 (compatible) to 3 (dangerous)."""
        return SEVERITIES.index(self.cell.severity)


@lru_cache(maxsize=1)
def reactivity() -> Reactivity:
    """Return the published matrix as stored; it is read once per process."""
    return Reactivity.load(artefacts("assets") / "chemistry" / "reactivity.json")


def cell(a: str, b: str) -> ReactivityCell:
    """Return the cell of two reactive groups; symmetric; every pair has one.

    Raises:
        UnknownNameError: no group has that name.
    """
    groups = rulebook().groups
    for group in (a, b):
        check_name("reactive group", group, groups)
    return _cells()[_sorted(a, b)]


def reactions(a: Asset, b: Asset) -> tuple[Reaction, ...]:
    """Return what happens when two reagents mix: all cells that apply, worst first; symmetric.

    A cell applies if one reagent has its first group or trait and the other its second, and no narrower group of either
    has an entry. For a reagent with itself, the cells of its groups with themselves are returned: what it does in
    storage. Empty if a reagent has no groups, and for equipment.
    """
    a, b = sorted((a, b), key=lambda asset: asset.name)
    cells, mine, others = _cells(), _features(a), _features(b)
    pairs = [(first, second) for first in mine for second in others if a.name != b.name or first == second]
    entered = {pair for pair in pairs if _sorted(*pair) in _entered()}
    result = [
        Reaction(ReactingGroup(a.name, first), ReactingGroup(b.name, second), cells[_sorted(first, second)])
        for first, second in pairs
        if _sorted(first, second) in cells
        if not any((narrow, second) in entered for narrow in _kinds(first))
        if not any((first, narrow) in entered for narrow in _kinds(second))
    ]
    return tuple(sorted(result, key=lambda reaction: (-reaction.rank, reaction.first.group, reaction.second.group)))


def products(reaction: Reaction, a: Asset, b: Asset) -> tuple[str, ...]:
    """Return the products of a reaction for which these reagents have the elements.

    Products are listed for groups: some acids release chlorine with an oxidizer, nitric acid does not.
    """
    formulas = [asset.chemistry.formula for asset in (a, b) if asset.chemistry is not None]
    if not all(formulas):
        return reaction.cell.products
    present = {element for formula in formulas for element in _ELEMENT.findall(formula or "")}
    return tuple(name for name in reaction.cell.products if set(_MADE_OF.get(name, ())) <= present)


def to_avoid(asset: Asset, others: Iterable[Asset]) -> tuple[tuple[str, Reaction], ...]:
    """Return the names of the reagents that are incompatible or dangerous with a reagent, with the worst reaction.

    Sorted by severity, worst first; the reagent itself may be among them.
    """
    worst = {other.name: cells[0] for other in others if (cells := reactions(asset, other))}
    bad = [(name, reaction) for name, reaction in worst.items() if reaction.cell.severity in SEVERITIES[2:]]
    return tuple(sorted(bad, key=lambda item: (-item[1].rank, item[0])))


def _features(asset: Asset) -> tuple[str, ...]:
    if not asset.groups:
        return ()
    flags = carried(asset)
    return tuple(sorted({*asset.groups, *(trait for trait in TRAITS if flags[trait])}))


def _kinds(group: str) -> tuple[str, ...]:
    return tuple(narrow for narrow, wide in reactivity().kinds.items() if wide == group)


@lru_cache(maxsize=1)
def _entered() -> frozenset[Pair]:
    """Return the pairs that have an entry, sorted."""
    return frozenset(_sorted(a, b) for entry in reactivity().entries for a, b in entry.pairs())


@lru_cache(maxsize=1)
def _cells() -> Mapping[Pair, ReactivityCell]:
    """Return every cell by its sorted pair: all pairs of groups, and those pairs of traits that have an entry."""
    matrix = reactivity()
    groups = sorted(matrix.groups)
    rest = ReactivityCell("compatible", matrix.rest.hazard, (), matrix.rest.source)
    cells = {(a, b): rest for place, a in enumerate(groups) for b in groups[place:]}
    for entry in matrix.entries:
        for a, b in entry.pairs():
            cells[_sorted(a, b)] = ReactivityCell(
                entry.severity, entry.hazard, entry.products, _source(matrix, entry, a, b)
            )
    return cells


def _source(matrix: Reactivity, entry: ReactivityEntry, a: str, b: str) -> str:
    charts = []
    for chart in entry.charts:
        low, high = sorted((matrix.groups[a][chart], matrix.groups[b][chart]))
        charts.append(f"{matrix.charts[chart]} {low} and {high}")
    return "; ".join([*charts, *([entry.source] if entry.source else [])])


def _sorted(a: str, b: str) -> Pair:
    return (a, b) if a <= b else (b, a)
