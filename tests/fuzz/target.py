"""A loader under test: what makes its cases, and what reads them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from random import Random

Case = Mapping[str, bytes]
"""The files of a case by name."""


@dataclass(frozen=True)
class Target:
    """A loader under test.

    Attributes:
        name: of the loader.
        prepare: makes valid files once and returns a function that makes a case from a random generator; case 0 of a
            run is made from None and must be accepted.
        read: reads a case from its folder as a user of labgym does; may raise LabgymError and nothing else.
        imports: modules that it takes long to import.
        isolated: labgym reads these files in a separate process, which may crash; so does the test.
        share: share of the cases; several targets may be one loader.
    """

    name: str
    prepare: Callable[[], Callable[[Random | None], Case]]
    read: Callable[[Path], object]
    imports: tuple[str, ...] = ()
    isolated: bool = False
    share: float = 1.0


def one_file(name: str, content: bytes, change: Callable[[Random, bytes], bytes]) -> Callable[[Random | None], Case]:
    """Return the maker of cases of one file.

    Args:
        name: name of the file.
        content: the valid file.
        change: returns a mutation of it.
    """
    return lambda rng: {name: content if rng is None else change(rng, content)}
