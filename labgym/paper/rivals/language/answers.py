"""The forms of a language model's answers: a list of objects, and a step."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from labgym.documents import Record
from labgym.paper.rivals.household import Relation
from labgym.paper.rivals.sceneweaver.policy import Tool

Name = Annotated[str, Field(max_length=80)]


class RelatedTo(Record):
    """A constraint with an object that is listed earlier."""

    relation: Relation
    target: Name


class OnTop(Record):
    """Small objects on each object of a kind."""

    name: Name
    quantity: Annotated[int, Field(ge=1, le=5)]


class ListedObject(Record):
    """A kind of large object."""

    name: Name
    quantity: Annotated[int, Field(ge=1, le=10)]
    location: Literal["floor", "wall"]
    height: Annotated[float, Field(ge=0.0, le=5.0)]
    place: Literal["edge", "middle"]
    relations: Annotated[list[RelatedTo], Field(max_length=8)]
    on_top: Annotated[list[OnTop], Field(max_length=20)]


class ListedRoom(Record):
    """Everything that is listed for a room."""

    objects: Annotated[list[ListedObject], Field(max_length=60)]


class ChosenStep(Record):
    """A step of SceneWeaver: the number of a problem, and a tool."""

    stop: bool
    problem: Annotated[int, Field(ge=0, le=1000)]
    tool: Tool
