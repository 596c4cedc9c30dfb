"""The commands that train the learned local planner."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from tyro.conf import arg

from labgym.cli.arguments import THIS_PROCESS, Execution, OptionalPath, OptionalText
from labgym.cli.outcome import written
from labgym.cli.problems import check_training

TRAINING = ("labgym train", "stable_baselines3", "safetensors")
"""The command in errors, and the packages that a training of the local planner needs."""

Fresh = Annotated[bool, arg(help="Move the files of the folder aside and start anew.")]
Practice = Annotated[Path, arg(help="Folder of labgym train local-practice.")]
Runs = Annotated[tuple[Path, ...], arg(help="Folders of runs that differ in their seeds; the first is published.")]
Tasks = Annotated[OptionalText, arg(help="Tasks to practice, separated by commas.")]


def local_practice(
    out: Path = Path("runs/local-practice"),
    floors: int = 72,
    per_task: int = 3,
    execution: Execution = THIS_PROCESS,
    fresh: Fresh = False,
) -> int:
    """Draw drives of the tasks of LabNav on training floors, for local-imitation and local-ppo.

    Args:
        out: Folder for the floors.
        floors: Number of training floors.
        per_task: Most drives of each task on a floor.
    """
    check_training(*TRAINING, floors=floors, per_task=per_task)
    from labgym.training.local.practice import make_practice

    make_practice(out, floors, per_task, execution.options(), fresh)
    return written(out)


def local_imitation(
    practice: Practice = Path("runs/local-practice"),
    *,
    out: Path = Path("runs/local-imitation"),
    tasks: Tasks = None,
    rounds: int = 4,
    drives: int = 224,
    seed: int = 0,
    execution: Execution = THIS_PROCESS,
    fresh: Fresh = False,
) -> int:
    """Train the local planner by imitation of the policy stack (DAgger).

    Args:
        out: Folder for the policy, its history and the recorded drives.
        rounds: Rounds of drives; the expert drives in the first one.
        drives: Drives of a round.
        seed: Random seed of the whole run.
    """
    check_training(*TRAINING, rounds=rounds, drives=drives, seed=seed)
    from labgym.training.local.imitation import imitate
    from labgym.training.local.options import ImitationOptions
    from labgym.training.local.practice import practice_files

    options = ImitationOptions(rounds=rounds, drives=drives, seed=seed, **_tasks(tasks))
    return written(imitate(options, practice_files(practice), out, execution.options(), fresh))


def local_ppo(
    start: Path = Path("runs/local-imitation/policy.safetensors"),
    *,
    practice: Practice = Path("runs/local-practice"),
    out: OptionalPath = None,
    tasks: Tasks = None,
    iterations: int = 40,
    seed: int = 0,
    execution: Execution = THIS_PROCESS,
    fresh: Fresh = False,
) -> int:
    """Train the local planner by PPO, from the policy of local-imitation.

    Args:
        start: Policy to begin with.
        out: Folder for policies, history and checkpoint; by default runs/local-ppo, with tasks runs/local-ppo-TASKS.
        iterations: Number of updates, each of 64 drives.
        seed: Random seed of the whole run.
    """
    check_training(*TRAINING, iterations=iterations, seed=seed)
    from labgym.training.local.options import ReinforcementOptions
    from labgym.training.local.practice import practice_files
    from labgym.training.local.reinforcement import reinforce

    options = ReinforcementOptions(iterations=iterations, seed=seed, **_tasks(tasks))
    folder = out or Path("runs") / ("local-ppo" if tasks is None else f"local-ppo-{'-'.join(options.tasks)}")
    return written(reinforce(options, start, practice_files(practice), folder, execution.options(), fresh))


def ablate_local_imitation(
    run: Path = Path("runs/local-imitation"),
    out: Path = Path("runs/local-imitation-ablation"),
    execution: Execution = THIS_PROCESS,
    fresh: Fresh = False,
) -> int:
    """Ablate the imitation: train networks without a part of the input on the same drives, and judge them.

    Args:
        run: Folder of labgym train local-imitation.
        out: Folder for the networks and the results.
    """
    check_training(*TRAINING)
    from labgym.training.local.ablation import ablate_imitation

    return written(ablate_imitation(run, out, execution.options(), fresh=fresh))


def ablate_local_ppo(
    run: Path = Path("runs/local-ppo"),
    start: Path = Path("runs/local-imitation/policy.safetensors"),
    singles: Annotated[
        tuple[Path, ...],
        arg(help="Folders of labgym train local-ppo --tasks TASK, all tasks or none.", help_behavior_hint=""),
    ] = (),
    out: Path = Path("runs/local-ppo-ablation"),
    execution: Execution = THIS_PROCESS,
    fresh: Fresh = False,
) -> int:
    """Ablate PPO: drive the policy before it, without its safety layer, and policies for a single task each.

    Args:
        run: Folder of labgym train local-ppo, or policies/local-ppo.
        start: Policy with which it began.
        out: Folder for the results.
    """
    check_training(*TRAINING)
    from labgym.training.local.ablation import ablate_reinforcement

    return written(ablate_reinforcement(run, start, out, singles, execution.options(), fresh=fresh))


def card_local_imitation(
    runs: Runs = (Path("runs/local-imitation"),),
    results: OptionalPath = None,
    ablation: OptionalPath = None,
    out: Path = Path("policies/local-imitation"),
) -> int:
    """Publish the imitated local planner with a model card.

    Args:
        results: Folder of labgym eval --suite lab30 with these weights.
        ablation: Folder of labgym ablate local-imitation.
        out: Folder for weights, options, histories, ablation, figures and CARD.md.
    """
    from labgym.cards.local import write_imitation_card

    return written(write_imitation_card(runs, out, results, ablation))


def card_local_ppo(
    runs: Runs = (Path("runs/local-ppo"),),
    results: OptionalPath = None,
    ablation: OptionalPath = None,
    out: Path = Path("policies/local-ppo"),
) -> int:
    """Publish the local planner by PPO with a model card.

    Args:
        results: Folder of labgym eval --suite lab30 with these weights.
        ablation: Folder of labgym ablate local-ppo.
        out: Folder for weights, options, histories, ablation, figures and CARD.md.
    """
    from labgym.cards.local import write_reinforcement_card

    return written(write_reinforcement_card(runs, out, results, ablation))


def _tasks(names: str | None) -> dict[str, tuple[str, ...]]:
    """Return the option `tasks`, none for the default."""
    return {} if names is None else {"tasks": tuple(name.strip() for name in names.split(","))}
