"""Furniture that is in each other's way: all of it is taken out and put back piece by piece, the hardest first."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from itertools import islice

from labgym.layouts.model import Layout
from labgym.layouts.moves import Place, apply, descendants, may_move, without
from labgym.layouts.placement import FLOOR, WALL
from labgym.layouts.repairs.berths import behind_poses, berths
from labgym.layouts.repairs.rank import RepairState, discouraged, narrowness
from labgym.layouts.rules.facility.backs import TALL
from labgym.layouts.rules.supplies import BURNERS
from labgym.layouts.rules.thresholds import ONE_SIDED
from labgym.layouts.tidying import tidied

MOST = 12
"""Maximum number of pieces that are taken out."""
ORDERS = 4
"""Maximum number of orders in which they are put back."""
BERTHS = 24
"""Maximum number of poses assessed for a piece."""
STAYING = 3
"""Maximum number of pieces that face no wall behind which others are tried, and of such pairs."""
MILD = 1
"""Warnings that keep no piece from staying where it is: a hood within 3 m of a door, as most are."""

Faults = tuple[int, int, int]
"""Cost without ways, narrow exits and blocked places, warnings."""


def reinserted(state: RepairState, others: Collection[str] = (), first: Collection[str] = ()) -> RepairState:
    """Return the state after furniture was taken out and put back at free places, one piece after the other.

    All pieces that take part in a fault are taken out, so that none of them is in the way of another. A piece that can
    stay where it is does so before any other chooses; then the largest comes first. Each piece takes the first place
    that adds no fault, narrows no way and causes no warning, else the best one, and then chooses before all others in
    the next attempt. Before that, pieces that face no wall stay, if another can stand back to back with them.

    Args:
        others: ids of further pieces that are taken out. first: ids of pieces that choose before all others.
    """
    pieces = _pieces(state, others)
    for pair in _pairs(state, pieces):
        out = [piece for piece in pieces if piece not in (pair.behind, pair.front)]
        state, is_clean = _attempts(state, apply(state.layout, pair.place), out, first)
        if is_clean:
            return state
    return _attempts(state, state.layout, pieces, first)[0] if pieces else state


def involvement(state: RepairState) -> Counter[str]:
    """Return the floor objects that take part in faults of furniture, with the number of faults; ways do not count."""
    layout, assessment = state.layout, state.assessment
    groups: list[tuple[str, ...]] = [(fault.id,) for fault in assessment.bounds]
    groups += [collision.ids for collision in assessment.collisions]
    groups += [issue.ids for issue in assessment.errors if issue.rule != "egress"]
    counts: Counter[str] = Counter()
    for ids in groups:
        roots = {layout.root(item).id for item in ids}
        counts.update(roots if len(roots) > 1 or ids[0] in roots else ())  # Not what is wrong on one piece.
    return Counter({root: count for root, count in counts.items() if layout.placement(root).support == FLOOR})


def _pieces(state: RepairState, others: Collection[str]) -> list[str]:
    counts, layout = involvement(state), state.layout
    on_floor = (each for each in {*counts, *others} if each in layout.by_id and layout.placement(each).support == FLOOR)
    able = [piece for piece in on_floor if may_move(layout, piece)]
    return sorted(able, key=lambda piece: (-counts[piece], piece))[:MOST]


@dataclass(frozen=True)
class _Pair:
    """A piece that stays although it faces no wall, and the place of another back to back with it."""

    front: str
    behind: str
    place: Place


def _pairs(state: RepairState, pieces: Sequence[str]) -> list[_Pair]:
    """Return the pairs of low pieces that have no fault if one of them stands behind the other, the nearest first."""
    layout, bare = state.layout, _bare(state.layout)
    free = {issue.ids[0] for issue in state.assessment.errors if issue.rule == "back_to_wall"}
    low = [p for p in pieces if layout.asset(p).size.height < TALL and layout.asset(p).size.depth < ONE_SIDED]
    fronts = [piece for piece in low if piece in free]
    if len(low) < 2 or not fronts:
        return []
    empty = without(bare, pieces)
    least, pairs = _faults(state, empty), []
    for front in fronts[:STAYING]:
        alone = _with(empty, bare, front)
        for behind in (piece for piece in low if piece != front):
            both = _with(alone, bare, behind)
            for place in behind_poses(both, behind, front):
                if _faults(state, apply(both, place), least) <= least:
                    pairs.append(_Pair(front, behind, place))
                    break
    position = {piece: layout.placement(piece).position for piece in low}
    pairs.sort(key=lambda pair: (math.dist(position[pair.behind][:2], (pair.place.x, pair.place.y)), pair.front))
    return pairs[:STAYING]


@dataclass(frozen=True)
class _Seating:
    """Places of pieces, and those that caused faults or warnings by how bad they are."""

    places: tuple[Place, ...]
    troubled: dict[str, Faults]


def _attempts(
    state: RepairState, layout: Layout, pieces: Sequence[str], first: Collection[str]
) -> tuple[RepairState, bool]:
    """Return the best state after some attempts to put pieces of a layout back, and whether it leaves no trouble."""
    bare, best = _bare(layout), state
    empty = without(bare, pieces)
    least = _faults(state, empty)
    staying = [piece for piece in pieces if _stays(state, empty, bare, piece, least)]
    area = {piece: layout.asset(piece).size.width * layout.asset(piece).size.depth for piece in pieces}
    order = sorted(pieces, key=lambda piece: (piece not in first, piece not in staying, -area[piece], piece))
    tried: set[tuple[str, ...]] = set()
    while len(tried) < ORDERS and tuple(order) not in tried:
        tried.add(tuple(order))
        seating = _seated(state, bare, order, staying, least)
        proposed = _applied(state, layout, seating.places)
        if proposed.rank < best.rank:
            best = proposed
        if not seating.troubled and proposed.rank.sound:
            return best, True
        worst = sorted(seating.troubled, key=lambda piece: seating.troubled[piece], reverse=True)
        order = [*worst, *(piece for piece in order if piece not in worst)]
    return best, False


def _applied(state: RepairState, layout: Layout, places: Sequence[Place]) -> RepairState:
    for place in places:
        layout = apply(layout, place)
    proposed = state.with_layout(layout)
    if proposed.rank.cost:
        tidy = state.with_layout(tidied(layout, state.protocol))
        proposed = tidy if tidy.rank < proposed.rank else proposed
    return proposed


def _stays(state: RepairState, empty: Layout, bare: Layout, piece: str, least: Faults) -> bool:
    """Whether a piece is no fault where it is, if the others are not there."""
    faults = _faults(state, _with(empty, bare, piece), least)
    return faults[:2] <= least[:2] and faults[2] <= least[2] + MILD


def _seated(
    state: RepairState, bare: Layout, order: Sequence[str], staying: Collection[str], least: Faults
) -> _Seating:
    """Put pieces back in an order."""
    standing = without(bare, order)
    places: list[Place] = []
    troubled: dict[str, Faults] = {}
    for piece in order:
        standing = _with(standing, bare, piece)
        place, faults = _place(state, standing, piece, least, piece in staying)
        if place is not None:
            places.append(place)
            standing = apply(standing, place)
        excess = tuple(max(own - limit, 0) for own, limit in zip(faults, least, strict=True))
        if any(excess):
            troubled[piece] = (excess[0], excess[1], excess[2])
        least = (faults[0], max(faults[1], least[1]), max(faults[2], least[2]))
    return _Seating(tuple(places), troubled)


def _place(state: RepairState, layout: Layout, piece: str, least: Faults, stays: bool) -> tuple[Place | None, Faults]:
    """Return the first place of a piece without a fault more, else the best one, and the faults; None for its place."""
    limit = least
    best, fewest = None, _faults(state, layout, least)
    if stays:
        limit = (*least[:2], least[2] + MILD)
    if fewest <= limit:
        return None, fewest
    for place in islice(berths(layout, piece), BERTHS):
        faults = _faults(state, apply(layout, place), fewest)
        if faults < fewest:
            best, fewest = place, faults
        if faults <= least:
            break
    return best, fewest


def _faults(state: RepairState, layout: Layout, limit: Faults | None = None) -> Faults:
    """Return the faults of furniture without what stands on it; above a limit only as many as exceed it."""
    assessment = state.assessed(layout, None)
    cost = assessment.cost
    if limit is not None and cost > limit[0]:
        return cost, 0, 0
    narrow = narrowness(assessment.arrangement) if state.navigation else 0
    if limit is not None and (cost, narrow) > limit[:2]:
        return cost, narrow, 0
    walks = any(asset.subtype == "shower" for asset in assessment.arrangement.assets)
    return cost, narrow, discouraged(assessment, walks)


def _bare(layout: Layout) -> Layout:
    """Return the layout without what stands on furniture, but for burners: they need gas."""
    return layout.replace(
        placements=tuple(
            placement
            for placement in layout.placements
            if placement.support in (FLOOR, WALL)
            or (placement.asset in BURNERS and layout.placement(placement.support).support == FLOOR)
        )
    )


def _with(layout: Layout, whole: Layout, piece: str) -> Layout:
    """Return a layout with a piece and what stands on it, as in the whole layout."""
    back = {piece, *descendants(whole, piece)}
    return layout.replace(placements=(*layout.placements, *(item for item in whole.placements if item.id in back)))
