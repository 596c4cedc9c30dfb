"""The document `labgym.trace/1` and its recorder: every state of a layout from its proposal on."""

from labgym.layouts.trace.document import Figures, Iteration, StateChange, Trace, Trial
from labgym.layouts.trace.recorder import Recorder

__all__ = ["Figures", "Iteration", "Recorder", "StateChange", "Trace", "Trial"]
