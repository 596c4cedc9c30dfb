"""The people of an episode as plain data: where they start, where they go and whether they yield."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from labgym.errors import OptionError

RADIUS = 0.30
"""Radius of a person, meters."""
MOST = 64
"""Greatest number of people, and of the stops of one of them."""

Coordinate = Annotated[float, Field(ge=-1e4, le=1e4, allow_inf_nan=False)]
Seconds = Annotated[float, Field(ge=0.0, le=600.0, allow_inf_nan=False)]
Model = Literal["orca", "social_force"]


class _Record(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class Role(_Record):
    """One person.

    Attributes:
        start: x, y at the start, meters. yields: whether the person avoids the robot while it moves.
        group: people of one number walk together.
        stops: (x, y, yaw, seconds) of the places where the person stands, in turn and again from the first; meters,
            radians.
    """

    start: tuple[Coordinate, Coordinate]
    yields: bool
    group: Annotated[int, Field(ge=0, lt=MOST)]
    stops: Annotated[tuple[tuple[Coordinate, Coordinate, Coordinate, Seconds], ...], Field(max_length=MOST)] = ()


class Cast(_Record):
    """The people of an episode.

    Attributes:
        model: how they avoid each other. speed: m/s. people: the people.
    """

    model: Model = "orca"
    speed: Annotated[float, Field(gt=0.0, le=3.0, allow_inf_nan=False)] = 1.0
    people: Annotated[tuple[Role, ...], Field(max_length=MOST)] = ()


def cast_of(data: Any) -> Cast:
    """Return the people that plain data describes.

    Raises:
        OptionError: it does not describe people.
    """
    try:
        return Cast.model_validate(data)
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(str(each) for each in first["loc"])
        raise OptionError(f"people: {place or 'data'}: {first['msg'][:120]}") from None
