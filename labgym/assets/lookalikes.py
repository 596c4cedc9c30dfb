"""Substances that the catalog lacks and whose names resemble those of its reagents."""

from __future__ import annotations

from functools import lru_cache
from typing import Annotated, ClassVar

from pydantic import Field

from labgym.artefacts import artefacts
from labgym.documents import Document


class Lookalikes(Document):
    """Names of other substances: a text that is as close to one of them is not a misspelling of a reagent."""

    SCHEMA: ClassVar[str] = "labgym.lookalikes/1"

    names: Annotated[tuple[Annotated[str, Field(min_length=1, max_length=80)], ...], Field(max_length=2000)]


@lru_cache(maxsize=1)
def lookalikes() -> tuple[str, ...]:
    """Return the published names; they are read once per process."""
    return Lookalikes.load(artefacts("assets") / "chemistry" / "lookalikes.json").names
