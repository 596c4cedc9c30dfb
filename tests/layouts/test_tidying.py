"""Accessories go to free places of their own size."""

from __future__ import annotations

from laboratories import put

from labgym.assets.model import Size
from labgym.layouts import Layout, Room
from labgym.layouts.rules.objective import evaluate_layout
from labgym.layouts.tidying import tidied


def test_an_accessory_with_a_size_of_its_layout_goes_where_that_size_fits():
    # Between the benches are 0.7 m: room for a stool of the catalog (0.45 m), not for one of 0.9 m.
    benches = [put(f"bench_{k}", "LabBench1800", 2.2, y) for k, y in enumerate((0.4, 1.85))]
    wide = put("stool", "LabStool", 2.2, 0.4).model_copy(update={"size": Size(width=0.9, depth=0.9, height=0.65)})
    layout = Layout(id="stools", floor=Room(width=6.0, depth=5.0).floor, placements=(*benches, wide))
    assert len(evaluate_layout(layout, rules="paper").collisions) == 1
    after = tidied(layout, None)
    assert evaluate_layout(after, rules="paper").v == 0
    assert after.placement("stool").size == wide.size
