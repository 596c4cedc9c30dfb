"""Hollow assets are hollow where things stand, solid below it, and things fit."""

from __future__ import annotations

import numpy as np
from every_case import for_each

from labgym.assets import SHELL, Catalog
from labgym.assets.model import APPARATUS_STAND

CATALOG = Catalog.load()
HOLLOW = [asset for asset in CATALOG if asset.cavity is not None]
CARRYING = [asset for asset in CATALOG if asset.surfaces]
hollow = for_each("asset", HOLLOW)
carrying = for_each("asset", CARRYING)


def inside_solid(asset, x, y, z):
    return any(
        abs(x - part.x) < part.width / 2 - 1e-9 and abs(y - part.y) < part.depth / 2 - 1e-9 and part.z0 < z < part.z1
        for part in asset.solids()
    )


def sample(surface, seed=0, count=60):
    rng = np.random.default_rng(seed)
    half = np.array([surface.width, surface.depth]) / 2 - 1e-4
    return np.array([surface.x, surface.y]) + rng.uniform(-half, half, (count, 2))


@carrying
def test_the_space_above_each_surface_is_free(asset):
    rng = np.random.default_rng(1)
    for surface in asset.surfaces:
        headroom = surface.headroom if surface.headroom is not None else 1.0
        for x, y in sample(surface):
            z = surface.z + rng.uniform(1e-4, headroom - 1e-4)
            assert not inside_solid(asset, x, y, z)


# What the slots of a stand hold rests on other pieces and in clamps: see test_apparatus.py.
@for_each("asset", [asset for asset in CARRYING if asset.subtype != APPARATUS_STAND])
def test_each_surface_is_carried_by_something_solid(asset):
    for surface in asset.surfaces:
        for x, y in sample(surface):
            assert inside_solid(asset, x, y, surface.z - SHELL / 4)


@hollow
def test_each_surface_ends_at_a_board_or_the_ceiling(asset):
    for surface in asset.surfaces:
        x, y = surface.x, surface.y
        assert inside_solid(asset, x, y, surface.z + surface.headroom + SHELL / 4)


@hollow
def test_walls_close_the_hollow_unless_it_is_open(asset):
    cavity, size = asset.cavity, asset.size
    z = (asset.surfaces[0].z + SHELL / 2 + cavity.z1) / 2
    if any(abs(surface.z - SHELL / 2 - z) < SHELL for surface in asset.surfaces):
        z += 2 * SHELL
    left = (-size.width / 2 + cavity.x - cavity.width / 2) / 2
    right = (size.width / 2 + cavity.x + cavity.width / 2) / 2
    back = (-size.depth / 2 + cavity.y - cavity.depth / 2) / 2
    front = (size.depth / 2 + cavity.y + cavity.depth / 2) / 2
    assert inside_solid(asset, left, cavity.y, z)
    assert inside_solid(asset, right, cavity.y, z)
    assert inside_solid(asset, cavity.x, back, z)
    assert inside_solid(asset, cavity.x, front, z) != cavity.open_front


@hollow
def test_the_solids_stay_in_the_bounding_box(asset):
    for part in asset.solids():
        assert abs(part.x) + part.width / 2 <= asset.size.width / 2 + 1e-9
        assert abs(part.y) + part.depth / 2 <= asset.size.depth / 2 + 1e-9
        assert -1e-9 <= part.z0 < part.z1 <= asset.size.height + 1e-9


@for_each(
    "name",
    [
        "FumeHood",
        "FumeHood1800",
        "FumeHood1200",
        "WalkInFumeHood",
        "GloveBox",
        "LabRefrigerator",
        "FlammableSafeRefrigerator",
        "UltraLowFreezer",
        "GeneralCabinet",
        "FlammableCabinet",
        "AcidCabinet",
        "BaseCabinet",
        "OxidizerCabinet",
        "ToxicCabinet",
        "WaterReactiveCabinet",
        "GasCylinderCabinet",
        "GlasswareCabinet",
        "WasteStation",
        "WallCabinet",
        "EquipmentRack",
        "ReagentShelf",
    ],
)
def test_what_should_hold_things_inside_is_hollow(name):
    assert CATALOG.get(name).cavity is not None
    assert all(surface.headroom > 0.2 for surface in CATALOG.get(name).surfaces)


def test_the_standard_hood_has_the_usual_inside():
    hood = CATALOG.get("FumeHood")
    cavity = hood.cavity
    assert (cavity.width, cavity.depth, round(cavity.z1 - cavity.z0, 6)) == (1.30, 0.70, 1.20)
    assert hood.surfaces[0].z == 0.90
    assert hood.fume_hood


def test_every_cylinder_stands_upright_in_the_gas_cabinet():
    (floor,) = CATALOG.get("GasCylinderCabinet").surfaces
    for name in ("Hydrogen", "NitrogenGas", "ArgonGas"):
        size = CATALOG.get(name).size
        assert size.height < floor.headroom
        assert 2 * size.width < floor.width


def test_tall_things_fit_into_the_hood():
    (floor,) = CATALOG.get("FumeHood").surfaces
    for asset in CATALOG.of_kind("instrument"):
        if asset.placing == "desktop" and asset.category == "glassware":
            assert asset.size.height < floor.headroom
