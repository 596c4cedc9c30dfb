"""The rubric `labbuilder`: a vision-language model scores four dimensions, of which conditions cap some at 5."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field

from labgym.documents import Record
from labgym.eval.scoring.judge import pictures
from labgym.eval.scoring.judgement import Mode, Score
from labgym.layouts.model import Layout
from labgym.llm import LanguageModel
from labgym.llm.prompting import load_prompt
from labgym.llm.rounds import ask_with_repairs

RUBRIC = Path(__file__).resolve().parent / "prompts" / "rubric.md"
TEMPERATURE = 0.3
"""Of the released program."""
CAPPED = 5.0
"""Greatest score of a dimension whose condition applies."""
Cap = Literal["implausible_equipment", "critical_device_missing", "unsafe_or_unworkable", "mostly_empty"]
CAPS: Mapping[str, Cap] = {
    "realism": "implausible_equipment",
    "functionality": "critical_device_missing",
    "layout": "unsafe_or_unworkable",
    "completion": "mostly_empty",
}
"""The dimensions, and the condition of each."""


class Rating(Record):
    """A model's scores of the four dimensions before caps, and the conditions that it finds."""

    realism: Score
    functionality: Score
    layout: Score
    completion: Score
    caps: Annotated[tuple[Cap, ...], Field(max_length=len(CAPS))]

    def points(self) -> dict[str, float]:
        """Return the points of each dimension, 0 to 10, and `mean`, a quarter of their sum."""
        scores: dict[str, float] = {name: getattr(self, name).score for name in CAPS}
        capped = {name: min(score, CAPPED) if CAPS[name] in self.caps else score for name, score in scores.items()}
        return capped | {"mean": sum(capped.values()) / len(CAPS)}


def rate(model: LanguageModel, layout: Layout, mode: Mode) -> Rating:
    """Return a model's rating of pictures of a layout, for its first protocol; one answer.

    Raises:
        LanguageModelError: no usable reply.
    """
    prompt, protocol, views = load_prompt(RUBRIC), layout.protocol, pictures(layout, layout.protocol)
    task = None if protocol is None else protocol.model_dump(include={"name", "description", "reagents", "instruments"})
    question = prompt.fill(
        tuple(view.png for view in views), pictures=[view.name for view in views], protocol=task, mode=mode
    )
    return ask_with_repairs(model, prompt.label, question, Rating, temperature=TEMPERATURE).answer
