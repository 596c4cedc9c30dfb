"""Viewers in the browser: `labgym view --web` and `labgym play`."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tyro.conf import Positional, arg

from labgym.cli.arguments import OptionalPath, OptionalText, PolicyOptions, allow_local_modules, parse_options
from labgym.cli.effects import refuses_idle_flags
from labgym.cli.episodes import play_episodes
from labgym.cli.outcome import DONE, written
from labgym.errors import OptionError, UnknownNameError

if TYPE_CHECKING:
    from labgym.eval.driving.drive import TransitionDrive
    from labgym.layouts import Layout
    from labgym.suites import Suite
    from labgym.viewer import ViewerEpisode

Layouts = Positional[Annotated[tuple[str, ...], arg(metavar="LAYOUT [...]", help_behavior_hint="(default: the suite)")]]


def watch(
    layouts: Sequence[str],
    *,
    suite: str | None,
    protocol: str | None,
    policy: str,
    pair: int,
    seed: int,
    options: PolicyOptions,
    port: int,
) -> int:
    """Show a policy on the goal pairs of layouts, or on the episodes of a suite, in the browser until Ctrl-C."""
    from labgym.policies.process import PolicyProcess, PolicySource
    from labgym.viewer import Console, Show, episodes_of, run_viewer

    allow_local_modules()
    chosen, rules = _choice(layouts, suite, protocol)
    episodes = episodes_of(chosen, rules)
    first = _first(episodes, pair)
    driver = PolicyProcess(PolicySource.named(policy, parse_options(options)))
    try:
        show = Show(episodes, rules, driver, policy, Console(), seed=seed, finished=_print)
        with suppress(KeyboardInterrupt):
            run_viewer(show, port, first, opened)
    finally:
        driver.close()
    return DONE


@refuses_idle_flags("play")
def play(
    layouts: Layouts = (),
    suite: Annotated[str, arg(aliases=("--split", "--task"))] = "test",
    protocol: OptionalText = None,
    out: OptionalPath = None,
    film: OptionalPath = None,
    name: str = "person",
    port: int = 8000,
) -> int:
    """Drive the robot by keyboard in the browser, under the rules of a suite, until Ctrl-C.

    A person's episodes count as a policy's: the same start, time limit and metrics. The page shows the laboratory, the
    robot's sensors and the shortest path. In LabNav the Enter key gives STOP.

    Args:
        layouts: Layouts to drive in instead of a suite: .json files, folders of them, or ids of published layouts.
        suite: Name of a suite (lab30, val, navdp_compat, labnav-val-people), a task of LabNav with its level
            (people-2), a suite's .json file, or a folder of labgym labnav. Where the layouts are not published, pass
            them too.
        protocol: Id or .json file of the protocol to drive for in the layouts; by default the one they embed.
        out: Folder for the finished episodes, in the files of labgym eval, so that labgym report reads it. An episode
            that is driven again replaces its row.
        film: A .mp4, .gif or .webp file for a film of the last finished episode.
        name: Name of the driver in the rows.
        port: Port of the page on 127.0.0.1; 0 takes a free port.
    """
    from labgym.eval.drawing.film import check_film_path
    from labgym.eval.labnav.suites import is_labnav
    from labgym.viewer import Console, KeyboardDriver, Show, episodes_of, run_viewer
    from labgym.viewer.records import DriveRecords

    if is_labnav(suite):
        return play_episodes(suite, layouts, out, name, port)
    if film is not None:
        check_film_path(film)
    chosen, rules = _choice(layouts, suite, protocol)
    episodes, drives = episodes_of(chosen, rules), []
    records = None if out is None else DriveRecords(out, episodes, rules, name)

    def finished(drive: TransitionDrive) -> None:
        _print(drive)
        drives.append(drive)
        if records is not None:
            records.add(drive)

    console = Console()
    show = Show(episodes, rules, KeyboardDriver(console), name, console, waits=True, finished=finished)
    with suppress(KeyboardInterrupt):
        run_viewer(show, port, 0, opened)
    if out is not None and drives:
        written(out)
    if film is not None and drives:
        _film(next(layout for layout in chosen if layout.id == drives[-1].row.layout), drives[-1], film)
    return DONE


def _choice(names: Sequence[str], suite: str | None, protocol: str | None) -> tuple[list[Layout], Suite]:
    """Return the layouts that arguments name, or those of a suite, and the rules of their episodes.

    A suite's .json file sets the rules for named layouts, too.

    Raises:
        OptionError: neither layouts nor a suite, or a protocol without layouts.
    """
    from labgym.envs.tasks import resolve_layouts
    from labgym.suites import load_suite, suite_of

    if protocol is not None and not names:
        raise OptionError("--protocol is for layouts; the layouts of a suite embed their protocols")
    layouts = resolve_layouts(names, protocol)
    if suite is None or (layouts and not suite.endswith(".json")):
        if not layouts:
            raise OptionError("name a layout, or a suite with --suite")
        return layouts, suite_of(layouts)
    rules = load_suite(suite)
    return layouts or list(rules.load_layouts()), rules


def _first(episodes: Sequence[ViewerEpisode], pair: int) -> int:
    """Return the number of the first episode of a goal pair of the first layout.

    Raises:
        OptionError: there are no episodes.
        UnknownNameError: the layout has no such pair.
    """
    if not episodes:
        raise OptionError("the layouts have no goal pair to drive: pass another --protocol")
    pairs = [episode.assignment.pair.index for episode in episodes if episode.layout is episodes[0].layout]
    if pair not in pairs:
        raise UnknownNameError(f"goal pair of layout {episodes[0].layout.id!r}", pair, {str(each) for each in pairs})
    return pairs.index(pair)


def _film(layout: Layout, drive: TransitionDrive, path: Path) -> None:
    from labgym.eval.drawing import film
    from labgym.progress import progress_bar

    pictures = film.film(layout, drive.route, 640, 480)
    written(film.save_film(progress_bar(pictures, "film", len(drive.route)), path))


def opened(url: str) -> None:
    """Print the address of a page."""
    print(f"Open {url} in a browser of this machine; press Ctrl-C to stop", flush=True)


def _print(drive: TransitionDrive) -> None:
    from labgym.cli.describe import episode_outcome

    row = drive.row
    score = "" if row.spl is None else f", SPL {row.spl:.3f}"
    print(f"{row.layout} pair {row.pair}: {episode_outcome(row)}, {row.contacts} contacts{score}", flush=True)
