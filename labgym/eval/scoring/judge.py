"""A vision-language model scores the realism, layout and completeness of a laboratory from pictures."""

from __future__ import annotations

import io
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from labgym.eval.scoring.judgement import DIMENSIONS, HARD_ZEROS, Judgement, JudgeOptions, Sample
from labgym.eval.scoring.layout_report import LayoutReport
from labgym.layouts.model import Layout
from labgym.layouts.placement import FLOOR
from labgym.llm.client import LanguageModel
from labgym.llm.errors import LanguageModelError
from labgym.llm.messages import Message
from labgym.llm.rounds import REPAIRS, UNUSABLE, ask_with_repairs
from labgym.navigation import resolve_protocol
from labgym.navigation.clearance import Obstacles
from labgym.protocols import Protocol
from labgym.scenes.camera import corner_views
from labgym.scenes.tracing import trace_view
from labgym.scenes.views import TALL, View, picture_view

CORNERS = 4
"""Greatest number of corners from which pictures show all spaces together."""
BENCHES = 5
"""Greatest number of places of work that have a picture."""
WIDTH, HEIGHT, SAMPLES = 768, 432, 2
"""Size of a picture, pixels, and rays per pixel."""


@dataclass(frozen=True)
class JudgedPicture:
    """A named picture as PNG."""

    name: str
    png: bytes


def judged_views(layout: Layout, protocol: Protocol | None) -> dict[str, View]:
    """Return the cameras of the pictures by name: topdown, corners of the largest spaces, and places of work."""
    cameras = {"topdown": picture_view(layout, "topdown")}
    spaces = sorted(layout.floor.spaces, key=lambda space: (-space.area, space.id))[:CORNERS]
    tall = Obstacles(box for box in layout.obstacles(TALL) if box.z1 > TALL)
    share, more = divmod(CORNERS, len(spaces))
    for index, space in enumerate(spaces):
        for number, view in enumerate(corner_views(space, tall, share + (index < more)), 1):
            cameras[f"corner {number} of {space.id}"] = view
    for name in _workplaces(layout, protocol):
        cameras[name] = picture_view(layout, name)
    return cameras


def pictures(layout: Layout, protocol: Protocol | None) -> tuple[JudgedPicture, ...]:
    """Return the pictures of a layout for a judge, rendered without OpenGL."""
    return tuple(
        JudgedPicture(name, _png(trace_view(layout, view, WIDTH, HEIGHT, SAMPLES)))
        for name, view in judged_views(layout, protocol).items()
    )


def _workplaces(layout: Layout, protocol: Protocol | None) -> list[str]:
    """Return the furniture at which the protocol works, in its order, then the benches that carry the most."""
    standing = [p.id for p in layout.placements if p.support == FLOOR and layout.asset(p.id).surfaces]
    located = [layout.find(name) for name in (protocol.locations if protocol is not None else ())]
    names = [placement.id for placement in located if placement is not None and placement.id in standing]
    open_tops = [name for name in standing if layout.asset(name).storage_class is None]
    names += sorted(open_tops, key=lambda name: (-len(layout.children(name)), name))
    return list(dict.fromkeys(names))[:BENCHES]


def _png(pixels: np.ndarray[tuple[int, ...], np.dtype[np.uint8]]) -> bytes:
    from PIL import Image

    stream = io.BytesIO()
    Image.fromarray(pixels).save(stream, "png")
    return stream.getvalue()


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
