"""The model card of the iPlanner-style policy, and the published folder around it."""

from __future__ import annotations

from pathlib import Path

from labgym.cards.ablation import IPLANNER, RESULTS, RUNS, WHOLE
from labgym.cards.labnav import headed
from labgym.cards.planner_run import PlannerRun
from labgym.cards.results import CardResults, ablation_table
from labgym.documents import write_text
from labgym.policies.iplanner.config import IPlannerConfig


def write_iplanner_card(run: Path, data: Path, results: Path, out: Path, ablation: Path | None = None) -> Path:
    """Publish the weights of a training run with a model card and return the card's path.

    Args:
        run: folder of `labgym train iplanner`.
        data: folder of the dataset that it was trained on.
        results: folder of a complete `labgym eval` with these weights.
        out: folder for weights, configuration, losses, the dataset's manifest, figures and `CARD.md`.
        ablation: folder of `labgym ablate iplanner`; None leaves its table out.

    Raises:
        DocumentError: a file is missing or broken.
        OptionError: an evaluation is not complete, or of another policy.
    """
    evaluated = CardResults.read(results, "iplanner")
    published = PlannerRun.read(run, IPlannerConfig, data / "manifest.json")
    parts = "" if ablation is None else ablation_section(ablation)
    published.publish(out)
    evaluated.draw(out)
    sections = [
        introduction(published.config),
        evaluated.markdown(),
        training_section(published),
        parts,
        differences_section(published.config),
    ]
    return write_text(out / "CARD.md", headed("\n\n".join(section for section in sections if section) + "\n"))


LABELS = {
    "cost-to-go": "Its targets do not come\nfrom an expert either: a path should shorten the way to the goal.",
    "expert": "Its target points come\nfrom an expert, because each lies on the expert's path.",
    "goal": "Its target is the goal.",
}
"""What the card says about the target of the loss."""


def introduction(config: IPlannerConfig) -> str:
    """Return the card's introduction."""
    labels = LABELS[config.loss.target]
    return f"""# iplanner: paths from one depth image

A re-implementation of iPlanner at a size that trains on a CPU, with the same kind of inputs, outputs and training
signal. It sees one depth image (72 x 128) and the goal. Its only memory is the path that it follows and where it last
faced the goal. It does not see the map.

The network is trained without path labels: its loss is the cost of its path on the true map. {labels}"""


def training_section(run: PlannerRun[IPlannerConfig]) -> str:
    """Return the card's section on the training."""
    training, loss = run.config.training, run.config.loss
    weights = ", ".join(f"{name} {getattr(loss, name):g}" for name in ("obstacle", "motion", "goal"))
    return f"""## Training

{run.data_line}
- Training: `labgym train iplanner --epochs {training.epochs} --patience {training.patience} --seed {training.seed}`, \
{run.history[-1]["epoch"]} epochs. All options are in `config.json`.
- Loss: weights {weights}; differentiated through the path and the cost map.
{run.losses_line}{run.notes}

Nothing was trained or chosen on the test split.

![Losses by epoch](losses.png)"""


def ablation_section(folder: Path) -> str:
    """Return the card's section on the ablation study in a folder."""
    training = IPlannerConfig.load(folder / RUNS / WHOLE / "config.json").training
    command = f"`labgym ablate iplanner --samples {training.samples} --epochs {training.epochs} --every N`"
    return f"""## Ablation study

One part is changed at a time. All variants, the unchanged one included, were trained on less than the published
weights: {training.samples} samples, {training.epochs} epochs.

{ablation_table(folder / RESULTS, IPLANNER.titles)}

Command: {command}, with N as in the suite's name."""


def differences_section(config: IPlannerConfig) -> str:
    """Return the card's section on the differences from the published method."""
    loss, training = config.loss, config.training
    lines = [
        "Size: the image is 72 x 128, averaged over squares of 2 x 2 pixels (published: 360 x 640). The encoder has "
        f"{len(config.network.channels) - 1} residual blocks instead of ResNet-18.",
        "Flat floor: key points have no height, and the height term is left out.",
        "No fear: the network does not predict collisions, and the robot does not stop for them.",
        f"Optimizer: AdamW with a rate of {training.rate:g} and a factor of {training.plateau:g} when the held-out "
        "loss stops falling, for fewer epochs (published: 1e-4 and 0.1). Images are mirrored.",
    ]
    published = "The published target is the goal, which pulls paths against furniture that hides it."
    if loss.target == "cost-to-go":
        lines.append(
            f"Targets: a path should end where the cost-to-go has fallen by {loss.horizon:g} m, or to 0 if the goal is "
            "nearer. It is the length of the shortest path of the robot's disc to the goal on the true map. "
            f"{published}"
        )
    elif loss.target == "expert":
        lines.append(f"Targets: {loss.horizon:g} m along the expert's path, or the goal if that is nearer. {published}")
    if loss.target != "goal" and loss.along:
        way = "fall of the cost-to-go" if loss.target == "cost-to-go" else "length of the expert's path to the target"
        lines.append(f"Motion term: even steps divide the {way}, not the straight distance.")
    lines.append(
        "Driving: an episode begins with a turn to the goal. A path is followed for a while. The robot turns in place "
        "when it is stuck, looks at a goal that was out of sight for a meter, and backs off from unseen obstacles "
        "(`IPlannerOptions`)."
    )
    return "\n".join(["## Differences from the published method", "", *(f"- {line}" for line in lines)])
