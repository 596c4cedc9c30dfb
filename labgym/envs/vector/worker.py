"""The part of a vector environment that runs in one worker process: some of its environments, one after the other."""

from __future__ import annotations

from functools import partial
from typing import Any

import cloudpickle
import numpy as np
from gymnasium.vector import AutoresetMode, SyncVectorEnv
from gymnasium.wrappers import TimeLimit
from numpy.typing import NDArray

from labgym.envs.config import PointNavConfig
from labgym.envs.point_nav import LabPointNavEnv
from labgym.envs.vector.board import Board, BoardAddress
from labgym.runs.local_pool import WorkerLostError

Infos = dict[str, Any]


class Rows:
    """Some environments of a vector environment.

    Args:
        config: of each environment. limit: steps after which an episode is truncated; None for no limit.
        first, count: the first environment, and their number. total: number of environments in all processes.
        address: where the observations are written; None to return them.
    """

    def __init__(
        self,
        config: PointNavConfig,
        limit: int | None,
        mode: AutoresetMode,
        first: int,
        count: int,
        total: int,
        address: BoardAddress | None,
    ) -> None:
        self._envs = SyncVectorEnv([partial(_single, config, limit)] * count, copy=False, autoreset_mode=mode)
        self._first = first
        self._latest: Any = None
        self._board: Board | None = None
        if address is not None:
            self._board = address.open(self._envs.single_observation_space, total)
            self._board.close()

    def reset(self, seeds: list[int | None], options: Infos, mask: NDArray[np.bool_]) -> tuple[Any, Infos]:
        """Begin the episodes that a mask chooses."""
        if not mask.any():
            return self._sent(self._latest), {}
        chosen = options if mask.all() else {**options, "reset_mask": mask}
        self._latest, infos = self._envs.reset(seed=seeds, options=chosen)
        return self._sent(self._latest), infos

    def step(self, actions: Any) -> tuple[Any, NDArray[Any], NDArray[Any], NDArray[Any], Infos]:
        """Carry out an action in each environment."""
        self._latest, *rest, infos = self._envs.step(actions)
        rewards, terminated, truncated = rest
        return self._sent(self._latest), rewards, terminated, truncated, infos

    def render(self) -> tuple[Any, ...]:
        """Return the picture of each environment."""
        return tuple(self._envs.render() or ())

    def _sent(self, observations: Any) -> Any:
        """Write observations where the other process reads them, or return them."""
        if self._board is None:
            return observations
        self._board.write(self._first, observations)
        return None


_rows: Rows | None = None
"""The environments of this process, which serves one vector environment."""


def begin(pickled: bytes, *arguments: Any) -> None:
    """Make the environments of this process.

    Args:
        pickled: the configuration, by cloudpickle. arguments: the others of `Rows`.
    """
    global _rows
    _rows = Rows(cloudpickle.loads(pickled), *arguments)


def call(name: str, *arguments: Any) -> Any:
    """Return the result of a method of the environments of this process.

    Raises:
        WorkerLostError: the process that had them was lost before the call, and this one replaced it.
    """
    if _rows is None:
        raise WorkerLostError("its replacement has no environments")
    return getattr(_rows, name)(*arguments)


def _single(config: PointNavConfig, limit: int | None) -> Any:
    env = LabPointNavEnv(config=config)
    return env if limit is None else TimeLimit(env, limit)
