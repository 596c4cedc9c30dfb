"""Answers that do not have the required form go back to the model, a bounded number of times."""

from __future__ import annotations

from pathlib import Path

from labgym.llm.client import LanguageModel, Reply
from labgym.llm.completion import Answer
from labgym.llm.errors import LanguageModelError, Reason
from labgym.llm.messages import Message
from labgym.llm.prompting import load_prompt

REPAIR = Path(__file__).resolve().parent / "prompts" / "repair_answer.md"
REPAIRS = 2
"""Number of times an answer is returned."""
QUOTED = 12_000
"""Greatest length of a returned answer, characters; the rest is cut off."""
UNUSABLE: frozenset[Reason] = frozenset({"malformed", "refused", "empty", "truncated", "oversize"})
"""Kinds of error of a server that answers, but without a usable answer."""


def ask_with_repairs(
    model: LanguageModel,
    prompt: str,
    question: tuple[Message, ...],
    answer: type[Answer],
    repairs: int = REPAIRS,
    seed: int | None = None,
    temperature: float | None = None,
) -> Reply[Answer]:
    """Return the model's answer; one that is not JSON or does not match `answer` is returned with the problem.

    Args:
        prompt, answer, seed, temperature: as `LanguageModel.ask`.
        question: the messages of the first question.
        repairs: maximum number of times an answer is returned.

    Raises:
        LanguageModelError: no reply, a refusal, or still no usable answer after the repairs.
    """
    label, conversation = prompt, question
    for attempt in range(repairs + 1):
        try:
            return model.ask(label, conversation, answer, seed, temperature)
        except LanguageModelError as error:
            if error.reason != "malformed" or not error.reply or attempt == repairs:
                raise
            repair = load_prompt(REPAIR)
            label = f"{prompt}+{repair.label}"
            # The first question and the latest answer are enough; a whole history would outgrow the model's window.
            returned = Message("assistant", error.reply[:QUOTED])
            conversation = (*question, returned, repair.fill(problem=str(error)[:QUOTED])[-1])
    raise AssertionError
