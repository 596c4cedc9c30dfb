"""Endings: which addition ends a reaction, and which materials are of the work-up alone."""

from __future__ import annotations

import re
from collections.abc import Sequence

from labgym.assets import Asset, Catalog
from labgym.protocols.experiments.feasibility import WORK_UP, is_inorganic
from labgym.protocols.experiments.grounding import WATER
from labgym.protocols.experiments.model import HOLDING, Action, Experiment, Portion, Role
from labgym.protocols.refusals import refusals

AQUEOUS = re.compile(r"\b(?:aqueous|saturated|dilute)\b|\bof \d[\d.]{0,8} ?[MN]\b|\bmL of \d[\d.]{0,8} ?%")
"""An amount of a solution in water."""
_SALTS = frozenset(
    (
        *("AmmoniumChloride", "PotassiumCarbonate", "PotassiumHydroxide", "SodiumBicarbonate", "SodiumChloride"),
        *("SodiumHydroxide", "SodiumSulfate"),
    )
)
"""Salts and bases that are added in water to end a reaction."""
_LIVELY = frozenset({"organometallic", "alkali_metal"})
_HYDROLYZED = frozenset({"acyl_halide", "anhydride", "chlorosilane", "halogenating_agent", "lewis_acid"})


def ended(experiment: Experiment, catalog: Catalog) -> Experiment:
    """Return an experiment whose water, after a hydride or organometallic has reacted, ends the reaction.

    "Water was added" after the mixture was stirred is a quench, also of an acyl halide or a Lewis acid if the work-up
    follows. Materials that only the work-up takes are of the work-up, whatever their name suggests.
    """
    roles = {material.name: material.role for material in experiment.materials}
    actions: list[Action] = []
    lively = hydrolyzed = held = quenching = False
    for place, action in enumerate(experiment.actions):
        names = [portion.name for portion in action.takes]
        assets = [catalog.get(name) for name in names if name in catalog]
        wet = any(_is_watery(catalog, portion) for portion in action.takes)
        protic = wet or any(_is_protic(asset) for asset in assets)
        fresh = any(
            asset.name in refusals().destroyed_by_protic or not _LIVELY.isdisjoint(asset.groups) for asset in assets
        )
        if fresh:
            lively, held, quenching = True, False, False
        elif any(not _HYDROLYZED.isdisjoint(asset.groups) for asset in assets):
            hydrolyzed, held, quenching = True, False, False
        elif action.verb == "Add" and wet and hydrolyzed and held and _works_up(experiment.actions[place + 1 :]):
            action = action.model_copy(update={"verb": "Quench"})
            lively, hydrolyzed, quenching = False, False, True
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


def _works_up(following: Sequence[Action]) -> bool:
    """Return whether a work-up follows, at most after some stirring."""
    rest = (action for action in following if action.verb not in HOLDING and action.verb != "Wait")
    return next((action.verb in WORK_UP for action in rest), False)


def _is_watery(catalog: Catalog, portion: Portion) -> bool:
    """Return whether a portion is water or a solution in water."""
    if portion.name not in catalog:
        return False
    asset = catalog.get(portion.name)
    if asset.name == WATER or "aqueous" in asset.groups:
        return True
    return is_inorganic(asset) and AQUEOUS.search(portion.amount) is not None


def _is_aside(names: list[str], roles: dict[str, Role], catalog: Catalog) -> bool:
    """Return whether nothing but solvents comes with the water of an addition."""
    others = [name for name in names if not (name in catalog and _is_protic(catalog.get(name)))]
    return all(roles[name] in ("solvent", "workup") or name in _SALTS for name in others)


def _is_protic(asset: Asset) -> bool:
    """Return whether a reagent destroys a hydride: water, an alcohol, or a solution in water."""
    groups = frozenset(asset.groups)
    return asset.name == WATER or asset.name in refusals().protic or "aqueous" in groups
