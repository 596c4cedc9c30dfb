"""Model cards as HTML: headings, paragraphs, lists, tables and code of Markdown; everything else is text."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from html import escape

_INLINE = re.compile(r"`([^`]+)`|\*\*([^*]+)\*\*|!?\[([^\]]*)\]\([^)]*\)")
"""Code, bold text, and a link or picture, of which the words stay."""
_ITEM = re.compile(r"(?:[-*]|\d+\.) +(.*)")
_RULE = re.compile(r"\|?[ :|-]+\|?$")


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
    return f'<div class="scroll"><table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table></div>'


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
