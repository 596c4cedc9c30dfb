"""A random part of a submission, driven again and compared exactly."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import TypeVar

import numpy as np
from tqdm import tqdm

from labgym.eval.driving.assignments import assignments
from labgym.eval.driving.drive import Drive, drive_episodes
from labgym.eval.driving.episode_row import EpisodeRow, Key
from labgym.eval.submission.folder import Episodes, episode_name
from labgym.eval.submission.published import Published
from labgym.eval.submission.row_checks import Terms
from labgym.policies.policy import Driver

T = TypeVar("T")
SHARE = 0.1
"""Share of the episodes of a large result that is driven again."""
FEWEST = 60
"""At least this many episodes are driven again: all of a smaller result."""
FORGED = 3
"""Number of forged rows whose probability to go unseen is stated."""


def sampled(published: Published, seed: int) -> tuple[Key, ...]:
    """Return the episodes of a suite that are driven again, in the suite's order."""
    return drawn_again([key for layout in published.keys.values() for key in layout], seed)


def drawn_again(keys: Sequence[T], seed: int) -> tuple[T, ...]:
    """Return the keys of the episodes that are driven again, in their order: a random tenth, but at least 60."""
    count = min(len(keys), max(FEWEST, math.ceil(SHARE * len(keys) - 1e-9)))
    chosen = np.random.default_rng(seed).choice(len(keys), size=count, replace=False)
    return tuple(keys[index] for index in sorted(chosen.tolist()))


def unseen(episodes: int, again: int, forged: int = FORGED) -> float:
    """Return the probability that none of some forged rows is among the episodes that are driven again.

    Args:
        episodes: number of all. again: number of those that are driven again. forged: number of forged rows.
    """
    forged = min(forged, episodes)
    return math.comb(episodes - forged, again) / math.comb(episodes, again)


def driven_again(again: int, episodes: int, policy: str, seed: int) -> str:
    """Return the sentence of a verdict on the episodes that were driven again."""
    if again == episodes:
        return f"all {again} episodes driven again with {policy!r}"
    chance = unseen(episodes, again)
    return (
        f"{again} of {episodes} episodes driven again with {policy!r}, chosen with --seed {seed}: {FORGED} forged rows "
        f"that pass the other checks go unseen with a probability of {100.0 * chance:.0f}%"
    )


def drive_problems(
    driver: Driver, keys: Sequence[Key], published: Published, episodes: Episodes, terms: Terms, progress: bool = True
) -> Iterator[str]:
    """Drive episodes again and yield a sentence for each whose row or route differs.

    Args:
        driver: the policy.
        keys: the episodes, as from `sampled`.
        published: suite and layouts.
        episodes: the rows and routes of the submission.
        terms: suite, policy and seed of the submission.
        progress: whether to show a progress bar.
    """
    with tqdm(total=len(keys), desc="drive again", unit="ep", disable=not progress) as bar:
        for name, layout in published.layouts.items():
            numbers = {key[1:] for key in keys if key[0] == name}
            if not numbers:
                continue
            chosen = [one for one in assignments(layout, terms.suite) if (one.pair.index, one.repeat) in numbers]
            for drive in drive_episodes(driver, layout, chosen, terms.suite, terms.policy, terms.seed):
                bar.update()
                yield from _differences(drive, episodes)


def _differences(drive: Drive, episodes: Episodes) -> Iterator[str]:
    key = drive.row.key
    row = episodes.rows.get(key)
    if row is None or key not in episodes.routes:
        return  # reported as missing
    fields = [name for name in EpisodeRow.model_fields if getattr(row, name) != getattr(drive.row, name)]
    if fields:
        shown = ", ".join(
            f"{name} {_text(getattr(row, name))}, now {_text(getattr(drive.row, name))}" for name in fields[:3]
        )
        more = f" and {len(fields) - 3} more" if len(fields) > 3 else ""
        yield f"episode {episode_name(key)} driven again differs: {shown}{more}"
        return
    route, again = episodes.route(key), np.array(drive.route)
    if route.shape != again.shape or (route != again).any():
        step = (
            int(np.argmax((route != again).any(axis=1))) if route.shape == again.shape else min(len(route), len(again))
        )
        yield f"episode {episode_name(key)} driven again has another route from step {step}"


def _text(value: object) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)[:60]
