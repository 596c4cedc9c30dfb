"""`labgym record`: films and ROS 2 recordings of drives and of episodes that were evaluated."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from tyro.conf import Positional, arg

from labgym.cli.arguments import (
    OptionalText,
    OptionalWholeNumber,
    PolicyOptions,
    allow_local_modules,
    numbers,
    parse_options,
    sized,
)
from labgym.cli.effects import refuses_idle_flags
from labgym.cli.outcome import complaints, written
from labgym.cli.problems import check_installed
from labgym.errors import OptionError

if TYPE_CHECKING:
    from labgym.eval.drawing.film import Picture
    from labgym.eval.driving.drive import Route
    from labgym.eval.labnav.replay import Replay
    from labgym.layouts import Layout
    from labgym.scenes import Quality

Filmed = Positional[Annotated[str, arg(metavar="LAYOUT|FOLDER|SUITE")]]
SMALL, WIDE = (480, 360), (960, 540)
"""Sizes of films in pixels: of drives, and of LabNav episodes with their panel."""
MCAP = ".mcap"
"""Suffix of a recording as messages of ROS 2, in place of a film."""


@refuses_idle_flags("record")
def record(
    layout: Filmed,
    *,
    policy: OptionalText = None,
    pair: int = 0,
    out: Path = Path("drive.mp4"),
    seed: int = 0,
    width: OptionalWholeNumber = None,
    height: OptionalWholeNumber = None,
    quality: Literal["fast", "fine"] = "fast",
    protocol: OptionalText = None,
    options: PolicyOptions = (),
    start: OptionalText = None,
    goal: OptionalText = None,
    episode: OptionalText = None,
) -> int:
    """Film a policy on a layout, an episode of an evaluation's folder, or an episode of a LabNav suite.

    With --out FILE.mcap the drive is recorded as ROS 2 messages instead: map, frames, odometry, scans, images, people.

    An episode of a folder is filmed as it was: its route, and for LabNav people and things where they were. For these
    the policy drives again, and the command fails if its row or route differs from those in the folder.

    Args:
        layout: A layout's .json file, or the id of a published layout; or a folder of labgym eval, labgym run or labgym
            play with --episode; or a LabNav suite or task such as people-2 with --episode.
        policy: Policy: a name, module:Class, a file or a URL (see labgym eval --help); by default astar, and for a
            folder the one that drove.
        pair: Index of the goal pair, in the order of the protocol's steps.
        out: The film, .mp4, .gif or .webp; or .mcap, the messages of ROS 2 for rosbag2, RViz and Foxglove.
        seed: Random seed of the policy.
        width: Width in pixels; by default 480, of a LabNav episode 960.
        height: Height in pixels; by default 360, of a LabNav episode 540.
        quality: fast, or fine with shadows and reflections (ten times slower without a GPU).
        protocol: Id or .json file of the protocol to drive for; by default the one that the layout embeds.
        options: Arguments of the policy, for example deterministic=false.
        start: Start x,y,yaw in meters and radians, for example 1.5,2,0; by default that of the goal pair.
        goal: Goal x,y in meters; by default that of the goal pair.
        episode: Episode of a folder or suite: people-2/floors-val-0003/1 or floors-val-0003/1 of LabNav, and
            LAYOUT/PAIR or LAYOUT/PAIR/REPEAT of other suites, such as test-sub_01/3.
    """
    from labgym.eval.drawing.episode_film import check_episode_film_size
    from labgym.eval.drawing.film import check_film_path
    from labgym.eval.labnav.evaluation import is_labnav_run
    from labgym.eval.labnav.suites import is_labnav

    allow_local_modules()
    if out.suffix == MCAP:
        check_installed("rosbags", "--out FILE.mcap")
    else:
        check_film_path(out)
    folder = Path(layout).is_dir()
    if not folder and not is_labnav(layout):
        return _film_pair(
            layout,
            policy=policy,
            pair=pair,
            out=out,
            seed=seed,
            size=(width, height),
            quality=quality,
            protocol=protocol,
            options=options,
            start=start,
            goal=goal,
        )
    if episode is None:
        raise OptionError(f"name an episode of {layout} with --episode; labgym record --help shows how they are named")
    if not folder or is_labnav_run(layout):
        check_episode_film_size(*sized((width, height), WIDE))
    if folder:
        return _film_episode(Path(layout), episode, policy, out, (width, height), quality)
    from labgym.eval.labnav.replay import drive_again
    from labgym.eval.labnav.suites import published_episode

    part, chosen, seconds = published_episode(layout, episode)
    arguments = parse_options(options)
    shown = drive_again(policy or "astar", part, chosen, arguments, seed, seconds=seconds)
    return _film_labnav(shown, out, (width, height), quality)


def _film_pair(
    layout: str,
    *,
    policy: str | None,
    pair: int,
    out: Path,
    seed: int,
    size: tuple[int | None, int | None],
    quality: Quality,
    protocol: str | None,
    options: Sequence[str],
    start: str | None,
    goal: str | None,
) -> int:
    """Film a policy on a goal pair of a layout; the arguments are those of `record`."""
    from labgym.cli.describe import episode_outcome
    from labgym.envs.tasks import resolve_layout
    from labgym.eval.driving.drive import drive_pair

    scene = resolve_layout(layout, protocol)
    ends = numbers("start", start), numbers("goal", goal)
    drive = drive_pair(policy or "astar", scene, pair, seed, parse_options(options), *ends)
    print(episode_outcome(drive.row))
    _save_drive(scene, drive.route, out, size, quality)
    return complaints([drive.row.error] if drive.row.error else [])


def _film_episode(
    folder: Path,
    episode: str,
    policy: str | None,
    out: Path,
    size: tuple[int | None, int | None],
    quality: Quality,
) -> int:
    """Film an episode of a folder of results."""
    from labgym.cli.describe import episode_outcome
    from labgym.eval.labnav.evaluation import LabNavEvaluation, is_labnav_run
    from labgym.eval.labnav.replay import replay
    from labgym.eval.reports.results import recorded_drive

    if is_labnav_run(folder):
        return _film_labnav(replay(LabNavEvaluation.read(folder), episode, policy), out, size, quality)
    layout, row, route = recorded_drive(folder, episode, policy)
    print(episode_outcome(row))
    return _save_drive(layout, route, out, size, quality)


def _save_drive(layout: Layout, route: Route, out: Path, size: tuple[int | None, int | None], quality: Quality) -> int:
    from labgym.eval.drawing.film import film
    from labgym.exchange.recording import write_recording

    if out.suffix == MCAP:
        return written(write_recording(layout, route, out))
    return _save(film(layout, route, *sized(size, SMALL), quality), len(route), out)


def _film_labnav(shown: Replay, out: Path, size: tuple[int | None, int | None], quality: Quality) -> int:
    from labgym.cli.describe import labnav_outcome
    from labgym.eval.drawing.episode_film import HOLD, episode_film

    row = shown.row
    print(labnav_outcome(row))
    if out.suffix == MCAP:
        from labgym.exchange.recording import write_recording

        poses, bodies = [shot.pose for shot in shown.shots], [shot.bodies for shot in shown.shots]
        written(write_recording(shown.fixtures, tuple(poses), out, bodies, shown.task.old_map or shown.task.layout))
    else:
        _save(episode_film(shown, *sized(size, WIDE), quality), len(shown.shots) + HOLD, out)
    return complaints([row.error] if row.error else [])


def _save(pictures: Iterable[Picture], count: int, out: Path) -> int:
    from labgym.eval.drawing.film import save_film
    from labgym.progress import progress_bar

    return written(save_film(progress_bar(pictures, "film", count), out))
