"""Endings: which addition ends a reaction, and which materials are of the work-up alone."""

from __future__ import annotations

from labgym.assets import Asset, Catalog
from labgym.protocols.experiments.feasibility import WORK_UP
from labgym.protocols.experiments.grounding import WATER
from labgym.protocols.experiments.model import HOLDING, Action, Experiment, Role
from labgym.protocols.refusals import refusals


def ended(experiment: Experiment, catalog: Catalog) -> Experiment:
    """Return an experiment whose water, after a hydride or organometallic has reacted, ends the reaction.

    "Water was added" after the mixture was stirred is a quench. Materials that only the work-up takes are of the
    work-up, whatever their name suggests.
    """
    roles = {material.name: material.role for material in experiment.materials}
    actions: list[Action] = []
    lively = held = quenching = False
    for action in experiment.actions:
        names = [portion.name for portion in action.takes]
        protic = any(name in catalog and _is_protic(catalog.get(name)) for name in names)
        fresh = any(name in refusals().destroyed_by_protic for name in names)
        if fresh:
            lively, held, quenching = True, False, False
        elif action.verb == "Add" and protic and (quenching or (lively and held and _is_aside(names, roles, catalog))):
            action = action.model_copy(update={"verb": "Quench"})
            lively, quenching = False, True
        elif names:
            quenching = False
        held = held or action.verb in HOLDING or action.verb == "Wait"
        actions.append(action)
    early = {portion.name for action in actions if action.verb not in WORK_UP for portion in action.takes}
    late = {portion.name for action in actions if action.verb in WORK_UP for portion in action.takes}
    materials = tuple(
        material.model_copy(update={"role": "workup"})
        if material.name in late - early and material.role == "solvent"
        else material
        for material in experiment.materials
    )
    return experiment.model_copy(update={"actions": tuple(actions), "materials": materials})


def _is_aside(names: list[str], roles: dict[str, Role], catalog: Catalog) -> bool:
    """Return whether nothing but solvents comes with the water of an addition."""
    others = [name for name in names if not (name in catalog and _is_protic(catalog.get(name)))]
    return all(roles[name] in ("solvent", "workup") for name in others)


def _is_protic(asset: Asset) -> bool:
    """Return whether a reagent destroys a hydride: water, an alcohol, or a solution in water."""
    groups = frozenset() if asset.chemistry is None else frozenset(asset.chemistry.groups)
    return asset.name == WATER or asset.name in refusals().protic or "aqueous" in groups
