"""A flag in memory that a process shares with its forks."""

from __future__ import annotations

import mmap


class SharedFlag:
    """A flag that is set for the process that made it and all its forks at once; a copy is a new flag, not set.

    The evaluator runs each episode in a fork of the process that loaded the policy. What the policy knows of a server
    outlives the fork, as the server does; it holds nothing of the episode.
    """

    def __init__(self) -> None:
        self._byte = mmap.mmap(-1, 1)

    def __bool__(self) -> bool:
        return self._byte[0] == 1

    def set(self, value: bool) -> None:
        """Change the flag."""
        self._byte[0] = int(value)

    def __reduce__(self) -> tuple[type[SharedFlag], tuple[()]]:
        return SharedFlag, ()
