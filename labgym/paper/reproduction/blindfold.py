"""Requests without something: an ablation removes the information itself, not a phase that uses it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from typing import Literal

from labgym.assets import Asset, Catalog
from labgym.assets.model import Hazards
from labgym.layouts.request import Request
from labgym.paper.rivals.reading import assets_in, description
from labgym.protocols import Protocol, protocols
from labgym.protocols.model import ReagentUse, Step

Hidden = Literal["nothing", "annotations", "protocol"]
"""What a method does not see: nothing; hazard flags, storage, heat and chemical classes, so that no rule of storage
applies; or the protocol's lists, steps and constraints, of which only the description remains."""


def blindfolded(request: Request, hidden: Hidden) -> Request:
    """Return a request without something."""
    if hidden == "annotations":
        return replace(request, catalog=bare_catalog(request.catalog), rules=request.rules.without("storage"))
    if hidden == "protocol":
        return replace(request, protocol=described(request.protocol, request.catalog))
    return request


@lru_cache(maxsize=2)
def bare_catalog(catalog: Catalog) -> Catalog:
    """Return a catalog whose entries have geometry and category alone: no hazard flags and no classes."""
    return Catalog([_bare(asset) for asset in catalog.assets])


def _bare(asset: Asset) -> Asset:
    return asset.model_copy(update={"hazards": Hazards(), "storage_class": None, "heat_class": None, "chemistry": None})


def described(protocol: Protocol, catalog: Catalog) -> Protocol:
    """Return what is left of a protocol if only its description is known.

    Reagents and instruments are those that the description names, and those that at least half of the library's other
    protocols use, which stand for general knowledge of laboratories; so do the places of work. Nothing is constrained.
    """
    texts = assets_in(description(protocol), catalog)
    others = [other for other in protocols().values() if other.id != protocol.id]
    reagents = _typical([[use.name for use in other.reagents] for other in others])
    instruments = _typical([other.instruments for other in others])
    reagents = dict.fromkeys([*(asset.name for asset in texts if asset.kind == "reagent"), *reagents])
    instruments = dict.fromkeys([*(asset.name for asset in texts if asset.kind == "instrument"), *instruments])
    places = _typical([other.locations for other in others])
    return protocol.model_copy(
        update={
            "reagents": tuple(ReagentUse(name=name, role="unknown") for name in reagents),
            "instruments": tuple(instruments),
            "steps": tuple(
                Step(index=index, location=place, action="work", text="Work.") for index, place in enumerate(places, 1)
            ),
            "chemical_constraints": (),
            "spatial_constraints": (),
        }
    )


def _typical(lists: Sequence[Sequence[str]]) -> dict[str, None]:
    """Return the names on at least half of the lists; the most frequent one without one."""
    counts = Counter(name for names in lists for name in set(names))
    ordered = sorted(counts, key=lambda name: (-counts[name], name))
    frequent = [name for name in ordered if 2 * counts[name] >= len(lists)]
    return dict.fromkeys(frequent or ordered[:1])
