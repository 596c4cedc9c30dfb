"""The floor: walls, the spaces between them, and what is fixed there."""

from __future__ import annotations

import re
from collections.abc import Sequence
from functools import cached_property
from typing import Annotated, Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, ValidationError, model_validator

from labgym.documents import Growing
from labgym.errors import LabgymError, UnknownNameError
from labgym.geometry import BoxArray, OrientedBox
from labgym.layouts.floor.checks import check_access, check_counts, check_doorways, check_enclosed, check_overlaps
from labgym.layouts.floor.doorways import Doorway, doorways_of
from labgym.layouts.floor.fields import Angle, FarCoordinate
from labgym.layouts.floor.rooms import READS, Door, Room, rectangle_parts, room_of
from labgym.layouts.floor.solids import FloorPart, solid_parts
from labgym.layouts.floor.spaces import Column, FreeRectangles, KeepOut, Service, Space
from labgym.layouts.floor.walls import Wall, extensions

SERVED = 0.6
"""A service point serves the spaces that it is at most this far outside of: it may be in their walls, meters."""
PIECE = 4096
"""Number of points of a grid that are looked up together: those in a few rows, near which few rectangles are."""


class Floor(Growing):
    """Walls, the spaces that they enclose, and what is fixed in them.

    All positions are in the floor's frame, in meters; that of a one-room floor has its origin at the front-left corner.

    Attributes:
        name: a label, such as the name of a room preset. It does not count in a layout's hash.
        walls, spaces: at least one exit leads into the spaces, and doors and passages join all of them.
        columns: from floor to ceiling.
        services: where water, gas, exhaust and power are available.
        keep_outs: areas without furniture.
        origin: pose x, y, yaw of the floor's frame in that of the drawing or map that it was read from, meters and
            radians; exports have that frame. It does not count in a layout's hash.
    """

    ADDED: ClassVar[frozenset[str]] = frozenset({"columns", "services", "keep_outs", "origin"})

    name: Annotated[str, Field(max_length=80)] = "custom"
    walls: Annotated[tuple[Wall, ...], Field(max_length=1000)]
    spaces: Annotated[tuple[Space, ...], Field(min_length=1, max_length=64)]
    columns: Annotated[tuple[Column, ...], Field(max_length=500)] = ()
    services: Annotated[tuple[Service, ...], Field(max_length=500)] = ()
    keep_outs: Annotated[tuple[KeepOut, ...], Field(max_length=200)] = ()
    origin: tuple[FarCoordinate, FarCoordinate, Angle] = (0.0, 0.0, 0.0)

    @model_validator(mode="after")
    def _check_parts(self) -> Self:
        _ = self._checked  # once: the validator also runs for every layout that takes an existing floor
        return self

    @cached_property
    def _checked(self) -> bool:
        """True, once all checks have passed; `Room` has checked what one can describe."""
        if self.as_room is not None:
            return True
        ids = [part.id for parts in (self.spaces, self.columns, self.keep_outs) for part in parts]
        check_counts(self.walls, self.spaces, ids)
        check_overlaps(self.spaces, self.wall_boxes)
        check_doorways(self.doorways, self.wall_boxes, [part.box for part in self.parts if part.kind == "column"])
        check_access(self.spaces, self.doorways)
        check_enclosed(self.spaces, self.wall_boxes)
        return True

    @classmethod
    def rectangle(
        cls,
        width: float,
        depth: float,
        height: float = 3.0,
        wall_thickness: float = 0.2,
        doors: Sequence[Door] = (Door(wall="front", offset=1.5),),
        name: str = "custom",
    ) -> Floor:
        """Return the floor of one rectangular room; arguments in meters, as in `Room`.

        Raises:
            ValueError: a value out of range, a door that does not fit its wall, or doors that overlap.
        """
        room = Room(
            name=name, width=width, depth=depth, height=height, wall_thickness=wall_thickness, doors=tuple(doors)
        )
        walls, space = rectangle_parts(room)
        return cls(name=name, walls=walls, spaces=(space,))

    @property
    def label(self) -> str:
        """The name as a part of ids: letters, digits, "_", "." and "-"; "floor" if it has none of them."""
        return re.sub(r"[^A-Za-z0-9_.-]+", "-", self.name).strip("-._") or "floor"

    @property
    def as_room(self) -> Room | None:
        """The floor as a `Room`, None if it is more than one can describe.

        A room is one rectangular space at the origin with four walls of one thickness, closed doors that open inwards
        as the only openings, no column and no keep-out. A rectangular bay with a window or a passage is none.
        """
        return self._room if isinstance(self._room, Room) else None

    @property
    def room(self) -> Room:
        """The only space as a rectangular room.

        Raises:
            LabgymError: the floor is not one rectangular room.
        """
        if isinstance(self._room, Room):
            return self._room
        raise LabgymError(self._room)

    @cached_property
    def _room(self) -> Room | str:
        """The room, or why the floor is not one."""
        try:
            room = room_of(self.name, self.walls, self.spaces)
        except ValidationError as error:
            return f"{READS}; " + " ".join(str(error.errors()[0]["msg"]).removeprefix("Value error, ").split())
        except LabgymError as error:
            return str(error)
        for what, fixed in (("columns", self.columns), ("keep-outs", self.keep_outs)):
            if fixed:
                return f"{READS} without {what}; got {len(fixed)} {what}"
        return room

    @cached_property
    def doorways(self) -> tuple[Doorway, ...]:
        """Doors and passages, in the order of the walls."""
        return doorways_of(self.walls, self.spaces)

    @cached_property
    def wall_boxes(self) -> tuple[OrientedBox, ...]:
        """Whole walls without their openings; their ends run on at joints, so that corners have no gap."""
        return tuple(
            wall.piece(-before, wall.length + after, 0.0, wall.height)
            for wall, (before, after) in zip(self.walls, self._extensions, strict=True)
        )

    @cached_property
    def _extensions(self) -> tuple[tuple[float, float], ...]:
        return extensions(self.walls)

    @cached_property
    def parts(self) -> tuple[FloorPart, ...]:
        """Solid parts with their kinds: walls, sills, lintels, leaves, panes, columns."""
        ceiling = max(space.ceiling for space in self.spaces)
        return tuple(solid_parts(self.walls, self._extensions, self.doorways, self.columns, ceiling))

    @cached_property
    def solids(self) -> tuple[OrientedBox, ...]:
        """Boxes that stop a robot or a ray, without furniture.

        Walls are cut at their openings; leaves, panes and columns are solid. Exits are filled, so that nothing leaves
        the floor.
        """
        return tuple(part.box for part in self.parts)

    @cached_property
    def bounds(self) -> tuple[float, float, float, float]:
        """Axis-aligned bounds (x0, y0, x1, y1) of solids and spaces, meters."""
        boxes = BoxArray.of([*self.solids, *(box for space in self.spaces for box in space.boxes)])
        corners = boxes.corners().reshape(-1, 2)
        (x0, y0), (x1, y1) = corners.min(axis=0).tolist(), corners.max(axis=0).tolist()
        return x0, y0, x1, y1

    def inside(self, points: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Return whether points (n, 2) lie in a space, or in the opening of an interior door or passage, shape (n,).

        Solids are not looked at: a point in a column or in the leaf of a door may be inside.
        """
        points = np.asarray(points, dtype=np.float64).reshape(-1, 2)
        within = np.zeros(len(points), dtype=np.bool_)
        for first in range(0, len(points), PIECE):
            within[first : first + PIECE] = self._rectangles.holding(points[first : first + PIECE]).any(axis=0)
        return within

    @cached_property
    def _rectangles(self) -> FreeRectangles:
        """The rectangles of the spaces, and the openings of interior doors and passages."""
        rows = [(*space.frame, r.x0, r.y0, r.x1, r.y1) for space in self.spaces for r in space.region]
        for box in (doorway.floor for doorway in self.doorways if not doorway.exit):
            width, depth = box.width / 2.0, box.depth / 2.0
            rows.append((box.x, box.y, box.yaw, -width, -depth, width, depth))
        return FreeRectangles.of(rows)

    @cached_property
    def _owners(self) -> list[int]:
        """Index of the space of each rectangle of a space, in their order."""
        return [index for index, space in enumerate(self.spaces) for _ in space.region]

    def services_of(self, space_id: str) -> tuple[Service, ...]:
        """Return the service points in a space, in the walls around it, and on their other sides."""
        return self._services.get(space_id, ())

    @cached_property
    def _services(self) -> dict[str, tuple[Service, ...]]:
        if not self.services:
            return {}
        points = np.array([(service.x, service.y) for service in self.services])
        near = {space.id: space.contains(points, SERVED).tolist() for space in self.spaces}
        return {
            name: tuple(service for service, is_near in zip(self.services, served, strict=True) if is_near)
            for name, served in near.items()
        }

    def space_at(self, x: float, y: float) -> Space | None:
        """Return the space that contains a point, None in walls, in doorways and outside."""
        within = self._rectangles.holding(np.array([[x, y]]))[: len(self._owners), 0]
        return self.spaces[self._owners[int(within.argmax())]] if within.any() else None

    def __getstate__(self) -> dict[Any, Any]:
        # Only the fields travel to another process, not what is cached.
        state = super().__getstate__()
        fields = {name: value for name, value in state["__dict__"].items() if name in type(self).model_fields}
        return {**state, "__dict__": fields}

    def space(self, space_id: str) -> Space:
        """Return a space by id.

        Raises:
            UnknownNameError: no space has that id.
        """
        for space in self.spaces:
            if space.id == space_id:
                return space
        raise UnknownNameError("space", space_id, [space.id for space in self.spaces])
