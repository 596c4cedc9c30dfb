"""The document `labgym.trace/1` and its recorder: every state of a layout from its proposal on."""

from labgym.layouts.trace.changes import Change
from labgym.layouts.trace.document import Figures, Iteration, Trace, Trial
from labgym.layouts.trace.recorder import Recorder

__all__ = ["Change", "Figures", "Iteration", "Recorder", "Trace", "Trial"]
