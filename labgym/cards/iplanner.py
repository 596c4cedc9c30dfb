"""The published folder of an iPlanner-style policy: weights, figures, and a card whose numbers are an evaluation's."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from labgym.cards.results import CardResults, ablation_table
from labgym.documents import write_bytes, write_text
from labgym.eval.drawing.pictures import save_picture
from labgym.policies.data import DatasetManifest, load_dataset
from labgym.policies.iplanner.config import PlannerConfig

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from labgym.policies.iplanner.calibration import Calibration

PUBLISHED_FEAR = 0.5
"""Cost over which the published fear is true."""
FILES = ("config.json", "weights.safetensors", "history.jsonl")

Row = dict[str, Any]


def write_iplanner_card(run: Path, data: Path, results: Path, out: Path, ablation: Path | None = None) -> Path:
    """Publish the weights of a training run with a card, and return the card's path.

    Args:
        run: folder of `labgym train iplanner`.
        data: folder of the dataset that it was trained on.
        results: folder of `labgym eval` with these weights, complete, on a suite.
        out: folder for weights, configuration, losses, the dataset's manifest, figures and `CARD.md`.
        ablation: folder of `labgym ablate iplanner`; None leaves its table out.

    Raises:
        DocumentError: a file is missing or broken.
        OptionError: an evaluation is not complete, or of another policy.
    """
    from labgym.policies.iplanner.calibration import calibration
    from labgym.policies.iplanner.network import load_planner

    found = CardResults.read(results, "iplanner")
    history = [json.loads(line) for line in (run / "history.jsonl").read_text(encoding="utf-8").splitlines()]
    config, manifest = PlannerConfig.load(run / "config.json"), DatasetManifest.load(data / "manifest.json")
    fear = calibration(load_planner(run), load_dataset(data, config.training.samples), config)
    parts = "" if ablation is None else _ablation(ablation)
    if run != out:
        for name in FILES:
            write_bytes(out / name, (run / name).read_bytes())
    manifest.save(out / "data.json")
    save_picture(loss_figure(history), out / "losses.png")
    save_picture(fear_figure(fear), out / "fear.png")
    found.draw(out)
    return write_text(out / "CARD.md", _card(config, manifest, history, found, fear, parts))


def loss_figure(history: list[Row]) -> Figure:
    """Draw the loss and its terms, each before weighting, against the epoch."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.0, 2.6), facecolor="#ffffff")
    names = list(history[0]["train"])
    for axes, name in zip(figure.subplots(1, len(names)), names, strict=True):
        for kind, look in (("train", "#3d444b"), ("held_out", "#b5482a")):
            rows = [row for row in history if kind in row]
            axes.plot([row["epoch"] for row in rows], [row[kind][name] for row in rows], color=look, label=kind)
        axes.set_title(name, fontsize=9)
        axes.set_ylim(bottom=0.0)
        axes.tick_params(labelsize=7)
        axes.grid(alpha=0.3)
    figure.axes[0].legend(fontsize=7)
    figure.tight_layout()
    return figure


def fear_figure(fear: Calibration) -> Figure:
    """Draw how often paths collide against the fear of it, and precision and recall against the threshold."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.0, 3.0), facecolor="#ffffff")
    reliable, counts, trade = figure.subplots(1, 3)
    mean, share, count = fear.reliability().T
    reliable.plot([0.0, 1.0], [0.0, 1.0], ":", color="#7b838c")
    reliable.plot(mean, share, "o-", color="#2a6fb5", markersize=4)
    reliable.set_title("share of paths that collide", fontsize=9)
    counts.bar(mean, count, width=0.08, color="#3d444b")
    counts.set_title("samples", fontsize=9)
    thresholds = np.linspace(0.02, 0.98, 49)
    for kind, colour in (("precision", "#2a6fb5"), ("recall", "#b5482a")):
        trade.plot(thresholds, [getattr(fear, kind)(each) for each in thresholds], color=colour, label=kind)
    trade.set_title("of a threshold", fontsize=9)
    trade.legend(fontsize=7)
    for axes in (reliable, counts, trade):
        axes.set_xlabel("fear", fontsize=8)
        axes.set_xlim(0.0, 1.0)
        axes.tick_params(labelsize=7)
        axes.grid(alpha=0.3)
    figure.tight_layout()
    return figure


def _card(
    config: PlannerConfig,
    manifest: DatasetManifest,
    history: list[Row],
    found: CardResults,
    fear: Calibration,
    ablation: str,
) -> str:
    training, options = config.training, manifest.options
    samples = sum(shard.samples for shard in manifest.shards)
    places = sum(len(shard.layouts) for shard in manifest.shards)
    last = history[-1]
    losses = ", ".join(
        f"{name} {value:.2f}" for name, value in last["held_out" if "held_out" in last else "train"].items()
    )
    weights = ", ".join(f"{name} {getattr(config.loss, name):g}" for name in ("obstacle", "motion", "goal", "fear"))
    return f"""# iplanner: paths from one depth image, learned without labels

An iPlanner-style policy: the same inputs, outputs, training signal and inference rule at a size that trains on a CPU.
It sees one depth image (72 x 128) and the goal, and has no memory but the path that it follows and where it last faced
the goal. It is not given the map.

{found.markdown()}

## Training

- Data: `labgym data --samples {options.samples} --seed {options.seed}`; {samples} samples were there,
  from {places} generated layouts. Their hashes are in `data.json`: a later version may generate others.
- Training: `labgym train iplanner --epochs {training.epochs} --patience {training.patience} --seed {training.seed}`;
  {last["epoch"]} epochs were run.
  All options are in `config.json`.
- Loss: the terms' weights are {weights}; differentiated through the path and the cost map.
- Means over the held-out layouts after the last epoch: {losses}.

Nothing was trained or chosen on the test split.

![Losses by epoch](losses.png)

## Fear

Fear is to be the probability that the planned path, in its first {config.loss.fear_length:g} m, comes to a cost over \
{config.loss.fear_cost:g}.
{_fear(fear)}

![Fear against what paths do](fear.png)

{ablation}## What differs from the published method

{_differences(config)}
"""


def _fear(fear: Calibration) -> str:
    if len(fear.fear) == 0:
        return "No sample was held out to test it on."
    precision, recall = fear.precision(0.5), fear.recall(0.5)
    at_half = (
        "at the threshold of 0.5 that driving has, none is feared: the stop at fear will hardly ever act."
        if precision is None
        else f"at the threshold of 0.5 the fear has precision {precision:.3f} and recall {_rate(recall)}."
    )
    error = fear.error()
    return f"""On the {len(fear.fear)} samples of the held-out layouts {fear.collides.mean():.1%} of the paths do;
{at_half}
Its expected calibration error is {error:.3f}: its probabilities are about right, but differ little from path to path.
It sees the image and the goal, not the path; which of the planner's own paths come too near it can hardly foresee."""


def _ablation(folder: Path) -> str:
    from labgym.cards.iplanner_ablation import RESULTS, RUNS, TITLES, WHOLE

    training = PlannerConfig.load(folder / RUNS / WHOLE / "config.json").training
    return f"""## What its parts are worth

One part is changed at a time, in training or in driving, at a smaller budget than the published weights had:
{training.samples} samples, {training.epochs} epochs.

{ablation_table(folder / RESULTS, TITLES)}

Made by `labgym ablate iplanner --samples {training.samples} --epochs {training.epochs} --every N`, \
with N as in the suite's name.

"""


def _differences(config: PlannerConfig) -> str:
    loss, training = config.loss, config.training
    lines = [
        "Size: the image is 72 x 128, averaged over squares of 2 x 2 (360 x 640 published); the encoder has "
        f"{len(config.network.channels) - 1} residual blocks in place of ResNet-18.",
        "The floor is flat: key points have no height, and the height term is left out.",
        f"AdamW with a rate of {training.rate:g}, times {training.plateau:g} where the held-out loss did not fall, for "
        "fewer epochs (1e-4 and 0.1 published); images are mirrored.",
    ]
    if loss.horizon is not None:
        lines.append(
            f"A path is to end {loss.horizon:g} m along the expert path, at the goal where that is nearer. "
            "The published one is to end at the goal, which behind furniture pulls it against what is in the way."
        )
    if loss.along:
        lines.append(
            "The motion term's even steps are as long as the way to the path's end needs, not as the straight line."
        )
    if loss.fear_cost != PUBLISHED_FEAR:
        lines.append(
            f"Fear is of a cost over {loss.fear_cost:g}, not {PUBLISHED_FEAR:g}, since the cost map is another: see "
            "`LossOptions` for what these costs mean in metres."
        )
    lines.append(
        "Driving: the published rule stops and turns after more than 3 fearful frames while heading at an obstacle; "
        "so does this. Beside it, an episode begins by facing the goal; a path is kept for a while; a goal out of "
        "sight for a metre is looked at; the robot backs off from what holds it up (`PlannerRules`)."
    )
    return "\n".join(f"- {line}" for line in lines)


def _rate(value: float | None) -> str:
    return "-" if value is None else f"{value:.3f}"
