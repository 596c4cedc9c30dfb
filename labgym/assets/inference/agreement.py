"""Agreement of the classification from structure with labeled substances: precision and recall of each label."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from labgym.assets.flags import carried
from labgym.assets.inference.classify import classify
from labgym.assets.model import Asset

Labels = frozenset[str]
Labeled = tuple[str, str, Labels, Labels]
"""A labeled substance: name, SMILES, reactive groups, flags."""


@dataclass(frozen=True)
class LabelScore:
    """Number of correct, wrong and missed inferences of a group or flag."""

    label: str
    right: int
    wrong: int
    missed: int

    @property
    def precision(self) -> float | None:
        """Share of the inferences that are correct; None without inferences."""
        return self.right / (self.right + self.wrong) if self.right + self.wrong else None

    @property
    def recall(self) -> float | None:
        """Share of the labels that are inferred; None without labels."""
        return self.right / (self.right + self.missed) if self.right + self.missed else None


@dataclass(frozen=True)
class Disagreement:
    """A label that was inferred but is not carried by the substance, or that is carried but was missed."""

    name: str
    kind: str
    label: str
    inferred: bool


@dataclass(frozen=True)
class LabelAgreement:
    """The comparison over many substances; `exact` counts, by kind, those whose labels all agree."""

    substances: int
    exact: dict[str, int]
    scores: dict[str, tuple[LabelScore, ...]]
    disagreements: tuple[Disagreement, ...]

    def total(self, kind: str) -> LabelScore:
        """Return the score of all labels of a kind (groups or flags) together."""
        scores = self.scores[kind]
        return LabelScore(
            "all",
            sum(score.right for score in scores),
            sum(score.wrong for score in scores),
            sum(score.missed for score in scores),
        )


def listed(reagents: Iterable[Asset]) -> list[Labeled]:
    """Return the reagents that have a structure, with their groups and flags."""
    return [
        (asset.name, asset.chemistry.smiles, frozenset(asset.chemistry.groups), _flags(asset))
        for asset in reagents
        if asset.chemistry is not None and asset.chemistry.smiles is not None
    ]


def compare(substances: Iterable[Labeled]) -> LabelAgreement:
    """Return how the classification of labeled substances agrees with their labels.

    Raises:
        StructureError: a SMILES is not valid.
        MissingDependencyError: RDKit is not installed.
    """
    rows = list(substances)
    disagreements: list[Disagreement] = []
    counts: dict[str, dict[str, list[int]]] = {"groups": {}, "flags": {}}
    exact = dict.fromkeys(counts, 0)
    for name, smiles, groups, flags in rows:
        inference = classify(smiles)
        for kind, carries, inferred in (
            ("groups", groups, frozenset(inference.groups)),
            ("flags", flags, frozenset(str(flag) for flag in inference.flags)),
        ):
            exact[kind] += carries == inferred
            for label in sorted(carries | inferred):
                tally = counts[kind].setdefault(label, [0, 0, 0])
                tally[0 if label in carries & inferred else 1 if label in inferred else 2] += 1
                if label not in carries & inferred:
                    disagreements.append(Disagreement(name, kind, label, label in inferred))
    scores = {
        kind: tuple(LabelScore(label, *tally) for label, tally in sorted(labels.items()))
        for kind, labels in counts.items()
    }
    return LabelAgreement(len(rows), exact, scores, tuple(disagreements))


def _flags(asset: Asset) -> Labels:
    return frozenset(str(flag) for flag, value in carried(asset).items() if value)
