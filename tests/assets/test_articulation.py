"""Moving parts of catalog assets: their joints, masses, and where they are when open."""

from __future__ import annotations

import math

import numpy as np
import pytest
from every_case import for_each
from scipy.spatial.transform import Rotation

from labgym.assets import Catalog
from labgym.assets.articulation import (
    FOOTINGS,
    all_parts,
    fixed_solids,
    footing,
    joints,
    posed_part,
    posed_solid,
    posed_solids,
    protruding,
)
from labgym.assets.shapes import SHAPES, build, tessellate
from labgym.assets.shapes.joints import MECHANISMS
from labgym.errors import OptionError, UnknownNameError

CATALOG = Catalog.load()
MOVING = [asset for asset in CATALOG if joints(asset)]


def of(name):
    return CATALOG.get(name)


def vertices_of(parts):
    return np.concatenate([tessellate(part)[0] for part in parts])


@for_each("asset", MOVING)
def test_moving_parts_are_inside_the_closed_asset_and_lighter_than_it(asset):
    half = np.array([asset.size.width / 2.0, asset.size.depth / 2.0]) + 1e-9
    for joint in joints(asset).values():
        box = joint.solid
        assert (np.abs(box.corners()) <= half).all()
        assert box.z0 >= 0.0
        assert box.z1 <= asset.size.height + 1e-9
        assert joint.travel > 0.0
        assert 0.0 <= joint.drawn <= joint.travel
        assert joint.mass > 0.0
        assert joint.friction > 0.0
        assert joint.damping > 0.0
        moved = vertices_of([part for part in all_parts(asset) if part.joint is joint])
        assert moved[:, 2].min() >= box.z0 - 0.03
        assert moved[:, 2].max() <= box.z1 + 0.03
    masses = sum(j.mass - MECHANISMS[j.mechanism].content for j in joints(asset).values())
    assert masses < asset.mass


@for_each("asset", MOVING)
def test_hidden_parts_are_inside_the_closed_asset(asset):
    shown, parts = build(asset), all_parts(asset)
    assert [part for part in parts if not part.hidden] == list(shown)
    low, high = vertices_of(shown).min(axis=0), vertices_of(shown).max(axis=0)
    vertices = vertices_of(parts)
    assert (vertices >= low - 1e-9).all()
    assert (vertices <= high + 1e-9).all()


@for_each("asset", MOVING)
def test_parts_and_their_solids_move_as_a_rotation_or_a_shift_says(asset):
    for joint in joints(asset).values():
        place = 0.6 * joint.travel
        motion, axis = place - joint.drawn, np.array(joint.axis)
        turn = Rotation.from_rotvec(motion * axis if joint.kind == "hinge" else np.zeros(3))
        shift = motion * axis if joint.kind == "slide" else np.zeros(3)

        def move(points, turn=turn, shift=shift, joint=joint):
            return turn.apply(points - joint.origin) + joint.origin + shift

        for part in (part for part in all_parts(asset) if part.joint is joint):
            expected = move(tessellate(part)[0])
            assert tessellate(posed_part(part, place))[0] == pytest.approx(expected, abs=1e-9)
        before, after = joint.solid, posed_solid(joint, place)
        corners = np.column_stack([before.corners(), np.full(4, before.z0)])
        assert np.column_stack([after.corners(), np.full(4, after.z0)]) == pytest.approx(move(corners), abs=1e-9)


@for_each("asset", MOVING)
def test_doors_up_to_90_degrees_and_drawers_stay_within_the_width_of_their_asset(asset):
    for joint in joints(asset).values():
        share = 1.0 if joint.kind == "slide" else math.radians(90.0) / joint.travel
        for box in protruding(asset, ((joint.name, share),)):
            assert np.abs(box.corners()[:, 0]).max() <= asset.size.width / 2.0 + 1e-6
            assert np.abs(box.corners()[:, 1]).max() > asset.size.depth / 2.0 + 0.1


def test_a_hollow_asset_has_an_open_front_behind_its_doors():
    cabinet = of("GeneralCabinet")
    front = cabinet.cavity.y + cabinet.cavity.depth / 2.0
    closed, fixed = cabinet.solids(), fixed_solids(cabinet)
    assert len(closed) == len(fixed) + 1
    middle = [b for b in fixed if b.y - b.depth / 2.0 >= front - 1e-9]
    assert not middle
    assert len(posed_solids(cabinet, (("door_1", 0.5),))) == len(fixed) + 2
    assert fixed_solids(of("LabBench")) == of("LabBench").solids()


def test_a_sash_is_drawn_at_its_stop_and_closes_the_hood():
    hood = of("FumeHood")
    sash = joints(hood)["sash"]
    assert sash.balanced
    assert sash.drawn == sash.travel == pytest.approx(hood.shape.parameters["sash"])
    assert posed_solid(sash, 0.0).z0 == pytest.approx(hood.cavity.z0)


def test_unknown_parts_and_shares_out_of_range_are_refused():
    with pytest.raises(UnknownNameError, match="door_1"):
        posed_solids(of("GeneralCabinet"), (("drawer_1", 0.5),))
    for share in (-0.1, 1.5, float("nan")):
        with pytest.raises(OptionError, match=r"0 \(closed\) to 1"):
            posed_solids(of("GeneralCabinet"), (("door_1", share),))
    with pytest.raises(OptionError, match="twice"):
        posed_solids(of("GeneralCabinet"), (("door_1", 0.5), ("door_1", 0.7)))


def test_every_figure_has_a_source_and_castored_assets_a_footing():
    assert all(mechanism.source for mechanism in MECHANISMS.values())
    assert set(FOOTINGS) <= set(SHAPES)
    assert all(each.source for each in FOOTINGS.values())
    for name in ("LabStool", "ServiceTrolley", "InstrumentTrolley", "CylinderTrolley", "PalletTruck"):
        assert footing(of(name)).castors
    assert footing(of("LabBench")) is None
    for mechanism in MECHANISMS.values():  # ADA 309.4
        assert mechanism.force <= 22.2
