"""Types of command-line arguments, with how `--help` shows them."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from tyro.conf import Positional, arg

from labgym.errors import OptionError

LayoutName = Positional[Annotated[str, arg(metavar="LAYOUT")]]
"""A layout's .json file, or the id of a published layout."""

ProtocolName = Positional[Annotated[str, arg(metavar="PROTOCOL")]]
"""A protocol's .json file, or the id of a protocol of the library."""

ProtocolNames = Positional[
    Annotated[tuple[str, ...], arg(metavar="PROTOCOL [PROTOCOL ...]", help_behavior_hint="(required)")]
]
"""One or more protocols, as `ProtocolName`."""

OptionalText = Annotated[str | None, arg(metavar="STR", help_behavior_hint="")]
OptionalWholeNumber = Annotated[int | None, arg(metavar="INT", help_behavior_hint="")]
OptionalPath = Annotated[Path | None, arg(metavar="PATH", help_behavior_hint="")]
Texts = Annotated[tuple[str, ...], arg(metavar="STR [STR ...]", help_behavior_hint="")]
PolicyOptions = Annotated[tuple[str, ...], arg(metavar="NAME=VALUE [...]", help_behavior_hint="")]
Folders = Positional[Annotated[tuple[Path, ...], arg(metavar="FOLDER [FOLDER ...]", help_behavior_hint="(required)")]]


def numbers(name: str, text: str | None) -> tuple[float, ...] | None:
    """Return the numbers in a text such as 1.5,2,0; None for None.

    Raises:
        OptionError: a part of the text is not a number.
    """
    if text is None:
        return None
    try:
        return tuple(float(part) for part in text.split(","))
    except ValueError:
        raise OptionError(f"--{name} {text[:60]!r} must be numbers with commas between them, such as 1.5,2,0") from None
