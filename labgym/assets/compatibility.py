"""Reagents that must be kept apart, and why: rules over reactive groups and hazard flags.

Profile "segregation" applies some twenty rules over reactive groups; "boolean" uses the hazard flags of the
annotation, closest to what the paper describes. Each rule names two sides, a hazard and a source.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache
from itertools import combinations
from typing import Annotated, ClassVar, Literal, get_args

from pydantic import Field

from labgym.artefacts import artefacts
from labgym.assets.flags import Flag, carried
from labgym.assets.model import Asset
from labgym.documents import Document, Record
from labgym.errors import UnknownNameError

Profile = Literal["segregation", "boolean"]
FLAG_TRAITS: tuple[Flag, ...] = ("flammable", "acid", "base", "oxidizer", "active_metal", "water_reactive")
"""Flags that rules may name in addition to reactive groups."""

UNCLASSIFIED = "unclassified_reagent"
"""Category of reagents of unknown structure, and the trait of them that rules may name."""


@dataclass(frozen=True)
class Hazard:
    """Why two reagents must be kept apart: the kind of the rule, what would happen, and the source."""

    kind: str
    hazard: str
    source: str


class Rule(Record):
    """A pair of sides that must be kept apart; each side is any of several traits."""

    kind: Annotated[str, Field(pattern=r"^[a-z][a-z_]+$")]
    a: Annotated[frozenset[str], Field(min_length=1)]
    b: Annotated[frozenset[str], Field(min_length=1)]
    hazard: Annotated[str, Field(min_length=1)]
    source: Annotated[str, Field(min_length=1)]

    def applies(self, first: frozenset[str], second: frozenset[str]) -> bool:
        """Return whether two sets of traits are on opposite sides of the rule."""
        return bool((first & self.a and second & self.b) or (first & self.b and second & self.a))


class RuleBook(Document):
    """Reactive groups with their meaning, and rules by profile; if several apply, the first is reported."""

    SCHEMA: ClassVar[str] = "labgym.segregation/1"

    groups: dict[str, str]
    profiles: dict[Profile, tuple[Rule, ...]]


@lru_cache(maxsize=1)
def rulebook() -> RuleBook:
    """Return the published rules; they are read once per process."""
    return RuleBook.load(artefacts("assets") / "chemistry" / "segregation.json")


def rules(profile: str = "segregation") -> tuple[Rule, ...]:
    """Return the rules of a profile.

    Raises:
        UnknownNameError: no profile has that name.
    """
    for name, entries in rulebook().profiles.items():
        if name == profile:
            return entries
    raise UnknownNameError("compatibility profile", profile, get_args(Profile))


def traits(asset: Asset) -> frozenset[str]:
    """Return the reactive groups and hazard flags of a reagent, or that it is unclassified; else nothing."""
    if asset.chemistry is None:
        return frozenset()
    flags = carried(asset)
    unknown = frozenset({UNCLASSIFIED} if asset.category == UNCLASSIFIED else ())
    return unknown.union(asset.chemistry.groups, (flag for flag in FLAG_TRAITS if flags[flag]))


def incompatible(a: Asset, b: Asset, profile: str = "segregation") -> Hazard | None:
    """Return why two assets must be kept apart, or None if they may stand together.

    Symmetric; a reagent is compatible with itself, and only reagents can be incompatible.

    Raises:
        UnknownNameError: no profile has that name.
    """
    entries = rules(profile)
    if a.name == b.name:
        return None
    first, second = traits(a), traits(b)
    if first and second:
        for rule in entries:
            if rule.applies(first, second):
                return Hazard(rule.kind, rule.hazard, rule.source)
    return None


def pairs(assets: Iterable[Asset], profile: str = "segregation") -> list[tuple[str, str, Hazard]]:
    """Return the unordered incompatible pairs among distinct assets, names sorted in and between pairs."""
    distinct = {asset.name: asset for asset in assets}
    incompatible_pairs = []
    for name_a, name_b in combinations(sorted(distinct), 2):
        hazard = incompatible(distinct[name_a], distinct[name_b], profile)
        if hazard is not None:
            incompatible_pairs.append((name_a, name_b, hazard))
    return incompatible_pairs
