"""The evaluator's side of the host process: one for each evaluating process and set of environment variables."""

from __future__ import annotations

import atexit
import json
import os
import re
import shlex
import socket
import subprocess
import sys
import threading
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from labgym.errors import LabgymError
from labgym.policies.process.box import Grants
from labgym.policies.process.family import cpu_seconds
from labgym.policies.process.host import END, START, STATUS, STOP
from labgym.policies.process.wire import FACTS, ClosedError, GarbageError, receive_answer, send_request
from labgym.runs.local_pool import THREAD_VARIABLES

INSIDE = "LABGYM_POLICY_PROCESS"
"""Environment variable that is set in the processes of policies."""
LAUNCHER = "LABGYM_POLICY_LAUNCHER"
"""Environment variable with a command that starts the processes of policies, such as "qemu-x86_64 -cpu Haswell"."""
PACKAGES = ("numpy", "pydantic", "torch")
"""Packages whose places the host takes from the evaluator, if they are imported."""
HOST = Path(__file__).with_name("__main__.py")
SECRETS = re.compile("KEY|TOKEN|SECRET|PASSW|CREDENTIAL|AUTH", re.IGNORECASE)
"""Names of environment variables that policies do not get, because errors and actions of theirs are published."""
START_SECONDS = 300.0
ANSWER_SECONDS = 30.0


class HostError(LabgymError):
    """The host of policies does not answer."""


@dataclass(frozen=True)
class LoaderTerms:
    """The terms on which the host starts a loader.

    Attributes:
        memory: largest memory of the loader and of each of its episodes, bytes.
        modules: names of modules that the host imports first.
        grants: files of a foreign policy, which is boxed; None for labgym's own.
        quiet: whether a traceback of the policy has been printed before.
    """

    memory: int
    modules: tuple[str, ...] = ()
    grants: Grants | None = None
    quiet: bool = False


class PolicyHost:
    """A host process, which forks loaders and ends them.

    Args:
        environment: environment variables of the process, in addition to the evaluator's.

    Raises:
        LabgymError: this is itself the process of a policy.
    """

    def __init__(self, environment: Mapping[str, str]) -> None:
        if INSIDE in os.environ:
            raise LabgymError(
                "a policy cannot evaluate policies: its module starts an evaluation when it is imported; put that code "
                'under if __name__ == "__main__":'
            )
        self._lock = threading.Lock()
        self._link, theirs = socket.socketpair()
        variables = {
            **{name: value for name, value in os.environ.items() if not SECRETS.search(name) and name != "PYTHONPATH"},
            **dict.fromkeys(THREAD_VARIABLES, "1"),
            "PYTHONHASHSEED": "0",
            **environment,
            INSIDE: "1",
        }
        with theirs:
            self._process = subprocess.Popen(
                [
                    *shlex.split(os.environ.get(LAUNCHER, "")),
                    sys.executable,
                    "-P",
                    str(HOST),
                    str(theirs.fileno()),
                    *_places(),
                ],
                pass_fds=[theirs.fileno()],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                env=variables,
                start_new_session=True,
            )

    @property
    def alive(self) -> bool:
        """Whether the process runs."""
        return self._process.poll() is None

    def start_loader(self, terms: LoaderTerms) -> tuple[int, str, socket.socket]:
        """Return the process id of a new loader, the level of its box ("" for labgym's own policies) and a link to it.

        Raises:
            HostError: the host does not answer.
        """
        ours, theirs = socket.socketpair()
        request = {
            "memory": terms.memory,
            "modules": terms.modules,
            "grants": None if terms.grants is None else terms.grants.to_json(),
            "quiet": terms.quiet,
        }
        try:
            with theirs:
                loader, level = self._ask(START, request, theirs.fileno())
                return int(loader), str(level), ours
        except HostError:
            ours.close()
            raise

    def end_episode(self, loader: int) -> int:
        """End the processes of a loader's episode; return the memory that exceeded its limit, bytes, or 0.

        Raises:
            HostError: the host does not answer.
        """
        return int(self._ask(END, loader))

    def end_of(self, loader: int) -> str:
        """Return how a loader ended, in words.

        Raises:
            HostError: the host does not answer.
        """
        return str(self._ask(STATUS, loader))

    def stop_loader(self, loader: int) -> int:
        """End a loader and its episode; return the memory that exceeded its limit, bytes, or 0.

        Raises:
            HostError: the host does not answer.
        """
        return int(self._ask(STOP, loader))

    def cpu_seconds(self) -> float:
        """Return the CPU time of all its policies, without its own, seconds."""
        return cpu_seconds(self._process.pid)

    def close(self) -> None:
        """End the host, which ends its loaders."""
        self._link.close()
        try:
            self._process.wait(ANSWER_SECONDS)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()

    def _ask(self, kind: bytes, content: Any, descriptor: int | None = None) -> Any:
        with self._lock:
            try:
                # The host may import modules before it starts a loader.
                seconds = START_SECONDS if kind == START else ANSWER_SECONDS
                self._link.settimeout(seconds)
                send_request(self._link, kind, json.dumps(content).encode(), descriptor)
                answer = receive_answer(self._link, seconds)
                if answer.status != FACTS:
                    raise GarbageError("an answer of another kind")
                return json.loads(answer.content)
            except (OSError, ValueError, ClosedError, GarbageError) as error:
                self._process.kill()
                raise HostError(
                    f"the host of policies does not answer and was ended ({type(error).__name__})"
                ) from None


def _places() -> list[str]:
    """Return the folders from which this process has imported packages."""
    files = [getattr(sys.modules.get(name), "__file__", None) for name in PACKAGES]
    return list(dict.fromkeys(str(Path(file).parents[1]) for file in files if file))


_hosts: dict[tuple[int, frozenset[tuple[str, str]]], PolicyHost] = {}
_hosts_lock = threading.Lock()


def host_with(environment: Mapping[str, str]) -> PolicyHost:
    """Return the host of this process with these environment variables, a new one if none runs.

    Raises:
        LabgymError: this is itself the process of a policy.
    """
    key = os.getpid(), frozenset(environment.items())
    with _hosts_lock:
        host = _hosts.get(key)
        if host is None or not host.alive:
            host = _hosts[key] = PolicyHost(environment)
        return host


@atexit.register
def close_hosts() -> None:
    """End the hosts of this process."""
    with _hosts_lock:
        for key in [key for key in _hosts if key[0] == os.getpid()]:
            _hosts.pop(key).close()
