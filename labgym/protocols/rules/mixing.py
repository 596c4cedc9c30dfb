"""Reagents that react dangerously are in one vessel only within the limits in which chemists control the reaction."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations

from labgym.assets import Asset
from labgym.assets.mixing import Limit, limit_of
from labgym.protocols.contents import SEPARATING, STILL, Situation
from labgym.protocols.rules.conditions import ENDING
from labgym.protocols.rules.finding import Case, Finding
from labgym.quantities import ROOM_TEMPERATURE

OXIDIZERS = frozenset({"strong_oxidizer", "hypochlorite", "organic_peroxide"})
REDUCTANTS = frozenset({"sulfite", "weak_reducer", "alcohol"})
"""Groups of what a quench destroys, and of what destroys it."""
COLD_END_C = 30.0
"""Highest temperature at which a step that ends a reaction may bring together what reacts violently."""


def pairs_stay_within_their_limits(case: Case) -> Iterator[Finding]:
    """Every pair in a vessel satisfies the reactivity matrix at the temperatures of all its steps, in a hood or not."""
    met: dict[tuple[str, str], bool] = {}
    reported: set[tuple[str, str]] = set()
    destroyed: set[str] = set()
    for situation in case.situations:
        if situation.step.action in STILL:
            continue
        for pair, limit in _limits(case, situation):
            if not destroyed.isdisjoint(pair):
                continue
            temperature = situation.step.temperature
            celsius = ROOM_TEMPERATURE if temperature is None else temperature
            first = pair not in met
            ends = situation.step.action in ENDING and celsius <= COLD_END_C
            met.setdefault(pair, ends)
            if pair in reported or (limit.ends and met[pair]):
                continue
            highest = limit.meets if first and limit.meets is not None else limit.above
            if celsius > highest:
                reported.add(pair)
                yield _finding(situation, pair, limit, celsius, highest)
        if situation.step.action in ENDING and any(_is_any_of(asset, REDUCTANTS) for asset in situation.added):
            destroyed |= {name for name in situation.contents if _is_any_of(case.catalog.get(name), OXIDIZERS)}


def _is_any_of(asset: Asset, groups: frozenset[str]) -> bool:
    return asset.chemistry is not None and not groups.isdisjoint(asset.chemistry.groups)


def _limits(case: Case, situation: Situation) -> Iterator[tuple[tuple[str, str], Limit]]:
    """Yield the pairs in the vessel of a step that have a limit; consecutive washes do not meet."""
    assets = {name: case.catalog.get(name) for name in sorted(situation.contents)}
    shares = {name: volume / situation.volume for name, volume in situation.contents.items() if situation.volume}
    added = {asset.name for asset in situation.added}
    in_turn = situation.vessel is not None and situation.vessel.name == SEPARATING
    for a, b in combinations(assets, 2):
        limit = limit_of(assets[a], assets[b], shares, assets.values())
        if limit is not None and not (in_turn and {a, b} <= added):
            yield (a, b), limit


def _finding(situation: Situation, pair: tuple[str, str], limit: Limit, celsius: float, highest: float) -> Finding:
    together = f"step {situation.step.index} has {pair[0]} and {pair[1]} together at {celsius:g} C"
    if limit.is_never:
        suggestion = f"use another solvent or reagent instead of one of them ({limit.source})"
    else:
        suggestion = f"stay at or below {highest:g} C, or use another solvent ({limit.source})"
    return Finding("violent-mixture", situation.step.index, f"{together}: {limit.hazard}", suggestion)


RULES = (pairs_stay_within_their_limits,)
