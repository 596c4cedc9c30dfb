"""How well classification from structure agrees with what is known: precision and recall, group by group."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from labgym.assets.flags import carried
from labgym.assets.inference.classify import classify
from labgym.assets.model import Asset

Labels = frozenset[str]
Known = tuple[str, str, Labels, Labels]
"""A substance that is labelled: name, SMILES, reactive groups, flags."""


@dataclass(frozen=True)
class Score:
    """How often a group or flag was inferred: rightly, wrongly, and how often it was missed."""

    label: str
    right: int
    wrong: int
    missed: int

    @property
    def precision(self) -> float | None:
        """Share of what was inferred that is so; None where it was never inferred."""
        return self.right / (self.right + self.wrong) if self.right + self.wrong else None

    @property
    def recall(self) -> float | None:
        """Share of what is so that was inferred; None where it never is."""
        return self.right / (self.right + self.missed) if self.right + self.missed else None


@dataclass(frozen=True)
class Disagreement:
    """A substance for which a label was inferred that it does not carry, or missed that it carries."""

    name: str
    kind: str
    label: str
    inferred: bool


@dataclass(frozen=True)
class Agreement:
    """The comparison over many substances; `exact` counts those whose labels all agree, by kind."""

    substances: int
    exact: dict[str, int]
    scores: dict[str, tuple[Score, ...]]
    disagreements: tuple[Disagreement, ...]

    def total(self, kind: str) -> Score:
        """Return all labels of a kind (groups or flags) together."""
        scores = self.scores[kind]
        return Score(
            "all",
            sum(score.right for score in scores),
            sum(score.wrong for score in scores),
            sum(score.missed for score in scores),
        )


def listed(reagents: Iterable[Asset]) -> list[Known]:
    """Return the reagents that have a structure, with the groups and flags that they carry."""
    return [
        (asset.name, asset.chemistry.smiles, frozenset(asset.chemistry.groups), _raised(asset))
        for asset in reagents
        if asset.chemistry is not None and asset.chemistry.smiles is not None
    ]


def compare(known: Iterable[Known]) -> Agreement:
    """Return how the classification of labelled substances agrees with their labels.

    Raises:
        StructureError: one of them has no valid SMILES.
        MissingDependencyError: RDKit is not installed.
    """
    rows = list(known)
    found: list[Disagreement] = []
    counts: dict[str, dict[str, list[int]]] = {"groups": {}, "flags": {}}
    exact = dict.fromkeys(counts, 0)
    for name, smiles, groups, flags in rows:
        seen = classify(smiles)
        for kind, carries, inferred in (
            ("groups", groups, frozenset(seen.groups)),
            ("flags", flags, frozenset(str(flag) for flag in seen.flags)),
        ):
            exact[kind] += carries == inferred
            for label in sorted(carries | inferred):
                tally = counts[kind].setdefault(label, [0, 0, 0])
                tally[0 if label in carries & inferred else 1 if label in inferred else 2] += 1
                if label not in carries & inferred:
                    found.append(Disagreement(name, kind, label, label in inferred))
    scores = {
        kind: tuple(Score(label, *tally) for label, tally in sorted(labels.items())) for kind, labels in counts.items()
    }
    return Agreement(len(rows), exact, scores, tuple(found))


def _raised(asset: Asset) -> Labels:
    return frozenset(str(flag) for flag, value in carried(asset).items() if value)
