"""The contents of the site, and its page."""

from __future__ import annotations

import base64
import hashlib
import json
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from importlib.resources import files
from pathlib import Path
from typing import Any

from labgym.documents import write_text
from labgym.envs.labnav.tasks import task_of
from labgym.eval.driving.episode_row import ENDINGS, TRACKS, Track
from labgym.eval.driving.intervals import Estimate, estimate_text
from labgym.eval.labnav.figure import differences, paired_difference
from labgym.eval.labnav.summary import DIFFICULTIES, TaskSummary
from labgym.eval.reports.labnav_tables import tasks_of
from labgym.eval.reports.report import PACKAGE, Card, page_environment
from labgym.eval.reports.site.entries import KINDS, Entry, Kind, card_of
from labgym.eval.reports.site.episodes import Shown, episodes_shown
from labgym.eval.reports.site.notes import MEANINGS, card_html, detail_of, reading_notes, swapped, versions_of
from labgym.eval.reports.site.plans import CLASSES as FURNITURE
from labgym.eval.reports.site.plans import thing_name
from labgym.eval.reports.site.replays import FOLDER as REPLAYS
from labgym.eval.reports.site.replays import write_replays
from labgym.table import Table

SCRIPTS, STYLE = ("replay.js", "site.js"), "site.css"
COLORS, LINES = 7, ("", "dashed", "dotted")
"""Number of colors of routes, and how their lines are drawn."""
MOST_CONTACTS = 8
"""Most kinds of things touched that a policy's section lists."""


@dataclass(frozen=True)
class Bar:
    """A figure with its interval: text, and value and ends in percent of the scale."""

    text: str
    value: float
    low: float | None
    high: float | None
    short: str = ""

    @classmethod
    def of(cls, estimate: Estimate, digits: int, scale: float) -> Bar | None:
        """Return the bar of an estimate; None if it has no value."""
        if estimate.value is None:
            return None
        ends = [None if end is None else scale * end for end in (estimate.low, estimate.high)]
        text = estimate_text(estimate, digits)
        return cls(text, scale * estimate.value, ends[0], ends[1], text.partition(" ")[0])


@dataclass(frozen=True)
class TaskLine:
    """A task in the section of a policy; `endings` are (ending, count, address of an episode or "")."""

    name: str
    score: Bar | None
    success: str
    contacts: str
    episodes: int
    endings: tuple[tuple[str, int, str], ...]


@dataclass(frozen=True)
class Section:
    """A policy: its row in the leaderboard, and its section.

    Attributes:
        number: on the page. color: index of the look of its routes.
        detail: its sensors, and its episodes if they are few.
        facts: names and values. classes: scores by difficulty.
        touched: things whose touch ended a drive, with counts. card: the model card as HTML.
    """

    number: int
    color: int
    entry: Entry
    detail: str
    figure: Bar | None
    mean: float | None
    success: float | None
    contacts: float | None
    scores: tuple[Bar | None, ...]
    lines: tuple[TaskLine, ...]
    facts: tuple[tuple[str, str], ...]
    classes: tuple[tuple[str, tuple[tuple[str, float, int], ...]], ...]
    touched: str
    card: str

    @property
    def look(self) -> str:
        """Classes of the line that draws its routes: 21 policies differ."""
        dashes = LINES[self.color // COLORS % len(LINES)]
        return f"r{self.color % COLORS}{f' {dashes}' if dashes else ''}"


@dataclass(frozen=True)
class TaskSection:
    """A task: what it asks for, and the policies that drove it, the best first.

    Attributes:
        name: with its level, such as "aisle-2". words: what it asks for. rows: policies with their results.
        episode: address of its first episode in the viewer; "" without one.
    """

    name: str
    words: str
    rows: tuple[tuple[Section, TaskLine], ...]
    episode: str

    @property
    def endings(self) -> tuple[str, ...]:
        """The endings that occurred, in the order of the tables."""
        occurred = {ending for _, line in self.rows for ending, count, _ in line.endings if count}
        return tuple(ending for ending in ENDINGS if ending in occurred)


@dataclass(frozen=True)
class PairLine:
    """A pair of policies, the better one first; the difference and its ends are in hundredths of the score."""

    first: Section
    second: Section
    text: str
    value: float
    low: float | None
    high: float | None
    episodes: int
    apart: bool


@dataclass(frozen=True)
class SiteContent:
    """The contents of the page.

    Attributes:
        headline: name of the figure. tasks: names. boards: the policies of each task. tracks: with their sections.
        pairs: all of them. swapped: those that the figure orders differently.
        shown: the episodes of the viewer. other: tables of other suites. facts: provenance.
        tables, cards: of laboratories and of routes in them. views: captions and addresses of pictures.
    """

    title: str
    subtitle: str
    headline: str
    tasks: tuple[str, ...]
    boards: tuple[TaskSection, ...]
    tracks: tuple[tuple[Track, str, tuple[Section, ...]], ...]
    sections: tuple[Section, ...]
    endings: tuple[str, ...]
    pairs: tuple[PairLine, ...]
    swapped: tuple[str, ...]
    shown: Shown
    notes: tuple[str, ...]
    problems: tuple[str, ...]
    other: tuple[Table, ...]
    facts: tuple[tuple[str, str], ...]
    tables: tuple[Table, ...] = ()
    views: tuple[tuple[str, str], ...] = ()
    cards: tuple[Card, ...] = ()

    @property
    def failures(self) -> tuple[tuple[Section, str, str, str], ...]:
        """The first drive of each ending without success, for each policy that is not a published result.

        Each is (policy, address of the episode, its key, how it ended).
        """
        failures: dict[tuple[int, str], tuple[Section, str, str, str]] = {}
        for index, episode in enumerate(self.shown.episodes):
            for run in episode["runs"]:
                one, ending = self.sections[run["policy"]], run["ending"]
                if ending == "success" or one.entry.published:
                    continue
                named = "time over" if ending == "time" else ending
                words = f"{named} with {run['contact']}" if run.get("contact") else named
                address = f"#e{index}.p{one.number}"
                failures.setdefault((one.number, ending), (one, address, episode["key"], words))
        return tuple(failures[key] for key in sorted(failures))

    @property
    def choice(self) -> str:
        """Which episodes the viewer has, as a sentence; "" if it has all."""
        shown, driven = len(self.shown.episodes), len({key for one in self.sections for key in one.entry.outcomes})
        if shown == driven:
            return ""
        return (
            f"{shown} of {driven} episodes: of each task those on which the scores differ most, and those that show "
            "how the policies fail."
        )

    @property
    def routes(self) -> bool:
        """Whether a policy has routes."""
        return any(one.entry.moves for one in self.sections)

    @property
    def mixed(self) -> bool:
        """Whether there are runs and published results."""
        return len({one.entry.published for one in self.sections}) > 1

    @property
    def kinds(self) -> dict[Kind, str]:
        """The kinds of the policies on the page and what they mean."""
        present = {one.entry.kind for one in self.sections}
        return {kind: words for kind, words in KINDS.items() if kind in present}

    @property
    def together(self) -> tuple[PairLine, ...]:
        """The pairs that are not apart."""
        return tuple(pair for pair in self.pairs if not pair.apart)

    def along(self, value: float) -> float:
        """Return where a difference of scores, in hundredths, lies on the scale of all pairs, in percent."""
        low, high = self._scale
        return 100.0 * (value - low) / (high - low)

    @cached_property
    def _scale(self) -> tuple[float, float]:
        ends = [end for pair in self.pairs for end in (pair.value, pair.low, pair.high) if end is not None]
        return min([0.0, *ends]), max([1.0, *ends])

    @property
    def data(self) -> dict[str, Any]:
        """The data that the script reads: policies, furniture, floors and episodes."""
        return {
            "policies": [one.entry.name for one in self.sections],
            "looks": [one.look for one in self.sections],
            "furniture": dict(FURNITURE.values()),
            "plans": self.shown.plans,
            "episodes": self.shown.outlines,
        }


def site_of(
    entries: Sequence[Entry],
    suite: str,
    home: Path,
    title: str = "LabNav",
    problems: Iterable[str] = (),
    other: Iterable[Table] = (),
    facts: Iterable[tuple[str, str]] = (),
) -> SiteContent:
    """Return the contents of the site.

    Args:
        entries: in the order of the page. suite: name of that of their episodes. home: folder of the page.
        title: heading. problems: contradictions in the results. other: tables of other suites. facts: provenance.
    """
    shown = episodes_shown(entries, suite, home) if entries else Shown()
    tasks = tasks_of([one.summary for one in entries])
    own = [one for one in entries if not one.published] or entries
    most = max((one.most_episodes for one in own), default=0)
    mixed = len({one.published for one in entries}) > 1
    colors = sorted(range(len(entries)), key=lambda number: not entries[number].moves)
    sections = tuple(
        _section(number, colors.index(number), one, tasks, detail_of(one, most, mixed), shown)
        for number, one in enumerate(entries)
    )
    tracks = tuple(
        (track, words, chosen)
        for track, words in TRACKS.items()
        if (chosen := tuple(one for one in sections if one.entry.summary.track == track))
    )
    few = "" if all(one.most_episodes == most for one in own) else "up to "
    versions = versions_of(entries)
    version = f", version {versions[0]}" if len(versions) == 1 else ""
    whole = any(one.summary.labnav is not None for one in entries)
    pairs = _pairs(sections)
    complete = [one for one in entries if len(one.summary.tasks) == len(tasks)]
    return SiteContent(
        title=title,
        subtitle=f"Navigation in chemistry laboratories at work: suite {suite}{version}, {few}{most} episodes a task",
        headline="LabNav" if whole else "Mean score",
        tasks=tasks,
        boards=tuple(_board(name, sections, shown) for name in tasks),
        tracks=tracks,
        sections=sections,
        endings=tuple(name for name in ENDINGS if any(name in each.endings.values() for each in entries)),
        pairs=pairs,
        swapped=swapped(complete, [(pair.first.entry, pair.second.entry) for pair in pairs]),
        shown=shown,
        notes=reading_notes(entries, whole) if entries else (),
        problems=(*problems, *shown.problems),
        other=tuple(other),
        facts=tuple(facts),
    )


def render_site(site: SiteContent) -> str:
    """Return the page as HTML; all text is escaped, and the script and the data are part of it."""
    *scripts, style = (files(PACKAGE).joinpath("templates", name).read_text("utf-8") for name in (*SCRIPTS, STYLE))
    script = "".join(scripts)
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    template = page_environment().get_template("site.html.j2")
    return template.render(
        site=site, kinds=KINDS, meanings=MEANINGS, script=script, style=style, digest=digest, data=embedded(site.data)
    )


def write_site(site: SiteContent, path: str | Path) -> Path:
    """Write the replays and then the page, each atomically, and return the page's path."""
    if site.shown.episodes:
        write_replays(site.shown.replays, Path(path).parent / REPLAYS)
    return write_text(path, render_site(site))


def embedded(data: Any) -> str:
    """Return data as JSON that a script element can hold: nothing in it can end the element or open another."""
    text = json.dumps(data, separators=(",", ":"), ensure_ascii=True, allow_nan=False)
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


def _section(number: int, color: int, one: Entry, tasks: Sequence[str], detail: str, shown: Shown) -> Section:
    summary, own, card = one.summary, one.summary.by_task, card_of(one.summary.policy)
    whole = len(own) == len(tasks)
    return Section(
        number=number,
        color=color,
        entry=one,
        detail=detail,
        figure=Bar.of(summary.headline, 1, 1.0) if whole else None,
        mean=summary.mean if whole else None,
        success=summary.share("success"),
        contacts=summary.share("contacts"),
        scores=tuple(Bar.of(own[name].score, 2, 100.0) if name in own else None for name in tasks),
        lines=tuple(_line(number, one, name, task, shown) for name, task in own.items()),
        facts=_facts(one),
        classes=tuple(
            (title, tuple((name, *group) for name, group in found.items()))
            for field, (title, _) in DIFFICULTIES.items()
            if len(found := summary.classes(field)) > 1
        ),
        touched=_touched(one),
        card="" if card is None else card_html(card.read_text("utf-8")),
    )


def _board(name: str, sections: Sequence[Section], shown: Shown) -> TaskSection:
    task, _, level = name.rpartition("-")
    rows = [(one, line) for one in sections for line in one.lines if line.name == f"{task} {level}"]
    rows.sort(key=lambda row: -(row[1].score.value if row[1].score else -1.0))
    first = next((index for index, each in enumerate(shown.episodes) if each["key"].startswith(f"{name}/")), None)
    return TaskSection(name, task_of(task).summary, tuple(rows), "" if first is None else f"#e{first}")


def _line(number: int, one: Entry, name: str, task: TaskSummary, shown: Shown) -> TaskLine:
    first: dict[str, str] = {}
    for index, episode in enumerate(shown.episodes):
        ending = one.endings.get(episode["key"])
        if episode["key"].startswith(f"{name}/") and ending is not None:
            first.setdefault(ending, f"#e{index}.p{number}")
    endings = tuple((each, task.endings.get(each, 0), first.get(each, "")) for each in ENDINGS)
    success, contacts = (estimate_text(each, 2) for each in (task.success, task.contacts))
    return TaskLine(name.replace("-", " "), Bar.of(task.score, 2, 100.0), success, contacts, task.episodes, endings)


def _facts(one: Entry) -> tuple[tuple[str, str], ...]:
    """Return what a section says about a policy besides its scores."""
    summary = one.summary
    options = ", ".join(f"{name}={value}" for name, value in summary.options.items())
    planning = () if one.planning is None else (f"{one.planning:.1f} ms an action (median of episodes)",)
    facts = [
        *([("Policy", summary.policy)] if summary.policy != one.name else []),
        ("Kind", f"{one.kind}: {KINDS[one.kind]}"),
        ("Track", TRACKS[summary.track]),
        ("Sensors", summary.sensors),
        ("Options", options or "defaults"),
        ("Latency of actions", f"{summary.latency:g} s"),
        *(("Measured time", words) for words in planning),
        ("Suite", f"{summary.suite}, random seed {summary.seed}"),
        ("Commit", one.commit_words or "not recorded"),
    ]
    if one.mark:
        facts.append(("Thinking time", one.mark))
    if one.fresh is not None:
        facts.append(("Fresh floors", one.fresh.sentence))
    parked = sum(task.parked for task in summary.tasks)
    if parked:
        facts.append(("Stopped by the evaluator", f"in {parked} episodes: the policy cannot stop"))
    for task in summary.tasks:
        if task.precise is not None:
            facts.append(("Docked within 0.05 m and 0.05 rad", f"{estimate_text(task.precise, 2)} of episodes"))
        if task.legs:
            facts.append(("Drives of shifts", _counted(task.legs.items())))
    return tuple(facts)


def _touched(one: Entry) -> str:
    counts: Counter[str] = Counter()
    for kind, count in one.summary.touched.items():
        counts[thing_name(kind)] += count
    words = _counted(counts.most_common(MOST_CONTACTS))
    rest = len(counts) - MOST_CONTACTS
    return words + (f" and {rest} other kinds" if rest > 0 else "")


def _counted(counts: Iterable[tuple[str, int]]) -> str:
    return ", ".join(f"{name} ({count})" for name, count in counts)


def _pairs(sections: Sequence[Section]) -> tuple[PairLine, ...]:
    """Return the paired differences of all pairs of policies that share episodes."""
    order = sorted(sections, key=lambda one: -(one.entry.summary.headline.value or 0.0))
    named = {one.entry.name: one for one in order}
    lines = []
    for names, result in differences({name: one.entry.scores for name, one in named.items()}).items():
        a, b = (named[name] for name in names)
        value = result.difference.value or 0.0
        if value < 0.0:
            a, b = b, a
            result = paired_difference(a.entry.scores, b.entry.scores)
        one = result.difference
        low, high = (None if end is None else 100.0 * end for end in (one.low, one.high))
        words, apart = estimate_text(one, 3), result.significant
        lines.append(PairLine(a, b, words, abs(100.0 * value), low, high, one.count, apart))
    return tuple(lines)
