"""The decisions of a policy in an episode, compact and exact, and a policy that repeats them."""

from __future__ import annotations

import base64
import binascii
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, StrictBool

from labgym.documents import Record
from labgym.envs.conditions.payload import MOST_LEGS
from labgym.policies import EpisodeStart, Policy
from labgym.policies.policy import Observation, PolicyError

BYTES = 8
"""Size of an action: two float32."""
MAX_CHARACTERS = 1_000_000
"""Greatest length of stored actions: 93,750 actions; the longest shift has 12,000."""
End = Literal["", "stop", "error"]
"""What followed the last action of a drive: nothing, the policy's STOP, or its error."""


class StoredActions(Record):
    """The decisions of a policy in an episode.

    Attributes:
        stops: whether the policy decides itself when it has arrived.
        drives: of each drive that was begun, the number of actions, and what followed the last one.
        data: all actions as little-endian float32 (n, 2) in base64. Not compressed: equal runs have equal bytes with
            every version of zlib.
    """

    stops: StrictBool
    drives: Annotated[tuple[tuple[Annotated[int, Field(ge=0)], End], ...], Field(min_length=1, max_length=MOST_LEGS)]
    data: Annotated[str, Field(max_length=MAX_CHARACTERS)]

    @classmethod
    def of(cls, tape: ActionTape, stops: bool) -> StoredActions:
        """Return what a tape recorded."""
        actions = np.array([action for drive in tape.drives for action in drive], "<f4").reshape(-1, 2)
        data = base64.b64encode(actions.tobytes()).decode()
        return cls(stops=stops, drives=tuple(zip(map(len, tape.drives), tape.ends, strict=True)), data=data)

    def arrays(self) -> tuple[NDArray[np.float32], ...]:
        """Return the actions of each drive, (n, 2).

        Raises:
            ValueError: the data are not those of finite actions in this number.
        """
        counts = [count for count, _ in self.drives]
        try:
            content = base64.b64decode(self.data, validate=True)
        except (binascii.Error, ValueError) as error:
            raise ValueError(f"data are not in base64 ({str(error)[:60]})") from None
        if len(content) != BYTES * sum(counts):
            raise ValueError(f"data are not those of {sum(counts)} actions")
        actions = np.frombuffer(content, "<f4").astype(np.float32).reshape(-1, 2)
        if not np.isfinite(actions).all():
            raise ValueError("an action is not finite")
        return tuple(np.split(actions, np.cumsum(counts)[:-1]))


class ActionTape:
    """Records the decisions of a policy in an episode.

    Attributes:
        drives: actions of each drive. ends: what followed the last one of each.
    """

    def __init__(self) -> None:
        self.drives: list[list[NDArray[np.floating]]] = []
        self.ends: list[End] = []

    def begin(self) -> None:
        """Begin a drive."""
        self.drives.append([])
        self.ends.append("")

    def add(self, action: NDArray[np.floating] | None) -> None:
        """Add an action of the drive, or STOP."""
        if action is None:
            self.ends[-1] = "stop"
        else:
            self.drives[-1].append(action)

    def fail(self) -> None:
        """Note that the policy failed."""
        self.ends[-1] = "error"


class StoredPolicy(Policy):
    """Repeats the decisions of an episode. It looks at nothing.

    Args:
        actions: of the episode. error: of the policy that took them, if it failed.

    Raises:
        ValueError: as `StoredActions.arrays`.
    """

    def __init__(self, actions: StoredActions, error: str | None) -> None:
        self._actions, self._arrays, self._error = actions, actions.arrays(), error
        self._drive, self._next, self._missing = -1, 0, ""

    @property
    def stops(self) -> bool:
        """Whether the policy that took the actions decides itself when it has arrived."""
        return self._actions.stops

    def reset(self, episode: EpisodeStart) -> None:  # noqa: ARG002 - it looks at nothing
        """Begin the next drive."""
        self._ended()
        self._drive, self._next = self._drive + 1, 0
        if self._drive >= len(self._arrays):
            self._lack(f"drive {self._drive} has no actions")
            raise PolicyError(self._missing)

    def stop(self, observation: Observation) -> bool:  # noqa: ARG002
        """Return whether the next decision is STOP."""
        return self._next == len(self._arrays[self._drive]) and self._actions.drives[self._drive][1] == "stop"

    def act(self, observation: Observation) -> NDArray[np.float32]:  # noqa: ARG002
        """Return the next action.

        Raises:
            PolicyError: the policy failed here, or the actions have come to their end.
        """
        number, actions = self._next, self._arrays[self._drive]
        if number < len(actions):
            self._next += 1
            action: NDArray[np.float32] = actions[number]
            return action
        if self._actions.drives[self._drive][1] == "error":
            raise PolicyError(self._error or "")
        self._lack(f"drive {self._drive} goes on after its {number} actions")
        raise PolicyError(self._missing)

    def mismatch(self) -> str:
        """Return in what the actions do not fit an episode that is over, "" for nothing."""
        self._ended()
        if self._drive + 1 < len(self._arrays):
            self._lack(f"drive {self._drive + 1}, which has actions, does not begin")
        return self._missing

    def _ended(self) -> None:
        """Note that the drive in progress is over."""
        if 0 <= self._drive < len(self._arrays) and self._next < len(self._arrays[self._drive]):
            self._lack(f"drive {self._drive} ends after {self._next} of its {len(self._arrays[self._drive])} actions")

    def _lack(self, reason: str) -> None:
        self._missing = self._missing or reason
