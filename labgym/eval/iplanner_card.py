"""The published folder of an iPlanner-style policy: weights, figures, and a card whose numbers are an evaluation's."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

from labgym.documents import write_bytes, write_text
from labgym.eval.cards import CardResults
from labgym.eval.pictures import save_picture
from labgym.policies.data import DatasetManifest
from labgym.policies.iplanner.config import PlannerConfig

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FILES = ("config.json", "weights.safetensors", "history.jsonl")

Row = dict[str, Any]


def write_iplanner_card(run: Path, data: Path, results: Path, out: Path) -> Path:
    """Publish the weights of a training run with a card, and return the card's path.

    Args:
        run: folder of `labgym train iplanner`.
        data: folder of the dataset that it was trained on.
        results: folder of `labgym eval` with these weights, complete, on a suite.
        out: folder for weights, configuration, losses, the dataset's manifest, figures and `CARD.md`.

    Raises:
        DocumentError: a file is missing or broken.
        OptionError: the evaluation is not complete, or of another policy.
    """
    found = CardResults.read(results, "iplanner")
    history = [json.loads(line) for line in (run / "history.jsonl").read_text(encoding="utf-8").splitlines()]
    if run != out:
        for name in FILES:
            write_bytes(out / name, (run / name).read_bytes())
    save_picture(loss_figure(history), out / "losses.png")
    found.draw(out)
    config, manifest = PlannerConfig.load(run / "config.json"), DatasetManifest.load(data / "manifest.json")
    manifest.save(out / "data.json")
    return write_text(out / "CARD.md", _card(config, manifest, history, found))


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


def _card(config: PlannerConfig, manifest: DatasetManifest, history: list[Row], found: CardResults) -> str:
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
It sees one depth image (72 x 128) and the goal, and has no memory but the path that it follows. It is not given the
map.

{found.markdown()}

## Training

- Data: `labgym data --samples {options.samples} --seed {options.seed}`; the first {samples} samples were there,
  from {places} generated layouts. Their hashes are in `data.json`: a later version may generate others.
- Training: `labgym train iplanner --epochs {training.epochs} --seed {training.seed}`; {last["epoch"]} epochs were run.
  All options are in `config.json`.
- Loss: the terms' weights are {weights}; differentiated through the path and the cost map.
  {_ending(config.loss.horizon)}
- Means over the held-out layouts after the last epoch: {losses}.

Nothing was trained or chosen on the test split.

![Losses by epoch](losses.png)
"""


def _ending(horizon: float | None) -> str:
    if horizon is None:
        return "A path is to end at the goal, as published."
    return (
        f"Unlike the published rule, a path is to end {horizon:g} m along the expert path, at the goal where that is\n"
        "  nearer: behind furniture the goal would pull it against what is in the way."
    )
