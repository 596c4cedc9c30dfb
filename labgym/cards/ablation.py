"""Ablation studies: a policy is driven with one part changed at a time."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from labgym.eval.evaluator import evaluate
from labgym.policies.iplanner.config import IPlannerConfig, IPlannerLossOptions, IPlannerTrainOptions
from labgym.suites import Suite, load_suite

RESULTS, RUNS = "results", "runs"
WHOLE = "whole"
"""Name of the variant that is not changed."""


@dataclass(frozen=True)
class AblationVariant:
    """A policy with one part changed.

    Attributes:
        name: name of its folders.
        title: its row in the table.
        options: options of the policy that differ.
        loss: options of the loss that differ; the policy is then trained with them.
    """

    name: str
    title: str
    options: Mapping[str, Any] = field(default_factory=dict)
    loss: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class PolicyAblation:
    """The variants of one policy.

    Attributes:
        policy: its name.
        variants: in the order of the table, the unchanged one first.
    """

    policy: str
    variants: tuple[AblationVariant, ...]

    @property
    def titles(self) -> dict[str, str]:
        """The variants' titles by name."""
        return {variant.name: variant.title for variant in self.variants}


IPLANNER = PolicyAblation(
    "iplanner",
    (
        AblationVariant(WHOLE, "unchanged"),
        AblationVariant("cost-to-go", "target on the cost-to-go, without an expert", loss={"target": "cost-to-go"}),
        AblationVariant("goal", "target at the goal itself, as published", loss={"target": "goal"}),
        AblationVariant("straight", "even steps along the straight line, as published", loss={"along": False}),
        AblationVariant("obstacle", "no obstacle term", loss={"obstacle": 0.0}),
        AblationVariant("glance", "no glance at a hidden goal", options={"glance": None}),
        AblationVariant("commit", "a new path at every look", options={"commit": 0.0}),
    ),
)
"""Variants of the loss are trained; the others drive with the weights of the unchanged one, trained alike."""

PLAIN: Mapping[str, Any] = {"veto": [], "guided": 0, "check": [], "settled": None}
"""Options of `navdp` without the parts that were added to the trained network."""

NAVDP = PolicyAblation(
    "navdp",
    (
        AblationVariant(WHOLE, "unchanged"),
        AblationVariant("plain", "no veto, guidance, check or settling", options=PLAIN),
        AblationVariant("veto", "no veto", options={"veto": []}),
        AblationVariant("guidance", "no guidance", options={"guided": 0}),
        AblationVariant("check", "no check of the next control steps", options={"check": []}),
        AblationVariant("settling", "no settling after a turn", options={"settled": None}),
        AblationVariant("critic", "first sample instead of the critic's choice", options={"choose": "first"}),
        AblationVariant("turn", "no turn in place if no sample is safe", options={"stop": None}),
        AblationVariant("samples", "2 samples instead of 12", options={"samples": 2}),
        AblationVariant("present", "present frame only", options={"remembers": False}),
    ),
)
"""All variants drive with the same weights."""


def ablate_iplanner(data: Path, out: Path, training: IPlannerTrainOptions, every: int, progress: bool = True) -> Path:
    """Train and drive every variant of `IPLANNER` that is missing, and return the folder of the evaluations.

    Args:
        data: folder of a dataset.
        out: folder for the training runs and the evaluations.
        training: options of each training.
        every: drive in every `every`-th layout of the validation split.
        progress: whether to show progress bars.

    Raises:
        OptionError: the folder holds runs with other options.
        DocumentError: the dataset cannot be read.
    """

    def trained(variant: AblationVariant) -> Path:
        from labgym.policies.iplanner.train import train

        folder = out / RUNS / (variant.name if variant.loss else WHOLE)
        loss = IPlannerLossOptions.model_validate(variant.loss)
        train(data, folder, IPlannerConfig(loss=loss, training=training), progress)
        return folder

    return _drive(IPLANNER, out, every, trained, progress)


def ablate_navdp(weights: Path, out: Path, every: int, progress: bool = True) -> Path:
    """Drive every variant of `NAVDP` that is missing, and return the folder of the evaluations.

    Args:
        weights: folder of the weights to drive with.
        out: folder for the evaluations.
        every: drive in every `every`-th layout of the validation split.
        progress: whether to show progress bars.

    Raises:
        OptionError: the folder holds runs with other options.
        DocumentError: the weights cannot be read.
    """
    return _drive(NAVDP, out, every, lambda _: weights, progress)


def thinned_suite(every: int) -> Suite:
    """Return the validation suite, reduced to every `every`-th of its layouts."""
    validation = load_suite("val")
    if every == 1:
        return validation
    layouts = tuple(layout.id for layout in validation.load_layouts())[::every]
    return validation.model_copy(update={"name": f"val-every-{every}", "layouts": layouts})


def _drive(
    study: PolicyAblation, out: Path, every: int, weights: Callable[[AblationVariant], Path], progress: bool
) -> Path:
    suite = thinned_suite(every)
    for variant in study.variants:
        options: dict[str, Any] = {"weights": str(weights(variant)), "options": dict(variant.options)}
        evaluate(study.policy, suite, out=out / RESULTS / variant.name, progress=progress, options=options)
    return out / RESULTS
