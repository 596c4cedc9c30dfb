"""The suites of LabNav: by name one task, all tasks, and two small ones, and those in files of `labgym labnav`."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from labgym.documents import canonical_hash, read_bytes
from labgym.envs.labnav.episodes import (
    DEVELOPMENT,
    UNFILTERED,
    LabNavEpisode,
    LabNavEpisodes,
    published_episodes,
    suite_file,
)
from labgym.envs.labnav.task import SECONDS
from labgym.envs.labnav.tasks import FIGURE_TASKS, HEADLINE, TASKS
from labgym.errors import DocumentError, OptionError, UnknownNameError, check_name
from labgym.json_stream import MAX_STREAM_BYTES
from labgym.layouts import Layout

PREFIX = "labnav"
MINI = "labnav-mini"
"""Small suite on floors-val, to try a policy out."""
CHECK = "labnav-check"
"""The same of the published suites on floors-test: `labgym run` compares its rows with published ones."""
VAL = f"{PREFIX}-{DEVELOPMENT}"
"""Suite of all tasks on floors-val, for development."""
MINI_EPISODES, MINI_SECONDS, MINI_GOALS = 3, 60.0, 3
"""Episodes of a task in the small suite, their time limit, seconds, and goals of a shift."""
_TASK = re.compile(r"([a-z]+)(-[a-z0-9]+)*")
_SCHEMA = re.compile(rb'"schema"\s*:\s*"' + re.escape(LabNavEpisodes.SCHEMA.encode()) + rb'"')


@dataclass(frozen=True)
class LabNavSuite:
    """A suite.

    Attributes:
        name: such as "labnav-aisle-2". parts: episodes of each task. seconds: time limit of a drive.
        figure: whether the suite has the figure LabNav: all eight tasks at one level.
    """

    name: str
    parts: tuple[LabNavEpisodes, ...]
    seconds: float = SECONDS

    @property
    def figure(self) -> bool:
        """Whether the suite gives the figure: it has all eight tasks, and their whole drives."""
        return is_whole(self.name, [part.task for part in self.parts])

    @property
    def draft(self) -> bool:
        """Whether some of its episodes may still change."""
        return any(part.draft for part in self.parts)

    @property
    def count(self) -> int:
        """Number of episodes."""
        return sum(len(part.episodes) for part in self.parts)

    @property
    def drives(self) -> int:
        """Number of drives: a shift has several."""
        return sum(len(episode.lengths) for part in self.parts for episode in part.episodes)

    @property
    def by_key(self) -> dict[str, tuple[LabNavEpisodes, LabNavEpisode]]:
        """The episodes with their part, by their keys, such as "aisle-2/floors-test-0000/1"."""
        return {key: (part, one) for part in self.parts for key, one in part.by_key.items()}

    @property
    def hash(self) -> str:
        """Hash of all that the suite's rules and episodes consist of."""
        return canonical_hash({"name": self.name, "seconds": self.seconds, "parts": [part.hash for part in self.parts]})


def is_whole(name: str, tasks: Iterable[str]) -> bool:
    """Whether a suite of some tasks gives the figure LabNav: all tasks, and their whole drives."""
    return name not in (MINI, CHECK) and set(tasks) == set(FIGURE_TASKS)


def is_labnav(suite: str) -> bool:
    """Whether a suite is one of LabNav: a name, or what `is_in_files` says."""
    name = _full_name(suite)
    named = name == PREFIX or name.startswith(f"{PREFIX}-")
    return (named and not suite.endswith(".json")) or is_in_files(suite)


def _full_name(suite: str) -> str:
    """Return the name of the suite that a task, such as "people-2", names; other names as they are."""
    match = _TASK.fullmatch(suite)
    return f"{PREFIX}-{suite}" if match and match[1] in TASKS else suite


def is_in_files(suite: str) -> bool:
    """Whether a suite is no name, but a file of episodes or a folder of such files."""
    path = Path(suite)
    files = _headline_files(path) if path.is_dir() else [path] if path.suffix == ".json" else []
    return suite not in suite_names() and any(_holds_episodes(file) for file in files)


def suite_names() -> tuple[str, ...]:
    """Return the names: of each task at each level and unfiltered, on floors-val, the selections and all tasks."""
    tasks, development = [f"{PREFIX}-{task}" for task in TASKS], [f"{VAL}-{task}" for task in TASKS]
    levels = [f"{task}-{level}" for task in (*tasks, *development) for level in (1, 2, 3)]
    unfiltered = [f"{task}-{HEADLINE}-{UNFILTERED}" for task in tasks]
    return (*tasks, *development, *levels, *unfiltered, MINI, CHECK, VAL, PREFIX)


def load_labnav(name: str) -> LabNavSuite:
    """Return a suite with its published episodes; a task without a level has the headline's.

    Args:
        name: of `suite_names`, or a task, such as "people-2".

    Raises:
        UnknownNameError: there is no such suite, or its episodes are not published.
        DocumentError: its file is broken.
    """
    name = _full_name(name)
    check_name("suite", name, suite_names())
    development = name.startswith(VAL) or name == MINI
    if name in (PREFIX, MINI, CHECK, VAL):
        prefix = VAL if development else PREFIX
        tasks = [task for task in TASKS if suite_file(f"{prefix}-{task}-{HEADLINE}").is_file()]
        parts = tuple(published_episodes(task, HEADLINE, development=development) for task in tasks)
        if name in (MINI, CHECK):
            return LabNavSuite(name, tuple(part.first(MINI_EPISODES, 1, MINI_GOALS) for part in parts), MINI_SECONDS)
        return LabNavSuite(name, parts)
    task, *rest = name.removeprefix(VAL if development else PREFIX).removeprefix("-").split("-")
    level = int(rest[0]) if rest else HEADLINE
    part = published_episodes(task, level, UNFILTERED not in rest, development)
    return LabNavSuite(f"{VAL}-{task}-{level}" if development else part.name, (part,))


def resolve_labnav(suite: str, layouts: Iterable[Layout] = ()) -> LabNavSuite:
    """Return the suite that a user names: a published one, or one in files.

    Args:
        suite: a name, or a file or folder of `labgym labnav`. layouts: the floors, if the split does not publish them.

    Raises:
        OptionError: layouts with a published suite. DocumentError, UnknownNameError: as `read_labnav`, `load_labnav`.
    """
    if is_in_files(suite):
        return read_labnav(suite, layouts)
    if tuple(layouts):
        raise OptionError(f"suite {suite!r} has its floors: leave out layouts")
    return load_labnav(suite)


def read_labnav(path: str | Path, layouts: Iterable[Layout] = ()) -> LabNavSuite:
    """Return the suite in a file of `labgym labnav`, or in its folder the suite of all tasks at the headline's level.

    Args:
        path: file or folder. layouts: the floors, if the split does not publish them.

    Raises:
        DocumentError: there is no such file, or it is broken.
        UnknownNameError: a floor is not published, or not among the layouts.
    """
    path, layouts = Path(path), tuple(layouts)
    files = _headline_files(path) if path.is_dir() else [path]
    if not files:
        raise DocumentError(path, "", f"holds no episodes: labgym labnav writes TASK-{HEADLINE}.json")
    parts = tuple(LabNavEpisodes.load(file) for file in files)
    if layouts:
        parts = tuple(part.on(layouts) for part in parts)
    splits = "-".join(sorted({part.split for part in parts}))
    own = "" if path.is_dir() else f"-{parts[0].name.removeprefix(f'{PREFIX}-')}"
    return LabNavSuite(f"{PREFIX}-{splits}{own}", parts)


def _headline_files(folder: Path) -> list[Path]:
    return [file for task in TASKS if (file := folder / f"{task}-{HEADLINE}.json").is_file()]


def _holds_episodes(file: Path) -> bool:
    """Whether a file holds episodes of LabNav; a file that cannot be read does not."""
    try:
        return _SCHEMA.search(read_bytes(file, MAX_STREAM_BYTES)) is not None
    except DocumentError:
        return False


DRIVE_CPU_S = {
    "still": 0.5, "straight": 0.25, "blind": 0.4, "bug2": 0.7, "astar": 0.4, "ppo": 0.5, "dwa": 1.0, "online_map": 4.0,
    "stack": 1.1, "local-imitation": 0.7, "local-ppo": 0.7, "clairvoyant": 2.5, "iplanner": 2.5, "navdp": 20.0,
    "ppo-depth": 3.0, "lidar-lstm": 0.5,
}  # fmt: skip
"""CPU seconds of a drive by policy on one core, with the processes of the policies: measured in carry; of online_map,
iplanner, ppo-depth and navdp in the first episode of each floor of all tasks, from the time that two cores took; of
clairvoyant estimated."""


def cost(suite: LabNavSuite, policy: str) -> str:
    """Return a sentence on the episodes of a suite, and on the CPU time of a policy as far as it is known."""
    tasks = ", ".join(f"{part.task}-{part.level}" for part in suite.parts)
    text = f"{suite.name}: {suite.count} episodes of at most {suite.seconds:g} s simulated ({tasks})"
    each = DRIVE_CPU_S.get(policy)
    text += "." if each is None else f"; about {_hours(suite.drives * each)} of CPU time for {policy}."
    missing = [task for task in FIGURE_TASKS if task not in {part.task for part in suite.parts}]
    if suite.name == "labnav" and missing:
        text += f" Not published yet: {', '.join(missing)}; without them there is no figure LabNav."
    return text


def _hours(seconds: float) -> str:
    return f"{max(1.0, seconds / 60.0):.0f} min" if seconds < 5400.0 else f"{seconds / 3600.0:.1f} h"


def published_episode(suite: str, key: str) -> tuple[LabNavEpisodes, LabNavEpisode, float]:
    """Return an episode of a suite with its task's episodes and its time limit, seconds.

    Args:
        suite: such as "labnav-people-2". key: floor/number, or task-level/floor/number.

    Raises:
        UnknownNameError: there is no such suite or episode.
        OptionError: several tasks of the suite have such an episode.
    """
    chosen = load_labnav(suite)
    keys = chosen.by_key
    fitting = [key] if key in keys else [each for each in keys if each.endswith(f"/{key.lstrip('/')}")]
    if not fitting:
        raise UnknownNameError(f"episode of {suite}", key, keys)
    if len(fitting) > 1:
        raise OptionError(f"episode {key!r} of {suite} is one of {', '.join(fitting[:5])}: name its task too")
    return *keys[fitting[0]], chosen.seconds
