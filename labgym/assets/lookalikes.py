"""Substances that the catalogue does not hold and whose names look like those of substances that it does."""

from __future__ import annotations

from functools import lru_cache
from typing import Annotated, ClassVar

from pydantic import Field

from labgym.artefacts import artefacts
from labgym.documents import Document


class Lookalikes(Document):
    """Names that no misspelling of a reagent may be as near to as to the reagent's own."""

    SCHEMA: ClassVar[str] = "labgym.lookalikes/1"

    names: Annotated[tuple[Annotated[str, Field(min_length=1, max_length=80)], ...], Field(max_length=2000)]


@lru_cache(maxsize=1)
def lookalikes() -> tuple[str, ...]:
    """Return the published names; read once a process."""
    return Lookalikes.load(artefacts("assets") / "chemistry" / "lookalikes.json").names
