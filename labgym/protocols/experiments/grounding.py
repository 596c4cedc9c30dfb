"""Grounding: which asset each material of an experiment is, by name, by CAS number or by structure."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from functools import cached_property

from labgym.assets import Asset, Catalog
from labgym.assets.structures import canonical
from labgym.errors import LabgymError, UnknownNameError
from labgym.protocols.experiments.model import Experiment, Material

MAX_STRUCTURE = 300
"""Longest SMILES, in characters, that is compared by structure; the catalog's longest has a third of that."""
SOLVENTS = ("organic_solvent", "solvent")
"""Categories of solvents."""
WATER = "DeionizedWater"
_REMARK = re.compile(
    r"^(.*[^\s(])\s*\((?![^()]*(?:yl|idene|oxy|amino|[ou]ro|bromo|iodo|nitro)\))([^()]*)\)((?:[\s,].*)?)$", re.DOTALL
)
"""A bracket in or behind a name that is no substituent: "palladium (II) acetate", "trimethylsilyl chloride (TMSCl)"."""
_NUMBERED = re.compile(r"^([a-z][a-z -]{3,}?)[ _-]?\d{1,2}$")
_SOLUTION = re.compile(r"^(.*[^ _-])[ _-]+solution$", re.IGNORECASE)
_SOLUTION_OF = re.compile(r"^(?:(.*?[^ _-])[ _-]+)?solution of (.+)$", re.IGNORECASE | re.DOTALL)
_IN = re.compile(r"^(.+?) in (?:an? |the )?(.+)$", re.IGNORECASE | re.DOTALL)
_HALF = re.compile(r"^half[ -](?=saturated)", re.IGNORECASE)


class Grounder:
    """Finds materials in a catalog; structures are compared in canonical form if RDKit is installed."""

    def __init__(self, catalog: Catalog) -> None:
        self.catalog = catalog
        self._names: dict[tuple[str, str], str | None] = {}

    def find(self, material: Material) -> str | None:
        """Return the name of the reagent that a material is, or None if the catalog lacks it.

        A structure, if there is one and RDKit can compare it, outweighs the name. A solution is its solute.
        """
        key = (material.name, material.smiles)
        if key not in self._names:
            self._names[key] = self._by_structure(material.smiles) or self._by_name(material)
        return self._names[key]

    def _by_name(self, material: Material) -> str | None:
        asset = next((asset for name in self._readings(material.name) if (asset := self._reagent(name))), None)
        if asset is None:
            return None
        stored = asset.smiles
        if material.smiles and stored and not _agree(material.smiles, stored):
            return None
        return asset.name

    def _reagent(self, name: str) -> Asset | None:
        try:
            asset = self.catalog.find(name)
        except UnknownNameError:
            return None
        return asset if asset.kind == "reagent" else None

    def _readings(self, name: str) -> Iterator[str]:
        """Yield what a name can mean, the most literal first.

        Besides the name itself: the numbered copies of one reagent that machine files have ("water1"), a name with its
        abbreviation ("t-butyldimethylsilyl chloride(TBDMSCl)") and the solute of a solution in a known solvent ("sodium
        iodide acetonitrile solution", "glyoxal in water").
        """
        yield name
        yield _HALF.sub("", name)
        numbered = _NUMBERED.match(name)
        if numbered:
            yield numbered[1]
        remark = _REMARK.match(name)
        if remark:
            without = f"{remark[1]}{remark[3]}".strip()
            yield without
            if not remark[3].strip():
                yield remark[2]
            yield from self._solutes(without)
        yield from self._solutes(name)

    def _solutes(self, name: str) -> Iterator[str]:
        """Yield the solute of a name that says "solution" or "in", if what is left names a solvent.

        A solvent in another solvent is a mixture and has no solute.
        """
        yield from (solute for solute in self._parts(name) if not self._is_solvent(solute))

    def _parts(self, name: str) -> Iterator[str]:
        for pattern, solute, solvent in ((_SOLUTION_OF, 2, 1), (_IN, 1, 2)):
            match = pattern.match(name)
            if match and (match[solvent] is None or self._is_solvent(_without_solution(match[solvent]))):
                yield _without_solution(match[solute])
        whole = _SOLUTION.match(name)
        words = whole[1].replace("_", " ").split() if whole else []
        for count in range(1, len(words)):
            if self._is_solvent(" ".join(words[count:])):
                yield " ".join(words[:count])

    def _is_solvent(self, name: str) -> bool:
        asset = self._reagent(name)
        return asset is not None and (asset.category in SOLVENTS or asset.name == WATER)

    def _by_structure(self, smiles: str) -> str | None:
        if not smiles or len(smiles) > MAX_STRUCTURE:
            return None
        return self._structures.get(_canonical(smiles) or smiles)

    @cached_property
    def _structures(self) -> Mapping[str, str]:
        names: dict[str, str] = {}
        for asset in sorted(self.catalog.of_kind("reagent"), key=_precedence):
            if asset.smiles:
                names.setdefault(_canonical(asset.smiles) or asset.smiles, asset.name)
        return names


def grounded(experiment: Experiment, names: Mapping[str, str]) -> Experiment:
    """Return an experiment with its materials under the names of assets; materials of the same asset are merged."""
    materials: dict[str, Material] = {}
    for material in experiment.materials:
        name = names[material.name]
        materials.setdefault(name, material.model_copy(update={"name": name}))
    actions = tuple(
        action.model_copy(update={"takes": tuple(p.model_copy(update={"name": names[p.name]}) for p in action.takes)})
        for action in experiment.actions
    )
    return experiment.model_copy(update={"materials": tuple(materials.values()), "actions": actions})


def _precedence(asset: Asset) -> tuple[bool, str]:
    return (not asset.core, asset.name)


def _without_solution(name: str) -> str:
    match = _SOLUTION.match(name)
    return match[1] if match else name


def _agree(smiles: str, stored: str) -> bool:
    first, second = _canonical(smiles), _canonical(stored)
    return first is None or second is None or first == second


def _canonical(smiles: str) -> str | None:
    """Return the canonical form of a structure, or None without RDKit or if it cannot be read."""
    try:
        return canonical(smiles)
    except LabgymError:
        return None
