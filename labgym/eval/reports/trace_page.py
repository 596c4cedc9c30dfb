"""The page of a trace: an animated plan with curves, and a table of all trials; self-contained HTML."""

from __future__ import annotations

import base64
import hashlib
import io
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from labgym.documents import write_text
from labgym.eval.drawing.pictures import with_palette
from labgym.eval.drawing.trace_frames import DrawnState, draw_state, judged
from labgym.eval.reports.report import Picture, page_environment
from labgym.layouts.trace import Iteration, Trace, Trial

SHOWN_TRIALS = 60
"""Most trials of one iteration on the page; the document has up to 400."""
SHOWN_COMMANDS = 6
PERIOD_MS = 900
"""Time for which the animation shows a state, milliseconds."""
SCRIPT = """
const frames = Array.from(document.querySelectorAll('#frames img'));
const slider = document.querySelector('#slider'), button = document.querySelector('#play');
let timer = null;
function show(index) { frames.forEach((frame, at) => { frame.hidden = at !== index; }); slider.value = index; }
function stop() { clearInterval(timer); timer = null; button.textContent = 'Play'; }
function step() { show((Number(slider.value) + 1) % frames.length); }
function play() { timer = setInterval(step, Number(slider.dataset.period)); button.textContent = 'Pause'; }
slider.addEventListener('input', () => { stop(); show(Number(slider.value)); });
button.addEventListener('click', () => { if (timer === null) play(); else stop(); });
show(0);
if (frames.length > 1 && !matchMedia('(prefers-reduced-motion: reduce)').matches) play();
"""


@dataclass(frozen=True)
class Row:
    """An iteration on the page: its cells, and its trials as (commands, verdict, figures)."""

    cells: tuple[str, ...]
    trials: tuple[tuple[str, str, str], ...]
    hidden: int


def render_trace(trace: Trace, states: Sequence[DrawnState]) -> str:
    """Return the page; all text is escaped."""
    digest = base64.b64encode(hashlib.sha256(SCRIPT.encode()).digest()).decode()
    first, last = trace.iterations[0].figures, trace.iterations[-1].figures
    trials = Counter(trial.verdict for iteration in trace.iterations for trial in iteration.trials)
    tiles = (
        ("violations v", f"{first.v} → {last.v}"),
        ("facility errors", f"{first.errors} → {last.errors}"),
        ("missing assets", f"{first.missing} → {last.missing}"),
        ("fitness F", f"{first.fitness:.3f} → {last.fitness:.3f}"),
        ("unreachable r", f"{first.unreachable}/{first.transitions} → {last.unreachable}/{last.transitions}"),
        ("accepted trials", f"{trials['accepted']} of {sum(map(judged, trace.iterations))}"),
    )
    return (
        page_environment()
        .get_template("trace.html.j2")
        .render(
            title=f"Trace of {trace.start.id}",
            subtitle=f"repair of a layout for protocol {trace.protocol or 'none'}, thresholds {trace.profile}",
            tiles=tiles,
            frames=[Picture(state.caption, _png(trace, state)) for state in states],
            rows=[_row(number, iteration) for number, iteration in enumerate(trace.iterations)],
            period=PERIOD_MS,
            script=SCRIPT,
            digest=digest,
        )
    )


def write_trace_page(trace: Trace, states: Sequence[DrawnState], path: str | Path) -> Path:
    """Write the page atomically and return its path."""
    return write_text(path, render_trace(trace, states))


def _png(trace: Trace, state: DrawnState) -> bytes:
    stream = io.BytesIO()
    draw_state(trace, state).savefig(stream, format="png", metadata={"Software": None})
    return with_palette(stream)


def _row(number: int, iteration: Iteration) -> Row:
    figures, change = iteration.figures, iteration.change
    refused = Counter(trial.verdict for trial in iteration.trials if trial.verdict not in ("accepted", "start"))
    names = [item.id for item in change.placed]
    moved = ", ".join(names[:SHOWN_COMMANDS]) + (f" and {len(names) - SHOWN_COMMANDS} more" if names[6:] else "")
    return Row(
        cells=(
            str(number),
            iteration.phase + (f" ({iteration.level})" if iteration.level else ""),
            str(figures.v),
            str(figures.errors),
            f"{figures.fitness:.4f}",
            f"{figures.unreachable}/{figures.transitions}",
            str(judged(iteration)),
            ", ".join(f"{count} {verdict.replace('_', ' ')}" for verdict, count in sorted(refused.items())),
            moved + (f"; removed {len(change.removed)}" if change.removed else ""),
        ),
        trials=tuple(_trial(trial) for trial in iteration.trials[:SHOWN_TRIALS]),
        hidden=max(iteration.tried, len(iteration.trials)) - min(len(iteration.trials), SHOWN_TRIALS),
    )


def _trial(trial: Trial) -> tuple[str, str, str]:
    commands = "; ".join(str(command) for command in trial.commands[:SHOWN_COMMANDS])
    more = len(trial.commands) - SHOWN_COMMANDS
    commands += f"; and {more} more" if more > 0 else ""
    words = [trial.note] if trial.note else []
    if trial.v is not None and trial.fitness is not None:
        reach = "" if trial.unreachable is None else f", U = {trial.unreachable}"
        words.append(f"v = {trial.v}, errors {trial.errors}, F = {trial.fitness:.4f}{reach}")
    words += [f"+{count} {kind}" for kind, count in trial.worse.items()]
    return f"{trial.operator}: {commands}" if commands else trial.operator, trial.verdict, ", ".join(words)
