"""What each main part of the NavDP-style policy is worth: it is left out, and the rest is trained and driven."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from labgym.cards.iplanner_ablation import RESULTS, RUNS, every_so_many
from labgym.eval.driving.runner import evaluate
from labgym.policies.navdp.config import LossOptions, NavDPConfig, NetworkOptions, TrainOptions


@dataclass(frozen=True)
class Variant:
    """The policy with something changed.

    Attributes:
        name: of its folders. title: what the table calls it.
        rules: rules of the policy that differ; the weights are then those of the whole run.
        trained: whether it is trained itself, on less, with other options of the network or the loss.
    """

    name: str
    title: str
    rules: dict[str, Any] = field(default_factory=dict)
    trained: bool = False
    network: dict[str, Any] = field(default_factory=dict)
    loss: dict[str, Any] = field(default_factory=dict)


SMALL = "small"

VARIANTS = (
    Variant("whole", "the whole"),
    Variant("critic", "the first sample in place of the critic's choice", rules={"choose": "first"}),
    Variant("turn", "no turn in place where no sample is safe", rules={"stop": None}),
    Variant("samples", "two samples in place of twelve", rules={"samples": 2}),
    Variant("present", "the present frame in place of its memories", rules={"remembers": False}),
    Variant(SMALL, "the whole, trained on less", trained=True),
    Variant("memory", "one frame, no memory, trained on less", trained=True, network={"memory": 1}),
    Variant("negatives", "a critic without turned paths, trained on less", trained=True, loss={"rotation": 0.0}),
)

TITLES = {variant.name: variant.title for variant in VARIANTS}


def ablate_navdp(run: Path, data: Path, out: Path, training: TrainOptions, every: int, progress: bool = True) -> Path:
    """Train and drive every variant, or what is missing of it, and return the folder with an evaluation of each.

    Args:
        run: folder of the weights that variants of the driving alone take.
        data: folder of a dataset.
        out: folder for the training runs and the evaluations.
        training: how the others are trained.
        every: the suite is every so many-th layout of the validation split.
        progress: whether to show progress bars.

    Raises:
        OptionError: the folder holds runs of other options.
        DocumentError: the dataset or the weights cannot be read.
    """
    from labgym.policies.navdp.train import train

    suite = every_so_many(every)
    for variant in VARIANTS:
        weights = out / RUNS / variant.name if variant.trained else run
        if variant.trained:
            network, loss = NetworkOptions(**variant.network), LossOptions(**variant.loss)
            train(data, weights, NavDPConfig(network=network, loss=loss, training=training), progress)
        options: dict[str, Any] = {"weights": str(weights), "rules": variant.rules}
        evaluate("navdp", suite, out=out / RESULTS / variant.name, progress=progress, options=options)
    return out / RESULTS
