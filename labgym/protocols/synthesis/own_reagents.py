"""Reagents that users have added: which slots of a kind of reaction they fill, by their structure.

The table lists the published reagents of each slot. A reagent of the user fills a slot if it has the structure of a
class of substances that the slot takes: a ketone or an aldehyde where borohydride reduces one.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import lru_cache

from labgym.assets import Asset, Catalog
from labgym.assets.inference.substructures import matches
from labgym.assets.structures import standard
from labgym.protocols.synthesis.transformations import Slot, Transformation, transformations


def own_reagents(names: Iterable[str], catalog: Catalog) -> tuple[Asset, ...]:
    """Return those of some reagents that the user has added."""
    return tuple(catalog.get(name) for name in dict.fromkeys(names) if name in catalog.own)


def classes_of(asset: Asset) -> frozenset[str]:
    """Return the classes of substances to which a reagent belongs; none if its entry has no SMILES.

    Raises:
        StructureError: its SMILES is not valid.
        MissingDependencyError: RDKit is not installed.
    """
    smiles = asset.chemistry.smiles if asset.chemistry is not None else None
    return _classes(smiles) if smiles else frozenset()


def with_own_reagents(kind: Transformation, names: Iterable[str], catalog: Catalog) -> Transformation:
    """Return a kind of reaction whose slots also accept the reagents of the user that fit them.

    Args:
        names: reagents that the text names.

    Raises:
        MissingDependencyError: the text names a reagent of the user, and RDKit is not installed.
    """
    own = {asset.name: classes_of(asset) for asset in own_reagents(names, catalog)}
    if not own:
        return kind
    slots = [_accepting(slot, own, catalog) for slot in kind.slots]
    return kind.model_copy(update={"slots": tuple(slots)})


def _accepting(slot: Slot, own: dict[str, frozenset[str]], catalog: Catalog) -> Slot:
    """Return a slot that accepts the reagents of the classes that it takes.

    A class counts if a listed reagent belongs to it: "amine" in a text may mean the aromatic amine of a Sandmeyer
    reaction, but an aliphatic one does not fit there.
    """
    usual = frozenset[str]().union(*(classes_of(catalog.get(name)) for name in (slot.asset, *slot.accepts)))
    fitting = [name for name, classes in own.items() if classes & usual & set(slot.classes)]
    return slot.model_copy(update={"accepts": (*slot.accepts, *fitting)}) if fitting else slot


@lru_cache(maxsize=1024)
def _classes(smiles: str) -> frozenset[str]:
    structure = standard(smiles)
    table = transformations().structures
    return frozenset(name for name, patterns in table.items() if any(matches(structure, each) for each in patterns))
