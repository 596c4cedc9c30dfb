"""Segregation rules separate what chemists keep apart and leave alone what they keep together."""

from __future__ import annotations

from itertools import combinations

import pytest

from labgym.assets import Catalog, incompatible, pairs
from labgym.assets.compatibility import UNCLASSIFIED, rulebook, rules, traits
from labgym.assets.flags import FLAGS
from labgym.assets.inference import substructures
from labgym.errors import UnknownNameError
from labgym.layouts.places import published_protocols

CATALOG = Catalog.load()
REAGENTS = CATALOG.of_kind("reagent")
PROFILES = ("segregation", "boolean")


def get(name):
    return CATALOG.get(name)


@pytest.mark.parametrize(
    ("a", "b", "kind"),
    [
        ("HydrochloricAcid", "SodiumHydroxide", "strong_acid_with_base"),
        ("SodiumHypochlorite", "AceticAcid", "acid_with_hypochlorite"),
        ("SodiumAzide", "Dichloromethane", "azide_or_hydrazine_with_halide"),
        ("SodiumCyanide", "AceticAcid", "acid_with_toxic_gas_former"),
        ("SodiumHypochlorite", "AmmoniumHydroxide", "hypochlorite_with_ammonia_or_amine"),
        ("PotassiumPermanganate", "Glycerol", "oxidizer_with_organic_fuel"),
        ("NitricAcid", "Acetone", "oxidizer_with_organic_fuel"),
        ("Sodium", "Chloroform", "metal_with_halogenated_organic"),
        ("Sodium", "DeionizedWater", "water_reactive_with_aqueous"),
        ("LithiumAluminumHydride", "EthylAcetate", "hydride_with_carbonyl"),
        ("PalladiumOnCarbon", "Hydrogen", "hydrogenation_catalyst_with_hydrogen"),
        ("AcetylChloride", "Ethanol", "acyl_halide_with_nucleophile"),
        ("SodiumSulfite", "HydrochloricAcid", "acid_with_toxic_gas_former"),
        ("HydrogenPeroxide", "SodiumSulfite", "oxidizer_with_reducer"),
        ("BenzoylPeroxide", "Aniline", "oxidizer_with_oxidizable_aromatic"),
        ("NitricAcid", "Aniline", "oxidizer_with_oxidizable_aromatic"),
        ("NitricAcid", "Phenol", "oxidizer_with_oxidizable_aromatic"),
        ("PerchloricAcid", "AceticAnhydride", "anhydride_with_nucleophile_or_catalyst"),
    ],
)
def test_known_dangers_are_told_with_kind_hazard_and_source(a, b, kind):
    hazard = incompatible(get(a), get(b))
    assert hazard is not None
    assert hazard.kind == kind
    assert hazard.hazard
    assert hazard.source


@pytest.mark.parametrize(
    ("a", "b"),
    [
        ("Acetone", "Ethanol"),
        ("EthylAcetate", "NHexane"),
        ("SodiumChloride", "MagnesiumSulfate"),
        ("SodiumHydroxide", "PotassiumCarbonate"),
        ("HydrochloricAcid", "PhosphoricAcid"),
        ("NitrogenGas", "Hydrogen"),
        ("Toluene", "Tetrahydrofuran"),
        ("PotassiumPermanganate", "SodiumPeriodate"),
        ("Celite", "SulfuricAcid"),
        ("SilicaGel", "Dichloromethane"),
    ],
)
def test_harmless_neighbours_are_left_alone(a, b):
    assert incompatible(get(a), get(b)) is None


@pytest.mark.parametrize("profile", PROFILES)
def test_symmetric_and_never_with_itself(profile):
    for a, b in combinations(REAGENTS[::3], 2):
        assert incompatible(a, b, profile) == incompatible(b, a, profile)
    for a in REAGENTS:
        assert incompatible(a, a, profile) is None


def test_only_reagents_can_be_incompatible():
    assert incompatible(get("Beaker"), get("SulfuricAcid")) is None
    assert traits(get("Beaker")) == frozenset()


@pytest.mark.parametrize(("profile", "found", "affected"), [("segregation", 51, 22), ("boolean", 35, 14)])
def test_the_published_protocols_hold_the_expected_pairs(profile, found, affected):
    counts = [len(pairs([get(use.name) for use in p.reagents], profile)) for p in published_protocols().values()]
    assert sum(counts) == found
    assert sum(count > 0 for count in counts) == affected


@pytest.mark.parametrize("profile", PROFILES)
def test_pairs_are_all_pairs_and_do_not_depend_on_order_or_repeats(profile):
    some = list(REAGENTS[:60])
    expected = {
        tuple(sorted((a.name, b.name))) for a, b in combinations(some, 2) if incompatible(a, b, profile) is not None
    }
    found = pairs(some, profile)
    assert {(a, b) for a, b, _ in found} == expected
    assert len(found) == len(expected)
    assert pairs([*reversed(some), *some], profile) == found


@pytest.mark.parametrize("profile", PROFILES)
def test_rules_speak_of_groups_and_flags_that_exist(profile):
    known = {*rulebook().groups, *FLAGS, UNCLASSIFIED}
    kinds = [rule.kind for rule in rules(profile)]
    assert len(kinds) == len(set(kinds))
    for rule in rules(profile):
        assert rule.a | rule.b <= known
        assert rule.a.isdisjoint(rule.b), f"{rule.kind} would separate a substance from its like"


@pytest.mark.parametrize("profile", PROFILES)
def test_every_rule_separates_some_reagents_of_the_catalogue(profile):
    held = [traits(asset) for asset in REAGENTS]
    for rule in rules(profile):
        if UNCLASSIFIED in rule.a:
            continue  # no reagent of the catalog is unclassified
        assert any(rule.applies(a, b) for a, b in combinations(held, 2)), rule.kind


def test_groups_of_reagents_are_defined_and_every_defined_group_is_used():
    used = {group for asset in REAGENTS for group in asset.chemistry.groups}
    inferred = {rule.gives for rule in substructures().groups}
    assert used <= set(rulebook().groups)
    assert used | inferred == set(rulebook().groups)
    assert set(rulebook().groups).isdisjoint(FLAGS)


def test_the_boolean_profile_separates_every_acid_from_every_base():
    acids = [asset for asset in REAGENTS if asset.hazards.acid and not asset.hazards.base]
    bases = [asset for asset in REAGENTS if asset.hazards.base and not asset.hazards.acid]
    assert all(incompatible(a, b, "boolean") is not None for a in acids for b in bases)


@pytest.mark.parametrize("profile", ["paper", "", "Segregation"])
def test_an_unknown_profile_names_those_that_exist(profile):
    with pytest.raises(UnknownNameError, match=r"boolean, segregation"):
        incompatible(get("Acetone"), get("Ethanol"), profile)
