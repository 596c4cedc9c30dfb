"""The published folder of a PPO policy: weights, options, figures, and a card with the numbers of an evaluation."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from labgym.cards.results import CardResults
from labgym.documents import write_bytes, write_text
from labgym.errors import OptionError
from labgym.eval.drawing.pictures import save_picture
from labgym.policies.ppo.options import TrainingOptions
from labgym.policies.ppo.progress import Progress

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

WEIGHTS = "weights.safetensors"

SEES = {
    "lidar": """Drives by the 180 ranges of the lidar, the goal, the velocity and where the robot was 0.5 to 16 s ago \
(by its odometry).
The network is three circular convolutions over the ranges and two layers.""",
    "depth": """Drives by the picture of the depth camera, taken down to 18 x 32 by the nearest of each square, the \
goal, the velocity
and where the robot was 0.5 to 16 s ago (by its odometry). The camera sees 68 degrees: what it has shown since the drive
began is kept in a map of occupied cells, and the network is shown how far the nearest of them is in each of 180
directions. The network is two convolutions over the picture, three circular ones over these ranges, and two layers.""",
}


def write_ppo_card(run: Path, results: Path, out: Path, without_warm_start: Path | None = None) -> Path:
    """Publish the best weights of a training run with a card, and return the card's path.

    Args:
        run: folder of `labgym train ppo`.
        results: folder of `labgym eval` with these weights, complete, on a suite.
        out: folder for weights, `config.json`, figures and `CARD.md`.
        without_warm_start: folder of a run with the same sensor and `--no-warm-start`, to be set beside it.

    Raises:
        DocumentError: a file is missing or broken.
        OptionError: the evaluation is not complete, or of another policy, or the other run is not of its kind.
    """
    from labgym.policies.ppo.policy import DRIVERS

    options, progress = TrainingOptions.load(run / "options.json"), Progress.load(run / "progress.json")
    found = CardResults.read(results, DRIVERS[options.observation].name)
    cold = None if without_warm_start is None else _cold(without_warm_start, options)
    if run != out:
        write_bytes(out / WEIGHTS, (run / "best" / WEIGHTS).read_bytes())
    options.save(out / "config.json")
    progress.save(out / "training.json")
    if cold is not None:
        cold.save(out / "training-without-warm-start.json")
    save_picture(learning_curve(options, progress, cold), out / "learning.png")
    found.draw(out)
    return write_text(out / "CARD.md", _card(options, progress, cold, found))


def learning_curve(options: TrainingOptions, progress: Progress, cold: Progress | None = None) -> Figure:
    """Draw the success rate against the control steps, the warm start's included.

    Shown are that of training episodes, which are noisy on purpose, and that on validation; in grey those of a run
    without the warm start.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.0, 3.2), facecolor="#ffffff")
    warm, ppo = figure.subplots(1, 2, width_ratios=[1, 2])
    rounds = _records(progress, "warm start")
    warm.plot([r["round"] + 1 for r in rounds], [r["loss"] for r in rounds], "o-", color="#3d444b")
    warm.set_title("warm start: error of the copied action", fontsize=9)
    warm.set_xlabel("round")
    warm.set_ylim(bottom=0.0)
    _draw_success(ppo, progress, _taught(options), ("#2a6fb5", "#b5482a"), "")
    if cold is not None:
        _draw_success(ppo, cold, 0, ("#c4c9cf", "#7b838c"), ", no warm start")
    ppo.set_title("success rate", fontsize=9)
    ppo.set_xlabel("control steps, the warm start's included")
    ppo.set_ylim(-0.02, 1.02)
    ppo.legend(fontsize=7, loc="lower right")
    for axes in (warm, ppo):
        axes.grid(alpha=0.3)
        axes.tick_params(labelsize=8)
    figure.tight_layout()
    return figure


def _draw_success(axes: Axes, progress: Progress, before: int, colours: tuple[str, str], kind: str) -> None:
    curves = (("leg", "-", "training episodes"), ("validation", "o-", "validation, every goal pair"))
    for (record, look, label), colour in zip(curves, colours, strict=True):
        found = [each for each in _records(progress, record) if each["success"] is not None]
        steps, success = [before + each["steps"] for each in found], [each["success"] for each in found]
        axes.plot(steps, success, look, color=colour, label=label + kind, markersize=4)


def _cold(folder: Path, options: TrainingOptions) -> Progress:
    other = TrainingOptions.load(folder / "options.json")
    if other.cloning_rounds or other.observation != options.observation:
        raise OptionError(
            f"{folder} holds a run on {other.observation} with {other.cloning_rounds} rounds of warm start; "
            f"expected one on {options.observation} with none: labgym train ppo --no-warm-start"
        )
    return Progress.load(folder / "progress.json")


def _taught(options: TrainingOptions) -> int:
    return options.cloning_rounds * options.cloning_steps


def _records(progress: Progress, kind: str) -> list[Mapping[str, Any]]:
    return [record for record in progress.records if record["kind"] == kind]


def _card(options: TrainingOptions, progress: Progress, cold: Progress | None, found: CardResults) -> str:
    taken, best = _taken(progress), _best(progress)
    steps = f"""{1 + bool(options.cloning_rounds)}. PPO (stable-baselines3), for {taken} control steps, with the \
environment's reward, collisions costing
   twice as much. The weights are those that did best on the validation split, after {best["steps"]} steps of PPO:
   success {_rate(progress.best)}. The test split was not used."""
    if options.cloning_rounds:
        steps = f"{_warm_start(options, progress)}\n{steps}"
    beside = "" if cold is None else f"\n{_without_warm_start(cold)}\n"
    return f"""# {found.evaluation.summary.policy}: {options.observation}, by proximal policy optimisation

{SEES[options.observation]}
It is not given the map. The action is the network's mean.

{found.markdown()}

## Training

`labgym train ppo --observation {options.observation} --steps {options.steps} --seed {options.seed}\
{"" if options.cloning_rounds else " --no-warm-start"}`:
{options.layouts} generated layouts of the training seeds; drives between the places of each layout and between random
points of its floor.

{steps}

![Learning curves](learning.png)
{beside}
Limits: it was trained in the rooms and by the generator that the suites are made with, on sensors and odometry without
noise and among things that do not move; how it does elsewhere was not measured.

All options are in `config.json`, the records of the run in `training.json`. The same command goes on from the last
checkpoint of `runs/ppo/{options.observation}`, and with more `--steps` trains for longer.
"""


def _warm_start(options: TrainingOptions, progress: Progress) -> str:
    (start, *_) = _records(progress, "validation")
    return f"""1. Warm start: the network copies a privileged expert (shortest paths on the true map and the tracking \
controller) on
   the states that it comes through itself (DAgger), for {options.cloning_rounds} rounds of {options.cloning_steps} \
control steps, {_taught(options)} in all.
   Before any PPO, success on validation was {_rate(start["success"])}."""


def _without_warm_start(cold: Progress) -> str:
    judged = ", ".join(f"{_rate(each['success'])} after {each['steps']}" for each in _records(cold, "validation"))
    return f"""### Without the warm start

The same training with `--no-warm-start`, for {_taken(cold)} control steps of PPO in all: success on validation was
{judged} steps. Nothing else was changed, nor tuned for it."""


def _taken(progress: Progress) -> int:
    legs = _records(progress, "leg")
    return int(legs[-1]["steps"]) if legs else 0


def _best(progress: Progress) -> Mapping[str, Any]:
    return [each for each in _records(progress, "validation") if each["success"] == progress.best][-1]


def _rate(value: float | None) -> str:
    return "not measured" if value is None else f"{value:.3f}"
