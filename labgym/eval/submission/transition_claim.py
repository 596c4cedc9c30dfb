"""A submission of transitions, such as that of lab30, and the published suite that it must match."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from labgym.envs.world import world_of
from labgym.errors import UnknownNameError
from labgym.eval.driving.assignments import assignments, episode_keys
from labgym.eval.driving.drive import Drive, drive_episodes
from labgym.eval.driving.episode_row import Key
from labgym.eval.driving.evaluation import in_one_line, summary_differences
from labgym.eval.driving.files import SUMMARY
from labgym.eval.driving.record import NavigationSummary
from labgym.eval.driving.runner import catalog_digest
from labgym.eval.submission.claim import Claim
from labgym.eval.submission.folder import Episodes, episode_name
from labgym.eval.submission.record_checks import RunRecord, catalog_problems, stated_problems
from labgym.eval.submission.route_checks import lab30_route_problems
from labgym.eval.submission.row_checks import Terms, row_problems
from labgym.layouts import Layout
from labgym.policies import Policy
from labgym.policies.process import PolicyProcess
from labgym.runs.identity import IDENTITY_FILE
from labgym.suites import Suite, load_suite, suite_names

KIND = "eval"
"""Kind of the runs of transitions."""


@dataclass(frozen=True)
class Published:
    """A suite of this installation.

    Attributes:
        suite: the suite, with the repeats and the jitter of the submission.
        layouts: its layouts by id, in order.
        keys: its episodes by layout id, in order.
    """

    suite: Suite
    layouts: dict[str, Layout]
    keys: dict[str, tuple[Key, ...]]

    @classmethod
    def of(cls, claimed: Suite, name: str | None = None) -> Published:
        """Return the published suite that a submission claims, repeated as the claimed one is.

        Args:
            claimed: the suite in the submission.
            name: name or .json file of the suite to use instead of the one that the claimed suite's name gives.

        Raises:
            UnknownNameError: no published suite has that name.
            DocumentError: the file is not a suite.
        """
        base = load_suite(name) if name is not None else load_suite(_base_name(claimed.name))
        suite = base.repeated(claimed.repeats, claimed.jitter)
        layouts = {layout.id: layout for layout in suite.load_layouts()}
        return cls(suite, layouts, {layout.id: episode_keys(layout, suite) for layout in layouts.values()})

    @property
    def episodes(self) -> int:
        """Number of episodes."""
        return sum(map(len, self.keys.values()))


class TransitionClaim(Claim[Key]):
    """A submission of transitions.

    Args:
        folder: of the submission. suite: name or .json file of the suite, if not that of the submission's name.

    Raises:
        DocumentError, UnknownNameError: the summary cannot be read, or there is no such suite.
    """

    summary: NavigationSummary

    def __init__(self, folder: Path, suite: str | None) -> None:
        self.summary = NavigationSummary.load(folder / SUMMARY)
        self._published = Published.of(self.summary.suite, suite)
        self._terms = Terms(self._published.suite, self.summary.policy, self.summary.seed)
        self._episodes = Episodes.read(folder, self._published.episodes)
        self.suite_name = self._published.suite.label
        self.keys = [key for layout in self._published.keys.values() for key in layout]
        self.rows, self.file_problems = self._episodes.rows, self._episodes.problems

    @property
    def routes(self) -> Mapping[Key, int]:
        """The places of the routes in their file."""
        return self._episodes.routes

    def route(self, key: Key) -> NDArray[np.float64]:
        """Return the poses (n, 3) of a route."""
        return self._episodes.route(key)

    def name_of(self, key: Key) -> str:
        """Return the name of an episode."""
        return episode_name(key)

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
        yield from stated_problems(identity, KIND, expected)
        if identity.kind != KIND:
            return
        if identity.inputs.get("isolated") is not True:
            yield f"{IDENTITY_FILE}: the policy was not driven in a separate process"
        yield from catalog_problems(identity, catalog_digest(self._published.layouts.values()))

    def suite_problems(self) -> Iterator[str]:
        """Yield a sentence if the claimed suite differs from the published one."""
        claimed, published = self.summary.suite, self._published.suite
        names = [name for name in Suite.model_fields if getattr(claimed, name) != getattr(published, name)]
        if names:
            yield f"suite {claimed.label} differs from the published {published.label} in {', '.join(names)}"

    def episode_problems(self) -> Iterator[str]:
        """Yield a sentence for each contradiction in a row, and between a row and its route."""
        suite = self._terms.suite
        for name, layout in self._published.layouts.items():
            if not any(key in self.rows for key in self._published.keys[name]):
                continue
            world = world_of(layout)
            for episode in assignments(layout, suite):
                key: Key = (name, episode.pair.index, episode.repeat)
                if key not in self.rows:
                    continue
                row = self._episodes.rows[key]
                problems = list(row_problems(row, episode, layout, world, self._terms))
                if key in self.routes:
                    problems += lab30_route_problems(row, self.route(key), suite, world)
                yield from (f"episode {episode_name(key)}: {problem}" for problem in problems)

    def summary_problems(self, record: RunRecord) -> Iterator[str]:
        """Yield a sentence for each part of the summary that does not match the rows or the published suite."""
        summary, published = self.summary, self._published
        hashes = {name: layout.hash for name, layout in published.layouts.items()}
        differing = [name for name in {**hashes, **summary.layouts} if hashes.get(name) != summary.layouts.get(name)]
        if differing:
            yield f"{SUMMARY}: other layouts than the published ones: {', '.join(name[:80] for name in differing[:5])}"
        if summary.expected != published.episodes:
            yield f"{SUMMARY}: expected is {summary.expected}, but the suite has {published.episodes} episodes"
        if not self.rows:
            return
        recomputed = summary.recomputed(tuple(self._episodes.rows.values()))
        # Intervals are equal if the present code wrote the summary.
        names = summary_differences(summary, recomputed, exactly=record.code_is_present)
        if names:
            yield f"{SUMMARY} does not match the rows in {in_one_line(name[:80] for name in names[:10])}"

    def stated(self, driver: PolicyProcess) -> dict[str, tuple[object, object]]:
        """Return properties of the policy, and what the submission says of them."""
        return {
            "privileged": (driver.privileged, self.summary.privileged),
            "sensors": (driver.observation, self.summary.sensors),
        }

    def driven(self, driver: PolicyProcess | Policy, keys: Sequence[Key]) -> Iterator[tuple[Key, Drive]]:
        """Drive episodes again and yield each with its key."""
        terms = self._terms
        for name, layout in self._published.layouts.items():
            numbers = {key[1:] for key in keys if key[0] == name}
            if not numbers:
                continue
            chosen = [one for one in assignments(layout, terms.suite) if (one.pair.index, one.repeat) in numbers]
            for drive in drive_episodes(driver, layout, chosen, terms.suite, terms.policy, terms.seed):
                yield drive.row.key, drive


def _base_name(name: str) -> str:
    """Return the name of the published suite of which a name such as test-5x-1a2b3c is a repetition."""
    names = [base for base in suite_names() if name == base or name.startswith(f"{base}-")]
    if not names:
        raise UnknownNameError("published suite", name, suite_names())
    return max(names, key=len)
