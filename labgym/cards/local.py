"""The model cards of the learned local planner, and the published folders around them."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from labgym.cards.labnav import headed
from labgym.cards.results import CardResults
from labgym.documents import json_bytes, write_bytes, write_text
from labgym.envs.labnav.tasks import FIGURE_TASKS
from labgym.errors import OptionError
from labgym.eval.drawing.pictures import save_picture
from labgym.eval.driving.intervals import estimate_text
from labgym.eval.labnav.figure import geometric
from labgym.policies.learned.training_loop import TIMES
from labgym.policies.local.inputs import SIZE, SIZES
from labgym.policies.local.policy import FILE, ImitationPolicy, ReinforcementPolicy
from labgym.runs.manifest import MANIFEST_FILE, file_digest
from labgym.table import Table, number
from labgym.training.local.ablation import BEFORE, EXPERT, HISTORIES, SINGLE, UNGUARDED, WHOLE, Ablation
from labgym.training.local.ablation import FILE as ABLATION
from labgym.training.local.collection import GOALS
from labgym.training.local.imitation import HISTORY, OPTIONS, ROUND, VALIDATION
from labgym.training.local.options import ImitationOptions, ReinforcementOptions
from labgym.training.local.reinforcement import ITERATION

if TYPE_CHECKING:
    from matplotlib.figure import Figure

INPUTS = {
    "free": "free distance in 48 directions, linear and as nearness",
    "path": "8 points of the path up to 2.5 m ahead, the length that is left, and the heading error",
    "room": "clearance on the path and 12 cm to its sides",
    "arcs": "least clearance on 21 arcs, each driven for 1 s",
    "people": "the nearest 5 people: place, velocity, whether they walk",
    "motion": "velocity, the latest 2 actions, and the way of the last 1, 3 and 8 s",
    "knowledge": "what the task is like: drift, dock, glass, people, mounting, STOP, freeboard, acceleration",
}
LIMITS = """Limits: localization, costmap, global planner, tracks of people, rests for people, recovery, the last half
meter at a dock and the end at the goal are those of `stack`; the network decides the velocities in between. It was
trained and evaluated in simulation only, for one robot."""
SAMPLES = "Each network learned once, from the drives that the run recorded. "
VARIANTS = {
    EXPERT: "Without DAgger: from the drives of the first round only, in which the expert drives.",
    BEFORE: "Without PPO: the policy with which it began.",
    UNGUARDED: "Without the safety layer: the network, which learned with it, decides when to rest for people.",
    SINGLE: "Without other tasks: a policy for each task, which has practiced this task alone, from the same start.",
}


def write_imitation_card(
    runs: Sequence[Path], out: Path, results: Path | None = None, ablation: Path | None = None
) -> Path:
    """Publish the first of some runs of the imitation with a model card, and return the card's path.

    Args:
        runs: folders of `labgym train local-imitation` that differ in their random seeds.
        out: folder for weights, options, histories, ablation, figures and `CARD.md`.
        results: folder of a complete `labgym eval --suite lab30` with these weights.
        ablation: folder of `labgym ablate local-imitation`.

    Raises:
        DocumentError: a file is missing or broken.
        OptionError: a run is not finished, or the evaluation or ablation is not complete or of another policy.
    """
    histories = [_history(run) for run in runs]
    options = ImitationOptions.load(runs[0] / OPTIONS)
    drives = options.rounds * options.drives
    samples = max(record.get("samples", 0) for record in histories[0])
    command = f"labgym train local-imitation --rounds {options.rounds} --drives {options.drives}{_choices(options)}"
    training = f"""`labgym train local-practice`, then `{command}`.

DAgger with `stack` as the expert, on training floors, with the errors and nuisances of level 2 of each task: {drives}
drives, {samples} decisions, {_minutes(runs[0])}. In the first round the expert drives, in the others the network;
wherever the network decides, the expert says what it would do.

![Error and scores by round](learning.png)

{_seeds(runs, histories)}"""
    shown = "" if ablation is None else _ablation(ablation, runs[0], out, SAMPLES)
    save_picture(_imitation_figure(histories), out / "learning.png")
    title = f"{ImitationPolicy.name}: a local planner by imitation of `stack`"
    return _published(ImitationPolicy.name, runs[0], histories, out, CardText(title, training, shown), results)


def write_reinforcement_card(
    runs: Sequence[Path], out: Path, results: Path | None = None, ablation: Path | None = None
) -> Path:
    """Publish the first of some runs of PPO with a model card, and return the card's path.

    Args:
        runs: folders of `labgym train local-ppo` that differ in their random seeds. out, results: as for
            `write_imitation_card`. ablation: folder of `labgym ablate local-ppo`.

    Raises:
        DocumentError, OptionError: as `write_imitation_card`.
    """
    histories = [_history(run) for run in runs]
    options = ReinforcementOptions.load(runs[0] / OPTIONS)
    samples = sum(record.get("samples", 0) for record in histories[0])
    training = f"""`labgym train local-ppo --iterations {options.iterations}{_choices(options)}`, from the weights of
`local-imitation` with the same seed: PPO (stable-baselines3) on {options.iterations * options.drives} drives of
{len(options.tasks)} tasks, {samples} decisions, {_minutes(runs[0])}. The reward is the score at the end, and on the
way progress, time, nearness to people and slosh (labgym/training/local/rewards.py). The published weights are those
after the last update; the evaluations on floors-val decide only how often each task is practiced.

![Figure by iteration](learning.png)

{_seeds(runs, histories)}"""
    shown = "" if ablation is None else _ablation(ablation, runs[0], out)
    save_picture(_reinforcement_figure(histories), out / "learning.png")
    title = f"{ReinforcementPolicy.name}: a local planner by PPO"
    return _published(ReinforcementPolicy.name, runs[0], histories, out, CardText(title, training, shown), results)


@dataclass(frozen=True)
class CardText:
    """Title, and Markdown of the sections on training and ablation; "" without an ablation."""

    title: str
    training: str
    ablation: str


def _published(
    name: str, run: Path, histories: list[list[dict[str, Any]]], out: Path, text: CardText, results: Path | None
) -> Path:
    """Write weights, options, histories and the card."""
    evaluated = None if results is None else CardResults.read(results, name)
    write_bytes(out / FILE, (run / FILE).read_bytes())
    write_bytes(out / OPTIONS, (run / OPTIONS).read_bytes())
    write_bytes(out / HISTORIES, json_bytes(histories))
    if evaluated is not None:
        evaluated.draw(out)
    sections = [
        f"# {text.title}",
        "A network drives along the path of the navigation stack `stack`, in place of its controller. The rules by "
        "which `stack` rests for people are a safety layer over it. It knows the old map.",
        _input_table(),
        "" if evaluated is None else evaluated.markdown(),
        f"## Training\n\n{text.training}",
        text.ablation,
        LIMITS,
    ]
    return write_text(out / "CARD.md", headed("\n\n".join(section for section in sections if section) + "\n"))


def _input_table() -> str:
    rows = tuple((part, str(SIZES[part]), meaning) for part, meaning in INPUTS.items())
    table = Table("", ("input", "numbers", "meaning"), rows).markdown()
    text = f"Two layers of 256 units lead from {SIZE} numbers to the velocities; memory is in the stack's costmap and "
    return f"{text}tracks of people.\n\n{table}"


def _choices(options: ImitationOptions | ReinforcementOptions) -> str:
    """Return the arguments of a training for its tasks and seed."""
    tasks = "" if options.tasks == tuple(FIGURE_TASKS) else f" --tasks {','.join(options.tasks)}"
    return f"{tasks} --seed {options.seed}"


def _seeds(runs: Sequence[Path], histories: list[list[dict[str, Any]]]) -> str:
    """Return the table of the scores of all seeds in their last evaluation."""
    tasks = [task for task in FIGURE_TASKS if task in histories[0][-1]["scores"]]
    rows = []
    for run, history in zip(runs, histories, strict=True):
        seed = json.loads((run / OPTIONS).read_text(encoding="utf-8"))["seed"]
        last = history[-1]
        rows.append((str(seed), number(last["figure"], 1), *(number(last["scores"].get(task), 2) for task in tasks)))
    table = Table("", ("seed", "figure ↑", *(f"{task} ↑" for task in tasks)), tuple(rows)).markdown()
    drives = sum(histories[0][-1]["endings"].values())
    return (
        f"Scores of the last weights in {drives} drives on floors-val; the figure is LabNav's, over these tasks, of "
        f"which shifts have {GOALS} goals. Seed {rows[0][0]} is published.\n\n{table}"
    )


def _ablation(folder: Path, run: Path, out: Path, text: str = "") -> str:
    """Return the section on an ablation, and publish its file."""
    ablation = Ablation.load(folder / ABLATION)
    if ablation.weights != file_digest(run / FILE):
        raise OptionError(f"{folder} holds the ablation of other weights than those of {run}: run labgym ablate again")
    rows = []
    for one in ablation.variants:
        difference = "" if one.difference is None else estimate_text(one.difference, 3)
        name = WHOLE if one.name == WHOLE else f"without {one.name}"
        rows.append((name, number(geometric(list(one.scores.values())), 1), difference))
    note = (
        f"{ablation.drives} drives on floors-val; in brackets: 95% intervals of the paired differences, over floors "
        "and not over trainings."
    )
    table = Table("", ("policy", "figure ↑", "difference of the mean score"), tuple(rows), (note,)).markdown()
    write_bytes(out / ABLATION, (folder / ABLATION).read_bytes())
    text += " ".join(VARIANTS[one.name] for one in ablation.variants if one.name in VARIANTS)
    return f"## Ablation\n\n{text}\n\n{table}"


def _imitation_figure(histories: list[list[dict[str, Any]]]) -> Figure:
    """Draw the error and the figure by round, a line for each seed."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.0, 3.0), facecolor="#ffffff")
    errors, scores = figure.subplots(1, 2)
    for history in histories:
        rounds = [record for record in history if record["kind"] == ROUND]
        numbers = [record["number"] for record in rounds]
        errors.plot(numbers, [record["error"] for record in rounds], "o-", markersize=3)
        scores.plot(numbers, [geometric(list(record["scores"].values())) for record in rounds], "o-", markersize=3)
    errors.set_title("error of the imitated action, of each seed", fontsize=9)
    scores.set_title("figure on training floors (round 0: the expert)", fontsize=9)
    return _finished(figure, "round")


def _reinforcement_figure(histories: list[list[dict[str, Any]]]) -> Figure:
    """Draw the figure of noisy drives on training floors and of judged drives, a line for each seed."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.0, 3.0), facecolor="#ffffff")
    axes = figure.subplots(1, 2)
    for history in histories:
        for place, kind, look in zip(axes, (ITERATION, VALIDATION), ("-", "o-"), strict=True):
            records = [record for record in history if record["kind"] == kind]
            values = [geometric(list(record["scores"].values())) for record in records]
            place.plot([record["number"] for record in records], values, look, linewidth=1.0, markersize=3)
    axes[0].set_title("figure on training floors, with noise, of each seed", fontsize=9)
    axes[1].set_title("figure on floors-val, of each seed", fontsize=9)
    return _finished(figure, "iteration")


def _finished(figure: Figure, unit: str) -> Figure:
    from matplotlib.ticker import MaxNLocator

    for axes in figure.axes:
        axes.set_xlabel(unit, fontsize=8)
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
        axes.set_ylim(0.0, 1.1 * axes.dataLim.y1)
        axes.tick_params(labelsize=8)
        axes.grid(alpha=0.3)
    figure.tight_layout()
    return figure


def _history(run: Path) -> list[dict[str, Any]]:
    if not (run / MANIFEST_FILE).is_file():
        raise OptionError(f"{run} is no finished training: run labgym train again with --out {run}")
    path = run / HISTORY
    return [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()]


def _minutes(run: Path) -> str:
    """Return the wall-clock time of a run, with what interruptions made it repeat."""
    lines = (run / TIMES).read_text(encoding="utf-8").splitlines() if (run / TIMES).is_file() else []
    return f"{sum(json.loads(line)['seconds'] for line in lines) / 60.0:.0f} minutes"
