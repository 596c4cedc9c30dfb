"""How a layout was made."""

from __future__ import annotations

from typing import Any

from pydantic import Field

from labgym.documents import Record


class Provenance(Record):
    """How a layout was made: enough to make it again."""

    generator: str = "manual"
    seed: int | None = None
    options: dict[str, Any] = Field(default_factory=dict)
    versions: dict[str, str] = Field(default_factory=dict)
