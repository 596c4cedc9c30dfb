"""Limits of mixing: the temperatures up to which pairs that the reactivity matrix calls dangerous may be in one vessel.

The matrix (`labgym.assets.reactivity`) says what two reagents do on contact. Chemists run some of these reactions on
purpose, within limits: an alcohol is added to an acyl chloride below room temperature, sodium hydride is used in
dimethylformamide as long as it stays cold. A pair that the matrix calls dangerous and that has no limit here must never
meet. Limits also cover pairs that are harmless cold and run away when heated.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from functools import lru_cache
from typing import Annotated, ClassVar

from pydantic import Field

from labgym.artefacts import artefacts
from labgym.assets.model import Asset, Chemistry
from labgym.assets.reactivity import reactions
from labgym.documents import Document, Record

NEVER_C = -300.0
"""Value of a limit that no temperature satisfies."""
Kinds = Annotated[tuple[str, ...], Field(min_length=1)]


class Limit(Record):
    """The conditions under which two kinds of reagent may be in one vessel.

    A kind is a reactive group, or a pattern of the formula as "formula:^I2$"; "&" joins conditions, "!" negates one.

    Attributes:
        a, b: kinds of the two reagents.
        c: kinds of a third reagent without which the limit does not apply.
        share: least share of the volume that a reagent of `a` has, if the limit is about solvents.
        meets: highest temperature at which they may be brought together, degrees Celsius; `above` if None.
        above: highest temperature of the mixture.
        ends: whether a cold step that ends the reaction, such as a quench, may bring them together nevertheless.
        hazard, source: what happens beyond the limit.
    """

    a: Kinds
    b: Kinds
    c: tuple[str, ...] = ()
    share: Annotated[float, Field(ge=0.0, le=1.0)] = 0.0
    meets: float | None = None
    above: Annotated[float, Field(ge=NEVER_C)]
    ends: bool = True
    hazard: Annotated[str, Field(min_length=1)]
    source: Annotated[str, Field(min_length=1)]

    @property
    def is_never(self) -> bool:
        """Whether the two must never be in one vessel."""
        return self.above <= NEVER_C


class Mixing(Document):
    """The table; of several limits that fit a pair, the first one holds."""

    SCHEMA: ClassVar[str] = "labgym.mixing/1"

    limits: tuple[Limit, ...]


@lru_cache(maxsize=1)
def mixing() -> Mixing:
    """Return the published table; it is read once per process."""
    return Mixing.load(artefacts("assets") / "chemistry" / "mixing.json")


def limit_of(a: Asset, b: Asset, shares: Mapping[str, float], others: Iterable[Asset] = ()) -> Limit | None:
    """Return the limit of two reagents in one vessel, or None if they may be together at any temperature.

    The first limit of the table that fits; without one, a pair that the matrix calls dangerous must never meet.

    Args:
        shares: share of each reagent in the volume, by name.
        others: what else is in the vessel.
    """
    rest = tuple(others)
    fitting = (limit for limit in mixing().limits if _fits(limit, a, b, shares, rest))
    worst = next(iter(reactions(a, b)), None)
    if worst is None or worst.cell.severity != "dangerous":
        return next(fitting, None)
    cell = worst.cell
    forbidden = Limit(
        a=(worst.first.group,),
        b=(worst.second.group,),
        above=NEVER_C,
        ends=False,
        hazard=cell.hazard,
        source=cell.source,
    )
    return next(fitting, forbidden)


def _fits(limit: Limit, a: Asset, b: Asset, shares: Mapping[str, float], others: tuple[Asset, ...]) -> bool:
    if limit.c and not any(_is_any(other, limit.c) for other in others):
        return False
    return any(
        shares.get(first.name, 0.0) >= limit.share and _is_any(first, limit.a) and _is_any(second, limit.b)
        for first, second in ((a, b), (b, a))
    )


def _is_any(asset: Asset, kinds: tuple[str, ...]) -> bool:
    chemistry = asset.chemistry
    return chemistry is not None and any(_is(chemistry, kind) for kind in kinds)


def _is(chemistry: Chemistry, kind: str) -> bool:
    """Return whether a reagent satisfies all conditions of a kind."""
    for condition in kind.split("&"):
        name = condition.removeprefix("!")
        pattern = name.removeprefix("formula:")
        matched = re.search(pattern, chemistry.formula or "") is not None
        holds = name in chemistry.groups if pattern == name else matched
        if holds == (name != condition):
            return False
    return True
