"""A submission set against the suite of this installation that it claims; what all kinds of suites have in common."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Generic, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from labgym.eval.driving.drive import Drive
from labgym.eval.driving.episode_row import EpisodeRow
from labgym.eval.driving.record import NavigationSummary
from labgym.eval.labnav.results import LabNavDrive
from labgym.eval.labnav.row import LabNavRow
from labgym.eval.labnav.summary import LabNavSummary
from labgym.eval.submission.record_checks import RunRecord
from labgym.policies import Policy
from labgym.policies.process import PolicyProcess

Key = TypeVar("Key")


class Claim(ABC, Generic[Key]):
    """A submission and the suite that it claims.

    Attributes:
        summary: of the submission. suite_name: of the suite. keys: of the suite's episodes, in their order.
        rows: of the submission by key. file_problems: a sentence for each line that cannot be read.
    """

    summary: NavigationSummary | LabNavSummary
    suite_name: str
    keys: Sequence[Key]
    rows: Mapping[Key, EpisodeRow] | Mapping[Key, LabNavRow]
    file_problems: Sequence[str]

    @property
    @abstractmethod
    def routes(self) -> Mapping[Key, Any]:
        """The routes of the submission, or where they are, by key."""

    @abstractmethod
    def route(self, key: Key) -> ArrayLike:
        """Return the poses (n, 3) of a route."""

    @abstractmethod
    def name_of(self, key: Key) -> str:
        """Return the name of an episode."""

    @abstractmethod
    def identity_problems(self, record: RunRecord) -> Iterator[str]:
        """Yield a sentence for each input of the run that is not the summary's or the suite's."""

    @abstractmethod
    def suite_problems(self) -> Iterator[str]:
        """Yield a sentence for each way in which the claimed suite differs from that of this installation."""

    @abstractmethod
    def episode_problems(self) -> Iterator[str]:
        """Yield a sentence for each contradiction in a row, and between a row and its route."""

    @abstractmethod
    def summary_problems(self, record: RunRecord) -> Iterator[str]:
        """Yield a sentence for each figure of the summary that the rows do not give."""

    @abstractmethod
    def stated(self, driver: PolicyProcess) -> dict[str, tuple[object, object]]:
        """Return properties of the policy, and what the submission says of them."""

    @abstractmethod
    def driven(self, driver: PolicyProcess | Policy, keys: Sequence[Key]) -> Iterator[tuple[Key, Drive | LabNavDrive]]:
        """Drive episodes again and yield each with its key."""

    def facts(self) -> Iterator[str]:
        """Yield further facts for the verdict."""
        return iter(())

    def difference(self, key: Key, drive: Drive | LabNavDrive) -> str:
        """Return in what an episode that was driven again differs, "" for nothing or if the submission lacks it."""
        row = self.rows.get(key)
        if row is None or key not in self.routes:
            return ""  # reported as missing
        fields = [name for name in type(row).model_fields if getattr(row, name) != getattr(drive.row, name)]
        if fields:
            shown = ", ".join(f"{name} {_text(row, name)}, now {_text(drive.row, name)}" for name in fields[:3])
            more = f" and {len(fields) - 3} more" if len(fields) > 3 else ""
            return f"episode {self.name_of(key)} driven again differs: {shown}{more}"
        route, again = (np.array(each, dtype=np.float64).reshape(-1, 3) for each in (self.route(key), drive.route))
        count = min(len(route), len(again))
        unlike = (route[:count] != again[:count]).any(axis=1)
        if len(route) == len(again) and not unlike.any():
            return ""
        step = int(np.argmax(unlike)) if unlike.any() else count
        return f"episode {self.name_of(key)} driven again has another route from step {step}"


def _text(row: EpisodeRow | LabNavRow, name: str) -> str:
    value = getattr(row, name)
    return f"{value:.6g}" if isinstance(value, float) else str(value)[:60]
