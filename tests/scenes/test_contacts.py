"""Contacts by MuJoCo agree with the separating-axis overlaps of labgym.geometry, which share no code with them."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest

from labgym.geometry import BoxArray, OrientedBox, pairwise_penetration
from labgym.layouts import Layout, Placement, Room
from labgym.scenes import contacts

ROOM = Room(width=6.0, depth=6.0)


def partings(one: tuple[OrientedBox, ...], other: tuple[OrientedBox, ...]) -> np.ndarray:
    """Least distance that parts each pair of upright boxes: in the plane by separating axes, or along z."""
    tall = [BoxArray.of([replace(box, z0=0.0, z1=1e6) for box in boxes]) for boxes in (one, other)]
    a, b = BoxArray.of(one), BoxArray.of(other)
    apart = np.abs(a.z.mean(axis=1)[:, None] - b.z.mean(axis=1)[None, :])
    upright = (np.ptp(a.z, axis=1)[:, None] + np.ptp(b.z, axis=1)[None, :]) / 2.0 - apart
    return np.minimum(pairwise_penetration(*tall), upright)


def overlaps(layout: Layout, depth: float) -> dict[tuple[str, str], float]:
    """Deepest overlap of each pair's solids by the separating-axis test."""
    ids = [placement.id for placement in layout.placements]
    deepest = {
        (first, second): float(partings(layout.solids(first), layout.solids(second)).max())
        for first, second in combinations(ids, 2)
    }
    return {names: overlap for names, overlap in deepest.items() if overlap > depth}


@pytest.mark.parametrize("seed", range(6))
def test_contacts_are_the_overlaps_that_separating_axes_find(seed: int) -> None:
    rng = np.random.default_rng(seed)
    kinds = [
        "LabStool",
        "WasteBin",
        "MobileBench",
        "FlammableCabinet",
        "FumeHood",
        "Acetone",
        "Beaker",
        "EquipmentRack",
    ]
    placements = tuple(
        Placement(
            id=f"thing_{k}",
            asset=str(rng.choice(kinds)),
            position=(float(rng.uniform(0.8, 5.2)), float(rng.uniform(0.8, 5.2)), float(rng.choice([0.0, 0.4, 0.91]))),
            yaw=float(rng.choice([0.0, math.pi / 2.0, rng.uniform(-3.0, 3.0)])),
        )
        for k in range(24)
    )
    layout = Layout(id="random", floor=ROOM.floor, placements=placements)
    expected = overlaps(layout, 0.001)
    depths = {(contact.a, contact.b): contact.depth for contact in contacts(layout)}
    assert expected
    assert depths.keys() == expected.keys()
    for pair, depth in expected.items():
        assert depths[pair] == pytest.approx(depth, abs=1e-4)


def pair(first: str, second: str, offset: tuple[float, float, float]) -> Layout:
    x, y, z = offset
    placements = (
        Placement(id="first", asset=first, position=(3.0, 3.0, 0.0)),
        Placement(id="second", asset=second, position=(3.0 + x, 3.0 + y, z)),
    )
    return Layout(id="pair", floor=ROOM.floor, placements=placements)


def test_a_planted_overlap_is_found_with_its_depth() -> None:
    (contact,) = contacts(pair("LabBench", "LabBench", (1.49, 0.0, 0.0)))
    assert (contact.a, contact.b) == ("first", "second")
    assert contact.depth == pytest.approx(0.01, abs=1e-5)


def test_objects_that_touch_or_stand_on_each_other_have_no_contact() -> None:
    assert contacts(pair("LabBench", "LabBench", (1.5, 0.0, 0.0))) == ()
    assert contacts(pair("LabBench", "Beaker", (0.0, 0.0, 0.9))) == ()


def test_the_tap_of_a_sink_bench_collides() -> None:
    # The tap is 0.36 m right of the middle, 0.18 m behind it, and reaches to 1.22 m.
    (contact,) = contacts(pair("SinkBench", "Beaker", (0.355, -0.10, 1.15)))
    assert contact.depth > 0.01
    assert contacts(pair("SinkBench", "Beaker", (0.355, -0.10, 1.23))) == ()


def test_the_depth_limit_can_be_chosen() -> None:
    layout = pair("LabBench", "LabBench", (1.495, 0.0, 0.0))
    assert len(contacts(layout, depth=0.004)) == 1
    assert contacts(layout, depth=0.006) == ()


def test_an_object_inside_a_cabinet_collides_only_with_walls_and_shelves() -> None:
    assert contacts(pair("FlammableCabinet", "Acetone", (0.0, 0.0, 0.1))) == ()
    (through_the_side,) = contacts(pair("FlammableCabinet", "Acetone", (0.48, 0.0, 0.1)))
    assert through_the_side.depth > 0.01
    (through_a_shelf,) = contacts(pair("FlammableCabinet", "Acetone", (0.0, 0.0, 0.4)))
    assert through_a_shelf.depth > 0.01


def test_the_laboratory_of_the_fixture_has_no_contacts(laboratory: Layout) -> None:
    assert contacts(laboratory) == ()
