"""A vision-language model scores the realism, layout and completeness of a laboratory from pictures."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from labgym.eval.scoring.judgement import DIMENSIONS, HARD_ZEROS, Judgement, Sample
from labgym.eval.scoring.judging.options import JudgeOptions
from labgym.eval.scoring.judging.pictures import pictures
from labgym.eval.scoring.layout_report import LayoutReport
from labgym.layouts.model import Layout
from labgym.llm.client import LanguageModel
from labgym.llm.errors import LanguageModelError
from labgym.llm.messages import Message
from labgym.llm.rounds import REPAIRS, UNUSABLE, ask_with_repairs
from labgym.navigation import resolve_protocol
from labgym.protocols import Protocol

TEMPERATURE = 0.7
"""Sampling temperature of the answers: at 0 they would be equal, and their spread would say nothing."""


class Judge:
    """Judges layouts with a vision-language model.

    Args:
        model: the client.
        options: rigor and number of samples.
        repairs: maximum number of times an answer that does not have the required form is returned.
    """

    def __init__(self, model: LanguageModel, options: JudgeOptions | None = None, repairs: int = REPAIRS) -> None:
        self.model, self.repairs = model, repairs
        self.options = options if options is not None else JudgeOptions()

    def judge(self, layout: Layout, protocol: Protocol | None = None) -> Judgement:
        """Return the model's judgement of a layout, which it sees in pictures.

        Samples differ in the random seed: that of the client's configuration, and those after it.

        Args:
            layout: the layout.
            protocol: what the laboratory is for; by default the layout's first protocol, if it has one.

        Raises:
            LanguageModelError: no reply, or no usable answer in any sample.
        """
        target = layout.protocol if protocol is None else protocol
        views = pictures(layout, target)
        question = self._question(tuple(view.png for view in views), [view.name for view in views], target)
        samples: list[Sample] = []
        failure: LanguageModelError | None = None
        for number in range(self.options.samples):
            try:
                samples.append(self._sample(question, number))
            except LanguageModelError as error:
                if error.reason not in UNUSABLE:
                    raise
                failure = error
        if failure is not None and not samples:
            raise failure
        return Judgement(
            model=self.model.config.model,
            prompt=self.options.label,
            mode=self.options.mode,
            pictures=tuple(view.name for view in views),
            samples=tuple(samples),
            unusable=self.options.samples - len(samples),
        )

    def completed(
        self, report: LayoutReport, layout: Layout, protocol: Protocol | str | Path | None = None
    ) -> LayoutReport:
        """Return a report with the model's scores, S_consist and the total of 100 points.

        Args:
            report: the report on the layout, for the same protocol.

        Raises:
            LanguageModelError: as `judge`.
        """
        target = None if protocol is None else resolve_protocol(layout, protocol)
        return report.judged(self.judge(layout, target))

    def _sample(self, question: tuple[Message, ...], number: int) -> Sample:
        seed = (self.model.config.seed + number) % 2**31
        temperature = self.model.config.temperature or TEMPERATURE
        label = self.options.label
        return ask_with_repairs(self.model, label, question, Sample, self.repairs, seed, temperature).answer

    def _question(self, images: tuple[bytes, ...], names: list[str], protocol: Protocol | None) -> tuple[Message, ...]:
        rubric, mode = self.options.prompts
        system, user = rubric.fill(
            images,
            pictures=names,
            protocol=None if protocol is None else _task(protocol),
            conditions=dict(HARD_ZEROS),
        )
        manner, order = mode.fill(dimensions=list(DIMENSIONS))
        asked = Message("user", f"{user.text}\n\n{order.text}", user.images)
        return Message("system", f"{system.text}\n\n{manner.text}"), asked


def _task(protocol: Protocol) -> dict[str, Any]:
    """Return the experiment of a protocol: name, description, and required assets with their purposes."""
    used: dict[str, list[int]] = {}
    for number, step in enumerate(protocol.steps, 1):
        for name in (step.location, *step.uses):
            used.setdefault(name, []).append(number)
    purposes = {use.name: use.role for use in protocol.reagents}
    names = dict.fromkeys(protocol.required_assets())
    return {
        "name": protocol.name,
        "description": protocol.description,
        "required": {name: purposes.get(name) or f"steps {', '.join(map(str, used.get(name, [])))}" for name in names},
    }
