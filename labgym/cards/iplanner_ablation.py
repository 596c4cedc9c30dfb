"""What each main part of the iPlanner-style policy is worth: it is left out, and the rest is trained and driven."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from labgym.eval.driving.runner import evaluate
from labgym.eval.driving.suites import Suite, load_suite
from labgym.policies.iplanner.config import LossOptions, PlannerConfig, TrainOptions

RESULTS, RUNS = "results", "runs"
WHOLE = "whole"


@dataclass(frozen=True)
class Variant:
    """The policy with something changed.

    Attributes:
        name: of its folders. title: what the table calls it.
        loss: options of the loss that differ; a variant with none drives with the weights of the whole.
        rules: rules of the policy that differ.
    """

    name: str
    title: str
    loss: dict[str, Any] = field(default_factory=dict)
    rules: dict[str, float | None] = field(default_factory=dict)


VARIANTS = (
    Variant(WHOLE, "the whole"),
    Variant("goal", "paths pulled to the goal itself, as published", loss={"horizon": None}),
    Variant("straight", "even steps as along the straight line, as published", loss={"along": False}),
    Variant("obstacle", "no obstacle term", loss={"obstacle": 0.0}),
    Variant("fear", "no stop at fear", rules={"fear": 1.0}),
    Variant("glance", "no look at a goal out of sight", rules={"glance": None}),
    Variant("commit", "a new path at every look", rules={"commit": 0.0}),
)

TITLES = {variant.name: variant.title for variant in VARIANTS}


def ablate_iplanner(data: Path, out: Path, training: TrainOptions, every: int, progress: bool = True) -> Path:
    """Train and drive every variant, or what is missing of it, and return the folder with an evaluation of each.

    Args:
        data: folder of a dataset.
        out: folder for the training runs and the evaluations.
        training: how each is trained.
        every: the suite is every so many-th layout of the validation split.
        progress: whether to show progress bars.

    Raises:
        OptionError: the folder holds runs of other options.
        DocumentError: the dataset cannot be read.
    """
    from labgym.policies.iplanner.train import train

    suite = every_so_many(every)
    for variant in VARIANTS:
        weights = out / RUNS / (variant.name if variant.loss else WHOLE)
        train(data, weights, PlannerConfig(loss=LossOptions(**variant.loss), training=training), progress)
        options: dict[str, Any] = {"weights": str(weights), "rules": variant.rules}
        evaluate("iplanner", suite, out=out / RESULTS / variant.name, progress=progress, options=options)
    return out / RESULTS


def every_so_many(every: int) -> Suite:
    """Return the validation suite, or one of every so many-th of its layouts."""
    validation = load_suite("val")
    if every == 1:
        return validation
    layouts = tuple(layout.id for layout in validation.load_layouts())[::every]
    return validation.model_copy(update={"name": f"val-every-{every}", "layouts": layouts})
