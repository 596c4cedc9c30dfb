"""The published folder of a NavDP-style policy: weights, figures, and a card whose numbers are an evaluation's."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from labgym.cards.iplanner import loss_figure
from labgym.cards.results import CardResults, ablation_table
from labgym.documents import write_bytes, write_text
from labgym.envs.sensors import Camera
from labgym.eval.drawing.pictures import save_picture
from labgym.eval.drawing.plan_drawing import draw_objects, draw_room
from labgym.eval.driving.record import NavigationSummary
from labgym.layouts import Layout, load_published, published
from labgym.navigation import goal_pairs
from labgym.policies.data import DatasetManifest
from labgym.policies.navdp.config import NavDPConfig
from labgym.scenes import RayScene

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from labgym.policies.navdp.policy import Drawn, NavDPPolicy

FILES = ("config.json", "weights.safetensors", "history.jsonl")
LEARNED = 0.5
"""Success rate below which a policy says little of what its parts are worth."""

SHOWN = 10
"""Validation layouts at whose first drive trajectories are drawn."""

PANEL_INCHES = 2.0

Pose = tuple[float, float, float]


def write_navdp_card(run: Path, data: Path, results: Path, out: Path, ablation: Path | None = None) -> Path:
    """Publish the weights of a training run with a card, and return the card's path.

    Args:
        run: folder of `labgym train navdp`.
        data: folder of the dataset that it was trained on.
        results: folder of `labgym eval` with these weights, complete, on a suite.
        out: folder for weights, configuration, losses, the dataset's manifest, figures and `CARD.md`.
        ablation: folder of `labgym ablate navdp`; None leaves its table out.

    Raises:
        DocumentError: a file is missing or broken.
        OptionError: an evaluation is not complete, or of another policy.
    """
    from labgym.policies.navdp.policy import NavDPPolicy

    found = CardResults.read(results, "navdp")
    history = [json.loads(line) for line in (run / "history.jsonl").read_text(encoding="utf-8").splitlines()]
    config, manifest = NavDPConfig.load(run / "config.json"), DatasetManifest.load(data / "manifest.json")
    parts = "" if ablation is None else _ablation(ablation)
    names = published("val")
    layouts = [load_published("val", names[k * len(names) // SHOWN]) for k in range(SHOWN)]
    figure = trajectories_figure(NavDPPolicy(run), layouts)
    if run != out:
        for name in FILES:
            write_bytes(out / name, (run / name).read_bytes())
    manifest.save(out / "data.json")
    save_picture(loss_figure(history), out / "losses.png")
    save_picture(figure, out / "trajectories.png")
    found.draw(out)
    return write_text(out / "CARD.md", _card(config, manifest, history, found, parts))


def trajectories_figure(policy: NavDPPolicy, layouts: Sequence[Layout]) -> Figure:
    """Draw what the policy would draw at the start of each layout's first drive, facing the goal, over the map."""
    from matplotlib.figure import Figure

    columns = min(5, len(layouts))
    lines = math.ceil(len(layouts) / columns)
    figure = Figure(figsize=(columns * PANEL_INCHES, lines * (PANEL_INCHES + 0.3)), facecolor="#ffffff")
    grid = figure.subplots(lines, columns, squeeze=False)
    for axes in grid.flat:
        axes.set_axis_off()
    for axes, layout in zip(grid.flat, layouts, strict=False):
        pose, goal, drawn = _drawn_at_start(policy, layout)
        room = layout.room
        axes.set_xlim(-room.wall_thickness, room.width + room.wall_thickness)
        axes.set_ylim(-room.wall_thickness, room.depth + room.wall_thickness)
        axes.set_aspect("equal")
        draw_room(axes, room)
        draw_objects(axes, layout, 72.0 * PANEL_INCHES / max(room.width, room.depth))
        order = np.argsort(drawn.values)
        for k in order:
            path = _in_room(np.vstack([np.zeros((1, 2)), drawn.trajectories[k]]), pose)
            best = k == order[-1]
            axes.plot(*path.T, color="#0a7d32" if best else "#d55e00", linewidth=1.6 if best else 0.7, zorder=70 + best)
        axes.plot(*goal, "*", color="#23282d", markersize=7, zorder=80)
        axes.set_title(f"{layout.id}\n{drawn.values[order[0]]:.1f} to {drawn.values[order[-1]]:.1f}", fontsize=7)
    figure.tight_layout(pad=0.4)
    return figure


def _drawn_at_start(policy: NavDPPolicy, layout: Layout) -> tuple[Pose, tuple[float, float], Drawn]:
    pair = goal_pairs(layout)[0]
    x, y = pair.start[:2]
    goal = pair.goal[:2]
    pose = x, y, math.atan2(goal[1] - y, goal[0] - x)
    rgb, depth = Camera().colour_and_depth(RayScene(layout, "visual"), pose)
    distance = math.dist(pose[:2], goal)
    return pose, goal, policy.drawn_from(rgb, depth, (distance, 0.0), seed=0)


def _in_room(points: np.ndarray[Any, np.dtype[np.float64]], pose: Pose) -> np.ndarray[Any, np.dtype[np.float64]]:
    cosine, sine = math.cos(pose[2]), math.sin(pose[2])
    x, y = points.T
    return np.column_stack([pose[0] + cosine * x - sine * y, pose[1] + sine * x + cosine * y])


def _card(
    config: NavDPConfig, manifest: DatasetManifest, history: list[dict[str, Any]], found: CardResults, ablation: str
) -> str:
    training, network, loss, options = config.training, config.network, config.loss, manifest.options
    samples = sum(shard.samples for shard in manifest.shards)
    places = sum(len(shard.layouts) for shard in manifest.shards)
    last = history[-1]
    losses = ", ".join(
        f"{name} {value:.3f}" for name, value in last["held_out" if "held_out" in last else "train"].items()
    )
    return f"""# navdp: trajectories by diffusion, chosen by a critic

A NavDP-style policy: the same kind of inputs and outputs, training signal and inference rule at a size that trains on
a CPU. It sees colour and depth, now and up to {(network.memory - 1) * 0.5:g} s ago ({network.memory} frames of
36 x 64), and the goal; it is not given the map. It draws 12 trajectories of {network.points} steps in
{config.diffusion.steps} denoising steps, follows the one that its critic values most, and turns in place where none is
valued enough.

{found.markdown()}

## What it draws

Facing the goal (star) at the start of a drive in {SHOWN} layouts of the validation split: green is the trajectory that
the critic chose, above the map the least and the highest of its values. Behind furniture the goal is out of sight.

![Ten times twelve trajectories over their maps](trajectories.png)

## Training

- Data: `labgym data --samples {options.samples} --seed {options.seed}`; {samples} samples were there, from {places}
  generated layouts. Their hashes are in `data.json`: a later version may generate others.
- Training: `labgym train navdp --epochs {training.epochs} --seed {training.seed}`; {last["epoch"]} epochs were run.
  All options are in `config.json`.
- Loss: {loss.noise:g} times the noise's mean squared error (half of the samples with the goal, half without) plus
  {loss.critic:g} times the critic's, on the expert's path and on paths turned by up to
  {math.degrees(loss.rotation):.0f} degrees. What a path is worth, the true map says: {loss.unsafe:g} times the
  share of its points nearer than {loss.margin:g} m to an obstacle, plus {loss.opening:g} times the metres that its
  end is farther from obstacles than its start.
- Means over the held-out layouts after the last epoch: {losses}.

Nothing was trained or chosen on the test split; the rules of driving were chosen on the validation split.

![Losses by epoch](losses.png)

{ablation}## What differs from the published method

- Size: {network.memory} frames in place of 8, a convolutional encoder of 36 x 64 images in place of pretrained
  vision transformers, a decoder of {network.layers} layers and width {network.width} in place of 16 and 384,
  {network.queries} queries in place of 128.
- Past frames are seen in colour and depth, not in colour alone.
- Goals behind the robot are not clipped away: its coordinates are clipped to 10 m in all directions.
- Trajectories end {loss.horizon:g} m along the expert's path. The goal reaches the network as distance and bearing.
- Each sample is used with or without its goal, and for its own or for the turned path, drawn anew in every pass;
  published are both at once.
- Driving: an episode begins with a turn to the goal; a trajectory is followed for 0.5 m (1.2 m after a turn) before
  others are drawn; the robot backs off from what stops it unseen.
"""


def _ablation(folder: Path) -> str:
    from labgym.cards.iplanner_ablation import RESULTS, RUNS
    from labgym.cards.navdp_ablation import SMALL, TITLES

    training = NavDPConfig.load(folder / RUNS / SMALL / "config.json").training
    small = NavigationSummary.load(folder / RESULTS / SMALL / "summary.json")
    success = small.metrics["success"].value or 0.0
    caution = (
        ""
        if success >= LEARNED
        else (
            f"\nTrained on so little the policy has hardly learned to drive (SR {success:.3f}): those rows say little\n"
            "of what memory and turned paths are worth to one that has.\n"
        )
    )
    return f"""## What its parts are worth

One part is changed at a time: in driving, with the published weights; or in training, on less than the published
weights had ({training.samples} samples, {training.epochs} epochs), to be compared with the whole trained on as little.

{ablation_table(folder / RESULTS, TITLES)}
{caution}
Made by `labgym ablate navdp --samples {training.samples} --epochs {training.epochs}`, in the layouts of the suite that
the table names.

"""
