"""Checks that an experiment is complete and that its amounts are consistent with each other and the catalog."""

from __future__ import annotations

import re
from collections.abc import Iterator

from labgym.assets import Asset, Catalog
from labgym.protocols.amounts import read_amount
from labgym.protocols.experiments.model import Experiment

TOLERANCE = 0.03
"""Tolerated relative disagreement between mass, volume and moles of one amount, beyond their rounding."""
_DILUTED = re.compile(r"%|\baq\b|sat|solution|in (?:water|hexanes?|thf|ethanol|methanol|toluene)|wet|conc", re.I)
_MOLAR = re.compile(r"(?<!\d)(\d+(?:\.\d+)?)\s*M\b")
_DECIMALS = re.compile(r"(?<!\d)\d+(?:\.(\d+))?\s*(mg|g|mL|mmol|mol|[µμ]L|L)\b")
_CHINESE = re.compile(r"[\u4e00-\u9fff]")


def check(experiment: Experiment, catalog: Catalog | None = None) -> list[str]:
    """Return what is missing or inconsistent, one sentence each; empty for a sound experiment.

    Args:
        catalog: source of molar masses and densities; the default catalog if None.
    """
    assets = catalog if catalog is not None else Catalog.load()
    return [*_incomplete(experiment), *_amounts(experiment, assets)]


def _incomplete(experiment: Experiment) -> Iterator[str]:
    used = {portion.name for action in experiment.actions for portion in action.takes}
    for material in experiment.materials:
        if material.name not in used:
            yield f"{material.name} is listed as a material, but no action takes it"
    names = [material.name for material in experiment.materials]
    for name in sorted({name for name in names if names.count(name) > 1}):
        yield f"{name} is listed twice among the materials"
    parts = experiment.reaction.split(">")
    if len(parts) != 3 or not parts[0] or not parts[2]:
        yield "the reaction SMILES does not have the form reactants>agents>products"
    if experiment.reaction_type is None:
        yield "the reaction type is missing"
    if not experiment.product or len(experiment.description) < 40:
        yield "the product is missing, or the description has fewer than 40 characters"
    if len(experiment.synonyms) < 2 or not any(_CHINESE.search(synonym) for synonym in experiment.synonyms):
        yield "it has fewer than two synonyms, or no Chinese synonym"
    verbs = [action.verb for action in experiment.actions]
    if verbs[-1] != "Yield" or "Analyze" not in verbs:
        yield "it has no analysis, or does not end with the action Yield"


def _amounts(experiment: Experiment, catalog: Catalog) -> Iterator[str]:
    for number, action in enumerate(experiment.actions, 1):
        for portion in action.takes:
            if portion.name in catalog and portion.amount:
                problem = disagreement(catalog.get(portion.name), portion.amount)
                if problem:
                    yield f"action {number} ({action.verb}) takes {portion.name} {portion.amount!r}: {problem}"


def disagreement(reagent: Asset, text: str) -> str | None:
    """Return how the parts of an amount contradict each other, or None if they agree or cannot be compared.

    Mass and moles are related by the molar mass, mass and volume by the density, volume and moles of a solution by its
    molarity. Other solutions are not compared.
    """
    chemistry, amount = reagent.chemistry, read_amount(text)
    if chemistry is None:
        return None
    molar = _MOLAR.search(text)
    estimates: list[tuple[str, float, float]] = []
    if molar and amount.volume is not None and amount.moles is not None:
        expected = amount.portions * amount.volume * float(molar[1]) / 1000.0
        estimates.append(("mol by the molarity", expected, amount.moles))
    elif not molar and not _DILUTED.search(text):
        mass, density = amount.mass, chemistry.density
        if mass is None and amount.volume is not None and density:
            mass = amount.volume * density
        if mass is not None and amount.moles is not None and chemistry.molar_mass:
            estimates.append(("mol by the molar mass", amount.portions * mass / chemistry.molar_mass, amount.moles))
        if amount.mass is not None and amount.volume is not None and density and chemistry.state == "liquid":
            estimates.append(("mL by the density", amount.mass / density, amount.volume))
    slack = TOLERANCE + _rounding(text)
    for what, expected, stated in estimates:
        if abs(expected - stated) > slack * stated:
            return f"{stated:g} stated, {expected:.3g} {what}"
    return None


def _rounding(text: str) -> float:
    """Return the largest relative error that the rounding of a text's numbers can cause."""
    total = 0.0
    for number in _DECIMALS.finditer(text):
        value = float(number[0][: -len(number[2])])
        if value > 0.0:
            total += 0.5 * 10.0 ** -len(number[1] or "") / value
    return total
