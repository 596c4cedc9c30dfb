"""The suites of LabNav by name: one task, all tasks, and two selections."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from labgym.documents import canonical_hash
from labgym.envs.labnav.episodes import DEVELOPMENT, UNFILTERED, LabNavEpisodes, published_episodes, suite_file
from labgym.envs.labnav.tasks import HEADLINE, SECONDS, TASKS
from labgym.errors import UnknownNameError

PREFIX = "labnav"
MINI = "labnav-mini"
FIRST = "labnav-60"
"""Suite of all tasks with the first episode of each floor only, for policies that cost much."""
VAL = f"{PREFIX}-{DEVELOPMENT}"
"""Suite of all tasks on floors-val, for development."""
ALL = ("aisle", "moved", "people", "odometry", "dock", "glass", "carry", "shift")
"""The eight tasks of the figure."""
MINI_EPISODES, MINI_SECONDS, MINI_GOALS = 3, 60.0, 3
"""Episodes of a task in the small suite, their time limit, seconds, and goals of a shift."""


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
    def hash(self) -> str:
        """Hash of all that the suite's rules and episodes consist of."""
        return canonical_hash({"name": self.name, "seconds": self.seconds, "parts": [part.hash for part in self.parts]})


def is_whole(name: str, tasks: Iterable[str]) -> bool:
    """Whether a suite of some tasks gives the figure LabNav: all tasks, and their whole drives."""
    return name != MINI and set(tasks) == set(ALL)


def is_labnav(name: str) -> bool:
    """Whether the name of a suite is one of LabNav's."""
    return name == PREFIX or name.startswith(f"{PREFIX}-")


def suite_names() -> tuple[str, ...]:
    """Return the names: of each task at each level and unfiltered, on floors-val, the selections and all tasks."""
    tasks, development = [f"{PREFIX}-{task}" for task in TASKS], [f"{VAL}-{task}" for task in TASKS]
    levels = [f"{task}-{level}" for task in (*tasks, *development) for level in (1, 2, 3)]
    unfiltered = [f"{task}-{HEADLINE}-{UNFILTERED}" for task in tasks]
    return (*tasks, *development, *levels, *unfiltered, MINI, VAL, FIRST, PREFIX)


def load_labnav(name: str) -> LabNavSuite:
    """Return a suite with its published episodes; a task without a level has the headline's.

    Raises:
        UnknownNameError: there is no such suite, or its episodes are not published.
        DocumentError: its file is broken.
    """
    if name not in suite_names():
        raise UnknownNameError("suite", name, suite_names())
    development = name.startswith(VAL)
    if name in (PREFIX, FIRST, MINI, VAL):
        prefix = VAL if development else PREFIX
        tasks = [task for task in TASKS if suite_file(f"{prefix}-{task}-{HEADLINE}").is_file()]
        parts = tuple(published_episodes(task, HEADLINE, development=development) for task in tasks)
        if name == MINI:
            return LabNavSuite(name, tuple(part.first(MINI_EPISODES, 1, MINI_GOALS) for part in parts), MINI_SECONDS)
        return LabNavSuite(name, tuple(part.first(None, 1) for part in parts) if name == FIRST else parts)
    task, *rest = name.removeprefix(VAL if development else PREFIX).removeprefix("-").split("-")
    level = int(rest[0]) if rest else HEADLINE
    part = published_episodes(task, level, UNFILTERED not in rest, development)
    return LabNavSuite(f"{VAL}-{task}-{level}" if development else part.name, (part,))
