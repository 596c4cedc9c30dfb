"""Ventilate: toxic and volatile reagents are handled in vessels that stand in a working hood."""

from __future__ import annotations

from labgym.layouts.rules.arrangement import Arrangement
from labgym.layouts.rules.rule import Term
from labgym.layouts.rules.satisfaction import Instance
from labgym.layouts.rules.whereabouts import Whereabouts
from labgym.protocols import Protocol
from labgym.protocols.capability import is_ventilated


def ventilation_instances(arrangement: Arrangement, protocol: Protocol) -> list[Instance]:
    """Return one instance for each `ventilate` constraint of a protocol.

    The satisfaction is the share of the vessels of the steps that stand in a ventilated place: of the instruments that
    the protocol puts at the location and that a step with the reagent uses there. It is 0 if the location is not
    placed. A vessel outside is a hard violation (OSHA 1910.1450, appendix A; TRGS 526, 4.3.2: work
    with dangerous vapors is done in the hood).
    """
    whereabouts = Whereabouts(arrangement, protocol)
    homes = {rule.subject: rule.object for rule in protocol.spatial_constraints if rule.kind == "on"}
    instances = []
    for constraint in protocol.chemical_constraints:
        if constraint.kind != "ventilate":
            continue
        reagent, location = constraint.subject, constraint.object
        place = whereabouts.place(location)
        vessels = [
            name
            for name in dict.fromkeys(
                name
                for step in protocol.steps
                if step.location == location and reagent in step.uses
                for name in step.uses
            )
            if homes.get(name) == location and whereabouts.of_name(name)
        ]
        outside = [name for name in vessels if not _inside(whereabouts, name)]
        ids: tuple[str, ...] = () if place is None else (arrangement.placements[place].id,)
        share = 0.0 if place is None else 1.0 - len(outside) / len(vessels) if vessels else 1.0
        ids += tuple(arrangement.placements[whereabouts.of_name(name)[0]].id for name in outside)
        note = f"{reagent} needs ventilation: {', '.join(outside)} outside of {location}" if outside else ""
        instances.append(Instance("ventilation", ids, None, 0.0, share, bool(outside), note))
    return instances


def _inside(whereabouts: Whereabouts, name: str) -> bool:
    """Whether some placement of an asset stands in a ventilated place."""
    assets = whereabouts.arrangement.assets
    carriers = (whereabouts.carriers(row) for row in whereabouts.of_name(name))
    return any(any(is_ventilated(assets[carrier]) for carrier in own) for own in carriers)


def _inside_hood(instance: Instance) -> tuple[float, str, str]:
    place, vessels = instance.ids[:1], instance.ids[1:]
    return 1.0, instance.note, f"place {', '.join(vessels)} in {place[0]}" if vessels else "place it"


VENTILATED = Term(
    name="ventilation",
    metric="ventilate",
    requires="Toxic and volatile reagents are handled in vessels that stand in a working hood",
    source="OSHA 29 CFR 1910.1450, appendix A; TRGS 526, 4.3.2",
    instances=lambda site: () if site.protocol is None else ventilation_instances(site.arrangement, site.protocol),
    remedy=_inside_hood,
    void="unusable",
)
