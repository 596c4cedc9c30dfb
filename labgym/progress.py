"""Progress of long work: a bar in a terminal, plain lines in a file or pipe."""

from __future__ import annotations

import math
import sys
from collections.abc import Iterable, Sized
from typing import Any, TextIO

from tqdm import tqdm

LINES = 10
"""Number of lines for a whole work without a terminal: one every 10%."""
UNCOUNTED_INTERVAL_S = 30.0
"""Least time between two lines where the total is not known, seconds."""


class LineStream:
    """Stream that writes the states of a progress bar as lines, each count once.

    Args:
        stream: receives the lines.
    """

    def __init__(self, stream: TextIO) -> None:
        self._stream, self._count = stream, ""

    def write(self, text: str) -> int:
        """Write a state of the bar as a line, unless it has the count of the line before."""
        line = text.strip()
        count = line.partition(",")[0]
        if line and count != self._count:
            self._count = count
            self._stream.write(f"{line}\n")
        return len(text)

    def flush(self) -> None:
        """Flush the stream."""
        self._stream.flush()


def progress_bar(
    iterable: Iterable[Any] | None = None,
    desc: str = "",
    total: int | None = None,
    *,
    unit: str = "it",
    disable: bool | None = False,
) -> tqdm[Any]:
    """Return a progress bar on standard error; without a terminal it writes a line every 10% of the total.

    Args:
        iterable: what the bar counts; None if its owner calls `update`.
        desc: label.
        total: number of items; by default that of an iterable with a length.
        unit: name of an item.
        disable: whether to show nothing; None shows nothing without a terminal.
    """
    if disable is not False or sys.stderr.isatty():
        return tqdm(iterable, desc, total, unit=unit, disable=disable)
    if total is None and isinstance(iterable, Sized):
        total = len(iterable)
    known = bool(total)
    count = "{n_fmt}/{total_fmt} {unit} ({percentage:.0f}%)" if known else "{n_fmt} {unit}"
    return tqdm(
        iterable,
        desc,
        total,
        unit=unit,
        file=LineStream(sys.stderr),
        bar_format=f"{{desc}}: {count}, {{elapsed}}" if desc else f"{count}, {{elapsed}}",
        mininterval=0.0 if known else UNCOUNTED_INTERVAL_S,
        miniters=math.ceil(total / LINES) if total else None,
        maxinterval=math.inf,
    )
