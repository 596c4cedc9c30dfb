"""Derived constraints say what the catalogue and the steps imply."""

from __future__ import annotations

from collections import Counter
from itertools import combinations, pairwise

from every_case import for_each

from labgym.assets import Catalog, incompatible
from labgym.protocols import protocols

CATALOG = Catalog.load()
LIBRARY = protocols()
each = for_each("protocol", LIBRARY.values())


def named(protocol, kind):
    return {(item.subject, item.object) for item in protocol.chemical_constraints if item.kind == kind}


@each
def test_each_flammable_reagent_is_kept_from_each_source_of_real_heat(protocol):
    flammable = [use.name for use in protocol.reagents if CATALOG.get(use.name).hazards.flammable]
    hot = [
        name
        for name in protocol.instruments
        if CATALOG.get(name).heat_class in ("flame", "hot_surface", "bath", "oven")
    ]
    assert named(protocol, "separate_heat") == {(reagent, source) for reagent in flammable for source in hot}


@each
def test_each_incompatible_pair_is_separated_once(protocol):
    names = sorted(use.name for use in protocol.reagents)
    pairs = {(a, b) for a, b in combinations(names, 2) if incompatible(CATALOG.get(a), CATALOG.get(b)) is not None}
    assert named(protocol, "separate_incompatible") == pairs


@each
def test_each_reagent_has_one_storage_class(protocol):
    stored = named(protocol, "store")
    assert stored == {(use.name, CATALOG.get(use.name).chemistry.storage_class) for use in protocol.reagents}
    assert len(stored) == len(protocol.reagents)


@each
def test_toxic_reagents_that_are_opened_outside_the_preparation_are_ventilated(protocol):
    ventilated = named(protocol, "ventilate")
    for step in protocol.steps:
        for name in step.uses:
            asset = CATALOG.get(name)
            if asset.kind == "reagent" and asset.hazards.volatile_or_toxic and step.location == "FumeHood":
                assert (name, "FumeHood") in ventilated
    assert all(CATALOG.get(name).hazards.volatile_or_toxic for name, _ in ventilated)


@each
def test_each_instrument_stands_where_it_is_first_used(protocol):
    standing = {item.subject: item.object for item in protocol.spatial_constraints if item.kind == "on"}
    assert set(standing) == set(protocol.instruments)
    for name, place in standing.items():
        assert next(step.location for step in protocol.steps if name in step.uses) == place


@each
def test_places_walked_between_twice_are_near(protocol):
    legs = Counter(frozenset(leg) for leg in pairwise(protocol.route))
    often = {leg for leg, count in legs.items() if count >= 2}
    near = {frozenset((item.subject, item.object)) for item in protocol.spatial_constraints if item.kind == "near"}
    places = set(protocol.locations)
    assert {pair for pair in near if pair <= places} == often


def test_a_known_protocol_in_full():
    protocol = LIBRARY["sub_01"]
    assert ("Acetone", "OilBath") in named(protocol, "separate_heat")
    assert ("Acetone", "MeltingPointApparatus") not in named(protocol, "separate_heat")
    assert ("BenzylBromide", "FumeHood") in named(protocol, "ventilate")
    assert ("PotassiumCarbonate", "Base") in named(protocol, "store")
    spatial = {(item.kind, item.subject, item.object) for item in protocol.spatial_constraints}
    assert ("on", "MeltingPointApparatus", "ValidationPlatform") in spatial
    assert ("near", "RefluxCondenser", "RoundBottomFlask") in spatial
    assert ("near", "FumeHood", "RotaryEvaporatorStation") in spatial
