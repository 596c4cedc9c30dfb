"""Plans of changed floors: each change is drawn once, in its color and at its place."""

from __future__ import annotations

import numpy as np
from laboratories import island_laboratory, put
from matplotlib.colors import to_rgb

from labgym.eval.drawing.changed_plan import CHANGED, GONE, PUSHED, changed_plan
from labgym.eval.drawing.pictures import picture_bytes

BASE = island_laboratory()
BEFORE = BASE.replace(placements=(*BASE.placements, put("stool", "LabStool", 1.0, 4.8)))


def outlines(figure, color, edge=False):
    """Return the corners of the patches of a color, each (n, 2)."""
    patches = [patch for patch in figure.axes[0].patches if hasattr(patch, "get_xy")]
    of = [
        patch for patch in patches if to_rgb(patch.get_edgecolor() if edge else patch.get_facecolor()) == to_rgb(color)
    ]
    return [np.asarray(patch.get_xy())[:4] for patch in of if not edge or not patch.get_fill()]


def test_added_moved_and_opened_things_are_drawn_in_their_colors():
    bench = BEFORE.placement("IslandBench1800_1").model_copy(update={"state": (("front_drawer_1", 1.0),)})
    changed = {"stool": put("stool", "LabStool", 1.5, 4.2), bench.id: bench}
    placements = [changed.get(each.id, each) for each in BEFORE.placements]
    after = BEFORE.replace(placements=(*placements, put("carton", "Carton", 6.0, 1.0)))
    figure = changed_plan(BEFORE, after, ["stool"])
    (pushed,), (gone,), fixed = outlines(figure, PUSHED), outlines(figure, GONE, edge=True), outlines(figure, CHANGED)
    np.testing.assert_allclose(pushed, after.box("stool").corners())
    np.testing.assert_allclose(gone, BEFORE.box("stool").corners())
    (drawer,) = after.open_parts(bench.id)
    assert len(fixed) == 2
    for box in (drawer, after.box("carton")):
        assert any(np.allclose(outline, box.corners()) for outline in fixed)
    assert picture_bytes(figure, "png")[:4] == b"\x89PNG"


def test_a_floor_that_is_its_map_has_no_colors():
    figure = changed_plan(BEFORE, BEFORE)
    assert not outlines(figure, PUSHED)
    assert not outlines(figure, CHANGED)
    assert not outlines(figure, GONE, edge=True)
