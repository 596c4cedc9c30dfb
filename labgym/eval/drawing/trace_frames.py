"""Pictures of a trace: the plan at each state with its violations, next to curves of v, F, r and the trials."""

from __future__ import annotations

import io
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from labgym.eval.drawing import palette
from labgym.eval.drawing.pictures import goal_poses
from labgym.eval.drawing.plan_drawing import draw_goals, draw_objects, draw_plan, draw_violations, plan_size
from labgym.eval.drawing.plan_labels import FONT
from labgym.layouts.model import Layout
from labgym.layouts.request import combination
from labgym.layouts.rules import rule_set
from labgym.layouts.rules.objective import Assessment, evaluate_layout
from labgym.layouts.trace import Iteration, Trace
from labgym.protocols import Protocol, protocols

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MOST_FRAMES = 60
"""Most states that are drawn; of more, the first, the last and evenly spaced ones between them."""
PLAN_INCHES, CURVES_INCHES = 5.6, 3.6
DPI = 100
MOVED = "#0f6fb5"
REFUSED = "#b9bec3"


@dataclass(frozen=True)
class DrawnState:
    """A state of a trace that is drawn.

    Attributes:
        number: position of its iteration in the trace.
        iteration: the iteration that led to it.
        layout: the layout. before: the state before.
        assessment: the layout's assessment with navigation.
    """

    number: int
    iteration: Iteration
    layout: Layout
    before: Layout
    assessment: Assessment

    @property
    def caption(self) -> str:
        """One line on the phase and the figures."""
        figures = self.iteration.figures
        level = f" ({self.iteration.level})" if self.iteration.level else ""
        return (
            f"{self.number}. {self.iteration.phase}{level}: v = {figures.v}, facility errors {figures.errors}, "
            f"F = {figures.fitness:.3f}, r = {figures.unreachable}/{figures.transitions}"
        )


def trace_protocol(trace: Trace) -> Protocol | None:
    """Return the protocol that the figures of a trace are for; None if it is unknown."""
    start = trace.start
    candidates = [*start.protocols, *([combination(start.protocols, start.catalog)] if start.protocols else [])]
    embedded = next((one for one in candidates if one.id == trace.protocol), None)
    return embedded if embedded is not None else protocols().get(trace.protocol or "")


def trace_states(trace: Trace, most: int = MOST_FRAMES) -> list[DrawnState]:
    """Return the states to draw: the first, and those after accepted updates.

    Raises:
        DocumentError: as `Trace.states`.
        UnknownNameError: the trace names a rule set or a profile that does not exist.
    """
    protocol, rules = trace_protocol(trace), rule_set(trace.rules, trace.profile)
    states, before = [], trace.start
    for number, (iteration, layout) in enumerate(trace.states()):
        if number == 0 or iteration.accepted:
            states.append((number, iteration, layout, before))
        before = layout
    chosen = {round(index) for index in np.linspace(0, len(states) - 1, min(most, len(states)))}
    return [
        DrawnState(*state, evaluate_layout(state[2], protocol, rules, navigation=True))
        for index, state in enumerate(states)
        if index in chosen
    ]


def judged(iteration: Iteration) -> int:
    """Return the number of trials of an iteration, without those that only name a state to start from."""
    starts = sum(trial.verdict == "start" for trial in iteration.trials)
    return max(iteration.tried, len(iteration.trials)) - starts


def draw_state(trace: Trace, state: DrawnState) -> Figure:
    """Draw a state: the plan with violations in red and moved objects in blue, and the curves up to the last state."""
    from matplotlib.figure import Figure

    width, depth = plan_size(state.layout.floor)
    scale = PLAN_INCHES / max(width, depth)
    size = (PLAN_INCHES + CURVES_INCHES + 0.9, PLAN_INCHES + 0.6)
    figure = Figure(figsize=size, facecolor="#ffffff", dpi=DPI)
    plan = figure.add_axes(
        (
            (0.15 + (PLAN_INCHES - width * scale) / 2.0) / size[0],
            (0.15 + (PLAN_INCHES - depth * scale) / 2.0) / size[1],
            width * scale / size[0],
            depth * scale / size[1],
        )
    )
    plan.set_axis_off()
    draw_plan(plan, state.layout.floor)
    poses = goal_poses(state.layout, trace_protocol(trace))
    draw_objects(plan, state.layout, 72.0 * scale, poses.values())
    draw_goals(plan, poses)
    _draw_moves(plan, state)
    draw_violations(plan, state.layout, (*state.assessment.violations.items, *state.assessment.errors))
    style: dict[str, Any] = {"fontsize": 9.5, "family": FONT, "color": palette.INK}
    figure.text(0.15 / size[0], 1.0 - 0.28 / size[1], state.caption, parse_math=False, **style)
    left, bottom, gap = (PLAN_INCHES + 0.75) / size[0], 0.45 / size[1], 0.022
    height = (1.0 - 0.55 / size[1] - bottom - 3 * gap) / 4.0
    panels = [
        figure.add_axes((left, bottom + row * (height + gap), CURVES_INCHES / size[0], height)) for row in (3, 2, 1, 0)
    ]
    draw_curves(panels, trace, state.number)
    return figure


def draw_curves(panels: Sequence[Axes], trace: Trace, current: int | None = None) -> None:
    """Draw v with facility errors, F, r and the trials over the iterations into four axes.

    Args:
        current: number of the iteration that is marked.
    """
    from matplotlib.ticker import MaxNLocator

    numbers = np.arange(len(trace.iterations))
    figures = [iteration.figures for iteration in trace.iterations]
    violations, fitness, rate, trials = panels
    style: dict[str, Any] = {"where": "post", "linewidth": 1.4}
    violations.step(numbers, [one.v for one in figures], color=palette.ALARM, label="v", **style)
    errors = [one.errors for one in figures]
    violations.step(numbers, errors, color=palette.MUTED, label="facility errors", **style)
    fitness.step(numbers, [one.fitness for one in figures], color=MOVED, **style)
    rate.step(numbers, [one.rate for one in figures], color=palette.HEAT, **style)
    accepted = [sum(trial.verdict == "accepted" for trial in each.trials) for each in trace.iterations]
    tried = [judged(each) for each in trace.iterations]
    trials.bar(numbers, accepted, color=palette.SAFETY.edge, label="accepted")
    refused = [total - good for total, good in zip(tried, accepted, strict=True)]
    trials.bar(numbers, refused, bottom=accepted, color=REFUSED, label="refused")
    rate.set_ylim(-0.04, 1.04)
    violations.set_ylim(bottom=-0.5)
    for axes, name in zip(panels, ("violations", "F", "r = U/N", "trials"), strict=True):
        axes.set_ylabel(name, fontsize=8, family=FONT)
        axes.tick_params(labelsize=7, labelbottom=axes is trials)
        axes.set_xlim(-0.7, len(numbers) - 0.3)
        axes.grid(color=palette.GRID, linewidth=0.6)
        axes.set_axisbelow(True)
        for side in ("top", "right"):
            axes.spines[side].set_visible(False)
        if current is not None:
            axes.axvline(current, color=palette.INK, linewidth=0.9, linestyle=(0, (3, 2)))
    for axes in (violations, trials):
        axes.legend(fontsize=6.5, frameon=False, loc="upper right")
    trials.xaxis.set_major_locator(MaxNLocator(integer=True))
    trials.set_xlabel("iteration", fontsize=8, family=FONT)


def trace_pictures(trace: Trace, states: Sequence[DrawnState]) -> Iterator[NDArray[np.uint8]]:
    """Yield a picture (height, width, 3) of each state, all of one size."""
    from PIL import Image

    for state in states:
        stream = io.BytesIO()
        draw_state(trace, state).savefig(stream, format="png")
        yield np.asarray(Image.open(stream).convert("RGB"))


def _draw_moves(axes: Axes, state: DrawnState) -> None:
    """Outline furniture that changed: dashed where it was, solid where it is."""
    from matplotlib.patches import Polygon

    for item in state.iteration.change.placed:
        if item.support in state.layout.by_id:
            continue
        places = [(state.layout, "solid")] if item.id in state.layout.by_id else []
        places += [(state.before, "dashed")] if item.id in state.before.by_id else []
        for layout, line in places:
            outline = layout.box(item.id).corners()
            axes.add_patch(
                Polygon(outline, closed=True, fill=False, edgecolor=MOVED, linewidth=1.6, linestyle=line, zorder=32)
            )
