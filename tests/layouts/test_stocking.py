"""Cabinets, surfaces and the constraint solver, checked by polygons."""

import os
import random
import signal
import threading
from itertools import combinations

import numpy as np
import pytest
from ortools.sat.python import cp_model
from shapely import box

from labgym.assets import Catalog, incompatible
from labgym.layouts.floor import Door, Room
from labgym.layouts.habits import Habits
from labgym.layouts.interiors.program import search
from labgym.layouts.request import Request
from labgym.layouts.rules import rule_set
from labgym.layouts.stocking import plan_cabinets
from labgym.layouts.tabletop import GAP, SurfaceItem, pack
from labgym.protocols import protocols

ROOM = Room(width=6.0, depth=6.0, doors=(Door(wall="front", offset=1.0),))


@pytest.mark.parametrize("seed", range(6))
def test_things_on_a_surface_keep_their_gaps_and_margins(seed):
    generator = np.random.default_rng(seed)
    items = [SurfaceItem(f"i{k}", *generator.uniform(0.05, 0.2, 2), 0.2, 0.15 if k % 2 else 0.02) for k in range(8)]
    spots = pack(items, 1.5, 0.75, None, generator)
    assert len(spots) == len(items)
    shapes = {
        k: box(s.x - s.width / 2, s.y - s.depth / 2, s.x + s.width / 2, s.y + s.depth / 2) for k, s in spots.items()
    }
    for first, second in combinations(shapes.values(), 2):
        assert first.distance(second) > 0.0
    for index, shape in shapes.items():
        margin = items[index].margin
        assert box(-0.75 + margin, -0.375 + margin, 0.75 - margin, 0.375 - margin).buffer(1e-9).covers(shape)
    grown = [shape.buffer(GAP / 2 - 1e-9, join_style="mitre") for shape in shapes.values()]
    assert all(first.intersection(second).area < 1e-9 for first, second in combinations(grown, 2))


def test_a_thing_too_high_for_its_shelf_is_left_out():
    generator = np.random.default_rng(0)
    assert pack([SurfaceItem("tall", 0.1, 0.1, 0.5, 0.0)], 1.0, 0.5, 0.4, generator) == {}


@pytest.mark.parametrize("name", sorted(protocols()))
def test_no_cabinet_holds_two_reagents_that_must_not_meet(name):
    protocol, catalog = protocols()[name], Catalog.load()
    cabinets = plan_cabinets(Request(protocol, ROOM.floor, rule_set(), 0, catalog, Habits.published()))
    stored = [reagent.name for cabinet in cabinets for reagent in cabinet.reagents]
    assert sorted(stored) == sorted(use.name for use in protocol.reagents)
    for cabinet in cabinets:
        for first, second in combinations(cabinet.reagents, 2):
            assert incompatible(first, second) is None
        kind = cabinet.asset.storage_class
        assert all(reagent.chemistry.storage_class == kind for reagent in cabinet.reagents)


def test_ctrl_c_during_a_search_is_not_a_result_of_the_search():
    model, generator = cp_model.CpModel(), random.Random(0)
    boxes = [[model.new_int_var(0, limit, "") for limit in (1000, 60)] for _ in range(60)]
    spans = [[model.new_fixed_size_interval_var(at, generator.randint(5, 20), "") for at in box] for box in boxes]
    model.add_no_overlap_2d([span[0] for span in spans], [span[1] for span in spans])
    model.minimize(sum(generator.randint(1, 9) * box[0] - generator.randint(1, 9) * box[1] for box in boxes))
    solver = cp_model.CpSolver()
    solver.parameters.num_workers = 1
    solver.parameters.max_deterministic_time = 60.0
    handler = signal.signal(signal.SIGINT, signal.default_int_handler)  # A shell's background jobs ignore SIGINT.
    try:
        threading.Timer(1.0, os.kill, (os.getpid(), signal.SIGINT)).start()
        with pytest.raises(KeyboardInterrupt):
            search(solver, model)
    finally:
        signal.signal(signal.SIGINT, handler)
