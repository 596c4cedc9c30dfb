"""Many point navigation environments in worker processes: any sensor, any part, any physics."""

from __future__ import annotations

import os
from collections.abc import Sequence
from functools import partial
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import cloudpickle
import numpy as np
from gymnasium import spaces
from gymnasium.vector import AutoresetMode, SyncVectorEnv
from gymnasium.vector.utils import batch_space, concatenate, create_empty_array
from gymnasium.wrappers import TimeLimit
from numpy.typing import NDArray

from labgym.counts import MAX_PROCESSES, PROCESS_MB, check_memory, whole_number
from labgym.envs.config import PointNavConfig
from labgym.envs.point_nav import LabPointNavEnv
from labgym.envs.presets import configured
from labgym.envs.vector.arguments import PointNavVectorEnv, kernel_has
from labgym.envs.vector.board import Board, BoardAddress, shared_board
from labgym.errors import LabgymError, OptionError
from labgym.runs.local_pool import LocalPool, WorkerLostError

if TYPE_CHECKING:
    from labgym.envs.vector.env import VectorPointNavEnv


class WorkersLostError(LabgymError):
    """A worker process of a vector environment died; its episodes are lost."""


class ProcessPointNavEnv(PointNavVectorEnv):
    """Many `LabPointNavEnv` in a few worker processes, which share memory for the observations.

        envs = gym.make_vec("labgym:LabFloorNavRGBD-v0", num_envs=16, vectorization_mode="vector_entry_point")

    Observations, rewards, ends of episodes and infos equal those of single environments with the same arguments and
    seeds to the bit; any part and any physics is supported. Each process steps its share of the environments together
    on the planar kernel if it has all their parts, otherwise one after the other. Threads would not help those: Embree
    and MuJoCo's bindings are called under the interpreter lock. On the kernel, processes pay with many processors,
    because what an episode owns is Python there.

    A script makes it under `if __name__ == "__main__":`, because processes are spawned. Parts of a user's own reach
    them by cloudpickle. After an exception, call `reset`.

    Attributes:
        autoreset_mode: when an environment whose episode ended is reset.

    Args:
        num_envs: number of environments.
        autoreset_mode: NEXT_STEP (default), SAME_STEP or DISABLED, as in Gymnasium.
        max_episode_steps: number of steps after which an episode is truncated; None for no limit.
        processes: number of processes; None for one per processor that this process may use. It changes the speed and
            the memory alone: each process keeps the layouts of its environments (`resident_mb`).
        config, options: as of `LabPointNavEnv`.

    Raises:
        OptionError: a value is out of range.
        LabgymError: as `LabPointNavEnv`.
    """

    def __init__(
        self,
        num_envs: int = 1,
        *,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        max_episode_steps: int | None = None,
        processes: int | None = None,
        config: Any = None,
        **options: Any,
    ) -> None:
        config = configured(config, options)
        if config.render_mode == "human":
            raise OptionError("a vector environment has no render_mode 'human': use 'rgb_array'")
        super().__init__(num_envs, config, autoreset_mode, max_episode_steps)
        most = processors() if processes is None else whole_number("processes", processes, most=MAX_PROCESSES)
        count = min(most, self.num_envs)
        check_memory("processes", count, 1e6 * PROCESS_MB)
        bounds = [self.num_envs * k // count for k in range(count + 1)]
        self._shares = list(pairwise(bounds))
        self._board = shared_board(self.single_observation_space, self.num_envs)
        # A pool of one process for each share: a share stays in its process.
        self._pools = [LocalPool(1) for _ in self._shares]
        address = None if self._board is None else self._board.address
        pickled = cloudpickle.dumps(config)
        try:
            self._each(
                begin,
                [
                    (pickled, self._limit, self.autoreset_mode, first, last - first, self.num_envs, address)
                    for first, last in self._shares
                ],
            )
        except WorkersLostError:
            self.close_extras()
            raise WorkersLostError(
                "the worker processes of the vector environment died at their start: in a script, make the environment "
                'under `if __name__ == "__main__":`'
            ) from None
        except BaseException:
            self.close_extras()
            raise

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Begin the episodes of all environments.

        Args:
            seed: of the first environment, and those of the others follow; or one for each.
            options: as of `LabPointNavEnv.reset`, for all; and "reset_mask", a truth value for each environment, which
                chooses those whose episodes begin anew.

        Raises:
            OptionError: before a first reset, the mask leaves out an environment.
        """
        seeds, mask, options = self._renewed(seed, options)
        shares = [("reset", seeds[first:last], options, mask[first:last]) for first, last in self._shares]
        answers = self._each(call, shares)
        self._begun = True
        self._ended[mask] = False
        return self._observations(answers), self._infos(answers)

    def step(self, actions: Any) -> tuple[Any, NDArray[Any], NDArray[Any], NDArray[Any], dict[str, Any]]:
        """Carry out one action in each environment; those that ended are reset by the rules of the autoreset mode."""
        self._check_running()
        shares = [("step", _share(actions, first, last, self.num_envs)) for first, last in self._shares]
        answers = self._each(call, shares)
        rewards, terminated, truncated = (np.concatenate([answer[k] for answer in answers]) for k in (1, 2, 3))
        self._ended = terminated | truncated
        return self._observations(answers), rewards, terminated, truncated, self._infos(answers)

    def render(self) -> tuple[Any, ...] | None:
        """Return the picture of each environment, or None without a render mode."""
        if self.render_mode is None:
            return None
        return tuple(picture for answer in self._each(call, [("render",)] * len(self._shares)) for picture in answer)

    @property
    def climb(self) -> list[list[int]]:
        """The states of all ladders, each as `LabPointNavEnv.climb`."""
        return [state for share in self._each(call, [("climb",)] * len(self._shares)) for state in share]

    def resume_climb(self, row: int, state: Sequence[int]) -> None:
        """Let an environment go on from a former value of its `climb`.

        Raises:
            OptionError: it is not one of its ladder.
        """
        share = next(number for number, (_, last) in enumerate(self._shares) if row < last)
        self._pools[share].submit(call, "resume_climb", row - self._shares[share][0], state).result()

    def close_extras(self, **_: Any) -> None:
        """End the processes."""
        for pool in self._pools:
            pool.shutdown(cancel_futures=True)
        if self._board is not None:
            self._board.close()

    def _each(self, function: Any, arguments: Sequence[tuple[Any, ...]]) -> list[Any]:
        """Return the results of a call in each process, all at the same time.

        Raises:
            WorkersLostError: a process died.
            Exception: the first one that a call raised, after all have ended.
        """
        calls = [pool.submit(function, *each) for pool, each in zip(self._pools, arguments, strict=True)]
        problems = [each.exception() for each in calls]
        for problem in problems:
            if isinstance(problem, WorkerLostError):
                self._begun = False
                raise WorkersLostError(
                    f"a worker process of the vector environment died ({problem}): make the environment again"
                )
            if problem is not None:
                raise problem
        return [each.result() for each in calls]

    def _observations(self, answers: Sequence[tuple[Any, ...]]) -> Any:
        if self._board is not None:
            return self._board.read()
        rows = [row for answer in answers for row in _each_row(self.single_observation_space, answer[0])]
        empty: Any = create_empty_array(self.single_observation_space, self.num_envs)
        return concatenate(self.single_observation_space, rows, empty)

    def _infos(self, answers: Sequence[tuple[Any, ...]]) -> dict[str, Any]:
        return joined([answer[-1] for answer in answers], [last - first for first, last in self._shares])


def joined(parts: Sequence[dict[str, Any]], counts: Sequence[int]) -> dict[str, Any]:
    """Return the infos of all environments from those of the shares, in Gymnasium's form.

    Args:
        parts: the infos of each share. counts: its number of environments. A key that a share lacks is zeros there, or
            None of objects.
    """
    infos: dict[str, Any] = {}
    for name in dict.fromkeys(name for part in parts for name in part):
        values = [part.get(name) for part in parts]
        present = next(value for value in values if value is not None)
        if isinstance(present, dict):
            infos[name] = joined([{} if value is None else value for value in values], counts)
            continue
        absent = None if present.dtype == object else 0
        infos[name] = np.concatenate(
            [
                np.full((count, *present.shape[1:]), absent, present.dtype) if value is None else value
                for value, count in zip(values, counts, strict=True)
            ]
        )
    return infos


def _share(actions: Any, first: int, last: int, count: int) -> Any:
    """Return the actions of some environments: slices of arrays, of dicts and tuples of arrays.

    Raises:
        OptionError: not one action for each environment.
    """
    if isinstance(actions, dict):
        return {name: _share(each, first, last, count) for name, each in actions.items()}
    if isinstance(actions, tuple) and any(isinstance(each, np.ndarray) for each in actions):
        return tuple(_share(each, first, last, count) for each in actions)
    array = np.asarray(actions)
    if array.ndim == 0 or len(array) != count:
        shown = " ".join(repr(actions).split())[:80]
        raise OptionError(f"actions {shown} must be {count} actions, one for each environment")
    return array[first:last]


def _each_row(space: spaces.Space[Any], observations: Any) -> list[Any]:
    """Return the observation of each environment of a share."""
    from gymnasium.vector.utils import iterate

    return list(iterate(batch_space(space, len(next(iter(observations.values())))), observations))


def processors() -> int:
    """Return the number of processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


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
        self._envs = _many(config, limit, mode, count)
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

    def climb(self) -> list[list[int]]:
        """Return the states of the ladders."""
        return self._envs.climb

    def resume_climb(self, row: int, state: Sequence[int]) -> None:
        """Let an environment of this process go on from a former state of its ladder."""
        self._envs.resume_climb(row, state)

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


class SingleEnvs(SyncVectorEnv):
    """Environments one after the other, with their ladders."""

    @property
    def climb(self) -> list[list[int]]:
        """The states of all ladders."""
        return list(self.get_attr("climb"))

    def resume_climb(self, row: int, state: Sequence[int]) -> None:
        """Let an environment go on from a former state of its ladder."""
        self.envs[row].get_wrapper_attr("resume_climb")(state)


def _many(config: PointNavConfig, limit: int | None, mode: AutoresetMode, count: int) -> SingleEnvs | VectorPointNavEnv:
    """Return environments of one process."""
    if not kernel_has(config):
        return SingleEnvs([partial(_single, config, limit)] * count, copy=False, autoreset_mode=mode)
    from labgym.envs.vector.env import VectorPointNavEnv

    return VectorPointNavEnv(
        count, autoreset_mode=mode, max_episode_steps=limit, threads=1, config=config, physics=config.physics
    )


def _single(config: PointNavConfig, limit: int | None) -> Any:
    env = LabPointNavEnv(config=config)
    return env if limit is None else TimeLimit(env, limit)
