"""Where a layout is generated: a room, a floor, or a floor drawn from a family; and how it is furnished."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import ClassVar

import numpy as np

from labgym.documents import Document, read_json
from labgym.errors import OptionError
from labgym.layouts.floor import Floor, Room
from labgym.layouts.floors import draw_floor
from labgym.layouts.model import Layout
from labgym.layouts.request import Request
from labgym.layouts.rooms import resolve_room
from labgym.layouts.style import Style

STYLE_STREAM = 0x57
"""Sub-stream of the seed from which the style of a floor without a family is drawn."""


class FloorFile(Document, Floor):
    """A floor file: the fields of `Floor`."""

    SCHEMA: ClassVar[str] = "labgym.floor/1"

    def floor(self) -> Floor:
        """Return the floor."""
        return Floor(**{name: getattr(self, name) for name in Floor.model_fields})


@dataclass(frozen=True)
class FurnishingSite:
    """A floor and how it is furnished."""

    floor: Floor
    style: Style


def resolve_site(
    seed: int,
    room: Room | str | Path | None,
    floor: Floor | str | Path | None,
    family: str | None,
) -> FurnishingSite:
    """Return the site that the arguments of `generate` describe.

    Args:
        seed: draws a floor of the family, and the style.
        room: a room or what names one; a file may also hold a floor, or a layout, of which the floor counts.
        floor: a floor or its .json file.
        family: name of a family of floors.

    Raises:
        UnknownNameError: no such room preset or family.
        DocumentError: a file holds neither a room nor a floor.
        OptionError: more than one of room, floor and family.
    """
    named = [name for name, value in (("room", room), ("floor", floor), ("family", family)) if value is not None]
    if len(named) > 1:
        raise OptionError(f"{' and '.join(named)} exclude each other: give one of room, floor and family")
    if floor is None and isinstance(room, (str, Path)):
        floor = _floor_of(room)
        room = room if floor is None else None
    generator = np.random.default_rng([seed, STYLE_STREAM])
    if family is not None:
        return _drawn(family, seed, generator)
    if floor is not None:
        resolved = floor if isinstance(floor, Floor) else (_floor_of(floor) or FloorFile.load(floor).floor())
        return FurnishingSite(resolved, Style.draw(generator))
    return FurnishingSite(resolve_room(room).floor, Style.draw(generator))


def at_seed(request: Request, seed: int) -> Request:
    """Return a request with another seed: it draws another floor of the family, and another style."""
    floor = None if request.family else request.floor
    site = resolve_site(seed, None, floor, request.family or None)
    return replace(request, seed=seed, floor=site.floor, style=site.style)


def _drawn(family: str, seed: int, generator: np.random.Generator) -> FurnishingSite:
    draw = draw_floor(family, seed)
    return FurnishingSite(draw.floor, Style.of(draw.style).varied(generator))


def _floor_of(path: str | Path) -> Floor | None:
    """Return the floor of a floor file or of a layout file; None for a name or another file.

    Raises:
        DocumentError: the file is missing or invalid.
    """
    if not str(path).endswith(".json"):
        return None
    data = read_json(path)
    schema = str(data.get("schema", "")) if isinstance(data, dict) else ""
    if schema.startswith("labgym.layout/"):
        return Layout.parse(data, path).floor
    return FloorFile.load(path).floor() if schema == FloorFile.SCHEMA else None
