"""The main loop of a local worker process: calls come through a pipe, and results go back."""

from __future__ import annotations

import os
import traceback
from multiprocessing.connection import Connection
from multiprocessing.reduction import ForkingPickler

from labgym.errors import LabgymError
from labgym.runs.orphans import begin_worker


def serve(pipe: Connection) -> None:
    """Run the calls that come through a pipe, until it ends.

    An answer is a pair: whether the call returned, and its result or else its exception, with the traceback as a note.
    """
    begin_worker()
    os.set_inheritable(pipe.fileno(), False)  # Else a process that a task leaves behind would keep the pipe open.
    while True:
        try:
            task = pipe.recv_bytes()
        except EOFError:
            return
        pipe.send_bytes(_answer(task))


def _answer(task: bytes) -> memoryview:
    try:
        function, arguments, keywords = ForkingPickler.loads(task)
        return ForkingPickler.dumps((True, function(*arguments, **keywords)))
    except Exception as error:  # noqa: BLE001 -- the coordinator raises it again
        if not isinstance(error, LabgymError):
            error.add_note(f"in the worker:\n{traceback.format_exc()}")
        return _pickled(error)


def _pickled(error: Exception) -> memoryview:
    try:
        answer = ForkingPickler.dumps((False, error))
        ForkingPickler.loads(answer)
    except Exception:  # noqa: BLE001 -- the exception's class may raise anything when it is pickled
        return ForkingPickler.dumps((False, RuntimeError(f"{type(error).__name__}: {error}")))
    return answer
