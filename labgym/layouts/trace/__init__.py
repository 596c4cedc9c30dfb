"""The document `labgym.trace/1` and its recorder: every state of a layout from its proposal on."""

from labgym.layouts.trace.changes import StateChange
from labgym.layouts.trace.document import Figures, Iteration, Trace, Trial
from labgym.layouts.trace.recorder import Recorder

__all__ = ["Figures", "Iteration", "Recorder", "StateChange", "Trace", "Trial"]
