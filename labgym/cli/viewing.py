"""Viewers in the browser: `labgym view --web` and `labgym play`."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tyro.conf import Positional, arg

from labgym.cli.arguments import OptionalPath, OptionalText, PolicyOptions, allow_local_modules, parse_options
from labgym.cli.describe import episode_outcome
from labgym.cli.outcome import DONE, written

if TYPE_CHECKING:
    from labgym.eval.driving.drive import Drive
    from labgym.layouts import Layout

Layouts = Positional[Annotated[tuple[str, ...], arg(metavar="LAYOUT [...]", help_behavior_hint="(default: the suite)")]]


def watch(layout: Layout, policy: str, pair: int, seed: int, options: PolicyOptions, port: int) -> int:
    """Show a policy on the goal pairs of a layout in the browser until Ctrl-C."""
    from labgym.envs.tasks import goal_pair
    from labgym.policies.process import PolicyProcess, PolicySource
    from labgym.suites import suite_of
    from labgym.viewer import Console, Show, episodes_of, run_viewer

    allow_local_modules()
    goal_pair(layout, pair)
    suite = suite_of([layout])
    driver = PolicyProcess(PolicySource.named(policy, parse_options(options)))
    try:
        show = Show(episodes_of([layout], suite), suite, driver, policy, Console(), seed, finished=_print)
        with suppress(KeyboardInterrupt):
            run_viewer(show, port, pair, _opened)
    finally:
        driver.close()
    return DONE


def play(
    layouts: Layouts = (),
    suite: Annotated[str, arg(aliases=("--split",))] = "test",
    protocol: OptionalText = None,
    out: OptionalPath = None,
    film: OptionalPath = None,
    name: str = "person",
    port: int = 8000,
) -> int:
    """Drive the robot by keyboard in the browser, under the rules of a suite, until Ctrl-C.

    A person's episodes count as a policy's: the same start, time limit and metrics. The page shows the laboratory, the
    robot's sensors and the shortest path.

    Args:
        layouts: Layouts to drive in instead of a suite: .json files, folders of them, or ids of published layouts.
        suite: Name of a suite (test, val, navdp_compat), or its .json file.
        protocol: Id or .json file of the protocol to drive for in the layouts; by default the one they embed.
        out: Folder for the finished episodes: episodes.jsonl with a row for each, as labgym eval writes it, and
            routes.jsonl. An episode that is driven again replaces its row.
        film: A .mp4 or .gif file for a film of the last finished episode.
        name: Name of the driver in the rows.
        port: Port of the page on 127.0.0.1; 0 takes a free port.
    """
    from labgym.envs.tasks import resolve_layouts
    from labgym.errors import OptionError
    from labgym.eval.drawing.film import check_film_path
    from labgym.suites import load_suite, suite_of
    from labgym.viewer import Console, Person, Show, episodes_of, run_viewer
    from labgym.viewer.records import DriveRecords

    if protocol is not None and not layouts:
        raise OptionError("--protocol is for layouts; the layouts of a suite embed their protocols")
    if film is not None:
        check_film_path(film)
    chosen = resolve_layouts(layouts, protocol)
    rules = suite_of(chosen) if chosen and not suite.endswith(".json") else load_suite(suite)
    chosen = chosen or list(rules.load_layouts())
    records = None if out is None else DriveRecords(out)
    episodes, drives = episodes_of(chosen, rules), []

    def finished(drive: Drive) -> None:
        _print(drive)
        drives.append(drive)
        if records is not None:
            records.add(drive)

    console = Console()
    show = Show(episodes, rules, Person(console), name, console, waits=True, finished=finished)
    with suppress(KeyboardInterrupt):
        run_viewer(show, port, 0, _opened)
    if out is not None and drives:
        written(out)
    if film is not None and drives:
        _film(next(layout for layout in chosen if layout.id == drives[-1].row.layout), drives[-1], film)
    return DONE


def _film(layout: Layout, drive: Drive, path: Path) -> None:
    from tqdm import tqdm

    from labgym.eval.drawing import film

    pictures = film.film(layout, drive.route, 640, 480)
    written(film.save_film(tqdm(pictures, "film", len(drive.route)), path))


def _opened(url: str) -> None:
    print(f"Open {url} in a browser of this machine; press Ctrl-C to stop", flush=True)


def _print(drive: Drive) -> None:
    row = drive.row
    score = "" if row.spl is None else f", SPL {row.spl:.3f}"
    print(f"{row.layout} pair {row.pair}: {episode_outcome(row)}, {row.contacts} contacts{score}", flush=True)
