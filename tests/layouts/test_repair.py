"""FastRepair, the optimiser and the refinement on layouts that were spoilt on purpose."""

import math

import numpy as np
import pytest

from labgym.geometry import penetration
from labgym.geometry.overlap import separating_push
from labgym.layouts import generate
from labgym.layouts.moves import Move, Rotate, Settle, Swap, apply, descendants
from labgym.layouts.optimise import optimise
from labgym.layouts.placement import Placement
from labgym.layouts.refinement import refine
from labgym.layouts.repair import fast_repair
from labgym.layouts.rules.objective import evaluate_layout
from labgym.protocols import protocols


@pytest.fixture(scope="module")
def layout():
    return generate("sub_01", 3)


def shaken(layout, seed, spread=0.12):
    """Furniture and what stands on it pushed about at random."""
    generator = np.random.default_rng(seed)
    for placement in layout.placements:
        if placement.support == "floor" or generator.random() < 0.2:
            dx, dy = generator.normal(0.0, spread, 2)
            layout = apply(layout, Move(placement.id, float(dx), float(dy)))
    return layout


@pytest.mark.parametrize("seed", range(4))
def test_fast_repair_mends_shaken_layouts(layout, seed):
    spoilt = shaken(layout, seed)
    before, after = evaluate_layout(spoilt, rules="paper"), evaluate_layout(fast_repair(spoilt), rules="paper")
    wrong = len(before.bounds) + len(before.collisions)
    left = len(after.bounds) + len(after.collisions)
    assert wrong >= 5
    assert left <= 0.35 * wrong


@pytest.mark.cases(1)
@pytest.mark.parametrize("seed", range(3))
def test_the_optimiser_never_adds_a_violation(layout, seed):
    protocol = protocols()["sub_01"]
    spoilt = shaken(layout, seed)
    before = evaluate_layout(spoilt, protocol, rules="paper")
    after = evaluate_layout(optimise(spoilt, protocol, rules="paper"), protocol, rules="paper")
    assert after.v < before.v


def test_a_good_layout_is_left_alone(layout):
    assert optimise(layout, protocols()["sub_01"], rules="paper") is layout
    assert refine(layout, protocols()["sub_01"], rules="paper") is layout


def test_a_push_separates_two_boxes_by_the_least(layout):
    generator = np.random.default_rng(0)
    from labgym.geometry import OrientedBox

    for _ in range(50):
        first, second = (
            OrientedBox(*generator.uniform(-0.5, 0.5, 2), *generator.uniform(0.5, 1.5, 2), generator.uniform(-3, 3))
            for _ in range(2)
        )
        push = separating_push(first, second, 0.005)
        overlap = penetration(first, second)
        if overlap <= 0.0:
            assert push is None
            continue
        moved = OrientedBox(first.x + push[0], first.y + push[1], first.width, first.depth, first.yaw)
        assert penetration(moved, second) <= 0.0
        assert math.hypot(*push) >= overlap


def test_a_reagent_on_a_bench_is_put_into_a_cabinet(layout):
    protocol = protocols()["sub_01"]
    reagent = next(p.id for p in layout.placements if p.asset == "Acetone")
    spoilt = apply(layout, Settle(reagent, "PreparationBench_1", 0, 0.3, 0.0))
    assert evaluate_layout(spoilt, protocol, rules="paper").v > 0
    mended = optimise(spoilt, protocol, rules="paper")
    assert evaluate_layout(mended, protocol, rules="paper").v == 0
    assert mended.asset(mended.placement(reagent).support).storage_class is not None


def test_what_stands_on_furniture_moves_and_turns_with_it(layout):
    hood = "FumeHood_1"
    carried = descendants(layout, hood)
    assert carried
    turned = apply(apply(layout, Move(hood, -0.2, -0.3)), Rotate(hood, 0.4))
    for item in carried:
        before = layout.box(hood).to_local(*layout.placement(item).position[:2])
        after = turned.box(hood).to_local(*turned.placement(item).position[:2])
        assert after == pytest.approx(before, abs=2e-6)


def test_swapped_cabinets_keep_their_backs_to_the_wall(layout):
    swapped = apply(layout, Swap("FlammableCabinet_1", "BaseCabinet_1"))
    for own, other in (("FlammableCabinet_1", "BaseCabinet_1"), ("BaseCabinet_1", "FlammableCabinet_1")):
        new, old = swapped.box(own), layout.box(other)
        assert new.to_world(0.0, -new.depth / 2.0) == pytest.approx(old.to_world(0.0, -old.depth / 2.0), abs=2e-6)


def test_refinement_turns_a_bench_that_faces_the_wall(layout):
    protocol = protocols()["sub_01"]
    bench = "ValidationPlatform_1"
    spoilt = apply(layout, Rotate(bench, layout.placement(bench).yaw + math.pi))
    before = evaluate_layout(spoilt, protocol, navigation=True, rules="paper")
    assert any(not transition.feasible for transition in before.transitions)
    after = evaluate_layout(refine(spoilt, protocol, rules="paper"), protocol, navigation=True, rules="paper")
    assert all(transition.feasible for transition in after.transitions)
    assert after.v < before.v


def test_refinement_moves_what_blocks_the_robot(layout):
    protocol = protocols()["sub_01"]
    hood = layout.box("FumeHood_1")
    x, y = hood.to_world(0.0, hood.depth / 2.0 + 0.6)
    stool = Placement(id="LabStool_99", asset="LabStool", position=(x, y, 0.0))
    spoilt = layout.replace(placements=(*layout.placements, stool))
    assert any(not t.feasible for t in evaluate_layout(spoilt, protocol, navigation=True, rules="paper").transitions)
    mended = refine(spoilt, protocol, rules="paper")
    assert evaluate_layout(mended, protocol, navigation=True, rules="paper").v == 0
    assert "LabStool_99" in mended.by_id


@pytest.mark.cases(1)
@pytest.mark.parametrize(("family", "seed"), [("ell", 2), ("suite", 4), ("refit", 5)])
def test_the_optimiser_repairs_a_shaken_floor_and_leaves_furniture_in_its_spaces(family, seed):
    layout = generate("sub_01", seed, family=family)
    generator, spoilt = np.random.default_rng(seed), layout
    standing = [item.id for item in layout.placements if item.support == "floor"]
    for item in generator.choice(standing, 3, replace=False):
        spoilt = apply(spoilt, Move(str(item), *map(float, generator.normal(0.0, 0.6, 2))))
    before = evaluate_layout(spoilt, layout.protocol, navigation=True, rules="paper")
    repaired = optimise(spoilt, layout.protocol, rules="paper")
    after = evaluate_layout(repaired, layout.protocol, navigation=True, rules="paper")
    assert before.cost > 0
    assert after.cost == 0
    for item in standing:
        assert repaired.floor.space_at(*repaired.placement(item).position[:2]) is not None
