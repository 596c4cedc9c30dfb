"""The model card of the NavDP-style policy, and the published folder around it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from labgym.cards.ablation import NAVDP, RESULTS
from labgym.cards.labnav import headed
from labgym.cards.planner_run import PlannerRun
from labgym.cards.results import CardResults, ablation_table
from labgym.documents import write_text
from labgym.envs.sensors import Camera
from labgym.eval.drawing.pictures import save_picture
from labgym.eval.drawing.plan_drawing import draw_objects, draw_plan, plan_size
from labgym.eval.reports.route_figures import panel_grid
from labgym.geometry import to_world
from labgym.layouts import Layout, load_published, published
from labgym.navigation import Pose, goal_pairs
from labgym.policies.navdp.config import NavDPConfig
from labgym.scenes import RayScene

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from labgym.policies.navdp.diffusion import DrawnTrajectories
    from labgym.policies.navdp.policy import NavDPPolicy

LAYOUTS = 10
"""Number of validation layouts in the figure of trajectories."""

PANEL_INCHES = 2.0


def write_navdp_card(run: Path, data: Path, results: Path, out: Path, ablation: Path | None = None) -> Path:
    """Publish the weights of a training run with a model card and return the card's path.

    Args:
        run: folder of `labgym train navdp`.
        data: folder of the dataset that it was trained on.
        results: folder of a complete `labgym eval` with these weights.
        out: folder for weights, configuration, losses, the dataset's manifest, figures and `CARD.md`.
        ablation: folder of `labgym ablate navdp`; None leaves its table out.

    Raises:
        DocumentError: a file is missing or broken.
        OptionError: an evaluation is not complete, or of another policy.
    """
    from labgym.policies.navdp.policy import NavDPPolicy

    evaluated = CardResults.read(results, "navdp")
    trained = PlannerRun.read(run, NavDPConfig, data / "manifest.json")
    parts = "" if ablation is None else ablation_section(ablation)
    names = published("val")
    layouts = [load_published("val", names[k * len(names) // LAYOUTS]) for k in range(LAYOUTS)]
    figure = trajectories_figure(NavDPPolicy(run), layouts)
    trained.publish(out)
    save_picture(figure, out / "trajectories.png")
    evaluated.draw(out)
    sections = [
        introduction(trained.config),
        evaluated.markdown(),
        TRAJECTORIES,
        training_section(trained),
        parts,
        differences_section(trained.config),
    ]
    return write_text(out / "CARD.md", headed("\n\n".join(section for section in sections if section) + "\n"))


def trajectories_figure(policy: NavDPPolicy, layouts: Sequence[Layout]) -> Figure:
    """Draw the trajectories of the policy, facing the goal at the start of each layout's first drive, over the map."""
    figure, panels = panel_grid(len(layouts), 5, PANEL_INCHES, title_inches=0.3)
    for axes, layout in zip(panels, layouts, strict=True):
        pose, goal, drawn = _drawn_at_start(policy, layout)
        axes.set_aspect("equal")
        draw_plan(axes, layout.floor)
        draw_objects(axes, layout, 72.0 * PANEL_INCHES / max(plan_size(layout.floor)))
        order = np.argsort(drawn.values)
        for k in order:
            path = to_world(np.vstack([np.zeros((1, 2)), drawn.trajectories[k]]), pose)
            best = k == order[-1]
            axes.plot(*path.T, color="#0a7d32" if best else "#d55e00", linewidth=1.6 if best else 0.7, zorder=70 + best)
        axes.plot(*goal, "*", color="#23282d", markersize=7, zorder=80)
        axes.set_title(f"{layout.id}\n{drawn.values[order[0]]:.1f} to {drawn.values[order[-1]]:.1f}", fontsize=7)
    figure.tight_layout(pad=0.4)
    return figure


def _drawn_at_start(policy: NavDPPolicy, layout: Layout) -> tuple[Pose, tuple[float, float], DrawnTrajectories]:
    """Return the pose at the start of a layout's first drive, facing the goal, the goal, and the trajectories."""
    pair = goal_pairs(layout)[0]
    x, y = pair.start[:2]
    goal = pair.goal[:2]
    pose = x, y, math.atan2(goal[1] - y, goal[0] - x)
    rgb, depth = Camera().colour_and_depth(RayScene(layout, "visual"), pose)
    return pose, goal, policy.drawn_from(rgb, depth, (math.dist(pose[:2], goal), 0.0), seed=0)


def introduction(config: NavDPConfig) -> str:
    """Return the card's first section."""
    network = config.network
    return f"""# navdp: trajectories by diffusion, chosen by a critic

A re-implementation of NavDP at a size that trains on a CPU, with the same kind of inputs, outputs and training signal.
It sees color and depth, now and up to {(network.memory - 1) * 0.5:g} s ago ({network.memory} frames of 36 x 64), and \
the goal. It does not see the map.
It draws 12 trajectories of {network.points} steps in {config.diffusion.steps} denoising steps and follows the one with
the highest value of its critic among those that are clear of all obstacles seen so far. If none is clear, or no value
is high enough, it draws others, then turns in place.

The network has the weights of the training below. Four parts around it were added without training; each is an option
(`NavDPOptions`) that can be switched off:

- **Veto.** A map in the frame of the odometry collects what the depth camera has shown, also what has left its view. A
  trajectory is followed only if the robot's disc stays clear of it, at a wide distance if possible (`veto`).
- **Guidance.** In the last denoising steps, the gradient of a collision cost on this map pushes the trajectories away
  from the obstacles (`guided`).
- **Check.** Before every control step, the way of driving it and then braking is checked on the map. The robot slows
  down or stops, and draws other trajectories (`check`).
- **Settling.** After a turn in place, the robot sets off once it turns slowly (`settled`)."""


TRAJECTORIES = f"""## Trajectories

Trajectories at the start of a drive, facing the goal (star), in {LAYOUTS} layouts of the validation split. Green: the
critic's choice. Above each map: the lowest and the highest value. Goals behind furniture are out of sight. The network
drew them alone, without veto and guidance.

![Ten times twelve trajectories over their maps](trajectories.png)"""


def training_section(run: PlannerRun[NavDPConfig]) -> str:
    """Return the card's section on the training."""
    training, loss = run.config.training, run.config.loss
    return f"""## Training

{run.data_line}
- Training: `labgym train navdp --epochs {training.epochs} --seed {training.seed}`, {run.history[-1]["epoch"]} epochs.
  All options are in `config.json`.
- Loss: {loss.noise:g} times the mean squared error of the noise (half of the samples with the goal, half without) plus
  {loss.critic:g} times that of the critic, on the expert's path and on paths rotated by up to \
{math.degrees(loss.rotation):.0f} degrees.
- Value of a path, computed on the true map: {loss.unsafe:g} times the share of its points nearer than \
{loss.margin:g} m to an obstacle, plus
  {loss.opening:g} times the distance in meters by which its end is farther from obstacles than its start.
{run.losses_line}{run.notes}

Nothing was trained or chosen on the test split; the driving options were chosen on the validation split.

![Losses by epoch](losses.png)"""


def ablation_section(folder: Path) -> str:
    """Return the card's section on the ablation study in a folder."""
    return f"""## Ablation study

One part of the driving is changed at a time, or all parts around the network at once; all variants use the published
weights. The effect of rotated paths on the training was not measured.

{ablation_table(folder / RESULTS, NAVDP.titles)}

Command: `labgym ablate navdp --every N`, with N as in the suite's name."""


def differences_section(config: NavDPConfig) -> str:
    """Return the card's section on the differences from the published method."""
    network, loss = config.network, config.loss
    lines = [
        f"Size: {network.memory} frames instead of 8; a convolutional encoder of 36 x 64 images instead of pretrained "
        f"vision transformers; a decoder of {network.layers} layers and width {network.width} instead of 16 and 384; "
        f"{network.queries} queries instead of 128.",
        "Past frames have color and depth, not color alone.",
        "Goals behind the robot are not clipped away; coordinates are clipped to 10 m in all directions.",
        f"Trajectories end {loss.horizon:g} m along the expert's path. The network reads the goal as distance and "
        "bearing.",
        "Each sample is used with or without its goal, and with its own or a rotated path, drawn anew in every pass; "
        "the published training uses both at once.",
        "Driving: an episode begins with a turn to the goal. A trajectory is followed for 0.5 m (1.2 m after a turn) "
        "before others are drawn. The robot backs off from unseen obstacles (`NavDPOptions`).",
        "The published policy has no map: it follows the trajectory with the highest value and turns around if none is "
        "high enough.",
    ]
    return "\n".join(["## Differences from the published method", "", *(f"- {line}" for line in lines)])
