"""A submission set against the suite of this installation that it claims; what all kinds of suites have in common.

Its files are read within bounds, and nothing in them is executed.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any, Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from labgym.counts import MAX_SEED
from labgym.documents import parse_json
from labgym.errors import DocumentError
from labgym.eval.driving.actions import StoredActions, StoredPolicy
from labgym.eval.driving.drive import DrivenEpisode
from labgym.eval.driving.episode_row import EpisodeRow
from labgym.eval.driving.evaluation import in_one_line
from labgym.eval.driving.files import (
    ACTIONS,
    EPISODES,
    MAX_LINE,
    ROUTES,
    SUMMARY,
    EpisodeActions,
    EpisodeRoute,
    each_record,
)
from labgym.eval.driving.record import EvaluationSummary
from labgym.eval.submission.record_checks import RunRecord
from labgym.policies import Policy
from labgym.policies.process import PolicyProcess, PolicySource

MOST = 20
"""Largest number of problems of one kind that are listed."""


@dataclass(frozen=True)
class Verdict:
    """The outcome of a check.

    Attributes:
        problems: a line for each failed check; empty if the submission passes.
        facts: a line for each check that was made or left out.
    """

    problems: tuple[str, ...]
    facts: tuple[str, ...]

    @property
    def passed(self) -> bool:
        """Whether there is no problem."""
        return not self.problems


def listed(problems: Iterable[str], kind: str) -> list[str]:
    """Return the first problems, and a line if there are more."""
    first = list(islice(problems, MOST + 1))
    return first if len(first) <= MOST else [*first[:MOST], f"more {kind} like these are not listed"]


def completeness_problems(
    episodes: Iterable[str], given: Mapping[str, Mapping[str, object]], suite: str
) -> Iterator[str]:
    """Yield a sentence for each episode without a row, a route or actions, and for each of these of no episode.

    Args:
        episodes: keys of those of the suite. given: rows, routes and actions of the submission by key, by their name.
        suite: its name.
    """
    expected = dict.fromkeys(episodes)
    for key in expected:
        missing = [kind for kind, keys in given.items() if key not in keys]
        if missing:
            yield f"episode {key[:120]} has no {' and no '.join(missing)}"
    for key in dict.fromkeys(key for keys in given.values() for key in keys):
        if key not in expected:
            yield f"episode {key[:120]} is not in suite {suite}"


EXCESS = 100
"""Number of lines beyond the suite's episodes after which reading a file stops."""
S = TypeVar("S", bound=EvaluationSummary)
R = TypeVar("R", bound=EpisodeRow)


class Claim(ABC, Generic[S, R]):
    """A submission and the suite that it claims.

    Args:
        folder: of the submission. summary: of it. suite_name: of the suite.
        keys: of the suite's episodes, in their order. kind: type of the rows.

    Raises:
        DocumentError: the seed is out of range.

    Attributes:
        rows: of the submission by key. routes, actions: places of theirs in the file, bytes.
        file_problems: a sentence for each line that cannot be read, repeats an episode or is one too many.
    """

    def __init__(self, folder: Path, summary: S, suite_name: str, keys: Sequence[str], kind: type[R]) -> None:
        if not 0 <= summary.seed <= MAX_SEED:
            raise DocumentError(folder / SUMMARY, "seed", f"is {str(summary.seed)[:40]}, expected 0 to {MAX_SEED}")
        self.folder, self.summary, self.suite_name, self.keys = folder, summary, suite_name, keys
        self.file_problems: list[str] = []
        self.rows: Mapping[str, R] = {record.key: record for _, record in self._records(EPISODES, kind)}
        self.routes = {record.key: place for place, record in self._records(ROUTES, EpisodeRoute)}
        self.actions = {record.key: place for place, record in self._records(ACTIONS, EpisodeActions)}

    def _records(self, name: str, kind: type[Any]) -> Iterator[tuple[int, Any]]:
        """Yield place and record of each line of a file, a few more than the suite has episodes at most."""
        path = self.folder / name
        if not path.is_file():
            self.file_problems.append(f"{name} is missing")
            return
        with path.open("rb") as stream:
            yield from each_record(name, stream, kind, self.file_problems, len(self.keys) + EXCESS)

    @property
    def given(self) -> dict[str, Mapping[str, object]]:
        """Rows, routes and actions by key, by their name."""
        return {"row": self.rows, "route": self.routes, "actions": self.actions}

    @property
    def complete(self) -> tuple[str, ...]:
        """The keys of the suite's episodes of which the submission has all."""
        return tuple(key for key in self.keys if all(key in given for given in self.given.values()))

    def route(self, key: str) -> NDArray[np.float64]:
        """Return the poses (n, 3) of a route."""
        poses = self._line(ROUTES, self.routes[key])["poses"]
        return np.array(poses, dtype=np.float64).reshape(-1, 3)

    def stored_actions(self, key: str) -> StoredActions:
        """Return the actions of an episode."""
        return EpisodeActions.model_validate(self._line(ACTIONS, self.actions[key])).actions

    def _line(self, name: str, place: int) -> Any:
        """Return the data of the line of a file that begins at a place."""
        with (self.folder / name).open("rb") as stream:
            stream.seek(place)
            return parse_json(stream.readline(MAX_LINE), name)

    @abstractmethod
    def identity_problems(self, record: RunRecord) -> Iterator[str]:
        """Yield a sentence for each input of the run that is not the summary's or the suite's."""

    @abstractmethod
    def suite_problems(self) -> Iterator[str]:
        """Yield a sentence for each way in which the claimed suite differs from that of this installation."""

    def measured_again(self, driver: PolicyProcess, source: PolicySource, seed: int) -> tuple[bool, str] | None:  # noqa: ARG002
        """Return whether the policy's time, measured again, allows the stated latency, and a sentence; None without."""
        return None

    @abstractmethod
    def stated(self, driver: PolicyProcess) -> dict[str, tuple[object, object]]:
        """Return properties of the policy, and what the submission says of them."""

    @abstractmethod
    def drive(self, driver: PolicyProcess | Policy, key: str, blind: bool = False) -> DrivenEpisode[R]:
        """Drive an episode again and return the results.

        Args:
            driver: the policy. key: of the episode. blind: read no sensor, for a policy that looks at nothing.
        """

    def simulated(self, key: str) -> str:
        """Simulate an episode again with its actions and without the policy.

        Returns:
            in what row or route differ, "" for nothing or if the submission lacks the episode.
        """
        if any(key not in given for given in self.given.values()):
            return ""  # reported as missing
        try:
            policy = StoredPolicy(self.stored_actions(key), self.rows[key].error)
        except ValueError as error:
            return f"episode {key[:120]}: its actions in {ACTIONS} are broken: {error}"
        differing = self.difference(self.drive(policy, key, blind=True), "simulated")
        mismatch = policy.mismatch()
        if not mismatch:
            return differing
        return f"{differing or f'episode {key[:120]} simulated again differs'}; {mismatch}"

    def driven_again(self, driver: PolicyProcess | Policy, key: str) -> str:
        """Drive an episode again with the policy; returns as `simulated`."""
        return self.difference(self.drive(driver, key), "driven")

    def summary_problems(self, record: RunRecord) -> Iterator[str]:
        """Yield a sentence if the summary has figures that the rows do not give."""
        if not self.rows:
            return
        recomputed = self.summary.recomputed(tuple(self.rows.values()))
        # Intervals are equal if the present code wrote the summary.
        names = self.summary.differences(recomputed, exactly=record.code_is_present)
        if names:
            yield f"{SUMMARY} does not match the rows in {in_one_line(name[:80] for name in names[:10])}"

    def facts(self) -> Iterator[str]:
        """Yield further facts for the verdict."""
        yield f"{len(self.complete)} episodes simulated again with their actions, without the policy"

    def difference(self, drive: DrivenEpisode[R], made: str) -> str:
        """Return in what an episode that was driven or simulated again differs.

        It is "" for nothing, or if the submission lacks the episode.

        Args:
            drive: the episode. made: "driven" or "simulated".
        """
        key = drive.row.key
        row = self.rows.get(key)
        if row is None or key not in self.routes:
            return ""  # reported as missing
        fields = [name for name in type(row).model_fields if getattr(row, name) != getattr(drive.row, name)]
        if fields:
            shown = ", ".join(f"{name} {_text(row, name)}, now {_text(drive.row, name)}" for name in fields[:3])
            more = f", and {', '.join(fields[3:])}" if len(fields) > 3 else ""
            return f"episode {key[:120]} {made} again differs: {shown}{more}"
        route, again = self.route(key), np.array(drive.route, dtype=np.float64).reshape(-1, 3)
        count = min(len(route), len(again))
        unlike = (route[:count] != again[:count]).any(axis=1)
        if len(route) == len(again) and not unlike.any():
            return ""
        step = int(np.argmax(unlike)) if unlike.any() else count
        return f"episode {key[:120]} {made} again has another route from step {step}"


def _text(row: EpisodeRow, name: str) -> str:
    value = getattr(row, name)
    return f"{value:.6g}" if isinstance(value, float) else repr(value)[:60]
