"""Reagents as users name them: by name, synonym or CAS number, or as a structure (SMILES, extra `chem`)."""

from __future__ import annotations

from collections.abc import Sequence

from labgym.assets.catalog import Catalog
from labgym.assets.inference.bottle import infer
from labgym.assets.model import Asset
from labgym.assets.structures import StructureError, reagent_of
from labgym.errors import MissingDependencyError, OptionError, UnknownNameError

SMILES_SIGNS = frozenset("=#()[]@")
"""Characters that are common in SMILES and rare in names."""


def reactive_reagent(catalog: Catalog, text: str) -> Asset:
    """Return the reagent that a name or a SMILES means, with known reactive groups.

    Raises:
        UnknownNameError: neither a name of the catalog nor a structure; lists the nearest names.
        OptionError: the asset is not a reagent, or none of its reactive groups are known.
        MissingDependencyError: the text looks like a SMILES and RDKit is not installed.
    """
    match = catalog.match(text)
    asset = catalog.get(match.name) if match is not None else reagent_by_structure(catalog, text)
    if asset.kind != "reagent":
        raise OptionError(f"{asset.name} is an asset of kind {asset.kind} ({asset.category}): name two reagents")
    if not asset.groups:
        raise OptionError(f"no reactive group of {asset.name} is known, so its reactions cannot be looked up")
    return asset


def reagent_by_structure(catalog: Catalog, smiles: str) -> Asset:
    """Return the reagent that a SMILES is: the catalog's, or one with groups inferred from the structure.

    An abbreviation that the catalog lacks may be a valid SMILES by accident, as NCS is. Text without any of
    `SMILES_SIGNS` is therefore compared with the structures of the catalog only.

    Raises:
        UnknownNameError: not a SMILES, or letters that name nothing; lists the nearest names.
        MissingDependencyError: the text looks like a SMILES and RDKit is not installed.
    """
    looks_like_smiles = not SMILES_SIGNS.isdisjoint(smiles)
    try:
        asset = reagent_of(smiles, catalog.of_kind("reagent"))
        if asset is None and looks_like_smiles:
            asset = infer(smiles)
    except StructureError:
        asset = None
    except MissingDependencyError:
        if looks_like_smiles:
            raise
        asset = None
    if asset is None:
        near = [name for name in catalog.nearest(smiles, 20) if catalog.get(name).kind == "reagent"]
        remedy = "a SMILES is also accepted"
        raise UnknownNameError("reagent", smiles, catalog.names, near[:5], remedy)
    return asset


def distinct(reagents: Sequence[Asset]) -> list[Asset]:
    """Return the reagents with one name per structure.

    Inferred reagents are named after their formula, which isomers share: these get a numbered suffix.
    """
    structures = sorted({asset.chemistry.smiles or "" for asset in reagents if asset.chemistry is not None})
    if len({asset.name for asset in reagents}) >= len(structures):
        return list(reagents)
    return [
        asset.model_copy(update={"name": f"{asset.name}Isomer{structures.index(asset.chemistry.smiles or '') + 1}"})
        for asset in reagents
        if asset.chemistry is not None
    ]
