"""The command that draws traces."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tyro.conf import Positional, arg

from labgym.cli.arguments import OptionalPath, OptionalText
from labgym.cli.effects import refuses_idle_flags
from labgym.cli.outcome import written
from labgym.errors import OptionError

if TYPE_CHECKING:
    from labgym.layouts.trace import Trace

Source = Positional[Annotated[str, arg(metavar="TRACE_OR_LAYOUT")]]


@refuses_idle_flags("trace")
def trace(
    source: Source,
    out: Path = Path("trace.html"),
    profile: str = "default",
    protocol: OptionalText = None,
    save: OptionalPath = None,
) -> int:
    """Draw how a layout was repaired: v, F and r over the iterations, the trials, and an animated plan.

    Violations are outlined in red at every state, furniture that moved in blue. A layout is first repaired.

    Args:
        source: The .json file of a trace (labgym generate --trace), the .json file of a layout, or the id of a
            published layout.
        out: The drawing: .html for a page with all trials, .gif or .mp4 for a film.
        profile: Of a layout: thresholds to satisfy.
        protocol: Of a layout: id or .json file of the protocol; by default the layout's.
        save: Of a layout: also write its trace to this .json file.
    """
    from labgym.eval.drawing import film
    from labgym.eval.drawing.trace_frames import trace_pictures, trace_states
    from labgym.eval.reports.trace_page import write_trace_page
    from labgym.layouts.trace import Trace
    from labgym.progress import progress_bar

    if out.suffix not in (".html", ".gif", ".mp4"):
        raise OptionError(f"drawing {out.name!r} must end in .html, .gif or .mp4")
    document = Trace.load(source) if is_trace(source) else _recorded(source, profile, protocol)
    if save is not None:
        written(document.save(save))
    states = trace_states(document)
    if out.suffix == ".html":
        return written(write_trace_page(document, progress_bar(states, "states"), out))
    return written(film.save_film(progress_bar(trace_pictures(document, states), "film", len(states)), out, rate=1.0))


def is_trace(source: str) -> bool:
    """Return whether a source is the .json file of a trace."""
    from labgym.documents import read_json

    data = read_json(source) if source.endswith(".json") else None
    return isinstance(data, dict) and str(data.get("schema", "")).startswith("labgym.trace/")


def _recorded(source: str, profile: str, protocol: str | None) -> Trace:
    """Return the trace of the repair of a layout."""
    from labgym.envs.tasks import resolve_layout
    from labgym.layouts.repairs import repair_layout
    from labgym.layouts.rules import rule_set
    from labgym.layouts.trace import Recorder

    layout, recorder = resolve_layout(source, protocol), Recorder()
    repair_layout(layout, None if protocol is None else layout.protocol, rule_set(profile=profile), trace=recorder)
    return recorder.trace()
