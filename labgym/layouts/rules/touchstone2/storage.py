"""Store, version 2: a reagent is stored if it stands in a cabinet of its storage class."""

from __future__ import annotations

from labgym.layouts.rules.arrangement import Arrangement
from labgym.layouts.rules.satisfaction import Instance
from labgym.layouts.rules.storage import storage_cabinet


def class_instances(arrangement: Arrangement) -> tuple[Instance, ...]:
    """Return one instance for each placed reagent: 1 on a shelf of a cabinet of its class, else 0 and hard.

    The classes are the catalog's (segregation of incompatible chemicals: Prudent Practices, 5.E.2; IFC 5003.9.8).
    A reagent without a class is at home in any reagent cabinet.
    """
    instances = []
    for row in arrangement.reagents:
        cabinet, chemistry = storage_cabinet(arrangement, row), arrangement.assets[row].chemistry
        own = None if chemistry is None else chemistry.storage_class
        if cabinet is None:
            note = "not in a storage cabinet"
        elif own is not None and arrangement.assets[cabinet].storage_class != own:
            note = f"of storage class {own}, in a cabinet of class {arrangement.assets[cabinet].storage_class}"
        else:
            note = ""
        ids = (arrangement.placements[row].id,)
        instances.append(Instance("storage", ids, None, 0.0, float(not note), bool(note), note))
    return tuple(instances)
