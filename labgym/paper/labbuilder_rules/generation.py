"""Layouts that satisfy `touchstone` and score highly under the rule set `labbuilder`, mode `corrected`."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np

from labgym.errors import InfeasibleError
from labgym.layouts.generate import generate_assessed
from labgym.layouts.method import Method
from labgym.layouts.model import Layout
from labgym.layouts.moves import Settle, apply, may_move, without
from labgym.layouts.phases import failures
from labgym.layouts.request import Request
from labgym.layouts.rules.objective import evaluate_layout
from labgym.layouts.rules.rule_sets import TOUCHSTONE, rule_set
from labgym.layouts.rules.thresholds import DEFAULT, Band
from labgym.layouts.settling import free_spots
from labgym.paper.labbuilder_rules.chemistry import DISTANCE_CM, EDGE_CM, satisfaction
from labgym.paper.labbuilder_rules.library import Library
from labgym.paper.labbuilder_rules.quirks import CORRECTED
from labgym.paper.labbuilder_rules.stage import STORAGE, layout_scene
from labgym.paper.labbuilder_rules.verdict import Verdict, evaluate_scene

_APART = Band(DISTANCE_CM / 100.0, DEFAULT.heat.d_low)
RULES = rule_set(
    TOUCHSTONE, replace(DEFAULT, name="labbuilder", heat=_APART, incompatible=_APART, glass=EDGE_CM / 100.0)
)
"""The rules of requests: `touchstone` with the distances of the rule set `labbuilder`, measured between surfaces."""
LEAST_SCORE, LEAST_OF_CEILING = 0.9, 0.95
"""Scores that a layout should reach, and the share of the greatest Glass that its surfaces admit."""
DRAWS = 6
"""Greatest number of layouts of which the one that misses the fewest scores is taken."""
STEP_M = 0.05
"""Spacing of the places along a shelf from which the nearest free spot is looked for, meters."""


def generate_by(request: Request, method: Method, library: Library) -> tuple[Layout, Verdict]:
    """Return a layout for a request with `RULES`, and its figures in the mode `corrected`.

    Bottles stand on the middle line of their shelves, and glassware that nothing requires is left out of cabinets. Of
    at most `DRAWS` seeds the first is taken whose layout misses no score, else the one that misses the fewest.

    Raises:
        InfeasibleError, SearchLimitError, UnrepairedError: as `generate_assessed`, of the request's own seed.
    """
    best: tuple[Layout, Verdict] | None = None
    for draw in range(DRAWS):
        seed = int(np.random.SeedSequence([request.seed, draw]).generate_state(1)[0]) if draw else request.seed
        try:
            layout, _ = generate_assessed(replace(request, seed=seed), method)
        except InfeasibleError:
            if draw == 0:
                raise
            continue
        layout = middled(_bared(layout, request, library), request, library)
        verdict = evaluate_scene(layout_scene(layout, library), library, CORRECTED)
        if best is None:
            best = layout, verdict
        elif len(missed(verdict)) < len(missed(best[1])):
            options = {**layout.provenance.options, "draw": draw}
            provenance = layout.provenance.model_copy(update={"seed": request.seed, "options": options})
            best = layout.replace(id=best[0].id, provenance=provenance), verdict
        if {*missed(best[1])} <= {"store"}:  # Other draws cool the same reagents: a refrigerator is no cabinet.
            break
    assert best is not None
    return best


def missed(verdict: Verdict) -> tuple[str, ...]:
    """Return the scores that a layout should reach and does not; those that do not apply are not missed."""
    figures = verdict.values()
    least = dict.fromkeys(("flam", "store", "incomp", "glassware"), LEAST_SCORE) | dict.fromkeys(
        ("nav_released", "nav_published"), 1.0
    )
    least["glass"] = LEAST_OF_CEILING * (verdict.glass_ceiling or 0.0)
    return tuple(name for name, bound in least.items() if (value := figures[name]) is not None and value < bound)


def middled(layout: Layout, request: Request, library: Library) -> Layout:
    """Return the layout with the bottles of each cabinet on the middle lines of its shelves, if no rule is worse."""
    for cabinet in layout.placements:
        items = [child.id for child in layout.children(cabinet.id) if may_move(layout, child.id)]
        if layout.asset(cabinet.id).storage_class not in STORAGE or not _glass(layout, items, library):
            continue
        proposed = _restocked(layout, cabinet.id, items, request, library)
        if proposed is not None and _sound(proposed, request):
            layout = proposed
    return layout


def _bared(layout: Layout, request: Request, library: Library) -> Layout:
    """Return the layout without the glassware in cabinets that nothing requires, if no rule is worse."""
    spare = Counter(placement.asset for placement in layout.placements)
    spare.subtract(request.catalog.find(name).name for name in request.protocol.required_assets())
    extra = []
    for placement in layout.placements:
        if placement.support in layout.by_id and layout.asset(placement.support).storage_class is not None:
            if spare[placement.asset] > 0 and _glass(layout, [placement.id], library):
                spare[placement.asset] -= 1
                extra.append(placement.id)
    proposed = without(layout, extra)
    return proposed if _sound(proposed, request) else layout


def _glass(layout: Layout, items: Iterable[str], library: Library) -> list[str]:
    """Return the items that a library flags as glass, by their ids or the names of their assets."""
    entries = {item: library.find(item) or library.find(layout.asset(item).name) for item in items}
    return [item for item, entry in entries.items() if entry is not None and "glass_container" in entry.flags]


def _restocked(layout: Layout, cabinet: str, items: list[str], request: Request, library: Library) -> Layout | None:
    """Return the layout with the items of a cabinet placed anew, glass first; None if one finds no place."""
    glass = _glass(layout, items, library)
    first = sorted(glass, key=lambda item: (-layout.box(item).width * layout.box(item).depth, item))
    proposed = without(layout, items)
    for item in (*first, *(item for item in items if item not in glass)):
        proposed = proposed.replace(placements=(*proposed.placements, layout.placement(item)))
        spots = _spots(proposed, cabinet, item, request)
        best = max(spots, key=lambda spot: (_edge(proposed, spot), -spot.slot), default=None)
        if best is None:
            return None
        proposed = apply(proposed, best)
    return proposed


def _spots(layout: Layout, cabinet: str, item: str, request: Request) -> Iterator[Settle]:
    """Yield the free spots nearest to places along the middle line of each shelf."""
    for slot, surface in enumerate(layout.asset(cabinet).surfaces):
        steps = int(surface.width / 2.0 / STEP_M)
        for x in (k * STEP_M for k in range(-steps, steps + 1)):
            started = apply(layout, Settle(item, cabinet, slot, x, 0.0))
            yield from free_spots(started, item, cabinet, slot, request.profile, most=1)


def _edge(layout: Layout, spot: Settle) -> float:
    """Return the satisfaction of the distance from the edges of the cabinet."""
    surface, size = layout.asset(spot.support).surfaces[spot.slot], layout.asset(spot.id).size
    holder = layout.asset(spot.support).size
    across = abs(math.sin(spot.yaw)) > 0.5
    width, depth = (size.depth, size.width) if across else (size.width, size.depth)
    x, y = abs(surface.x + spot.x) + width / 2.0, abs(surface.y + spot.y) + depth / 2.0
    gap = min(holder.width / 2.0 - x, holder.depth / 2.0 - y)
    return satisfaction(100.0 * max(gap, 0.0) / EDGE_CM, CORRECTED)


def _sound(layout: Layout, request: Request) -> bool:
    return not failures(evaluate_layout(layout, request.protocol, request.rules, navigation=True))
