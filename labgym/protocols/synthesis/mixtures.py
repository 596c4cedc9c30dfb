"""Mixtures of liquids by ratio, "dioxane/H2O (4:1, 25 mL)", and reagents in solution, "DIBAL-H (1 M in hexanes)"."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

from labgym.protocols.language import Mention
from labgym.protocols.refusals import refusals
from labgym.quantities import Quantity, strength

_JOINT = re.compile(r"\s*(?:[/:+–-]|and|与|和|-)\s*")
_SLASH, _OPENING = re.compile(r"\s*[/–-]\s*"), re.compile(r"\s*(?:mixture\s*)?[(（,]\s*")
_SEVERAL = re.compile(r"\s*[/+:]\s*\d")
_RATIO = r"(\d{1,5}(?:\.\d{1,5})?(?:\s*[:：/]\s*\d{1,5}(?:\.\d{1,5})?){1,5})"
_RATIO_AFTER = re.compile(
    rf"\s*+(?:mixture\s*+|混合\S{{0,3}})?(?:[(（,]\s*+)?(?:[^()（）]{{0,16}}[,;，]\s*)?{_RATIO}(?![\d.%])"
)
_RATIO_BEFORE = re.compile(rf"(?<![\d.]){_RATIO}\s*(?:\(?v/v\)?\s*)?(?:mixture\s+(?:of|in)\s+|solution\s+of\s+)?$")
_FILLER = re.compile(
    r"(?:[\s(（,;，]|[:：/]\s*+(?:\d++(?:\.\d++)?)?|\d++(?:\.\d++)?(?=\s*[:：/])|v/v|an?\b|of\b|mixture\b|的|混合溶?剂?)*+"
)
_SOLD = re.compile(
    r"\s*(?:solution\s*)?(?:[(（,]\s*)(?:\d+(?:\.\d+)?\s*(?:M|N|mol/L|wt\s?%|%)\s*)?(?:solution\s+)?in\s+(?:dry\s+)?"
)
_IN = re.compile(r"\s+(?:solution\s+)?in\s+")


@dataclass(frozen=True)
class SolventMixture:
    """Liquids with their shares of the volume.

    Attributes:
        shares: the mentions with their shares, which sum to 1.
        start, end: the span of the names.
    """

    shares: tuple[tuple[Mention, float], ...]
    start: int
    end: int

    def names(self) -> tuple[tuple[str, float], ...]:
        """Return the names of the liquids with their shares."""
        return tuple((mention.name, share) for mention, share in self.shares)

    def parts(self, text: str, quantity: Quantity) -> tuple[tuple[Quantity, Mention], ...]:
        """Return the volume of each liquid if a quantity refers to the whole mixture, else nothing."""
        after = quantity.start >= self.end and _FILLER.fullmatch(text, self.end, quantity.start)
        before = quantity.end <= self.start and _FILLER.fullmatch(text, quantity.end, self.start)
        if quantity.dimension != "volume" or not (after or before):
            return ()
        return tuple((_share(quantity, share), mention) for mention, share in self.shares)


def _share(quantity: Quantity, share: float) -> Quantity:
    return replace(quantity, value=float(f"{quantity.value * share:.3g}"), number="")


def mixtures(text: str, mentioned: Sequence[Mention]) -> tuple[SolventMixture, ...]:
    """Return the mixtures whose ratio a text gives, in order."""
    return tuple(_mixtures(text, [mention for mention in mentioned if mention.kind == "reagent"]))


def _mixtures(text: str, reagents: Sequence[Mention]) -> Iterator[SolventMixture]:
    run = list(reagents[:1])
    for first, second in pairwise([*reagents, *reagents[-1:]]):
        if second is not first and _JOINT.fullmatch(text, first.end, second.start):
            run.append(second)
            continue
        ratio = _RATIO_AFTER.match(text, run[-1].end) or _RATIO_BEFORE.search(text, 0, run[0].start)
        numbers = [float(number) for number in re.split(r"[:：/]", ratio[1])] if ratio is not None else []
        if len(run) > 1 and len(numbers) == len(run) and sum(numbers) > 0.0:
            shares = tuple((mention, number / sum(numbers)) for mention, number in zip(run, numbers, strict=True))
            yield SolventMixture(shares, run[0].start, run[-1].end)
        run = [second]


def without_ratio(text: str, mentioned: Sequence[Mention], quantity: Quantity) -> bool:
    """Return whether a quantity is the volume of a mixture whose ratio a text does not give: "THF/water (25 mL)"."""
    reagents = [mention for mention in mentioned if mention.kind == "reagent"]
    several = _SEVERAL.match(text, quantity.end) is not None
    return (
        quantity.dimension == "volume"
        and not several
        and any(
            _SLASH.fullmatch(text, first.end, second.start) and _OPENING.fullmatch(text, second.end, quantity.start)
            for first, second in pairwise(reagents)
        )
    )


def solutions(text: str, mentioned: Sequence[Mention]) -> dict[Mention, Mention]:
    """Return the solvents of reagents of stated concentration, each with its reagent."""
    sold: dict[Mention, Mention] = {}
    reagents = [mention for mention in mentioned if mention.kind == "reagent"]
    for solute, solvent in pairwise(reagents):
        plain = _IN.fullmatch(text, solute.end, solvent.start) and solute.name in refusals().destroyed_by_protic
        bracketed = _SOLD.fullmatch(text, solute.end, solvent.start)
        protic = solvent.name in refusals().protic
        if (plain or bracketed) and not protic and strength(text, solute.start, solute.end):
            sold[solvent] = solute
    return sold
