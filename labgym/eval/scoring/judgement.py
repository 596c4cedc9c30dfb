"""The judgement of a vision-language model about a layout."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field

from labgym.documents import Record
from labgym.errors import OptionError, check_name
from labgym.llm.prompting import Prompt, load_prompt

Mode = Literal["strict", "medium", "lenient"]
Dimension = Literal["realism", "layout", "completeness"]
HardZero = Literal[
    "unconventional_equipment", "unsafe_placement", "unsafe_or_infeasible", "blocked_exit", "mostly_empty"
]
DIMENSIONS: tuple[Dimension, ...] = ("realism", "layout", "completeness")
HARD_ZEROS: Mapping[HardZero, Dimension] = {
    "unconventional_equipment": "realism",
    "unsafe_placement": "realism",
    "unsafe_or_infeasible": "layout",
    "blocked_exit": "layout",
    "mostly_empty": "completeness",
}
"""Conditions under which the score of a dimension is 0, whatever the model's figure: those of the paper, and that many
instruments stand on the floor or in the air (`unsafe_placement`) and that furniture stands in a door."""
Points = Annotated[float, Field(ge=0.0, le=10.0)]


class Score(Record):
    """Points of a dimension, 0 to 10, and the model's reason."""

    score: Points
    reason: Annotated[str, Field(max_length=1000)]


class Sample(Record):
    """One answer of the model.

    Attributes:
        realism, layout, completeness: its scores, before hard zeros.
        hard_zeros: the conditions that it finds.
    """

    realism: Score
    layout: Score
    completeness: Score
    hard_zeros: Annotated[tuple[HardZero, ...], Field(max_length=len(HARD_ZEROS))]

    def points(self, dimension: Dimension) -> float:
        """Return the points of a dimension: 0 under a hard zero."""
        if any(HARD_ZEROS[condition] == dimension for condition in self.hard_zeros):
            return 0.0
        own: Score = getattr(self, dimension)
        return own.score

    @property
    def total(self) -> float:
        """Sum of the three dimensions, at most 30."""
        return sum(self.points(dimension) for dimension in DIMENSIONS)


class Judgement(Record):
    """Several answers of a model about one layout.

    Attributes:
        model, prompt: name of the model; names and versions of the prompts.
        mode: the rigor that the prompt asks for.
        pictures: names of the views that it saw.
        samples: its answers.
        unusable: number of further answers that could not be used, after repairs.
    """

    model: str
    prompt: str
    mode: Mode
    pictures: tuple[str, ...]
    samples: Annotated[tuple[Sample, ...], Field(min_length=1, max_length=100)]
    unusable: Annotated[int, Field(ge=0, le=100)] = 0

    def mean(self, dimension: Dimension) -> float:
        """Return the mean points of a dimension over the samples."""
        return sum(sample.points(dimension) for sample in self.samples) / len(self.samples)

    def spread(self, dimension: Dimension | None = None) -> float:
        """Return the greatest difference between two samples: of a dimension, or of the sum."""
        points = [sample.total if dimension is None else sample.points(dimension) for sample in self.samples]
        return max(points) - min(points)

    @property
    def s_consist(self) -> float:
        """S_consist, at most 30: the sum of the means."""
        return sum(self.mean(dimension) for dimension in DIMENSIONS)


PROMPTS = Path(__file__).resolve().parent / "prompts"
MODES: tuple[Mode, ...] = ("strict", "medium", "lenient")
SAMPLES = 3
MAX_SAMPLES = 20


@dataclass(frozen=True)
class JudgeOptions:
    """Rigor of a judge, and number of answers about each layout.

    Raises:
        UnknownNameError: there is no such mode.
        OptionError: the number of samples is out of range.
    """

    mode: Mode = "medium"
    samples: int = SAMPLES

    def __post_init__(self) -> None:
        check_name("mode of the judge", self.mode, MODES)
        if not 1 <= self.samples <= MAX_SAMPLES:
            raise OptionError(f"samples is {self.samples}: the judge gives 1 to {MAX_SAMPLES} answers about a layout")

    @property
    def prompts(self) -> tuple[Prompt, Prompt]:
        """The rubric, which all modes share, and the instruction of the mode."""
        return load_prompt(PROMPTS / "judge_layout.md"), load_prompt(PROMPTS / f"{self.mode}.md")

    @property
    def label(self) -> str:
        """Names and versions of the prompts, such as judge_layout/1+medium/1."""
        return "+".join(prompt.label for prompt in self.prompts)
