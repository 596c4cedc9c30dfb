"""A submission of transitions, such as that of lab30, and the published suite that it must match."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from pathlib import Path

from labgym.envs.labnav.task import spl
from labgym.envs.world import world_of
from labgym.errors import UnknownNameError
from labgym.eval.driving.assignments import Assignment, assignments, episode_keys
from labgym.eval.driving.drive import TransitionDrive, drive_episodes
from labgym.eval.driving.episode_row import TransitionRow
from labgym.eval.driving.evaluation import TransitionEvaluation
from labgym.eval.driving.files import SUMMARY
from labgym.eval.driving.navigation_metrics import soft_spl
from labgym.eval.driving.record import NavigationSummary
from labgym.eval.driving.runner import catalog_digest
from labgym.eval.submission.claim import Claim
from labgym.eval.submission.record_checks import RunRecord, box_problems, catalog_problems, stated_problems
from labgym.eval.submission.route_checks import lab30_route_problems
from labgym.layouts import Layout
from labgym.policies import Policy
from labgym.policies.process import PolicyProcess
from labgym.runs.identity import IDENTITY_FILE
from labgym.suites import Suite, load_suite, suite_names

EXACT = 1e-9
"""Differences of recomputed figures up to this are rounding, relative or absolute."""
LENGTH_ERROR = 1e-6
"""Accuracy of shortest lengths, meters."""


class TransitionClaim(Claim[NavigationSummary, TransitionRow]):
    """A submission of transitions, and the published suite with its repeats and its jitter.

    Args:
        folder: of the submission. suite: name or .json file of the suite, if not that of the submission's name.

    Raises:
        DocumentError, UnknownNameError: the summary cannot be read, or there is no such suite.
    """

    def __init__(self, folder: Path, suite: str | None) -> None:
        summary = NavigationSummary.load(folder / SUMMARY)
        claimed = summary.suite
        published = load_suite(suite if suite is not None else _base_name(claimed.name))
        self._suite = published.repeated(claimed.repeats, claimed.jitter)
        self._layouts = {layout.id: layout for layout in self._suite.load_layouts()}
        keys = [key for layout in self._layouts.values() for key in episode_keys(layout, self._suite)]
        super().__init__(folder, summary, self._suite.label, keys, TransitionRow)

    def identity_problems(self, record: RunRecord) -> Iterator[str]:
        """Yield a sentence for each input of the run that is not the summary's or the suite's."""
        identity, summary = record.identity, self.summary
        if identity is None:
            return
        expected = {
            "suite": summary.suite.model_dump(mode="json"),
            "layouts": summary.layouts,
            "seed": summary.seed,
            "policy": summary.policy,
        }
        yield from stated_problems(identity, TransitionEvaluation.KIND, expected)
        if identity.kind != TransitionEvaluation.KIND:
            return
        if identity.inputs.get("isolated") is not True:
            yield f"{IDENTITY_FILE}: the policy was not driven in a separate process"
        yield from box_problems(identity, summary.box)
        yield from catalog_problems(identity, catalog_digest(self._layouts.values()))

    def suite_problems(self) -> Iterator[str]:
        """Yield a sentence if the claimed suite differs from the published one."""
        claimed, published = self.summary.suite, self._suite
        names = [name for name in Suite.model_fields if getattr(claimed, name) != getattr(published, name)]
        if names:
            yield f"suite {claimed.label} differs from the published {published.label} in {', '.join(names)}"

    def problems_by_episode(self) -> Iterator[tuple[str, str]]:
        """Yield the key and a sentence for each contradiction in a row, and between a row and its route."""
        for layout in self._layouts.values():
            if not any(key in self.rows for key in episode_keys(layout, self._suite)):
                continue
            keys = episode_keys(layout, self._suite)
            for key, episode in zip(keys, assignments(layout, self._suite), strict=True):
                row = self.rows.get(key)
                if row is None:
                    continue
                problems = list(row_problems(row, episode, layout, self._suite, self.summary))
                if key in self.routes:
                    problems += lab30_route_problems(row, self.route(key), self._suite, world_of(layout))
                yield from ((key, problem) for problem in problems)

    def summary_problems(self, record: RunRecord) -> Iterator[str]:
        """Yield a sentence for each part of the summary that does not match the rows or the published suite."""
        summary, count = self.summary, len(self.keys)
        hashes = {name: layout.hash for name, layout in self._layouts.items()}
        differing = [name for name in {**hashes, **summary.layouts} if hashes.get(name) != summary.layouts.get(name)]
        if differing:
            yield f"{SUMMARY}: other layouts than the published ones: {', '.join(name[:80] for name in differing[:5])}"
        if summary.expected != count:
            yield f"{SUMMARY}: expected is {summary.expected}, but the suite has {count} episodes"
        yield from super().summary_problems(record)

    def stated(self, driver: PolicyProcess) -> dict[str, tuple[object, object]]:
        """Return properties of the policy, and what the submission says of them."""
        return {
            "privileged": (driver.privileged, self.summary.privileged),
            "sensors": (driver.observation, self.summary.sensors),
        }

    def driven(self, driver: PolicyProcess | Policy, keys: Sequence[str]) -> Iterator[TransitionDrive]:
        """Drive episodes again and yield their results."""
        for layout in self._layouts.values():
            names = episode_keys(layout, self._suite)
            if not set(names) & set(keys):
                continue
            every = zip(names, assignments(layout, self._suite), strict=True)
            chosen = [episode for key, episode in every if key in keys]
            yield from drive_episodes(driver, layout, chosen, self._suite, self.summary.policy, self.summary.seed)


def row_problems(
    row: TransitionRow, episode: Assignment, layout: Layout, suite: Suite, summary: NavigationSummary
) -> Iterator[str]:
    """Yield a sentence for each field of a row that does not agree with the episode or with other fields.

    Args:
        row: the row.
        episode: the episode, with its start and goal.
        layout: the published layout. suite: the published suite. summary: of the submission.
    """
    stated = {
        "suite": (row.suite, suite.label),
        "split": (row.split, suite.split),
        "policy": (row.policy, summary.policy),
        "seed": (row.seed, summary.seed),
        "layout_hash": (row.layout_hash, layout.hash),
        "protocol": (row.protocol, layout.protocol_id),
    }
    for name, (value, expected) in stated.items():
        if value != expected:
            yield f"{name} is {str(value)[:80]!r}, expected {expected!r}"
    for name, pose, published in (("start", row.start, episode.pair.start), ("goal", row.goal, episode.pair.goal)):
        if not all(map(_equal, pose, published)):
            yield f"{name} is {_shown(pose)}, expected {_shown(published)}"
    yield from _length_problems(row, world_of(layout).shortest_length(episode.pair))
    yield from _outcome_problems(row, suite)
    yield from _score_problems(row, episode, suite)


def _length_problems(row: TransitionRow, shortest: float) -> Iterator[str]:
    length = row.shortest_path_length
    if (length is None) != math.isinf(shortest) or (length is not None and abs(length - shortest) > LENGTH_ERROR):
        yield f"shortest_path_length is {length}, recomputed {shortest:.6f} m"


def _outcome_problems(row: TransitionRow, suite: Suite) -> Iterator[str]:
    arrived = row.error is None and row.final_distance <= suite.success_distance
    if row.success != arrived:
        reason = "the policy failed" if row.error is not None else f"it ended {row.final_distance:.3f} m from the goal"
        yield f"success is {row.success}, but {reason} (success distance {suite.success_distance:g} m)"
    if row.steps > suite.max_steps:
        yield f"steps is {row.steps}, above the suite's limit of {suite.max_steps}"
    if not _equal(row.time, row.steps * suite.control_dt):
        yield f"time is {row.time:g} s, but {row.steps} steps take {row.steps * suite.control_dt:g} s"
    if row.contacts > row.steps:
        yield f"contacts is {row.contacts}, more than the {row.steps} steps"


def _score_problems(row: TransitionRow, episode: Assignment, suite: Suite) -> Iterator[str]:
    initial = math.dist(episode.pair.start[:2], episode.pair.goal[:2])
    length, driven = row.shortest_path_length, row.path_length
    navdp = suite.metrics == "navdp"
    scores: dict[str, tuple[float | None, float | None]] = {
        "spl": (row.spl, None if navdp or length is None else spl(row.success, length, driven)),
        "soft_spl": (
            row.soft_spl,
            None if navdp or length is None else soft_spl(initial, row.final_distance, length, driven),
        ),
        "navdp_spl": (row.navdp_spl, spl(row.success, initial, driven) if navdp else None),
    }
    for name, (value, expected) in scores.items():
        if (value is None) != (expected is None) or (
            value is not None and expected is not None and not _equal(value, expected)
        ):
            yield f"{name} is {value}, recomputed {expected}"


def _equal(one: float, other: float) -> bool:
    return abs(one - other) <= EXACT * max(1.0, abs(other))


def _shown(pose: tuple[float, ...]) -> str:
    return "(" + ", ".join(f"{number:.6g}" for number in pose) + ")"


def _base_name(name: str) -> str:
    """Return the name of the published suite of which a name such as test-5x-1a2b3c is a repetition."""
    names = [base for base in suite_names() if name == base or name.startswith(f"{base}-")]
    if not names:
        raise UnknownNameError("published suite", name, suite_names())
    return max(names, key=len)
