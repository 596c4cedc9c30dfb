"""The command that makes training data."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from tyro.conf import arg

from labgym.cli.arguments import (
    THIS_PROCESS,
    Execution,
    OptionalNumber,
    OptionalPath,
    OptionalText,
    OptionalWholeNumber,
)
from labgym.cli.effects import refuses_idle_flags
from labgym.cli.episodes import task_and_level
from labgym.cli.outcome import written
from labgym.cli.problems import check_installed
from labgym.counts import MAX_SEED, whole_number
from labgym.errors import OptionError

if TYPE_CHECKING:
    from labgym.policies.navdp.leader import NavDPLeader

DataFormat = Literal["planner", "parquet", "minari", "lerobot"]
Fresh = Annotated[bool, arg(help="Move the files of the folder aside and start anew.")]
LED = 0.5
"""Default share of the drives that a learner leads."""


@refuses_idle_flags("data")
def data(
    out: OptionalPath = None,
    *,
    format: DataFormat = "planner",  # noqa: A002
    samples: OptionalWholeNumber = None,
    floors: OptionalNumber = None,
    learner: OptionalPath = None,
    led: OptionalNumber = None,
    task: OptionalText = None,
    level: OptionalWholeNumber = None,
    split: OptionalText = None,
    policy: OptionalText = None,
    sensors: OptionalText = None,
    episodes: OptionalWholeNumber = None,
    successful: Annotated[bool, arg(help_behavior_hint="")] = False,
    seed: int = 0,
    shard: OptionalWholeNumber = None,
    execution: Execution = THIS_PROCESS,
    fresh: Fresh = False,
) -> int:
    """Make training data: samples for the learned planners, or drives of an expert for other libraries.

    An interrupted command resumes. docs/training-data.md describes the files.

    Args:
        out: Folder; by default runs/data, or runs/FORMAT/NAME for drives.
        format: planner: frames, goals, expert paths and maps, for labgym train. parquet, minari, lerobot: drives of an
            expert.
        samples: Number of samples of the format planner (50000).
        floors: Share of the layouts of the format planner that are training floors with clutter (0).
        learner: Folder of labgym train navdp: its network leads drives of the format planner, and the expert says what
            it should have done (DAgger).
        led: Share of the drives that the learner leads (0.5).
        task: Task of the drives: one of LabNav, such as people (the default) or with its level people-3, or point.
        level: Level of the task of LabNav, 1 to 3 (2), if --task does not name it.
        split: Layouts of the drives: floors-train (the default) or floors-val; for point also train (its default), val.
        policy: Expert, a built-in policy (stack; for point astar); labgym policies lists them.
        sensors: Sensors of the observations: lidar (the default), depth or rgbd; the expert has its own.
        episodes: Number of drives (100).
        successful: Keep successful drives only: one that fails is drawn again.
        seed: Random seed; the files depend on it, not on the number of workers.
        shard: Samples (500) or drives (10) in a shard, the unit of work and of resuming.
    """
    whole_number("seed", seed, 0, MAX_SEED)
    if format == "planner":
        from labgym.policies.data import DataOptions, make_dataset

        sizes = {"samples": 50_000 if samples is None else samples, "shard": 500 if shard is None else shard}
        for name, value in sizes.items():
            whole_number(name, value)
        leader, shares = _mixture(floors, learner, led)
        out = out or Path("runs/data")
        make_dataset(out, DataOptions(**sizes, **shares, seed=seed), execution.options(), fresh, leader=leader)
        return written(out)
    from labgym.datasets import drive_options, make_drives

    task, level = task_and_level(task or "people", level)
    options = drive_options(
        task,
        policy,
        split,
        level,
        format=format,
        sensors=sensors or "lidar",
        episodes=100 if episodes is None else episodes,
        successful=successful,
        seed=seed,
        shard=10 if shard is None else shard,
    )
    folder = out or Path("runs") / format / options.name
    return written(make_drives(folder, options, execution.options(), fresh))


def _mixture(
    floors: float | None, learner: Path | None, led: float | None
) -> tuple[NavDPLeader | None, dict[str, Any]]:
    """Return the learner, and the options of the dataset that say how much of what it holds.

    Raises:
        OptionError: a share is not between 0 and 1, or there is one of drives that nobody leads.
        DocumentError: the learner cannot be read.
    """
    for name, share in {"floors": floors, "led": led}.items():
        if share is not None and not 0.0 <= share <= 1.0:
            raise OptionError(f"{name} is {share:g}, expected a share from 0 to 1")
    shares: dict[str, Any] = {"floors": floors or 0.0}
    if learner is None:
        return None, shares
    check_installed("torch", "labgym data --learner")
    from labgym.policies.navdp.leader import NavDPLeader

    leader = NavDPLeader.of(learner)
    return leader, {**shares, "led": LED if led is None else led, "learner": leader.digest}
