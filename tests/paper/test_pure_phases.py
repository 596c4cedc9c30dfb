"""The paper's phases alone: nothing is added, a stated loop, and proposals that they cannot save."""

from __future__ import annotations

import math

import pytest

from labgym.layouts.generate import generate_assessed, resolve_request
from labgym.layouts.method import Method
from labgym.layouts.placement import FLOOR
from labgym.layouts.rules.objective import evaluate_layout
from labgym.layouts.rules.rule_sets import PAPER
from labgym.paper.pure import optimized, refined
from labgym.paper.reproduction.comparison import HeapProposer, NothingProposer
from labgym.paper.reproduction.measures import origin_metrics
from labgym.protocols import protocols

PROTOCOL = protocols()["sub_01"]


@pytest.fixture(scope="module")
def request_():
    return resolve_request(PROTOCOL, 3, "bay", None, None, (), rules=PAPER)


def proposal(request_, proposer):
    return generate_assessed(request_, Method(proposer, optimise=False, refine=False, on_failure="keep"))[0]


def test_no_proposal_stays_empty_under_the_phases_of_the_paper_and_fails(request_):
    empty = proposal(request_, NothingProposer())
    assert empty.placements == ()
    after = refined(optimized(empty, PROTOCOL, request_.rules), PROTOCOL, request_.rules)
    assert after.placements == ()
    assert set(PROTOCOL.locations) <= set(evaluate_layout(after, PROTOCOL, request_.rules).missing)


def test_a_heap_has_every_required_asset_once_at_the_center(request_):
    heap = proposal(request_, HeapProposer())
    wanted = {*PROTOCOL.locations, *PROTOCOL.instruments, *(use.name for use in PROTOCOL.reagents)}
    placed = [item.asset for item in heap.placements]
    assert wanted <= set(placed)
    standing = [item for item in heap.placements if item.support == FLOOR]
    assert {(item.position[0], item.position[1]) for item in standing} == {(4.0, 4.0)}  # of a room of 8 x 8 m


def test_the_phases_of_the_paper_neither_add_nor_drop_an_object_and_lower_v(request_):
    sampled = proposal(request_, "sampler")
    before = evaluate_layout(sampled, PROTOCOL, request_.rules)
    after = optimized(sampled, PROTOCOL, request_.rules)
    assert {item.id: item.asset for item in after.placements} == {item.id: item.asset for item in sampled.placements}
    assert evaluate_layout(after, PROTOCOL, request_.rules).v < before.v


def test_what_survives_is_what_stands_where_it_was_proposed(request_):
    sampled = proposal(request_, "sampler")
    first, *rest = sampled.placements
    x, y, z = first.position
    moved = first.model_copy(update={"position": (x + 0.2, y, z)})
    nudged = first.model_copy(update={"position": (x + 0.05, y, z)})
    total = len(sampled.placements)
    figures = origin_metrics(sampled.replace(placements=(moved, *rest)), sampled)
    assert figures["placed"] == 1
    assert math.isclose(figures["survives"], 1.0 - 1.0 / total, abs_tol=1e-8)
    assert origin_metrics(sampled.replace(placements=(nudged, *rest)), sampled)["placed"] == 0
    assert origin_metrics(sampled, sampled.replace(placements=()))["survives"] == 0.0
