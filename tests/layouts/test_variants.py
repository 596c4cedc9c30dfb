"""Variants of furniture: which floors have them, and what they may replace."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from labgym.assets import Catalog
from labgym.assets.checks import check
from labgym.assets.shapes import build
from labgym.layouts import generate
from labgym.layouts.clutter import add_clutter
from labgym.layouts.floors import draw_floor
from labgym.layouts.generate import generate_assessed, resolve_request
from labgym.layouts.style import Style, draw_variants
from labgym.protocols import protocols

CATALOG = Catalog.load()
VARIANTS = [asset for asset in CATALOG if asset.variant_of is not None]
ROLES = sorted({asset.role for asset in VARIANTS})
FAMILIES_OF_FURNITURE = {
    "bench": "LabBench1800",
    "island": "IslandBench",
    "hood": "FumeHood",
    "cabinet": "GeneralCabinet",
    "shelf": "EquipmentRack",
    "stool": "LabStool",
    "trolley": "ServiceTrolley",
}


def held_out_floor(family, seed, clutter=0):
    """A floor as test splits draw it."""
    draw = draw_floor(family, seed, held_out=True)
    request = resolve_request("sub_01", seed, None, "default", floor=draw.floor, clutter=clutter)
    return generate_assessed(replace(request, style=Style.of(draw.style), family=family))[0]


@pytest.mark.parametrize("role", FAMILIES_OF_FURNITURE.values(), ids=FAMILIES_OF_FURNITURE)
def test_there_are_three_variants_for_training_and_two_held_out_ones(role):
    assert len(CATALOG.variants(role)) >= 3
    assert len(CATALOG.variants(role, held_out=True)) >= 2


@pytest.mark.parametrize("role", ROLES)
def test_variants_of_an_asset_differ_in_size_or_look(role):
    looks = [CATALOG.get(role), *(asset for asset in VARIANTS if asset.role == role)]
    assert len({(asset.size, asset.shape.name, str(asset.shape.parameters)) for asset in looks}) == len(looks)
    held_out = {asset.size for asset in CATALOG.variants(role, held_out=True)}
    assert not held_out & {asset.size for asset in looks if not asset.held_out}


@pytest.mark.parametrize("asset", VARIANTS, ids=lambda asset: asset.name)
def test_the_parts_of_a_variant_fill_its_box(asset):
    bounds = np.array([part.bounds() for part in build(asset)])
    low, high = bounds[:, 0].min(axis=0), bounds[:, 1].max(axis=0)
    size = asset.size
    assert np.allclose(low, (-size.width / 2, -size.depth / 2, 0.0), atol=3e-3)
    assert np.allclose(high, (size.width / 2, size.depth / 2, size.height), atol=3e-3)


def test_a_variant_that_cannot_take_the_role_is_a_problem():
    hood = CATALOG.variants("FumeHood")[0]
    wrong = [
        hood.model_copy(update={"name": "A1", "fume_hood": False, "synonyms_en": ("a1",), "synonyms_zh": ("甲",)}),
        hood.model_copy(update={"name": "A2", "variant_of": "Nothing", "synonyms_en": ("a2",), "synonyms_zh": ("乙",)}),
    ]
    problems = {(one.asset, one.field) for one in check(Catalog([CATALOG.get("FumeHood"), *wrong]))}
    assert {("A1", "fume_hood"), ("A2", "variant_of")} <= problems


def test_a_search_finds_variants_by_their_names_alone():
    assert CATALOG.find("FumeHoodOpen").name == "FumeHoodOpen"
    assert CATALOG.find("fume hood").name == "FumeHood"
    assert CATALOG.find("fumehod").name == "FumeHood"
    names = {match.name for text in ("bench", "fume hood", "stool", "trolley") for match in CATALOG.candidates(text, 9)}
    assert not names & {asset.name for asset in VARIANTS}


def test_draws_follow_the_seed_and_never_mix_training_with_held_out_ones():
    assert draw_variants(CATALOG, "plain", 1) == {}
    drawn = {variety: set() for variety in ("training", "held_out")}
    for seed in range(40):
        for variety, names in drawn.items():
            chosen = draw_variants(CATALOG, variety, seed)
            assert chosen == draw_variants(CATALOG, variety, seed)
            assert all(CATALOG.get(name).role == role for role, name in chosen.items())
            names.update(chosen.values())
    assert drawn["training"] == {asset.name for asset in VARIANTS if not asset.held_out}
    assert drawn["held_out"] == {asset.name for asset in VARIANTS if asset.held_out}


def test_a_held_out_floor_shows_no_furniture_that_training_shows():
    layout = held_out_floor("double", 21, clutter=2)
    placed = [layout.asset(placement.id) for placement in layout.placements]
    assert not [asset.name for asset in placed if asset.name in ROLES]
    assert {asset.name for asset in placed if asset.held_out}
    assert not [asset.name for asset in placed if asset.variant_of and not asset.held_out]
    location = next(step.location for step in protocols()["sub_01"].steps if step.location == "FumeHood")
    assert layout.asset(layout.find(location).id).held_out


def test_training_floors_show_no_held_out_furniture_and_provenance_names_the_variants():
    layout = generate("sub_01", 4, family="ell", clutter=1)
    assert not any(layout.asset(placement.id).held_out for placement in layout.placements)
    chosen = layout.provenance.options["variants"]
    assert chosen == draw_variants(CATALOG, "training", 4)
    assert {p.asset for p in layout.placements if layout.asset(p.id).variant_of} <= set(chosen.values())


def test_rooms_and_floors_that_a_user_names_have_no_variants():
    for layout in (generate("sub_01", 4), generate(["sub_01", "red_02"], 4, room="12x9")):
        assert not any(layout.asset(placement.id).variant_of for placement in layout.placements)


def test_clutter_takes_other_variants_if_they_are_named():
    layout = generate("sub_01", 4)
    used = add_clutter(layout, 3, np.random.default_rng(1), {"Carton": "SteelDrum"})
    names = {placement.asset for placement in used.placements[len(layout.placements) :]}
    assert "SteelDrum" in names
    assert "Carton" not in names
