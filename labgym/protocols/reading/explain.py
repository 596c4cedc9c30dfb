"""Explanations: a procedure with what each of its spans became, for a terminal and as HTML."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from html import escape
from typing import Literal

from labgym.protocols.experiments.model import Action, Portion
from labgym.protocols.reading.actions import ActionList
from labgym.protocols.reading.figures import figures, plain

SpanKind = Literal["operation", "substance", "figure", "unread"]
_COLORS: dict[SpanKind, str] = {"operation": "34", "substance": "32", "figure": "36", "unread": "1;31"}
"""ANSI colors: blue operations, green substances, cyan amounts and conditions, bold red unread."""
_STYLE = (
    "body{font:16px/1.6 sans-serif;max-width:60em;margin:2em auto;padding:0 1em}"
    ".operation{border-bottom:2px solid #36c}.substance{background:#d6f5d6}.figure{background:#d9eefc}"
    ".unread{background:#fbb;font-weight:bold}li{margin:.2em 0}small{color:#555}"
)


@dataclass(frozen=True)
class Marked:
    """A span of a text and its meaning; `action` is counted from 1, or 0 without one."""

    start: int
    end: int
    kind: SpanKind
    action: int
    meaning: str


def marks(actions: ActionList) -> list[Marked]:
    """Return the disjoint spans that were understood or are unread, in order."""
    found: list[Marked] = []
    for number, action in enumerate(actions.actions, 1):
        portions = [portion for portion in (*action.takes, *action.gives) if portion.span is not None]
        found += [Marked(*portion.span, "substance", number, _portion(portion)) for portion in portions if portion.span]
    found += [Marked(item.start, item.end, "unread", 0, item.why) for item in actions.unread]
    taken = bytearray(len(actions.text))
    kept: list[Marked] = []
    for mark in sorted(found, key=lambda item: (item.start, -item.end)):
        if not any(taken[mark.start : mark.end]):
            taken[mark.start : mark.end] = b"\1" * (mark.end - mark.start)
            kept.append(mark)
    spans = [(action.span, number, action) for number, action in enumerate(actions.actions, 1) if action.span]
    for figure in figures(plain(actions.text)):
        owner = next((number for span, number, _ in spans if span[0] <= figure.start < span[1]), 0)
        if owner and not any(taken[figure.start : figure.end]):
            taken[figure.start : figure.end] = b"\1" * (figure.end - figure.start)
            kept.append(Marked(figure.start, figure.end, "figure", owner, figure.kind))
    for span, number, action in spans:
        stop = span[0]
        while stop < span[1] and not taken[stop] and actions.text[stop] not in " ,;(":
            stop += 1
        if stop > span[0]:
            taken[span[0] : stop] = b"\1" * (stop - span[0])
            kept.append(Marked(span[0], stop, "operation", number, action.verb))
    return sorted(kept, key=lambda item: item.start)


def explained(actions: ActionList, color: bool = True) -> str:
    """Return the text with its spans marked, and the actions below, for a terminal.

    Args:
        color: with ANSI colors; else unread spans stand in double brackets.
    """
    parts: list[str] = []
    at = 0
    for mark in marks(actions):
        parts.append(actions.text[at : mark.start])
        words = actions.text[mark.start : mark.end]
        if color:
            words = f"\033[{_COLORS[mark.kind]}m{words}\033[0m"
        elif mark.kind == "unread":
            words = f"[[{words}]]"
        parts.append(words)
        at = mark.end
    parts.append(actions.text[at:])
    return "\n".join(["".join(parts), "", *_lines(actions)])


def explained_html(actions: ActionList) -> str:
    """Return the explanation as an HTML page; all text is escaped."""
    body: list[str] = []
    at = 0
    for mark in marks(actions):
        body.append(escape(actions.text[at : mark.start]))
        title = f"{mark.action}. {mark.meaning}" if mark.action else mark.meaning
        words = escape(actions.text[mark.start : mark.end])
        body.append(f'<span class="{mark.kind}" title="{escape(title, quote=True)}">{words}</span>')
        at = mark.end
    body.append(escape(actions.text[at:]))
    items = "".join(f"<li>{escape(step(action))}</li>" for action in actions.actions)
    unread = "".join(f"<li>{escape(item.text)} <small>{escape(item.why)}</small></li>" for item in actions.unread)
    rest = f"<h2>Unread</h2><ul>{unread}</ul>" if unread else ""
    return (
        f'<!doctype html><html lang="en"><meta charset="utf-8"><title>Procedure: {actions.outcome}</title>'
        f"<style>{_STYLE}</style><h1>Procedure: {actions.outcome}</h1>"
        f"<p>{''.join(body)}</p><ol>{items}</ol>{rest}</html>\n"
    )


def _lines(actions: ActionList) -> Iterator[str]:
    yield f"outcome: {actions.outcome}"
    for number, action in enumerate(actions.actions, 1):
        yield f"{number:>3}. {step(action)}"
    for item in actions.unread:
        yield f"unread: {item.text!r} at {item.start}: {item.why}"


def step(action: Action) -> str:
    """Return an action on one line: "Stir: at 22 C for 60 min"."""
    parts = [", ".join(map(_portion, (*action.takes, *action.gives)))]
    if action.part == "solution":
        parts.append("the solution made before")
    for period in action.periods:
        words = [f"at {period.temperature:g} C" if period.temperature is not None else ""]
        words.append(f"for {period.duration:g} min" if period.duration is not None else "")
        parts.append(" ".join(filter(None, words)))
    parts += [action.manner or "", f"under {action.atmosphere}" if action.atmosphere else ""]
    parts.append(f"{action.pressure:.3g} bar" if action.pressure is not None else "")
    parts.append(f"pH {action.ph:g}" if action.ph is not None else "")
    parts.append(f"of the {action.part}" if action.part not in (None, "solution") else "")
    parts.append(f"keep the {action.keep}" if action.keep else "")
    parts.append(f"{action.repeats} times" if action.repeats > 1 else "")
    parts.append(action.note)
    parts.append(f"assumed: {', '.join(action.assumed)}" if action.assumed else "")
    said = "; ".join(filter(None, parts))
    return f"{action.verb}: {said}" if said else action.verb


def _portion(portion: Portion) -> str:
    return f"{portion.name} ({portion.amount})" if portion.amount else portion.name
