"""What happens to a layout between its proposal and its final state, as a document."""

from labgym.layouts.trace.changes import Change
from labgym.layouts.trace.document import Figures, Iteration, Trace, Trial
from labgym.layouts.trace.recorder import Recorder

__all__ = ["Change", "Figures", "Iteration", "Recorder", "Trace", "Trial"]
