"""Episodes of the viewer: their choice, and the data that the page holds of them."""

from __future__ import annotations

import os
import shlex
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np

from labgym.envs.labnav.nuisances import prepared
from labgym.envs.labnav.tasks import task_of
from labgym.envs.tasks import Task
from labgym.errors import LabgymError
from labgym.eval.labnav.replay import things_along
from labgym.eval.labnav.shown_drive import ShownDrive
from labgym.eval.labnav.suites import LabNavSuite, load_labnav, suite_names
from labgym.eval.reports.site.entries import Entry
from labgym.eval.reports.site.plans import plan_of_map, thing_name, world_of_episode
from labgym.eval.reports.site.replays import Replay
from labgym.layouts import Layout
from labgym.policies.registry import BUILT_IN

MOST_EPISODES = 60
"""Greatest number of episodes in the viewer."""
TELLING = 2
"""Episodes of each task on which the policies differ most."""
FILMS = "films"
"""Folder in that of an evaluation where its films are, named after their episodes."""
MOVES = ("route", "people", "things")
"""Names of what moves in a drive."""


@dataclass
class Shown:
    """The episodes in the viewer, and their floors.

    Attributes:
        episodes: in the order of the suite, with what moves in each drive. plans: floors by their key.
        tasks: of the episodes, after their conditions.
        problems: a sentence for each task whose episodes cannot be shown.
    """

    episodes: list[dict[str, Any]] = field(default_factory=list)
    plans: dict[str, dict[str, Any]] = field(default_factory=dict)
    tasks: list[Task] = field(default_factory=list)
    problems: list[str] = field(default_factory=list)

    @property
    def outlines(self) -> list[dict[str, Any]]:
        """The episodes without what moves in their drives, which the page loads when it shows an episode."""
        return [
            {**one, "runs": [{name: run[name] for name in run if name not in MOVES} for run in one["runs"]]}
            for one in self.episodes
        ]

    @property
    def replays(self) -> list[Replay]:
        """The episodes as they are replayed."""
        return [
            Replay(task, {run["policy"]: {name: run[name] for name in MOVES if name in run} for run in one["runs"]})
            for one, task in zip(self.episodes, self.tasks, strict=True)
        ]

    @property
    def keys(self) -> frozenset[str]:
        """The keys of the episodes."""
        return frozenset(one["key"] for one in self.episodes)


def episodes_shown(entries: Sequence[Entry], suite: str, home: Path, most: int = MOST_EPISODES) -> Shown:
    """Return the episodes of the viewer.

    Args:
        entries: in the order of the page. suite: name of that of their episodes.
        home: folder of the page, for links to films. most: greatest number of episodes.
    """
    shown = Shown()
    if suite not in suite_names():
        shown.problems.append(f"no episodes are shown: suite {suite} is not published")
        return shown
    try:
        published = load_labnav(suite)
    except LabgymError as error:
        shown.problems.append(f"no episodes are shown: {error}")
        return shown
    current = set()
    for part in published.parts:
        labels = {task.suite for one in entries for task in one.summary.tasks if task.task == part.task}
        if labels - {part.label}:
            shown.problems.append(f"episodes of {part.name} are not shown: they are now those of {part.label}")
        else:
            current.add(part.name)
    places = {key: place for key, place in published.by_key.items() if place[0].name in current}
    layouts: dict[tuple[str, str, str], Layout] = {}
    for key in chosen(entries, list(places), most):
        part, episode = places[key]
        place = part.split, episode.floor, episode.floor_hash
        layout = layouts[place] = layouts.get(place) or part.layout(episode.floor)
        task = prepared(part.task, part.level, episode, layout)
        name = f"{part.split}/{episode.floor}"
        if task.old_map is not None and task.old_map.hash != layout.hash:
            name += f"/{key}"
        if name not in shown.plans:
            shown.plans[name] = plan_of_map(task.old_map or task.layout)
        shown.episodes.append(_episode(key, published, task, name, entries, home))
        shown.tasks.append(task)
    return shown


def chosen(entries: Sequence[Entry], keys: Sequence[str], most: int) -> list[str]:
    """Return the episodes to show, in the order of the suite.

    Of each task those that most policies drove and on which their scores differ most, on different floors; then those
    that show how each policy fails in each task, as many ways at a time as possible.

    Args:
        entries: the policies. keys: of all episodes. most: greatest number.
    """
    keys = [key for key in keys if any(key in one.outcomes for one in entries)]
    if len(keys) <= most:
        return list(keys)
    picked: list[str] = []
    for task in dict.fromkeys(key.split("/")[0] for key in keys):
        picked += _telling(entries, [key for key in keys if key.startswith(f"{task}/")])
    picked = picked[:most]
    ways: dict[str, set[tuple[str, str, str]]] = {key: set() for key in keys}
    for one in entries:
        for key in keys:
            if key in one.endings:
                ways[key].add((one.name, key.split("/")[0], one.endings[key]))
    missing = set().union(*ways.values()) - set().union(*(ways[key] for key in picked))
    while missing and len(picked) < most:
        best = max(keys, key=lambda key: len(ways[key] & missing))
        picked.append(best)
        missing -= ways[best]
    return [key for key in keys if key in set(picked)]


def _telling(entries: Sequence[Entry], keys: Sequence[str]) -> list[str]:
    """Return the episodes of most policies with the greatest spread of scores, on different floors."""
    scores = {key: [one.scores[key] for one in entries if key in one.scores] for key in keys}
    most = max(map(len, scores.values()), default=0)
    spread = {key: float(np.std(values)) for key, values in scores.items() if len(values) == most}
    order = {key: number for number, key in enumerate(keys)}
    picked: list[str] = []
    for key in sorted(spread, key=lambda key: (-spread[key], order[key])):
        if key.split("/")[-2] not in {each.split("/")[-2] for each in picked}:
            picked.append(key)
    return picked[:TELLING]


def _episode(
    key: str, suite: LabNavSuite, task: Task, plan: str, entries: Sequence[Entry], home: Path
) -> dict[str, Any]:
    """Return an episode as the page holds it."""
    part, episode = suite.by_key[key]
    runs = [
        {
            "policy": number,
            "score": round(one.scores[key], 3),
            "ending": one.endings[key],
            **_drive(one, key, suite, task, home),
        }
        for number, one in enumerate(entries)
        if key in one.outcomes
    ]
    return {
        "key": key,
        "task": part.task,
        "level": part.level,
        "words": task_of(part.task).summary,
        "plan": plan,
        "floor": episode.floor,
        "number": episode.number,
        "length": round(sum(episode.lengths), 2),
        "radius": round(task_of(part.task).radius * 100),
        **world_of_episode(task),
        "runs": runs,
    }


def _drive(one: Entry, key: str, suite: LabNavSuite, task: Task, home: Path) -> dict[str, Any]:
    """Return what the page holds of a drive: score, ending, facts, route, people, things, film and command."""
    row, outcome = one.rows.get(key), one.outcomes[key]
    if row is None:
        shown = one.drives.get(key)
    else:
        folder = one.evaluation if task.pushable else None
        things = None if folder is None else things_along(folder, suite, key)
        shown = ShownDrive.of(row, one.routes.get(key, ()), task, things)
    drive: dict[str, Any] = {"score": round(outcome.score, 3), "ending": outcome.ending, "time": round(outcome.time, 1)}
    drive |= {} if shown is None else _facts_of(shown)
    if command := command_of(one, key):
        drive["command"] = command
    film = film_of(one, key, home)
    return drive if film is None else {**drive, "film": film}


def _facts_of(shown: ShownDrive) -> dict[str, Any]:
    """Return what the viewer says and draws of a drive besides its outcome; without what it does not have."""
    facts: dict[str, Any] = {
        "driven": shown.driven,
        "away": shown.away,
        "touches": shown.touches,
        "contact": thing_name(shown.contact) if shown.contact else "",
        "legs": [[leg.ending, int(leg.docked), leg.time] for leg in shown.legs],
        "error": shown.error,
    }
    parts = {name: getattr(shown, name) for name in MOVES}
    facts |= {name: part.model_dump(mode="json") for name, part in parts.items() if part is not None}
    return {name: value for name, value in facts.items() if value not in ("", [])}


def command_of(one: Entry, key: str) -> str:
    """Return the command that drives an episode again and films it; "" for a policy that is not installed."""
    if one.evaluation is not None:
        return shlex.join(["labgym", "record", str(one.evaluation.folder), "--episode", key, "--out", "drive.mp4"])
    policy, options = one.summary.policy, one.summary.options
    if policy not in BUILT_IN:
        return ""
    given = [f"{name}={value}" for name, value in options.items()]
    command = ["labgym", "record", one.summary.suite, "--episode", key, "--policy", policy, "--out", "drive.mp4"]
    return shlex.join([*command, "--seed", str(one.summary.seed), *(["--options", *given] if given else [])])


def film_of(one: Entry, key: str, home: Path) -> str | None:
    """Return the address of an episode's film, relative to the page; None without a film."""
    if one.evaluation is None:
        return None
    for suffix in (".mp4", ".gif"):
        path = one.evaluation.folder / FILMS / (key.replace("/", "_") + suffix)
        if path.is_file():
            return quote(Path(os.path.relpath(path.resolve(), home.resolve())).as_posix())
    return None
