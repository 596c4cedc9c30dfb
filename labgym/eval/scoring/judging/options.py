"""How a judge judges."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from labgym.errors import OptionError, UnknownNameError
from labgym.eval.scoring.judgement import Mode
from labgym.llm.prompting import Prompt, load_prompt

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
        if self.mode not in MODES:
            raise UnknownNameError("mode of the judge", self.mode, MODES)
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
