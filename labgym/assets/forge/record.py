"""The record of an annotation: the origin of each field of an asset, and the confidence in it."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

from pydantic import Field

from labgym.documents import Document, Record

How = Literal["file", "measured", "catalogue", "rule", "model", "default"]
Share = Annotated[float, Field(ge=0.0, le=1.0)]

CONFIDENCE: dict[How, float] = {
    "measured": 1.0,
    "file": 0.9,
    "catalogue": 0.8,
    "rule": 0.6,
    "model": 0.7,
    "default": 0.2,
}
"""Confidence in a field by its origin, unless something more specific is known."""


class Origin(Record):
    """Origin of a field of an asset.

    Attributes:
        how: file (its texts or metadata), measured (geometry), catalogue (a published entry that it resembles), rule
            (of the engine), model (a language model), default (nothing was known).
        confidence: between 0 and 1. why: the evidence in a few words.
    """

    how: How
    confidence: Share
    why: str = ""


def origin(how: How, why: str = "", confidence: float | None = None) -> Origin:
    """Return an origin, by default with the confidence that is usual for it."""
    return Origin(how=how, why=why, confidence=round(CONFIDENCE[how] if confidence is None else confidence, 3))


class MeshSource(Record):
    """The file that was added and how it was read; equal sources give equal assets."""

    file: str
    sha256: str
    source_unit: str
    unit_from: str
    up_axis: str
    up_from: str = ""
    options: dict[str, str] = Field(default_factory=dict)


class Physical(Record):
    """Measurements in meters and cubic meters; only closed meshes have a volume."""

    short: float
    long: float
    height: float
    watertight: bool
    volume: float | None
    parts: int
    faces: int
    convex_bodies: int
    decomposed_by: str


class Annotation(Document):
    """How an imported asset was annotated.

    Attributes:
        resembles: the published entry that most fields are taken from, if any.
        fields: origin of each field of the asset, by its name; hazards one by one as `hazards.<flag>`.
        notes: points for the user to check.
    """

    SCHEMA: ClassVar[str] = "labgym.annotation/1"

    asset: str
    source: MeshSource
    physical: Physical
    resembles: str | None = None
    fields: dict[str, Origin]
    notes: tuple[str, ...] = ()
