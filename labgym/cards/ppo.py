"""The model card of a PPO policy, and the published folder around it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from labgym.cards.labnav import headed
from labgym.cards.results import CardResults
from labgym.documents import write_bytes, write_text
from labgym.errors import OptionError
from labgym.eval.drawing.pictures import save_picture
from labgym.policies.ppo.options import PPOOptions, TrainingProgress

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

WEIGHTS = "weights.safetensors"

INPUTS = {
    "lidar": """Inputs: the 180 ranges of the lidar, the goal, the velocity, and the robot's positions 0.5 to 16 s ago
by odometry. Network: three circular convolutions over the ranges and two layers.""",
    "depth": """Inputs: the depth image, reduced to 18 x 32 by the nearest depth of each square, the goal, the velocity,
and the robot's positions 0.5 to 16 s ago by odometry. The camera sees 68 degrees, so obstacles seen since the start of
the drive are remembered in a map of occupied cells; the network also reads the distance to the nearest of them in each
of 180 directions. Network: two convolutions over the image, three circular ones over the distances, and two layers.""",
}


def write_ppo_card(run: Path, results: Path, out: Path, without_warm_start: Path | None = None) -> Path:
    """Publish the best weights of a training run with a model card and return the card's path.

    Args:
        run: folder of `labgym train ppo-imitation`.
        results: folder of a complete `labgym eval` with these weights.
        out: folder for weights, `config.json`, figures and `CARD.md`.
        without_warm_start: folder of a run with the same sensor and `--no-warm-start`, for comparison.

    Raises:
        DocumentError: a file is missing or broken.
        OptionError: the evaluation is not complete or of another policy, or the other run has a warm start or another
            sensor.
    """
    from labgym.policies.ppo.policy import DRIVERS

    options, progress = PPOOptions.load(run / "options.json"), TrainingProgress.load(run / "progress.json")
    evaluated = CardResults.read(results, DRIVERS[options.observation].name)
    cold = None if without_warm_start is None else _cold(without_warm_start, options)
    if run != out:
        write_bytes(out / WEIGHTS, (run / "best" / WEIGHTS).read_bytes())
    options.save(out / "config.json")
    progress.save(out / "training.json")
    if cold is not None:
        cold.save(out / "training-without-warm-start.json")
    save_picture(learning_curve(options, progress, cold), out / "learning.png")
    evaluated.draw(out)
    return write_text(out / "CARD.md", headed(_card(options, progress, cold, evaluated)))


def learning_curve(options: PPOOptions, progress: TrainingProgress, cold: TrainingProgress | None = None) -> Figure:
    """Draw the success rate against the control steps, those of the warm start included.

    Colored: training episodes, whose actions are noisy, and validation. Gray: the same of a run without warm start.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.0, 3.2), facecolor="#ffffff")
    warm, ppo = figure.subplots(1, 2, width_ratios=[1, 2])
    rounds = _records(progress, "warm start")
    warm.plot([r["round"] + 1 for r in rounds], [r["loss"] for r in rounds], "o-", color="#3d444b")
    warm.set_title("warm start: error of the imitated action", fontsize=9)
    warm.set_xlabel("round")
    warm.set_ylim(bottom=0.0)
    _draw_success(ppo, progress, _imitated(options), ("#2a6fb5", "#b5482a"), "")
    if cold is not None:
        _draw_success(ppo, cold, 0, ("#c4c9cf", "#7b838c"), ", no warm start")
    ppo.set_title("success rate", fontsize=9)
    ppo.set_xlabel("control steps, warm start included")
    ppo.set_ylim(-0.02, 1.02)
    ppo.legend(fontsize=7, loc="lower right")
    for axes in (warm, ppo):
        axes.grid(alpha=0.3)
        axes.tick_params(labelsize=8)
    figure.tight_layout()
    return figure


def _draw_success(axes: Axes, progress: TrainingProgress, before: int, colors: tuple[str, str], kind: str) -> None:
    curves = (("leg", "-", "training episodes"), ("validation", "o-", "validation, every goal pair"))
    for (kind_of_record, look, label), color in zip(curves, colors, strict=True):
        records = [each for each in _records(progress, kind_of_record) if each["success"] is not None]
        steps, success = [before + each["steps"] for each in records], [each["success"] for each in records]
        axes.plot(steps, success, look, color=color, label=label + kind, markersize=4)


def _cold(folder: Path, options: PPOOptions) -> TrainingProgress:
    other = PPOOptions.load(folder / "options.json")
    if other.cloning_rounds or other.observation != options.observation:
        raise OptionError(
            f"{folder} holds a run on {other.observation} with {other.cloning_rounds} rounds of warm start; "
            f"expected {options.observation} and 0 rounds: labgym train ppo-imitation --no-warm-start"
        )
    return TrainingProgress.load(folder / "progress.json")


def _imitated(options: PPOOptions) -> int:
    return options.cloning_rounds * options.cloning_steps


def _records(progress: TrainingProgress, kind: str) -> list[Mapping[str, Any]]:
    return [record for record in progress.records if record["kind"] == kind]


def _card(
    options: PPOOptions, progress: TrainingProgress, cold: TrainingProgress | None, evaluated: CardResults
) -> str:
    return f"""# {evaluated.evaluation.summary.policy}: {options.observation}, by proximal policy optimization

{INPUTS[options.observation]}
The action is the network's mean. The policy does not see the map.

{evaluated.markdown()}

{training_section(options, progress, cold)}
"""


def training_section(options: PPOOptions, progress: TrainingProgress, cold: TrainingProgress | None) -> str:
    """Return the card's section on the training.

    Args:
        options, progress: options and progress of the run.
        cold: progress of a run without warm start; None leaves the comparison out.
    """
    best = _best(progress)
    steps = f"""{1 + bool(options.cloning_rounds)}. PPO (stable-baselines3) for {_taken(progress)} control steps, with \
the environment's reward; collisions cost twice as
   much. The published weights are the best on the validation split, after {best["steps"]} steps of PPO: success \
{_rate(progress.best)}.
   The test split was not used."""
    if options.cloning_rounds:
        steps = f"{_warm_start(options, progress)}\n{steps}"
    comparison = "" if cold is None else f"\n{_without_warm_start(cold)}\n"
    return f"""## Training

`labgym train ppo-imitation --observation {options.observation} --steps {options.steps} --seed {options.seed}\
{"" if options.cloning_rounds else " --no-warm-start"}`,
in {options.layouts} generated layouts of the training seeds, on drives between the places of each layout and between \
random points of its floor.

{steps}

![Learning curves](learning.png)
{comparison}
Limits: training and evaluation use the same room generator, noise-free sensors and odometry, and static objects.
Other conditions were not measured.

All options are in `config.json`, the records of the run in `training.json`. The same command resumes from the last
checkpoint in `runs/ppo/{options.observation}`; a larger `--steps` trains for longer."""


def _warm_start(options: PPOOptions, progress: TrainingProgress) -> str:
    (start, *_) = _records(progress, "validation")
    return f"""1. Warm start: the network imitates a privileged expert (shortest paths on the true map and the path \
tracker) on the
   states that it visits itself (DAgger), in {options.cloning_rounds} rounds of {options.cloning_steps} control steps, \
{_imitated(options)} in all. Success on
   validation before PPO: {_rate(start["success"])}."""


def _without_warm_start(cold: TrainingProgress) -> str:
    scores = ", ".join(f"{_rate(each['success'])} after {each['steps']}" for each in _records(cold, "validation"))
    return f"""### Without warm start

The same training with `--no-warm-start`, for {_taken(cold)} control steps of PPO. Success on validation:
{scores} steps. Nothing else was changed or tuned."""


def _taken(progress: TrainingProgress) -> int:
    legs = _records(progress, "leg")
    return int(legs[-1]["steps"]) if legs else 0


def _best(progress: TrainingProgress) -> Mapping[str, Any]:
    return [each for each in _records(progress, "validation") if each["success"] == progress.best][-1]


def _rate(value: float | None) -> str:
    return "not measured" if value is None else f"{value:.3f}"
