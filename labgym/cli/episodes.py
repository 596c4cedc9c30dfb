"""`labgym view --task` and `labgym play`: a LabNav episode as a picture, or in the browser."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from labgym.cli.arguments import PolicyOptions, allow_local_modules, parse_options, sized
from labgym.cli.outcome import DONE, written

if TYPE_CHECKING:
    from labgym.envs.labnav.episodes import LabNavEpisode
    from labgym.eval.driving.drive import LabNavDrive
    from labgym.layouts import Layout

SIZE = (900, 560)
"""Size of the rendered view, pixels."""


Level = TypeVar("Level", int, int | None)


def task_and_level(name: str, level: Level) -> tuple[str, int | Level]:
    """Return the task and level that a name such as "people-2" or "labnav-people-2" names.

    Args:
        name: of the task, with or without the level. level: of a name without one.
    """
    name = name.removeprefix("labnav-")
    task, _, number = name.rpartition("-")
    return (task, int(number)) if task and number in ("1", "2", "3") else (name, level)


def view_episode(
    task: str, level: int, episode: str | None, seed: int, out: Path | None, size: tuple[int | None, int | None]
) -> int:
    """Write the picture of an episode; the arguments are those of `labgym view`."""
    from labgym.eval.drawing.episode_picture import (
        EpisodeWorld,
        check_episode_size,
        check_picture_path,
        episode_picture,
        save_episode_picture,
    )

    out = Path(f"{task}-{level}.png") if out is None else out
    width, height = sized(size, SIZE)
    check_picture_path(out)
    check_episode_size(width, height)
    layout, chosen = _episode(task, level, episode, seed)
    world = EpisodeWorld.of(task, level, chosen, layout)
    return written(save_episode_picture(episode_picture(world, width, height), out))


def watch_episode(
    task: str, level: int, episode: str | None, seed: int, policy: str, options: PolicyOptions, port: int
) -> int:
    """Show a policy on an episode in the browser; the arguments are those of `labgym view`."""
    from labgym.cli.viewing import opened
    from labgym.eval.driving.runner import open_driver, policy_source
    from labgym.policies.kernels import kernel_mode
    from labgym.viewer import Console, LabNavShow, LabNavWatch, run_viewer

    allow_local_modules()
    watch = LabNavWatch.of(task, level, *_episode(task, level, episode, seed))
    source = policy_source(policy, parse_options(options))
    with open_driver(policy, source, None, kernel_mode(), isolated=True) as driver:
        show = LabNavShow((watch,), driver, policy, Console(), seed=seed, finished=_print)
        with suppress(KeyboardInterrupt):
            run_viewer(show, port, 0, opened)
    return DONE


def play_episodes(suite: str, layouts: Sequence[str], out: Path | None, name: str, port: int) -> int:
    """Let a person drive the episodes of a suite of LabNav in the browser; the arguments are those of `labgym play`."""
    from labgym.cli.viewing import opened
    from labgym.envs.tasks import resolve_layouts
    from labgym.eval.labnav.suites import resolve_labnav
    from labgym.viewer import Console, LabNavKeyboardDriver, LabNavShow, LabNavWatch, run_viewer
    from labgym.viewer.records import LabNavRecords

    chosen = resolve_labnav(suite, resolve_layouts(layouts))
    records = None if out is None else LabNavRecords(out, chosen, name)
    watches = []
    for part in chosen.parts:
        for floor, episodes in part.floors.items():
            layout = part.layout(floor)
            watches += [LabNavWatch(part.task, part.level, layout, one, part.label) for one in episodes]
    driven = []

    def finished(drive: LabNavDrive) -> None:
        _print(drive)
        driven.append(drive.row.key)
        if records is not None:
            records.add(drive)

    console = Console()
    driver = LabNavKeyboardDriver(console)
    show = LabNavShow(
        watches, driver, name, console, finished=finished, waits=True, seconds=chosen.seconds, suite=chosen.name
    )
    with suppress(KeyboardInterrupt):
        run_viewer(show, port, 0, opened)
    return written(out) if out is not None and driven else DONE


def _print(drive: LabNavDrive) -> None:
    from labgym.cli.describe import labnav_outcome

    print(labnav_outcome(drive.row), flush=True)


def _episode(task: str, level: int, episode: str | None, seed: int) -> tuple[Layout, LabNavEpisode]:
    """Return a published episode, or one that is drawn, and its floor."""
    from labgym.envs.labnav.nuisances import drawn_episode
    from labgym.envs.labnav.tasks import task_of
    from labgym.eval.labnav.suites import published_episode

    task_of(task).level(level)
    if episode is None:
        return drawn_episode(task, level, seed)
    part, chosen, _ = published_episode(f"labnav-{task}-{level}", episode)
    return part.layout(chosen.floor), chosen
