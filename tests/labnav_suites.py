"""Suites of LabNav episodes that are drawn on published floors."""

from __future__ import annotations

from collections.abc import Iterable

from labgym.envs.labnav.drawing import ATTEMPTS, draw_floor
from labgym.envs.labnav.episodes import Draws, LabNavEpisode, LabNavEpisodes, Split
from labgym.layouts import load_published, published


def draw_suite(
    task: str,
    level: int,
    split: Split,
    floors: int,
    per_floor: int,
    *,
    seed: int,
    attempts: int = ATTEMPTS,
    names: Iterable[str] | None = None,
) -> LabNavEpisodes:
    """Return the draft of a suite: episodes on the first floors of a split that have all of them.

    Args:
        task, level, split, seed, attempts: as for `draw_floor`.
        floors: number of floors. per_floor: episodes on each.
        names: ids of the floors to try; by default those of the split.

    Raises:
        UnknownNameError: there is no such task, level or floor.
    """
    episodes: list[LabNavEpisode] = []
    draws: dict[str, Draws] = {}
    for name in published(split) if names is None else names:
        if sum(one.accepted >= per_floor for one in draws.values()) == floors:
            break
        accepted, draws[name] = draw_floor(load_published(split, name), task, level, per_floor, seed, attempts)
        if len(accepted) == per_floor:
            episodes += accepted
    return LabNavEpisodes(task=task, level=level, split=split, seed=seed, episodes=tuple(episodes), draws=draws)
