"""Protocols as experiments: what is exported of them. Places and instruments remain in the protocol."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, get_args

from labgym.assets import Asset
from labgym.protocols.experiments import Action, Experiment, Material, Portion
from labgym.protocols.experiments.model import Role, Verb
from labgym.protocols.model import Protocol, Step

PREPARING = ("Weigh", "Measure")
"""Actions that only prepare reagents, if a later step adds them."""
_VERBS: dict[str, tuple[Verb, dict[str, Any]]] = {
    "Acidify": ("AdjustPH", {}),
    "Basify": ("AdjustPH", {}),
    "DryVacuum": ("DrySolid", {"atmosphere": "vacuum"}),
}
"""Actions of protocols that have another name among the verbs, with the fields that they imply."""
_ROLES: tuple[tuple[str, Role], ...] = (
    ("solvent", "solvent"),
    ("cataly", "catalyst"),
    ("substrate", "reactant"),
    ("reactant", "reactant"),
    *((word, "workup") for word in ("quench", "wash", "drying", "extraction", "recrystalli", "eluent", "work-up")),
)
"""Roles of materials by a word of the role in the protocol."""


def as_experiment(protocol: Protocol) -> Experiment:
    """Return the materials and actions of a protocol.

    A reagent is taken where a step first uses it for more than weighing, with its whole amount. A step that is no verb
    is an addition if it takes something, else a note. The text of a step becomes the note of its action.

    Raises:
        LabgymError: the protocol uses a reagent that neither the catalog nor the protocol describes.
    """
    catalog = protocol.assets()
    assets = {use.name: catalog.get(use.name) for use in protocol.reagents}
    names = {name: _common_name(asset) for name, asset in assets.items()}
    if len(set(names.values())) < len(names):
        names = {name: name for name in names}
    amounts = {use.name: use.amount for use in reversed(protocol.reagents)}
    taken: dict[int, list[Portion]] = {}
    for name, amount in reversed(amounts.items()):
        taken.setdefault(_taking(protocol, name), []).append(Portion(name=names[name], amount=amount[:200]))
    materials = {
        names[use.name]: Material(
            name=names[use.name], role=_role(use.role), smiles=getattr(assets[use.name].chemistry, "smiles", None) or ""
        )
        for use in protocol.reagents
    }
    return Experiment(
        id=f"protocol_{protocol.id}",
        name=protocol.name[:300],
        reaction_type=protocol.reaction_type,
        reaction=protocol.reaction,
        product=protocol.product[:500],
        description=protocol.description[:4000],
        materials=tuple(materials.values()),
        actions=tuple(_actions(protocol.steps, taken)),
    )


def _taking(protocol: Protocol, name: str) -> int:
    """Return the index of the step that takes a reagent: the first that adds it, else the first that uses it."""
    using = [step for step in protocol.steps if name in step.uses]
    return next((step.index for step in (*(s for s in using if s.action not in PREPARING), *using)), 1)


def _actions(steps: tuple[Step, ...], taken: dict[int, list[Portion]]) -> Iterator[Action]:
    for step in steps:
        takes = tuple(taken.get(step.index, ()))
        verb, implied = _VERBS.get(step.action, (step.action, {}))
        if verb not in get_args(Verb):
            verb = "Add" if takes else "Note"
        yield Action.model_validate(
            {
                "verb": verb,
                "takes": takes,
                "temperature": step.temperature,
                "duration": step.duration,
                "note": step.text[:400],
                **implied,
            }
        )


def _common_name(asset: Asset) -> str:
    return asset.synonyms_en[0] if asset.synonyms_en else asset.name


def _role(text: str) -> Role:
    return next((role for word, role in _ROLES if word in text.lower()), "reagent")
