"""The published folder of a PPO policy: weights, options, figures, and a card with the numbers of an evaluation."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from labgym.documents import write_bytes, write_text
from labgym.eval.cards import CardResults
from labgym.eval.pictures import save_picture
from labgym.policies.ppo.options import TrainingOptions
from labgym.policies.ppo.progress import Progress

if TYPE_CHECKING:
    from matplotlib.figure import Figure

WEIGHTS = "weights.safetensors"


def write_ppo_card(run: Path, results: Path, out: Path) -> Path:
    """Publish the best weights of a training run with a card, and return the card's path.

    Args:
        run: folder of `labgym train ppo`.
        results: folder of `labgym eval` with these weights, complete, on a suite.
        out: folder for weights, `config.json`, figures and `CARD.md`.

    Raises:
        DocumentError: a file is missing or broken.
        OptionError: the evaluation is not complete, or of another policy.
    """
    options, progress = TrainingOptions.load(run / "options.json"), Progress.load(run / "progress.json")
    found = CardResults.read(results, "ppo")
    if run != out:
        write_bytes(out / WEIGHTS, (run / "best" / WEIGHTS).read_bytes())
    options.save(out / "config.json")
    progress.save(out / "training.json")
    save_picture(learning_curve(progress), out / "learning.png")
    found.draw(out)
    return write_text(out / "CARD.md", _card(options, progress, found))


def learning_curve(progress: Progress) -> Figure:
    """Draw the success rate against PPO's steps: of training episodes, noisy on purpose, and on validation."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.0, 3.2), facecolor="#ffffff")
    warm, ppo = figure.subplots(1, 2, width_ratios=[1, 2])
    rounds = _records(progress, "warm start")
    warm.plot([r["round"] + 1 for r in rounds], [r["loss"] for r in rounds], "o-", color="#3d444b")
    warm.set_title("warm start: error of the copied action", fontsize=9)
    warm.set_xlabel("round")
    warm.set_ylim(bottom=0.0)
    for kind, look, label in (("leg", "-", "training episodes"), ("validation", "o-", "validation, every goal pair")):
        found = [record for record in _records(progress, kind) if record["success"] is not None]
        ppo.plot([r["steps"] for r in found], [r["success"] for r in found], look, label=label, markersize=4)
    ppo.set_title("PPO: success rate", fontsize=9)
    ppo.set_xlabel("control steps")
    ppo.legend(fontsize=8, loc="lower right")
    for axes in (warm, ppo):
        axes.grid(alpha=0.3)
        axes.tick_params(labelsize=8)
    figure.tight_layout()
    return figure


def _records(progress: Progress, kind: str) -> list[Mapping[str, Any]]:
    return [record for record in progress.records if record["kind"] == kind]


def _card(options: TrainingOptions, progress: Progress, found: CardResults) -> str:
    legs = _records(progress, "leg")
    taken = legs[-1]["steps"] if legs else 0
    judged = _records(progress, "validation")
    start, best = judged[0], [record for record in judged if record["success"] == progress.best][-1]
    taught = options.cloning_rounds * options.cloning_steps
    return f"""# ppo: lidar, by proximal policy optimisation

Drives by the 180 ranges of the lidar, the goal, the velocity and where the robot was 0.5 to 16 s ago (by its odometry).
It is not given the map. The network is three circular convolutions and two layers; the action is its mean.

{found.markdown()}

## Training

`labgym train ppo --observation {options.observation} --steps {options.steps} --seed {options.seed}`:
{options.layouts} generated layouts of the training seeds; drives between the places of each layout and between random
points of its floor.

1. Warm start: the network copies a privileged expert (shortest paths on the true map and the tracking controller) on
   the states that it comes through itself (DAgger), for {options.cloning_rounds} rounds of {options.cloning_steps}
   control steps, {taught} in all. Most of what it can do it has from this: before any PPO, success on validation was
   {_rate(start["success"])}.
2. PPO (stable-baselines3) from there, for {taken} control steps, with the environment's reward, collisions costing
   twice as much. The weights are those that did best on the validation split, after {best["steps"]} steps of PPO:
   success {_rate(progress.best)}. The test split was not used.

![Learning curves](learning.png)

Limits: it was trained in the rooms and by the generator that the suites are made with, on sensors without noise and
among things that do not move; how it does elsewhere was not measured. Nor was PPO without the warm start.

All options are in `config.json`, the records of the run in `training.json`. The same command goes on from the last
checkpoint of `runs/ppo/{options.observation}`, and with more `--steps` trains for longer.
"""


def _rate(value: float | None) -> str:
    return "not measured" if value is None else f"{value:.3f}"
