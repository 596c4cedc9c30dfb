"""The scene that SceneWeaver works on: large objects with their relations, and small objects on them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

from labgym.geometry import rotate
from labgym.layouts.placement import FLOOR
from labgym.paper.rivals.piece import RivalPiece

RelationKind = Literal["against_wall", "front_against", "side_by_side", "on"]
"""Relations of SceneWeaver's tools that a laboratory uses; `on` is both "on" and "ontop" of its tool card."""
ROOM = "room"


@dataclass(frozen=True)
class WeaverItem:
    """An object of the scene, its relation, and the object that it relates to (`ROOM` for the walls).

    An object has at most one relation: SceneWeaver's rule that each has one parent, with the room counted as one.
    """

    piece: RivalPiece
    relation: RelationKind | None = None
    parent: str = ""

    @property
    def large(self) -> bool:
        """Whether it stands on the floor."""
        return self.piece.support == FLOOR


@dataclass(frozen=True)
class WeaverScene:
    """Objects in the order in which they were added; a parent comes before its children."""

    items: tuple[WeaverItem, ...]

    @cached_property
    def by_id(self) -> dict[str, WeaverItem]:
        """Items by id."""
        return {item.piece.id: item for item in self.items}

    @property
    def large(self) -> list[WeaverItem]:
        """Objects on the floor."""
        return [item for item in self.items if item.large]

    def on(self, parent: str) -> list[RivalPiece]:
        """Return the objects that stand on or in an object."""
        return [item.piece for item in self.items if item.piece.support == parent]

    def adding(self, items: Iterable[WeaverItem]) -> WeaverScene:
        """Return the scene with further objects."""
        return WeaverScene((*self.items, *items))

    def without(self, ids: Iterable[str]) -> WeaverScene:
        """Return the scene without some objects and what stands on them; relations to them end."""
        gone = set(ids)
        gone |= {item.piece.id for item in self.items if item.piece.support in gone}
        return WeaverScene(tuple(_kept(item, gone) for item in self.items if item.piece.id not in gone))

    def moved(self, item_id: str, x: float, y: float, yaw: float) -> WeaverScene:
        """Return the scene with an object on the floor at another pose, and what stands on it with it."""
        anchor = self.by_id[item_id].piece
        return WeaverScene(
            tuple(
                replace(item, piece=_carried(item.piece, anchor, x, y, yaw))
                if item_id in (item.piece.id, item.piece.support)
                else item
                for item in self.items
            )
        )

    def related(self, item_id: str, relation: RelationKind | None, parent: str) -> WeaverScene:
        """Return the scene with another relation of an object."""
        return WeaverScene(
            tuple(
                replace(item, relation=relation, parent=parent) if item.piece.id == item_id else item
                for item in self.items
            )
        )

    def pieces(self) -> Iterator[RivalPiece]:
        """Yield all objects."""
        return (item.piece for item in self.items)


def _kept(item: WeaverItem, gone: set[str]) -> WeaverItem:
    return replace(item, relation=None, parent="") if item.parent in gone else item


def _carried(piece: RivalPiece, anchor: RivalPiece, x: float, y: float, yaw: float) -> RivalPiece:
    turn = yaw - anchor.yaw
    dx, dy = rotate(piece.x - anchor.x, piece.y - anchor.y, turn)
    return replace(piece, x=x + dx, y=y + dy, yaw=piece.yaw + turn)
