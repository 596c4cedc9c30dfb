"""Explanations on the site: how to read its figures, and how episodes end."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from functools import lru_cache
from html import escape

from labgym.envs.labnav.task import DOCK_HEADING, DOCK_POSITION
from labgym.envs.parts.endings import StuckEnding
from labgym.eval.driving.episode_row import Ending
from labgym.eval.labnav.rules import WAITED
from labgym.eval.reports.site.entries import Entry

MEANINGS: dict[Ending, str] = {
    "success": "at rest in the goal's disc, in dock aligned, in carry without a spill; in shift at every goal",
    "contact": "the robot touched something that ends the drive",
    "stuck": f"{StuckEnding.duration:g} s within {StuckEnding.radius:g} m",
    "lost": "stopped outside the goal's disc, and inside it by its own odometry",
    "wrong place": "stopped outside the goal's disc, and outside it by its own odometry",
    "frozen": f"the time was over, and the robot had waited near people for at least {WAITED:g} s",
    "spilt": "arrived, and the liquid rose above the rim; in shift, it rose above the rim",
    "undocked": f"stopped at the dock with an error beyond {DOCK_POSITION:.2f} m or {DOCK_HEADING:.2f} rad",
    "time": "the time was over",
    "error": "the policy raised an exception or exceeded a limit",
}
"""How episodes end."""


def reading_notes(entries: Sequence[Entry], whole: bool) -> tuple[str, ...]:
    """Return how to read the figures of the leaderboard.

    Args:
        entries: on the page. whole: whether the headline is LabNav.
    """
    if whole:
        notes = ["LabNav is 100 (exp(mean ln(s + 0.05)) - 0.05) over the mean scores s of the eight tasks."]
        head = "LabNav"
    else:
        notes = ["The mean score is 100 times the mean of the tasks' mean scores; LabNav needs all eight tasks."]
        head = "the mean score"
    notes += [
        f"Bars show {head} from 0 to 100; brackets and whiskers are its 95% interval over floors.",
        "Columns of tasks are mean scores, 0 to 1; the shade grows with the score.",
        *(["Mean is 100 times their arithmetic mean."] if whole else []),
        "SR is the share of episodes that ended by success.",
        "Collision rate, the only column in which less is better, is the share of episodes in which the robot touched "
        "something; in shift touches of furniture count and do not end the drive.",
    ]
    if len({len(one.summary.tasks) for one in entries}) > 1:
        notes.append(
            "SR and collision rate are over the tasks that the policy drove; a dash marks a task that it did not."
        )
    most = max(one.most_episodes for one in entries)
    fewer = [f"{one.name} {one.most_episodes}" for one in entries if one.most_episodes < most]
    if fewer:
        notes.append(f"Fewer episodes per task: {', '.join(fewer)}; their intervals are wider.")
    still = [one.name for one in entries if one.published and not one.moves]
    if still and any(one.moves for one in entries):
        notes.append(f"No routes are published of {', '.join(still)}.")
    if any(one.summary.draft for one in entries):
        notes.append("Draft episodes: they may change, and their figures are not those of LabNav.")
    return tuple(notes)


def detail_of(one: Entry, episodes: int, mixed: bool) -> str:
    """Return the sensors of a policy and in what its row differs from the others.

    Args:
        one: its entry. episodes: number of episodes of a task. mixed: whether there are runs and published results.
    """
    parts = [
        one.summary.sensors,
        f"{one.most_episodes} episodes a task" if one.most_episodes != episodes else "",
        "published" if mixed and one.published else "",
    ]
    return ", ".join(part for part in parts if part)


def versions_of(entries: Sequence[Entry]) -> tuple[str, ...]:
    """Return the versions of the suites of the tasks, such as "1"."""
    labels = {task.suite for one in entries for task in one.summary.tasks}
    return tuple(sorted({label.partition("/")[2].partition(" ")[0] for label in labels} - {""}))


def swapped(entries: Sequence[Entry], better: Sequence[tuple[Entry, Entry]]) -> tuple[str, ...]:
    """Return the pairs that the figure and the mean score order differently.

    Args:
        entries: with a figure over the same tasks. better: pairs, the one with the higher mean score first.
    """
    comparable = {one.name for one in entries}
    return tuple(
        f"{worse.name} and {one.name}"
        for one, worse in better
        if {one.name, worse.name} <= comparable
        and (one.summary.headline.value or 0.0) < (worse.summary.headline.value or 0.0)
    )


_INLINE = re.compile(r"`([^`]+)`|\*\*([^*]+)\*\*|!?\[([^\]]*)\]\([^)]*\)")
"""Code, bold text, and a link or picture, of which the words stay."""
_ITEM = re.compile(r"(?:[-*]|\d+\.) +(.*)")
_RULE = re.compile(r"\|?[ :|-]+\|?$")


@lru_cache(maxsize=64)
def card_html(text: str) -> str:
    """Return a Markdown text without comments as HTML; text is escaped, links and pictures keep their words only."""
    lines = [line for line in text.splitlines() if not line.startswith("<!--")]
    return "\n".join(_blocks(lines))


def _blocks(lines: Sequence[str]) -> Iterator[str]:
    at = 0
    while at < len(lines):
        line = lines[at]
        if line.startswith("```"):
            end = _end(lines, at + 1, lambda each: not each.startswith("```"))
            yield f"<pre>{escape(chr(10).join(lines[at + 1 : end]))}</pre>"
            at = end + 1
        elif line.startswith("#"):
            yield f"<h4>{_inline(line.lstrip('# '))}</h4>"
            at += 1
        elif line.startswith("|"):
            end = _end(lines, at, lambda each: each.startswith("|"))
            yield _table(lines[at:end])
            at = end
        elif _ITEM.match(line):
            end = _end(lines, at, lambda each: bool(_ITEM.match(each)) or each.startswith(" "))
            yield _list(lines[at:end])
            at = end
        elif line.strip():
            end = _end(lines, at, lambda each: bool(each.strip()) and not each.startswith(("#", "|", "```")))
            words = _inline(" ".join(map(str.strip, lines[at:end])))
            if words.strip():
                yield f"<p>{words}</p>"
            at = end
        else:
            at += 1


def _end(lines: Sequence[str], start: int, inside: Callable[[str], bool]) -> int:
    """Return the index of the first line from `start` that is not inside a block."""
    return next((at for at in range(start, len(lines)) if not inside(lines[at])), len(lines))


def _list(lines: Sequence[str]) -> str:
    items: list[str] = []
    for line in lines:
        match = _ITEM.match(line)
        if match:
            items.append(match[1])
        else:
            items[-1] += f" {line.strip()}"
    return "<ul>" + "".join(f"<li>{_inline(item)}</li>" for item in items) + "</ul>"


def _table(lines: Sequence[str]) -> str:
    rows = [[cell.strip() for cell in line.strip().strip("|").split("|")] for line in lines if not _RULE.match(line)]
    if not rows:
        return ""
    rule = next((line for line in lines if _RULE.match(line)), "")
    right = [cell.strip().endswith(":") for cell in rule.strip().strip("|").split("|")]
    count = max(map(len, rows))
    look = ["" if index == 0 or right[index : index + 1] == [True] else ' class="words"' for index in range(count)]
    head = "".join(f'<th scope="col"{kind}>{_inline(cell)}</th>' for kind, cell in zip(look, rows[0], strict=False))
    body = "".join(
        f'<tr><th scope="row">{_inline(cells[0])}</th>'
        + "".join(f"<td{kind}>{_inline(cell)}</td>" for kind, cell in zip(look[1:], cells[1:], strict=False))
        + "</tr>"
        for cells in rows[1:]
    )
    return f'<div class="scroll" tabindex="0"><table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table></div>'


def _inline(text: str) -> str:
    """Return a line with its code, bold text and the words of its links."""
    parts, last = [], 0
    for match in _INLINE.finditer(text):
        parts.append(escape(text[last : match.start()]))
        code, bold, words = match.groups()
        if code is not None:
            parts.append(f"<code>{escape(code)}</code>")
        elif bold is not None:
            parts.append(f"<b>{escape(bold)}</b>")
        elif not match[0].startswith("!"):
            parts.append(escape(words))
        last = match.end()
    return "".join([*parts, escape(text[last:])])
