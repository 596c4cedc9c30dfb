"""Glassware on work surfaces is assembled to apparatus, and everything that the rules ask for stays as it was."""

from __future__ import annotations

import math
from collections import Counter

import numpy as np
import pytest

from labgym.layouts import Layout, Placement, generate
from labgym.layouts.floor import Floor
from labgym.layouts.interiors.setups import assembled, published_setups
from labgym.layouts.rules.objective import evaluate_layout
from labgym.layouts.rules.thresholds import profile
from labgym.scenes import contacts

DEFAULT = profile("default")


def on(placement_id: str, asset: str, x: float, y: float, **fields: object) -> Placement:
    return Placement(id=placement_id, asset=asset, position=(x, y, 0.9), support="hood", slot=0, yaw=math.pi, **fields)  # type: ignore[arg-type]


def loose(*fixed: str) -> Layout:
    """A hood with the pieces of a reflux apparatus, a filtration and a separation, side by side."""
    names = {
        "stirrer": ("MagneticHotplateStirrer", 3.5, 4.6),
        "bath": ("OilBath", 3.2, 4.6),
        "flask": ("RoundBottomFlask", 2.95, 4.6),
        "condenser": ("RefluxCondenser", 2.8, 4.6),
        "filter": ("FilterFlask", 3.5, 4.35),
        "funnel": ("BuchnerFunnel", 3.3, 4.35),
        "separator": ("SeparatoryFunnel", 3.1, 4.4),
        "erlenmeyer": ("ErlenmeyerFlask", 2.9, 4.4),
        "cylinder": ("GraduatedCylinder", 2.7, 4.4),
    }
    hood = Placement(id="hood", asset="FumeHood", position=(3.0, 4.565, 0.0), yaw=math.pi)
    pieces = [on(name, asset, x, y, fixed=name in fixed) for name, (asset, x, y) in names.items()]
    return Layout(id="loose", floor=Floor.rectangle(6.0, 5.0), placements=(hood, *pieces))


def made(layout: Layout) -> Layout:
    return assembled(layout, DEFAULT, np.random.default_rng(1))


def test_pieces_stand_in_the_slots_of_their_stand() -> None:
    layout = made(loose())
    (reflux,) = (p for p in layout.placements if p.asset == "RefluxStandOilBath")
    assert reflux.support == "hood"
    for slot, piece in enumerate(("stirrer", "bath", "flask", "condenser")):
        placement = layout.placement(piece)
        assert (placement.support, placement.slot) == (reflux.id, slot)
        surface = layout.surface(reflux.id, slot)
        assert placement.position == pytest.approx((surface.x, surface.y, surface.z0), abs=1e-6)
    stands = Counter(p.asset for p in layout.placements if layout.asset(p.id).subtype == "apparatus_stand")
    assert stands == {"RefluxStandOilBath": 1, "FiltrationStand": 1, "SeparationStand": 1}


def test_assembling_adds_stands_and_neither_removes_nor_renames_anything() -> None:
    before, after = loose(), made(loose())
    assert {(p.id, p.asset) for p in before.placements} <= {(p.id, p.asset) for p in after.placements}
    assert len(after.placements) == len(before.placements) + 3
    assert after.placement("cylinder").support == "hood"


def test_an_assembled_layout_breaks_no_rule_and_loses_no_score() -> None:
    before, after = (evaluate_layout(layout, None, "paper") for layout in (loose(), made(loose())))
    assert after.v == 0
    assert after.collisions == ()
    assert len(after.of("glass")) == len(before.of("glass"))
    assert min(instance.satisfaction for instance in after.of("glass")) == 1.0
    assert after.fitness >= before.fitness
    assert contacts(made(loose())) == ()


def test_glass_in_a_stand_is_as_far_from_the_edge_as_its_stand() -> None:
    layout = made(loose())
    (stand,) = (p for p in layout.placements if p.asset == "RefluxStandOilBath")
    surface, box = layout.surface("hood", 0), layout.box(stand.id)
    corners = np.array([surface.to_local(x, y) for x, y in box.corners()])
    edge = float((np.array([surface.width, surface.depth]) / 2.0 - np.abs(corners)).min())
    (flask,) = (each for each in evaluate_layout(layout, None, "paper").of("glass") if each.ids == ("flask",))
    assert flask.distance == pytest.approx(edge, abs=1e-6)


def test_pieces_of_two_apparatus_still_collide() -> None:
    layout = made(loose())
    stands = [p for p in layout.placements if layout.asset(p.id).subtype == "apparatus_stand"]
    moved = {}
    target = stands[1].position
    for piece in (stands[0], *layout.children(stands[0].id)):
        dx, dy = target[0] - stands[0].position[0], target[1] - stands[0].position[1]
        x, y, z = piece.position
        moved[piece.id] = piece.model_copy(update={"position": (x + dx, y + dy, z)})
    stacked = layout.replace(placements=tuple(moved.get(p.id, p) for p in layout.placements))
    pairs = {frozenset(collision.ids) for collision in evaluate_layout(stacked, None, "paper").collisions}
    assert frozenset((stands[0].id, stands[1].id)) in pairs
    assert pairs <= {frozenset((contact.a, contact.b)) for contact in contacts(stacked)}


def test_fixed_pieces_stay_and_the_others_are_not_assembled_without_them() -> None:
    layout = made(loose("flask"))
    assert layout.placement("flask") == loose("flask").placement("flask")
    assert not any(p.asset.startswith("RefluxStand") for p in layout.placements)
    assert any(p.asset == "FiltrationStand" for p in layout.placements)
    assert evaluate_layout(layout, None, "paper").v == 0


def test_an_apparatus_without_room_is_left_in_pieces() -> None:
    layout = loose()
    crowd = [on(f"crowd_{k}", "Desiccator", 2.55 + 0.3 * k, 4.6, fixed=True) for k in range(4)]
    kept = tuple(p for p in layout.placements if p.id in ("hood", "stirrer", "bath", "flask", "condenser"))
    crowded = layout.replace(placements=(*kept, *crowd))
    assert made(crowded) == crowded


def test_the_setups_are_ordered_by_their_number_of_pieces() -> None:
    sizes = [len(setup.pieces) for setup in published_setups()]
    assert sizes == sorted(sizes, reverse=True)


def test_a_generated_floor_has_assembled_glassware_and_all_that_the_protocol_requires() -> None:
    layout = generate("alk_04", 3, family="bay")
    (stand,) = (p for p in layout.placements if p.asset == "AdditionStandOilBath")
    held = {p.asset for p in layout.children(stand.id)}
    assert held == {"MagneticHotplateStirrer", "OilBath", "ThreeNeckFlask", "RefluxCondenser", "DroppingFunnel"}
    assessment = evaluate_layout(layout, layout.protocol, "paper", navigation=True)
    assert (assessment.v, assessment.missing, assessment.errors) == (0, (), ())
    assert contacts(layout) == ()


def test_a_hood_takes_a_missing_piece_from_a_bench_unless_the_protocol_ties_it_there() -> None:
    layout = loose()
    bench = Placement(id="bench", asset="PreparationBench", position=(3.0, 0.4, 0.0))
    flask = layout.placement("flask").model_copy(update={"position": (3.0, 0.4, 0.9), "support": "bench"})
    kept = tuple(flask if p.id == "flask" else p for p in layout.placements)
    apart = layout.replace(placements=(bench, *kept))
    taken = made(apart)
    assert taken.asset(taken.placement("flask").support).name == "RefluxStandOilBath"
    assert evaluate_layout(taken, None, "paper").v == 0
    tied = assembled(apart, DEFAULT, np.random.default_rng(1), {"RoundBottomFlask"})
    assert tied.root("flask").id == "bench"
