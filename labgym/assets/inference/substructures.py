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
"""Matches of one pattern that are looked for; structures are bounded, and no rule counts further."""

Share = Annotated[float, Field(ge=0.0, le=1.0)]


class Reason(Record):
    """Why something is said of a structure: the rule in words, the part that it matched, and how sure it is."""

    why: str
    part: str = ""
    confidence: Share


class Substructure(Record):
    """A rule.

    Attributes:
        gives: the reactive group, or the flag.
        why: the structural feature in words.
        smarts: patterns, any of which must match.
        without: patterns none of which may match anywhere in the structure.
        least: number of places that must match.
        ratio: the rule holds only where the number of carbon and oxygen atoms over that of nitrogen atoms is below it.
        confidence: how often the rule is right, as its author judges it.
    """

    gives: str
    why: Annotated[str, Field(min_length=1)]
    smarts: Annotated[tuple[str, ...], Field(min_length=1)]
    without: tuple[str, ...] = ()
    least: Annotated[int, Field(ge=1, le=10)] = 1
    ratio: Annotated[float, Field(gt=0.0)] | None = None
    confidence: Share


class Substructures(Document):
    """All rules: those that give reactive groups and those that give hazard flags."""

    SCHEMA: ClassVar[str] = "labgym.substructures/1"

    groups: tuple[Substructure, ...]
    flags: tuple[Substructure, ...]


@lru_cache(maxsize=1)
def substructures() -> Substructures:
    """Return the published rules; read once a process."""
    return Substructures.load(artefacts("assets") / "chemistry" / "substructures.json")


@lru_cache(maxsize=2048)
def pattern(smarts: str) -> Any:
    """Return the compiled pattern.

    Raises:
        DocumentError: no valid SMARTS.
    """
    from rdkit import Chem

    compiled = Chem.MolFromSmarts(smarts)
    if compiled is None:
        raise DocumentError("substructures.json", "smarts", f"{smarts!r} is no valid SMARTS")
    return compiled


def matches(molecule: Any, smarts: str) -> tuple[tuple[int, ...], ...]:
    """Return the atoms of each place where a pattern matches."""
    found: tuple[tuple[int, ...], ...] = molecule.GetSubstructMatches(pattern(smarts), maxMatches=MAX_MATCHES)
    return found


def reasons(molecule: Any, rules: Iterable[Substructure]) -> Iterator[tuple[str, Reason]]:
    """Yield what the rules give for a molecule in canonical form, in the order of the rules."""
    from rdkit import Chem

    for rule in rules:
        if any(molecule.HasSubstructMatch(pattern(smarts)) for smarts in rule.without):
            continue
        if rule.ratio is not None and not _nitrogen_rich(molecule, rule.ratio):
            continue
        places = [atoms for smarts in rule.smarts for atoms in matches(molecule, smarts)]
        if len(places) >= rule.least:
            part = Chem.MolFragmentToSmiles(molecule, atomsToUse=places[0])
            yield rule.gives, Reason(why=rule.why, part=part, confidence=rule.confidence)


def _nitrogen_rich(molecule: Any, ratio: float) -> bool:
    counts = [atom.GetSymbol() for atom in molecule.GetAtoms()]
    return counts.count("C") + counts.count("O") < ratio * counts.count("N")
