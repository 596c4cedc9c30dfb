"""The adjuster that asks a language model for commands; each is verified like a command of the rules."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from labgym.layouts.adjust import ADJUST, Level
from labgym.layouts.language.commands import CommandError, command_form, edits
from labgym.layouts.language.material import carrier_facts, carriers, floor_facts, involved, object_facts, problem_facts
from labgym.layouts.model import Layout
from labgym.layouts.moves import Command, applied
from labgym.layouts.rules.objective import Assessment, evaluate_layout
from labgym.layouts.trace import Recorder
from labgym.llm.client import LanguageModel
from labgym.llm.errors import LanguageModelError
from labgym.llm.messages import Message
from labgym.llm.prompting import load_prompt
from labgym.llm.rounds import QUOTED, REPAIRS, UNUSABLE, ask_with_repairs
from labgym.protocols import Protocol

Cause = Literal["invalid", "more violations", "lower fitness", "no gain"]


@dataclass(frozen=True)
class CommandRefusal:
    """A command that was not accepted: the command as plain data, the kind of reason, and the reason."""

    command: dict[str, Any]
    cause: Cause
    reason: str


@dataclass(frozen=True)
class CommandOutcome:
    """The layout after the accepted commands, the same object without one, and the refused commands."""

    layout: Layout
    accepted: int
    refusals: tuple[CommandRefusal, ...]


def verified(
    layout: Layout,
    protocol: Protocol | None,
    assessment: Assessment,
    proposed: Sequence[Any],
    trace: Recorder | None = None,
) -> CommandOutcome:
    """Apply each command that improves the layout; if none does alone, apply all together if that improves it.

    Args:
        assessment: of the layout.
        proposed: commands of the form of `commands.command_form`.
        trace: records every command.
    """
    current, best, accepted = layout, assessment, 0
    refusals: list[CommandRefusal] = []
    together: list[Command] = []
    for command in proposed:
        try:
            steps = edits(current, command)
        except CommandError as error:
            refusals.append(CommandRefusal(command.model_dump(), "invalid", str(error)))
            if trace is not None:
                trace.refuse(ADJUST, str(error))
            continue
        together += steps
        candidate = applied(current, steps)
        after = evaluate_layout(candidate, protocol, assessment.rules, earlier=best)
        better = after.better_than(best)
        if trace is not None:
            trace.trial(ADJUST, steps, best, after, better)
        if better:
            current, best, accepted = candidate, after, accepted + 1
        else:
            refusals.append(_refusal(command.model_dump(), best, after))
    if accepted or len(together) < 2:
        return CommandOutcome(current, accepted, tuple(refusals))
    candidate = applied(layout, together)
    after = evaluate_layout(candidate, protocol, assessment.rules, earlier=assessment)
    better = after.better_than(assessment)
    if trace is not None:
        trace.trial(ADJUST, together, assessment, after, better, note="all commands together")
    if not better:
        return CommandOutcome(layout, 0, tuple(refusals))
    invalid = tuple(refusal for refusal in refusals if refusal.cause == "invalid")
    return CommandOutcome(candidate, len(refusals) - len(invalid), invalid)


def _refusal(command: dict[str, Any], before: Assessment, after: Assessment) -> CommandRefusal:
    """Return why a candidate is not accepted."""
    if after.cost > before.cost:
        worse = [each for each in after.violations.items if each not in before.violations.items]
        cause = f": {worse[0].message}" if worse else ""
        counts = f"violations and facility errors rise from {before.cost} to {after.cost}"
        return CommandRefusal(command, "more violations", f"{counts}{cause}")
    if before.better_than(after):
        return CommandRefusal(
            command, "lower fitness", f"the fitness falls from {before.fitness:.3f} to {after.fitness:.3f}"
        )
    return CommandRefusal(command, "no gain", f"nothing improves: still {before.cost} violations and facility errors")


PROMPTS = Path(__file__).resolve().parent / "prompts"
ROUNDS = 2
"""Number of answers for one state of a layout; the second follows the reasons for which the first was refused."""
QUESTIONS = 60
"""Greatest number of states of layouts about which an adjuster asks."""


class LanguageAdjuster:
    """Adjusts a layout by commands of a language model: move, rotate and swap, and settle for items.

    A command is accepted if the layout has fewer violations and facility errors with it, or as many and a higher
    fitness. If none of several commands is accepted alone, all of them together are tried.

    Args:
        model: the client; by default the one that the environment configures.
        repairs: maximum number of times an answer that does not have the required form is returned.

    Attributes:
        accepted: number of accepted commands. refused: number of refused ones, by reason.
    """

    def __init__(self, model: LanguageModel | None = None, repairs: int = REPAIRS) -> None:
        self._model, self._repairs = model, repairs
        self._asked: set[tuple[str, Level]] = set()
        self.accepted = 0
        self.refused: Counter[str] = Counter()

    def adjust(
        self,
        layout: Layout,
        protocol: Protocol | None,
        assessment: Assessment,
        level: Level,
        trace: Recorder | None = None,
    ) -> Layout:
        """Return the layout after the accepted commands, or the same object if none is accepted.

        A state is asked about once, and at most `QUESTIONS` states are. An answer without commands that can be used
        counts as a refusal.

        Raises:
            LanguageModelError: no model is configured or reachable.
        """
        movable = involved(layout, assessment, level)
        state = (layout.hash, level)
        if not movable or state in self._asked or len(self._asked) >= QUESTIONS:
            return layout
        self._asked.add(state)
        if self._model is not None:
            return self._adjusted(self._model, layout, protocol, assessment, level, movable, trace)
        with LanguageModel.from_environment() as model:
            return self._adjusted(model, layout, protocol, assessment, level, movable, trace)

    def _adjusted(
        self,
        model: LanguageModel,
        layout: Layout,
        protocol: Protocol | None,
        assessment: Assessment,
        level: Level,
        movable: tuple[str, ...],
        trace: Recorder | None,
    ) -> Layout:
        prompt = load_prompt(PROMPTS / "adjust_layout.md")
        supports = carriers(layout) if level == "desktop" else ()
        question = prompt.fill(
            level=level,
            floor=floor_facts(layout.floor),
            objects=object_facts(layout, movable),
            surfaces=carrier_facts(layout, supports),
            problems=problem_facts(assessment),
        )
        form = command_form(layout, level, movable, supports)
        label, conversation = prompt.label, question
        for _ in range(ROUNDS):
            try:
                reply = ask_with_repairs(model, label, conversation, form, self._repairs)
            except LanguageModelError as error:
                if error.reason not in UNUSABLE:
                    raise
                self.refused[f"unusable answer: {error.reason}"] += 1
                if trace is not None:
                    trace.refuse(ADJUST, str(error))
                return layout
            answer: Any = reply.answer
            outcome = verified(layout, protocol, assessment, answer.commands, trace)
            self.accepted += outcome.accepted
            self.refused.update(refusal.cause for refusal in outcome.refusals)
            if outcome.accepted or not outcome.refusals:
                return outcome.layout
            again = load_prompt(PROMPTS / "adjust_again.md")
            label = f"{prompt.label}+{again.label}"
            refusals = [{"command": each.command, "reason": each.reason} for each in outcome.refusals]
            answered = Message("assistant", reply.text[:QUOTED])
            conversation = (*question, answered, again.fill(refusals=refusals)[-1])
        return layout
