"""Which asset each material of an experiment is: by name, by CAS number, or by structure."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property

from labgym.assets import Asset, Catalog
from labgym.assets.structures import canonical
from labgym.errors import LabgymError, UnknownNameError
from labgym.protocols.experiments.model import Experiment, Material

MAX_STRUCTURE = 300
"""Longest SMILES, in characters, that is compared by structure; the catalogue's longest has a third of that."""


class Grounder:
    """Finds materials in a catalogue; structures are compared in canonical form where RDKit is installed."""

    def __init__(self, catalog: Catalog) -> None:
        self.catalog = catalog
        self._found: dict[tuple[str, str], str | None] = {}

    def find(self, material: Material) -> str | None:
        """Return the name of the reagent that a material is, or None where the catalogue has none such.

        A structure, where one is given and RDKit can compare it, outweighs a name: a name can be anything.
        """
        key = (material.name, material.smiles)
        if key not in self._found:
            self._found[key] = self._by_structure(material.smiles) or self._by_name(material)
        return self._found[key]

    def _by_name(self, material: Material) -> str | None:
        try:
            asset = self.catalog.find(material.name)
        except UnknownNameError:
            return None
        stored = asset.chemistry.smiles if asset.chemistry is not None else None
        if asset.kind != "reagent" or (material.smiles and stored and not _agree(material.smiles, stored)):
            return None
        return asset.name

    def _by_structure(self, smiles: str) -> str | None:
        if not smiles or len(smiles) > MAX_STRUCTURE:
            return None
        return self._structures.get(_canonical(smiles) or smiles)

    @cached_property
    def _structures(self) -> Mapping[str, str]:
        found: dict[str, str] = {}
        for asset in sorted(self.catalog.of_kind("reagent"), key=_bottled):
            if asset.chemistry is not None and asset.chemistry.smiles:
                smiles = asset.chemistry.smiles
                found.setdefault(_canonical(smiles) or smiles, asset.name)
        return found


def grounded(experiment: Experiment, names: Mapping[str, str]) -> Experiment:
    """Return an experiment with its materials under the names of assets; those that are one asset become one."""
    materials: dict[str, Material] = {}
    for material in experiment.materials:
        name = names[material.name]
        materials.setdefault(name, material.model_copy(update={"name": name}))
    actions = tuple(
        action.model_copy(update={"takes": tuple(p.model_copy(update={"name": names[p.name]}) for p in action.takes)})
        for action in experiment.actions
    )
    return experiment.model_copy(update={"materials": tuple(materials.values()), "actions": actions})


def _bottled(asset: Asset) -> tuple[bool, str]:
    return (not asset.core, asset.name)


def _agree(given: str, stored: str) -> bool:
    first, second = _canonical(given), _canonical(stored)
    return first is None or second is None or first == second


def _canonical(smiles: str) -> str | None:
    """Return the canonical form of a structure, or None without RDKit or where it cannot be read."""
    try:
        return canonical(smiles)
    except LabgymError:
        return None
