"""The chemical and spatial constraints that a protocol's reagents, instruments and steps imply."""

from __future__ import annotations

from collections import Counter
from itertools import pairwise

from labgym.assets import Asset, Catalog, pairs
from labgym.protocols.capability import is_ventilated
from labgym.protocols.model import ChemicalConstraint, Protocol, SpatialConstraint

MAIN_VESSELS = ("flask", "beaker", "vessel", "reactor")
ASSEMBLY = ("condenser", "adapter", "trap", "funnel")
CONDITIONING = ("heating", "cooling", "stirring")
SHARED_TRIPS = 2
"""Number of trips between two locations from which on they should be near each other."""


def derive(protocol: Protocol, catalog: Catalog | None = None) -> Protocol:
    """Return the protocol with its constraints replaced by those that its content implies.

    Args:
        catalog: the assets that the protocol names; the default catalog if None.

    Raises:
        UnknownNameError: the protocol names an asset that the catalog lacks.
    """
    assets = protocol.assets(catalog)
    return protocol.model_copy(
        update={
            "chemical_constraints": chemical_constraints(protocol, assets),
            "spatial_constraints": spatial_constraints(protocol, assets),
        }
    )


def chemical_constraints(protocol: Protocol, catalog: Catalog) -> tuple[ChemicalConstraint, ...]:
    """Return the reagents to keep apart, their storage classes, and where they need ventilation.

    Flammable reagents are kept from heat sources (instruments that merely run warm do not count), incompatible reagents
    from each other; each reagent has a storage class; toxic or volatile reagents are handled at ventilated places.
    """
    reagents = [catalog.get(use.name) for use in protocol.reagents]
    return (
        *_heat(protocol, reagents, catalog),
        *_incompatible(reagents),
        *_storage(reagents),
        *_ventilation(protocol, reagents, catalog),
    )


def spatial_constraints(protocol: Protocol, catalog: Catalog) -> tuple[SpatialConstraint, ...]:
    """Return where instruments stand and which objects should be near each other.

    An instrument stands where it is first used; the apparatus of one step stands together; locations between which the
    protocol goes back and forth are near each other.
    """
    return (*_standing(protocol, catalog), *_assemblies(protocol, catalog), *_neighbours(protocol))


def _heat(protocol: Protocol, reagents: list[Asset], catalog: Catalog) -> list[ChemicalConstraint]:
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
    return [
        ChemicalConstraint(
            kind="store",
            subject=reagent.name,
            object=reagent.chemistry.storage_class,
            reason=_storage_reason(reagent),
        )
        for reagent in reagents
        if reagent.chemistry is not None
    ]


def _storage_reason(reagent: Asset) -> str:
    flags = [name for name, value in reagent.hazards if value]
    if reagent.chemistry is not None and reagent.chemistry.water_reactive:
        flags.append("water_reactive")
    return ", ".join(flags).replace("_", " ") or "no particular hazard"


def _ventilation(protocol: Protocol, reagents: list[Asset], catalog: Catalog) -> list[ChemicalConstraint]:
    constraints = []
    for reagent in reagents:
        if reagent.hazards.volatile_or_toxic:
            for location in protocol.locations:
                handled = any(step.location == location and reagent.name in step.uses for step in protocol.steps)
                if handled and is_ventilated(catalog.get(location)):
                    reason = "toxic or volatile, handled open"
                    constraints.append(
                        ChemicalConstraint(kind="ventilate", subject=reagent.name, object=location, reason=reason)
                    )
    return constraints


def _standing(protocol: Protocol, catalog: Catalog) -> list[SpatialConstraint]:
    first: dict[str, SpatialConstraint] = {}
    for step in protocol.steps:
        for name in step.uses:
            if name in protocol.instruments and name not in first and catalog.get(name).placing == "desktop":
                reason = f"first used in step {step.index}"
                first[name] = SpatialConstraint(kind="on", subject=name, object=step.location, reason=reason)
    return list(first.values())


def _assemblies(protocol: Protocol, catalog: Catalog) -> list[SpatialConstraint]:
    links: dict[tuple[str, str], SpatialConstraint] = {}
    for step in protocol.steps:
        used = [catalog.get(name) for name in step.uses if name in protocol.instruments]
        for vessel in [asset for asset in used if asset.subtype in MAIN_VESSELS][:1]:
            for other in used:
                if other.subtype in ASSEMBLY or other.category in CONDITIONING:
                    reason = f"one apparatus in step {step.index}"
                    # Hoses join a device on the floor to the vessel, so it stands next to the place of the step.
                    partner = vessel.name if other.placing == "desktop" else step.location
                    link = SpatialConstraint(kind="near", subject=other.name, object=partner, reason=reason)
                    links.setdefault((other.name, partner), link)
    return list(links.values())


def _neighbours(protocol: Protocol) -> list[SpatialConstraint]:
    trips = Counter(tuple(sorted(leg)) for leg in pairwise(protocol.route))
    return [
        SpatialConstraint(kind="near", subject=a, object=b, reason=f"{count} trips between them")
        for (a, b), count in sorted(trips.items())
        if count >= SHARED_TRIPS
    ]
