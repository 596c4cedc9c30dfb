"""Substructure rules as data: a SMARTS pattern gives a reactive group or a hazard flag, with a reason.

Patterns are matched against the canonical form of a structure (`labgym.assets.structures.canonical`), in which salts
of electropositive metals are drawn as ions, so that every spelling of a substance is classified alike.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from functools import lru_cache
from typing import Annotated, Any, ClassVar

from pydantic import Field

from labgym.artefacts import artefacts
from labgym.documents import Document, Record
from labgym.errors import DocumentError

MAX_MATCHES = 100
"""Most matches of one pattern that are counted; no rule needs more."""

Share = Annotated[float, Field(ge=0.0, le=1.0)]


class Reason(Record):
    """Reason of an inference: the rule in words, the part of the structure that matched, and the confidence."""

    why: str
    part: str = ""
    confidence: Share


class Substructure(Record):
    """A rule.

    Attributes:
        gives: the reactive group or the flag.
        why: the structural feature in words.
        smarts: patterns, any of which must match.
        without: patterns none of which may match anywhere in the structure.
        least: least number of matches.
        balance: what neutralizes the group within the molecule. The rules of the group hold only if they match more
            atoms than it does: an amino acid with one amine is a zwitterion, not a base.
        ratio: the rule holds only if the number of carbon and oxygen atoms over that of nitrogen atoms is below it.
        confidence: share of correct inferences, as judged by the author of the rule.
    """

    gives: str
    why: Annotated[str, Field(min_length=1)]
    smarts: Annotated[tuple[str, ...], Field(min_length=1)]
    without: tuple[str, ...] = ()
    least: Annotated[int, Field(ge=1, le=10)] = 1
    balance: tuple[str, ...] = ()
    ratio: Annotated[float, Field(gt=0.0)] | None = None
    confidence: Share


class Substructures(Document):
    """All rules: for reactive groups and for hazard flags."""

    SCHEMA: ClassVar[str] = "labgym.substructures/1"

    groups: tuple[Substructure, ...]
    flags: tuple[Substructure, ...]


@lru_cache(maxsize=1)
def substructures() -> Substructures:
    """Return the published rules; they are read once per process."""
    return Substructures.load(artefacts("assets") / "chemistry" / "substructures.json")


@lru_cache(maxsize=2048)
def pattern(smarts: str) -> Any:
    """Return the compiled pattern.

    Raises:
        DocumentError: not a valid SMARTS.
    """
    from rdkit import Chem

    compiled = Chem.MolFromSmarts(smarts)
    if compiled is None:
        raise DocumentError("substructures.json", "smarts", f"{smarts!r} is not a valid SMARTS pattern")
    return compiled


def matches(molecule: Any, smarts: str) -> tuple[tuple[int, ...], ...]:
    """Return the atoms of each match of a pattern."""
    atoms: tuple[tuple[int, ...], ...] = molecule.GetSubstructMatches(pattern(smarts), maxMatches=MAX_MATCHES)
    return atoms


def reasons(molecule: Any, rules: Iterable[Substructure]) -> Iterator[tuple[str, Reason]]:
    """Yield label and reason for each rule that matches a molecule in canonical form, in the order of the rules."""
    from rdkit import Chem

    rules = tuple(rules)
    for rule in rules:
        if any(molecule.HasSubstructMatch(pattern(smarts)) for smarts in rule.without):
            continue
        if rule.ratio is not None and not _nitrogen_rich(molecule, rule.ratio):
            continue
        places = [atoms for smarts in rule.smarts for atoms in matches(molecule, smarts)]
        if len(places) >= rule.least and not (rule.balance and _is_balanced(molecule, rule, rules)):
            part = Chem.MolFragmentToSmiles(molecule, atomsToUse=places[0])
            yield rule.gives, Reason(why=rule.why, part=part, confidence=rule.confidence)


def _is_balanced(molecule: Any, rule: Substructure, rules: Iterable[Substructure]) -> bool:
    """Return whether a molecule has as many atoms that neutralize the group of a rule as it has of the group."""
    group = [smarts for each in rules if each.gives == rule.gives and each.balance for smarts in each.smarts]
    ours, theirs = (
        {atoms[0] for smarts in some for atoms in matches(molecule, smarts)} for some in (group, rule.balance)
    )
    return len(theirs) >= len(ours)


def _nitrogen_rich(molecule: Any, ratio: float) -> bool:
    counts = [atom.GetSymbol() for atom in molecule.GetAtoms()]
    return counts.count("C") + counts.count("O") < ratio * counts.count("N")
