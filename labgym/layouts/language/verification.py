"""Verification of a model's commands, by the acceptance that applies to the commands of the rules."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

from labgym.layouts.adjust import ADJUST
from labgym.layouts.language.commands import CommandError, edits
from labgym.layouts.model import Layout
from labgym.layouts.moves import Command, apply
from labgym.layouts.rules.objective import Assessment, evaluate_layout
from labgym.layouts.trace import Recorder
from labgym.protocols import Protocol

Cause = Literal["invalid", "more violations", "lower fitness", "no gain"]


@dataclass(frozen=True)
class Refusal:
    """A command that was not accepted: the command as plain data, the kind of reason, and the reason."""

    command: dict[str, Any]
    cause: Cause
    reason: str


@dataclass(frozen=True)
class Outcome:
    """The layout after the accepted commands, the same object without one, and the refused commands."""

    layout: Layout
    accepted: int
    refusals: tuple[Refusal, ...]


def verified(
    layout: Layout,
    protocol: Protocol | None,
    assessment: Assessment,
    proposed: Sequence[Any],
    trace: Recorder | None = None,
) -> Outcome:
    """Apply each command that improves the layout; if none does alone, apply all together if that improves it.

    Args:
        assessment: of the layout.
        proposed: commands of the form of `commands.command_form`.
        trace: records every command.
    """
    current, best, accepted = layout, assessment, 0
    refusals: list[Refusal] = []
    together: list[Command] = []
    for command in proposed:
        try:
            steps = edits(current, command)
        except CommandError as error:
            refusals.append(Refusal(command.model_dump(), "invalid", str(error)))
            if trace is not None:
                trace.refuse(ADJUST, str(error))
            continue
        together += steps
        candidate = _applied(current, steps)
        after = evaluate_layout(candidate, protocol, assessment.rules)
        better = after.better_than(best)
        if trace is not None:
            trace.trial(ADJUST, steps, best, after, better)
        if better:
            current, best, accepted = candidate, after, accepted + 1
        else:
            refusals.append(_refusal(command.model_dump(), best, after))
    if accepted or len(together) < 2:
        return Outcome(current, accepted, tuple(refusals))
    candidate = _applied(layout, together)
    after = evaluate_layout(candidate, protocol, assessment.rules)
    better = after.better_than(assessment)
    if trace is not None:
        trace.trial(ADJUST, together, assessment, after, better, note="all commands together")
    if not better:
        return Outcome(layout, 0, tuple(refusals))
    invalid = tuple(refusal for refusal in refusals if refusal.cause == "invalid")
    return Outcome(candidate, len(refusals) - len(invalid), invalid)


def _applied(layout: Layout, commands: Sequence[Command]) -> Layout:
    for command in commands:
        layout = apply(layout, command)
    return layout


def _refusal(command: dict[str, Any], before: Assessment, after: Assessment) -> Refusal:
    """Return why a candidate is not accepted."""
    if after.cost > before.cost:
        worse = [each for each in after.violations.items if each not in before.violations.items]
        cause = f": {worse[0].message}" if worse else ""
        counts = f"violations and facility errors rise from {before.cost} to {after.cost}"
        return Refusal(command, "more violations", f"{counts}{cause}")
    if before.better_than(after):
        return Refusal(command, "lower fitness", f"the fitness falls from {before.fitness:.3f} to {after.fitness:.3f}")
    return Refusal(command, "no gain", f"nothing improves: still {before.cost} violations and facility errors")
