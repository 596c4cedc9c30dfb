"""A random part of a submission, driven again and compared exactly."""

from __future__ import annotations

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
FEWEST = 5
"""At least this many episodes are driven again."""


def sampled(published: Published, seed: int) -> tuple[Key, ...]:
    """Return a random tenth of a suite's episodes, at least five, in the suite's order."""
    return random_tenth([key for layout in published.keys.values() for key in layout], seed)


def random_tenth(keys: Sequence[T], seed: int) -> tuple[T, ...]:
    """Return a random tenth of the keys of episodes, at least five, in their order."""
    count = min(len(keys), max(FEWEST, round(SHARE * len(keys) + 0.499)))
    chosen = np.random.default_rng(seed).choice(len(keys), size=count, replace=False)
    return tuple(keys[index] for index in sorted(chosen.tolist()))


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
