"""The evaluator's view of a policy in a separate process, which pieces of work of a thread share."""

from __future__ import annotations

import contextlib
import os
import pickle
import socket
import threading
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from labgym.confinement import linux
from labgym.errors import LabgymError
from labgym.policies.fingerprint.sources import search_path
from labgym.policies.kernels import kernel_mode
from labgym.policies.policy import EpisodeStart, Observation, PolicyError
from labgym.policies.process.box import BUILT_IN_CODE, NOT_BOXED, Grants
from labgym.policies.process.episode import ACT, CLOSE, DECIDE, NEXT, PLAN, RESET
from labgym.policies.process.facts import DECLARED, PolicyFacts, read_error, read_facts, read_text
from labgym.policies.process.hosts import HostError, LoaderTerms, PolicyHost, host_with
from labgym.policies.process.limits import ProcessLimits
from labgym.policies.process.loader import EPISODE, LOAD, STATUS, LoadRequest
from labgym.policies.process.places import OwnPlaces, driving_grants, known_files
from labgym.policies.process.source import MAPS, PolicySource
from labgym.policies.process.wire import (
    ACTING,
    DECIDED,
    DECISION,
    FACTS,
    FAILED,
    OK,
    PATH,
    POINT,
    SIZES,
    Answer,
    ClosedError,
    GarbageError,
    receive_answer,
    send_request,
)

CLOSE_SECONDS = 5.0
"""Time limit for a policy to close after an episode, seconds."""

STATUS_SECONDS = 3.0


class PolicyProcess:
    """A policy in a separate process, with the methods of `Policy`.

    Each episode of a policy of labgym begins in a fork of the process that loaded the policy, or in a newly loaded
    process if the policy has threads or child processes. A foreign policy is loaded anew for each episode, in a box
    (`labgym.policies.process.box`) that the process enters before. Nothing that a policy keeps reaches another episode.
    The process receives the observations, the goal, the robot, a random generator, and for privileged policies the map;
    it answers with bytes that are validated. It ends with the evaluator.

    Args:
        source: the policy.
        limits: limits of time and memory.
        environment: environment variables of the process, in addition to the evaluator's, such as those of a
            `KernelMode`; None takes the default mode's. Numerical libraries are limited to one thread.

    Attributes:
        name, observation, privileged, foresees, exclusive, goal_kinds, stops, latency: as `Policy` declares them.
        kernels: the kernels in force in the process once the policy is loaded, as `kernel_facts` returns them.
        box: level of the box, such as "landlock-7+seccomp"; `NOT_BOXED` for a server's policy and on a kernel without;
            `BUILT_IN_CODE` for a policy of labgym.

    Raises:
        LabgymError: the policy cannot be loaded; the class of the error is that of `make_policy`.
    """

    def __init__(
        self,
        source: PolicySource,
        limits: ProcessLimits | None = None,
        environment: Mapping[str, str] | None = None,
    ) -> None:
        self._source = source = source.installed()
        self._limits = limits or ProcessLimits()
        self._environment = dict(kernel_mode().environment if environment is None else environment)
        self._process: _LoadedProcess | None = None
        self._guard = contextlib.ExitStack()
        self._guard.enter_context(linux.unreadable_memory())
        self._grants: Grants | None = None
        self._modules, self._failed = source.shared_modules, False
        self._known: tuple[str, ...] | None = None
        try:
            places = OwnPlaces(source) if source.foreign else None
            if places is not None:
                self._grants, self._modules = places.grants, tuple(sorted(places.shared))
            self._process = self._loaded()
        except BaseException:
            self._guard.close()
            raise
        facts = self._facts = self._process.facts
        self.name, self.observation, self.privileged = facts.name, facts.observation, facts.privileged
        self.foresees, self.exclusive, self.stops = facts.foresees, facts.exclusive, facts.stops
        self.goal_kinds = facts.goal_kinds
        self.latency, self.kernels = facts.latency, facts.kernels
        self._files = tuple(Path(path) for path in facts.files)
        self.box = (self._process.level if self._grants else "") or (BUILT_IN_CODE if source.built_in else NOT_BOXED)
        if self._grants is not None:
            # It loaded with all files of its folder; it drives with those of its identity.
            self._known = known_files(self._grants, (*facts.files, *facts.sources))
            self._grants = driving_grants(self._grants, self._known)
            self._modules += (MAPS,) if facts.privileged else ()
            self._process.stop()
            self._process = None

    def files(self) -> tuple[Path, ...]:
        """Return the files that the actions depend on."""
        return self._files

    def cpu_seconds(self) -> float:
        """Return the CPU time of the policy's processes, seconds: differences within an episode count."""
        return host_with(self._environment).cpu_seconds()

    def reset(self, episode: EpisodeStart) -> None:
        """Begin an episode in a fresh process.

        Raises:
            PolicyError: the policy raised an exception, died, or exceeded a limit.
        """
        self._check_knowledge(episode)
        self._call(self._fresh_process(), RESET, episode, OK)

    def next_goal(self, episode: EpisodeStart) -> None:
        """Begin the next drive of a chain of goals, in the process of the drives before.

        Raises:
            PolicyError: as `reset`.
        """
        self._check_knowledge(episode)
        self._call(self._running(), NEXT, episode, OK)

    def act(self, observation: Observation) -> NDArray[np.float32]:
        """Return the action for the next control step, two finite numbers.

        Raises:
            PolicyError: the policy raised an exception, gave no valid action, died, or exceeded a limit.
        """
        content = self._call(self._running(), ACT, dict(observation), ACTING)
        return _finite(np.frombuffer(content, dtype="<f4").astype(np.float32))

    def decide(self, observation: Observation) -> NDArray[np.float32] | None:
        """Return the action for the next control step, two finite numbers, or None if the policy stops.

        Raises:
            PolicyError: as `act`.
        """
        content = self._call(self._running(), DECIDE, dict(observation), DECIDED)
        stops, *action = DECISION.unpack(content)
        return None if stops else _finite(np.array(action, dtype=np.float32))

    def continue_with(self, episode: EpisodeStart) -> None:
        """Begin an episode in the process of the one before, if it lives: for drives that are not compared.

        Raises:
            PolicyError: as `reset`.
        """
        if self._process is None or not self._process.in_episode:
            self.reset(episode)
            return
        self._check_knowledge(episode)
        self._call(self._process, RESET, episode, OK)

    def planned_path(self) -> NDArray[np.float64] | None:
        """Return the path that the last action follows, (n, 2) meters in the start frame; None without one.

        Raises:
            PolicyError: as `act`.
        """
        content = self._call(self._running(), PLAN, None, PATH)
        points = np.frombuffer(content, dtype="<f8").reshape(-1, 2)
        if not np.isfinite(points).all():
            raise PolicyError("planned_path returned numbers that are not finite")
        return points.copy() if len(points) else None

    def close(self) -> None:
        """End the process. A later `reset` starts another."""
        if self._process is not None:
            self._process.stop()
            self._process = None
        self._guard.close()

    def _call(self, process: _LoadedProcess, kind: bytes, content: object, expected: bytes) -> bytes:
        try:
            return process.call(kind, pickle.dumps(content, protocol=5), expected)
        except PolicyError:
            self._failed = True
            raise

    def _check_knowledge(self, episode: EpisodeStart) -> None:
        if episode.truth is not None and not self.privileged:
            raise LabgymError(f"policy {self.name!r} is not privileged and must not receive the map")
        if episode.world is not None:
            raise LabgymError(f"policy {self.name!r} runs in a separate process, which must not receive the world")

    def _running(self) -> _LoadedProcess:
        if self._process is None:
            raise PolicyError("the policy's process has ended; reset begins an episode in another")
        return self._process

    def _loaded(self) -> _LoadedProcess:
        terms = LoaderTerms(self._limits.memory_bytes, self._modules, self._grants, self._failed)
        return _LoadedProcess(self._source, self._limits, host_with(self._environment), terms, self._known)

    def _loaded_again(self) -> _LoadedProcess:
        try:
            process = self._loaded()
        except LabgymError as error:
            raise PolicyError(f"the policy could not be loaded again: {error}"[:500]) from error
        changed = [name for name in DECLARED if getattr(process.facts, name) != getattr(self._facts, name)]
        if changed:
            process.stop()
            raise PolicyError(f"the policy declares another {changed[0]} than when it was loaded first")
        return process

    def _fresh_process(self) -> _LoadedProcess:
        """Return a process that has the policy loaded and has begun an episode."""
        if self._process is not None:
            self._process.end_episode(polite=True)
            if not self._process.usable:
                self._process.stop()
                self._process = None
        for attempt in range(2):
            if self._process is None:
                self._process = self._loaded_again()
            try:
                self._process.begin_episode()
                break
            except (OSError, HostError) as error:
                # The process ended between two episodes.
                self._process.stop()
                self._process = None
                if attempt:
                    raise PolicyError(f"the policy's process could not be started: {error}"[:500]) from error
        assert self._process is not None
        return self._process


def _finite(action: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return an action, or raise PolicyError if it is not finite."""
    if not np.isfinite(action).all():
        raise PolicyError("act returned numbers that are not finite")
    return action


CALLS = {RESET: "reset", NEXT: "next_goal", DECIDE: "stop and act", PLAN: "planned_path"}
"""Names of requests in messages; the others are `act`."""


def _has_size(answer: Answer) -> bool:
    """Return whether an answer has the size of its status: points are of any number."""
    size = len(answer.content)
    return size % POINT.size == 0 if answer.status == PATH else size == SIZES[answer.status]


class _LoadedProcess:
    """A loader and the episode that it has begun."""

    def __init__(
        self,
        source: PolicySource,
        limits: ProcessLimits,
        host: PolicyHost,
        terms: LoaderTerms,
        known: tuple[str, ...] | None,
    ) -> None:
        self._limits, self._host, self._boxed = limits, host, terms.grants is not None
        self._loader, self.level, self._link = host.start_loader(terms)
        self._episode: socket.socket | None = None
        self.usable = True
        try:
            self.facts = self._load(source, known)
        except BaseException:
            self.stop()
            raise

    def _load(self, source: PolicySource, known: tuple[str, ...] | None) -> PolicyFacts:
        request = LoadRequest(tuple(search_path()), os.getcwd(), pickle.dumps(source), known)  # noqa: PTH109 - as text
        try:
            self._link.settimeout(self._limits.load_seconds)
            send_request(self._link, LOAD, pickle.dumps(request))
            answer = receive_answer(self._link, self._limits.load_seconds)
            if answer.status == FAILED:
                raise read_error(answer.content)
            if answer.status != FACTS:
                raise GarbageError("it declared nothing")
            return read_facts(answer.content)
        except TimeoutError:
            reason = f"took longer than {self._limits.load_seconds:g} s"
        except (ClosedError, OSError):
            exceeded = self._host.stop_loader(self._loader)
            reason = self._memory_reason(exceeded) if exceeded else "its process ended"
        except GarbageError as error:
            reason = f"its process sent {error}"
        raise LabgymError(f"policy {source.name!r} could not be loaded: {reason}")

    def begin_episode(self) -> None:
        """Begin an episode.

        Raises:
            OSError: the loader has ended.
        """
        self._episode, theirs = socket.socketpair()
        with theirs:
            self._link.settimeout(self._limits.call_seconds)
            send_request(self._link, EPISODE, b"", theirs.fileno())
        self.usable = not self._single_use

    @property
    def _single_use(self) -> bool:
        """Whether the loader is the process of its only episode. A foreign policy does not decide that."""
        return self._boxed or self.facts.single_use

    @property
    def in_episode(self) -> bool:
        """Whether an episode has begun and not ended."""
        return self._episode is not None

    def call(self, kind: bytes, content: bytes, expected: bytes) -> bytes:
        """Return the content of the policy's answer.

        Raises:
            PolicyError: the policy raised an exception, died, or exceeded a limit; its episode has ended.
        """
        if self._episode is None:
            raise PolicyError("the policy's process has ended")
        try:
            answer = self._exchange(self._episode, kind, content, self._limits.call_seconds)
            if answer.status == FAILED:
                reason = read_text(answer.content)
            elif answer.status == expected and _has_size(answer):
                return answer.content
            else:
                reason = "the policy's process sent an answer of another kind"
        except TimeoutError:
            reason = f"{CALLS.get(kind, 'act')} took longer than {self._limits.call_seconds:g} s"
        except (ClosedError, OSError):
            reason = ""
        except GarbageError as error:
            reason = f"the policy's process sent garbage: {error}"
        raise PolicyError(self._ended(reason))

    def _ended(self, reason: str) -> str:
        """End the episode and return why it failed."""
        status = reason or self._status()
        exceeded = self.end_episode(polite=False)
        return reason or (f"the policy's process {self._memory_reason(exceeded)}" if exceeded else status)

    def _status(self) -> str:
        """Return how the episode's process ended, as the loader reports it."""
        unknown = "the policy's process ended"
        try:
            if self._single_use:
                return f"the policy's process {self._host.end_of(self._loader)}"
            answer = self._exchange(self._link, STATUS, b"", STATUS_SECONDS)
            return f"the policy's process {read_text(answer.content)}" if answer.status == FAILED else unknown
        except (ClosedError, GarbageError, HostError, OSError):
            self.usable = False
            return unknown

    def end_episode(self, polite: bool) -> int:
        """End all processes of the episode; return the memory that exceeded the limit, bytes, or 0.

        Args:
            polite: whether the policy may close first.
        """
        if self._episode is None:
            return 0
        if polite:
            with contextlib.suppress(ClosedError, GarbageError, OSError):
                self._exchange(self._episode, CLOSE, b"", min(CLOSE_SECONDS, self._limits.call_seconds))
        self._episode.close()
        self._episode = None
        try:
            exceeded = self._host.end_episode(self._loader)
        except HostError:
            self.usable = False
            return 0
        self.usable = self.usable and not exceeded
        return exceeded

    def stop(self) -> None:
        """End the loader and its episode."""
        self.end_episode(polite=True)
        self.usable = False
        self._link.close()
        with contextlib.suppress(HostError):
            self._host.stop_loader(self._loader)

    def _memory_reason(self, exceeded: int) -> str:
        return f"used {exceeded / 1e9:.1f} GB of memory, more than the limit of {self._limits.memory_gb:g} GB"

    @staticmethod
    def _exchange(link: socket.socket, kind: bytes, content: bytes, seconds: float) -> Answer:
        link.settimeout(seconds)
        send_request(link, kind, content)
        return receive_answer(link, seconds)


_local = threading.local()


def shared_process(
    source: PolicySource,
    limits: ProcessLimits | None = None,
    environment: Mapping[str, str] | None = None,
    most: int = 1,
) -> PolicyProcess:
    """Return the process of a policy that this thread opened before, or a new one.

    Loading a policy may take seconds; this way it is loaded once, however many pieces of work drive it.

    Args:
        source, limits, environment: as for `PolicyProcess`.
        most: number of processes that the thread keeps, at least 1; those that it used least recently end.

    Raises:
        LabgymError: the policy cannot be loaded.
    """
    key = source, limits or ProcessLimits(), None if environment is None else dict(environment)
    kept = _kept()
    index = next((place for place, (other, _) in enumerate(kept) if other == key), None)
    if index is not None:
        kept.append(kept.pop(index))
        return kept[-1][1]
    while len(kept) >= most:
        kept.pop(0)[1].close()
    process = PolicyProcess(source, limits, environment)
    kept.append((key, process))
    return process


def close_shared_process() -> None:
    """End the processes that this thread opened."""
    kept = _kept()
    while kept:
        kept.pop()[1].close()


def _kept() -> list[tuple[Any, PolicyProcess]]:
    """Return the open processes with their keys; a fork of this process has none of them."""
    if getattr(_local, "owner", None) != os.getpid():
        _local.owner, _local.processes = os.getpid(), []
    processes: list[tuple[Any, PolicyProcess]] = _local.processes
    return processes
