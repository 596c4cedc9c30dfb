"""The chemical and spatial constraints that follow from a protocol's reagents, instruments and steps."""

from __future__ import annotations

from collections import Counter
from itertools import pairwise

from labgym.assets import Asset, Catalog, pairs
from labgym.protocols.model import ChemicalConstraint, Protocol, SpatialConstraint
from labgym.protocols.places import is_ventilated

VESSELS = ("flask", "beaker", "vessel", "reactor")
ASSEMBLY = ("condenser", "adapter", "trap", "funnel")
CONDITIONING = ("heating", "cooling", "stirring")
SHARED_TRIPS = 2
"""Two locations that are walked between this often or more want to be near each other."""


def derive(protocol: Protocol) -> Protocol:
    """Return the protocol with the constraints that its content implies in place of those that it had.

    Raises:
        UnknownNameError: the protocol names an asset that the catalogue lacks.
    """
    return protocol.model_copy(
        update={
            "chemical_constraints": chemical_constraints(protocol),
            "spatial_constraints": spatial_constraints(protocol),
        }
    )


def chemical_constraints(protocol: Protocol) -> tuple[ChemicalConstraint, ...]:
    """Return what must be kept apart, stored or ventilated.

    Flammable reagents from heat sources (not from instruments that merely run warm), incompatible reagents from
    each other, each reagent in its storage class, and toxic or volatile ones handled where it is ventilated.
    """
    catalog = Catalog.load()
    reagents = [catalog.get(use.name) for use in protocol.reagents]
    return (
        *_heat(protocol, reagents),
        *_incompatible(reagents),
        *_storage(reagents),
        *_ventilation(protocol, reagents),
    )


def spatial_constraints(protocol: Protocol) -> tuple[SpatialConstraint, ...]:
    """Return where instruments stand and what wants to be close.

    An instrument stands where it is first used; apparatus of one step stands together; locations between which the
    protocol goes back and forth are near each other.
    """
    return (*_standing(protocol), *_assemblies(protocol), *_neighbours(protocol))


def _heat(protocol: Protocol, reagents: list[Asset]) -> list[ChemicalConstraint]:
    catalog = Catalog.load()
    instruments = [catalog.get(name) for name in dict.fromkeys(protocol.instruments)]
    sources = [asset for asset in instruments if asset.heat_class not in (None, "instrument")]
    return [
        ChemicalConstraint(
            kind="separate_heat", subject=reagent.name, object=source.name, reason=_ignition(reagent, source)
        )
        for reagent in reagents
        if reagent.hazards.flammable
        for source in sources
    ]


def _ignition(reagent: Asset, source: Asset) -> str:
    chemistry = reagent.chemistry
    flash = None if chemistry is None else chemistry.flash_point
    what = f"flash point {flash:g} C" if flash is not None else "flammable"
    return f"{what}; heat source of class {source.heat_class}"


def _incompatible(reagents: list[Asset]) -> list[ChemicalConstraint]:
    return [
        ChemicalConstraint(kind="separate_incompatible", subject=a, object=b, reason=f"{hazard.kind}: {hazard.hazard}")
        for a, b, hazard in pairs(reagents)
    ]


def _storage(reagents: list[Asset]) -> list[ChemicalConstraint]:
    found = []
    for reagent in reagents:
        if reagent.chemistry is not None:
            kept = reagent.chemistry.storage_class
            found.append(
                ChemicalConstraint(kind="store", subject=reagent.name, object=kept, reason=_why_stored(reagent))
            )
    return found


def _why_stored(reagent: Asset) -> str:
    flags = [name for name, value in reagent.hazards if value]
    if reagent.chemistry is not None and reagent.chemistry.water_reactive:
        flags.append("water_reactive")
    return ", ".join(flags).replace("_", " ") or "no particular hazard"


def _ventilation(protocol: Protocol, reagents: list[Asset]) -> list[ChemicalConstraint]:
    catalog = Catalog.load()
    found = []
    for reagent in reagents:
        if reagent.hazards.volatile_or_toxic:
            for location in protocol.locations:
                handled = any(step.location == location and reagent.name in step.uses for step in protocol.steps)
                if handled and is_ventilated(catalog.get(location)):
                    reason = "toxic or volatile, handled open"
                    found.append(
                        ChemicalConstraint(kind="ventilate", subject=reagent.name, object=location, reason=reason)
                    )
    return found


def _standing(protocol: Protocol) -> list[SpatialConstraint]:
    first: dict[str, SpatialConstraint] = {}
    for step in protocol.steps:
        for name in step.uses:
            if name in protocol.instruments and name not in first and Catalog.load().get(name).placing == "desktop":
                reason = f"first used in step {step.index}"
                first[name] = SpatialConstraint(kind="on", subject=name, object=step.location, reason=reason)
    return list(first.values())


def _assemblies(protocol: Protocol) -> list[SpatialConstraint]:
    catalog = Catalog.load()
    found: dict[tuple[str, str], SpatialConstraint] = {}
    for step in protocol.steps:
        used = [catalog.get(name) for name in step.uses if name in protocol.instruments]
        for vessel in [asset for asset in used if asset.subtype in VESSELS][:1]:
            for other in used:
                if other.subtype in ASSEMBLY or other.category in CONDITIONING:
                    reason = f"one apparatus in step {step.index}"
                    link = SpatialConstraint(kind="near", subject=other.name, object=vessel.name, reason=reason)
                    found.setdefault((other.name, vessel.name), link)
    return list(found.values())


def _neighbours(protocol: Protocol) -> list[SpatialConstraint]:
    trips = Counter(tuple(sorted(leg)) for leg in pairwise(protocol.route))
    return [
        SpatialConstraint(kind="near", subject=a, object=b, reason=f"{count} trips between them")
        for (a, b), count in sorted(trips.items())
        if count >= SHARED_TRIPS
    ]
