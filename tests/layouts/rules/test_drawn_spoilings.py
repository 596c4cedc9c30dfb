"""Five kinds of faults drawn at random: none passes `touchstone`, and each is real by measures of shapely."""

from __future__ import annotations

import math
from itertools import combinations

import numpy as np
import pytest
from laboratories import published_in_order
from shapely.affinity import rotate, translate
from shapely.geometry import Polygon, box
from spoiling import DRAWN

from labgym.eval import score
from labgym.layouts import Layout, generate
from labgym.layouts.rules import Assessment, evaluate_layout

DRAWS = 8


@pytest.fixture(scope="module")
def bases() -> tuple[Layout, ...]:
    """A published room, and a floor of the family `ell`."""
    return published_in_order(), generate("sub_02", 704, family="ell")


def assess(layout: Layout) -> Assessment:
    assessment = evaluate_layout(layout, layout.protocol, rules="touchstone")
    assert isinstance(assessment, Assessment)
    return assessment


def drawn(base: Layout, kind: str, seed: int) -> Layout:
    assert base.protocol is not None
    spoilt = DRAWN[kind].draw(base, base.protocol, np.random.default_rng(seed))
    assert spoilt is not base
    return spoilt


def footprint(layout: Layout, placement: str) -> Polygon:
    """The footprint of an object, by shapely alone."""
    item, size = layout.placement(placement), layout.asset(placement).size
    plain = box(-size.width / 2.0, -size.depth / 2.0, size.width / 2.0, size.depth / 2.0)
    return translate(rotate(plain, item.yaw, origin=(0.0, 0.0), use_radians=True), *item.position[:2])


def moved(before: Layout, after: Layout) -> list[str]:
    return [item.id for item in after.placements if item != before.placement(item.id)]


def test_the_bases_pass_touchstone_v2(bases: tuple[Layout, ...]) -> None:
    for base in bases:
        report = score(base, contacts=False, rules="touchstone")
        assert report.passed, (report.violations, report.missing, report.warnings)


@pytest.mark.parametrize("kind", DRAWN)
def test_no_draw_passes_and_each_breaks_a_rule_of_its_kind(bases: tuple[Layout, ...], kind: str) -> None:
    for seed in range(DRAWS):
        spoilt = drawn(bases[seed % len(bases)], kind, seed)
        assessment = assess(spoilt)
        assert assessment.v > 0, seed
        broken = [issue for issue in assessment.issues if issue.rule in DRAWN[kind].rules]
        assert broken, seed
        for issue in broken:
            assert issue.severity == "error"
            assert issue.ids
            assert all(name in spoilt.by_id for name in issue.ids)
            assert issue.source
            assert ": " in issue.message


@pytest.mark.parametrize("kinds", list(combinations(DRAWN, 2)), ids="+".join)
def test_of_two_drawn_faults_neither_hides_the_other(bases: tuple[Layout, ...], kinds: tuple[str, str]) -> None:
    both = 0
    for seed in range(4):
        base = bases[seed % len(bases)]
        once = drawn(base, kinds[0], seed)
        twice = drawn(once, kinds[1], seed)
        assessment = assess(twice)
        assert assessment.v > 0, seed
        before = {item.id: item for item in once.placements}
        changed = [name for name in base.by_id if before.get(name) != base.by_id[name]]
        if any(twice.by_id.get(name) != before.get(name) for name in changed):
            continue  # the second fault took the object of the first
        both += 1
        broken = {issue.rule for issue in assessment.issues if issue.severity == "error"}
        for kind in kinds:
            assert broken & DRAWN[kind].rules, (seed, kind, broken)
    assert both


def test_equal_seeds_draw_equal_layouts(bases: tuple[Layout, ...]) -> None:
    for kind in DRAWN:
        first, second = (drawn(bases[0], kind, 7) for _ in range(2))
        assert first.hash == second.hash


@pytest.mark.parametrize("seed", range(12))
def test_the_item_over_an_opening_covers_it_in_elevation(bases: tuple[Layout, ...], seed: int) -> None:
    base = bases[seed % len(bases)]
    spoilt = drawn(base, "wall_item_over_opening", seed)
    (item,) = moved(base, spoilt)
    bottom = spoilt.placement(item).position[2]
    top = bottom + spoilt.asset(item).size.height
    covered = 0.0
    for wall in spoilt.floor.walls:
        for opening in wall.openings:
            x, y = wall.point(opening.position)
            hole = box(
                -opening.width / 2.0, -0.5 - wall.thickness / 2.0, opening.width / 2.0, 0.5 + wall.thickness / 2.0
            )
            hole = translate(rotate(hole, wall.yaw, origin=(0.0, 0.0), use_radians=True), x, y)
            height = min(top, opening.top) - max(bottom, opening.sill)
            if height > 0.0:
                covered = max(covered, footprint(spoilt, item).intersection(hole).area * height)
    assert covered > 0.0


@pytest.mark.parametrize("seed", range(12))
def test_skewed_furniture_is_parallel_to_no_wall_and_no_space(bases: tuple[Layout, ...], seed: int) -> None:
    base = bases[seed % len(bases)]
    spoilt = drawn(base, "skewed_furniture", seed)
    piece = min(moved(base, spoilt), key=lambda name: spoilt.placement(name).position[2])
    root = spoilt.root(piece).id
    edge = np.diff(np.array(footprint(spoilt, root).exterior.coords)[:2], axis=0)[0]
    angle = math.atan2(edge[1], edge[0])
    axes = [wall.yaw for wall in spoilt.floor.walls] + [space.yaw for space in spoilt.floor.spaces]
    assert min(abs(math.remainder(angle - axis, math.pi / 2.0)) for axis in axes) > math.radians(2.0)
