"""One episode of a policy, in the policy's process."""

from __future__ import annotations

import contextlib
import copy
import mmap
import pickle
import random
import socket
import sys
import traceback
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from labgym.errors import LabgymError
from labgym.policies.fingerprint.reads import Reads
from labgym.policies.kernels import pin_torch
from labgym.policies.policy import EpisodeStart, Observation, Policy
from labgym.policies.process.facts import encode_text, error_text
from labgym.policies.process.room import ERROR_LINE
from labgym.policies.process.wire import (
    ACTING,
    DECIDED,
    DECISION,
    FAILED,
    MAX_POINTS,
    OK,
    PATH,
    Answer,
    ClosedError,
    receive_request,
    send_answer,
)

RESET, NEXT, ACT, DECIDE, PLAN, CLOSE = b"r", b"n", b"a", b"d", b"p", b"c"
"""Requests of an episode: `reset`, `next_goal`, `act`, `stop` and then `act`, `planned_path`, `close`."""
FRAMES, MAX_TRACEBACK = 10, 4_000
"""Longest traceback that is printed: frames, the innermost ones, and characters."""


def serve_episode(policy: Policy, reads: Reads, link: socket.socket, printed: mmap.mmap | bytearray) -> None:
    """Answer the evaluator's requests until it closes the link.

    Args:
        policy: drives the episode. reads: the files that it opens.
        link: to the evaluator.
        printed: 1 byte that the episodes of a policy share: whether the traceback of an error has been printed.
    """
    try:
        while True:
            kind, content, _ = receive_request(link)
            answer = _answer(policy, kind, content, printed)
            unknown = reads.unknown()
            send_answer(link, answer if unknown is None else Answer(FAILED, encode_text(_unknown(unknown))))
    except (ClosedError, OSError):
        return


def _unknown(file: Path) -> str:
    """Return the reason to fail a policy that read a file that its identity does not cover."""
    return (
        f"the policy read {str(file)[:200]} while driving, which is not in its identity: open it in __init__, or "
        "return it from files()"
    )


def _answer(policy: Policy, kind: bytes, content: bytes, printed: mmap.mmap | bytearray) -> Answer:
    # A policy may import torch in any call.
    pin_torch()
    try:
        if kind == ACT:
            return Answer(ACTING, checked_action(policy.act(pickle.loads(content))).tobytes())  # noqa: S301
        if kind == DECIDE:
            action = decision(policy, pickle.loads(content))  # noqa: S301 - from the evaluator
            return Answer(DECIDED, DECISION.pack(action is None, *((0.0, 0.0) if action is None else action.tolist())))
        if kind == RESET:
            start = pickle.loads(content)  # noqa: S301 - from the evaluator
            _seed_global_generators(start)
            policy.reset(start)
        elif kind == PLAN:
            return Answer(PATH, _path_bytes(policy.planned_path()))
        elif kind == NEXT:
            policy.next_goal(pickle.loads(content))  # noqa: S301 - from the evaluator
        else:
            policy.close()
    except InvalidActionError as error:
        return Answer(FAILED, encode_text(str(error)))
    except BaseException as error:  # noqa: BLE001 - whatever the policy raises ends its episode only
        if not isinstance(error, LabgymError):
            _print_traceback(error, printed)
        return Answer(FAILED, encode_text(error_text(error)))
    return Answer(OK)


def _path_bytes(path: NDArray[np.float64] | None) -> bytes:
    """Return a path as pairs of float64, nothing for none.

    Raises:
        InvalidActionError: it is not (n, 2), or has too many points.
    """
    points = np.zeros((0, 2)) if path is None else np.asarray(path, dtype="<f8")
    if points.ndim != 2 or points.shape[1] != 2 or len(points) > MAX_POINTS:
        raise InvalidActionError(f"planned_path returned shape {points.shape}, expected (n, 2) with n <= {MAX_POINTS}")
    return points.tobytes()


def _print_traceback(error: BaseException, printed: mmap.mmap | bytearray) -> None:
    """Print the traceback of the first error of a policy on the standard error, because it often recurs."""
    with contextlib.suppress(Exception):
        if not printed[0]:
            printed[0] = 1
            text = "".join(traceback.format_exception(error, limit=-FRAMES))
            sys.stderr.write(f"\n{ERROR_LINE}\n{text[-MAX_TRACEBACK:]}")
            sys.stderr.flush()


class InvalidActionError(Exception):
    """An answer of `act` that is not an action, of `stop` that is not a truth value, of `planned_path` that is none."""


def decision(policy: Policy, observation: Observation) -> NDArray[np.float32] | None:
    """Return the next action of a policy as float32 (2,), or None if it stops.

    Raises:
        InvalidActionError: an answer of the policy is of another kind.
    """
    stops = policy.stop(observation)
    if not isinstance(stops, bool | np.bool_):
        raise InvalidActionError(f"stop returned a {type(stops).__name__}, expected True or False")
    return None if stops else checked_action(policy.act(observation))


def checked_action(action: object) -> NDArray[np.float32]:
    """Return an action as float32 (2,).

    Raises:
        InvalidActionError: it is not two finite numbers.
    """
    try:
        with np.errstate(over="ignore"):
            array = np.asarray(action, dtype=np.float32)
    except (TypeError, ValueError):
        kind = type(action).__name__
        raise InvalidActionError(f"act returned a {kind}, expected two numbers in [-1, 1]") from None
    if array.shape != (2,):
        raise InvalidActionError(f"act returned shape {array.shape}, expected two finite numbers in [-1, 1]")
    if not np.isfinite(array).all():
        raise InvalidActionError(f"act returned {array.tolist()}, expected two finite numbers in [-1, 1]")
    return array


def _seed_global_generators(start: EpisodeStart) -> None:
    """Seed the generators of Python, NumPy and torch, so that policies that use them have repeatable results."""
    seed = int(copy.deepcopy(start.rng).integers(2**32))
    random.seed(seed)
    np.random.seed(seed)  # noqa: NPY002 - for policies that use it
    torch: Any = sys.modules.get("torch")
    if torch is not None:
        torch.manual_seed(seed)
