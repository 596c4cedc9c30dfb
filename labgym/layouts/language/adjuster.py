"""The adjuster that asks a language model for commands; each is verified like a command of the rules."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Any

from labgym.layouts.adjust import ADJUST, Level
from labgym.layouts.language.commands import command_form
from labgym.layouts.language.feedback import carrier_facts, carriers, involved, object_facts, problem_facts
from labgym.layouts.language.material import floor_facts
from labgym.layouts.language.verification import verified
from labgym.layouts.model import Layout
from labgym.layouts.rules.objective import Assessment
from labgym.layouts.trace import Recorder
from labgym.llm.client import LanguageModel
from labgym.llm.errors import LanguageModelError
from labgym.llm.messages import Message
from labgym.llm.prompting import load_prompt
from labgym.llm.rounds import QUOTED, REPAIRS, UNUSABLE, ask_with_repairs
from labgym.protocols import Protocol

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
