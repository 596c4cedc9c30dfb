"""The storeys of untrusted building models: footprints of walls, doors, windows and spaces."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from labgym.documents import read_bytes
from labgym.errors import DocumentError, UnknownNameError, optional_package
from labgym.exchange.ifc.footprints import Array, Entity, footprint
from labgym.exchange.strips import Point
from labgym.geometry.frames import PlanarPose
from labgym.geometry.polygons import grown, polygons

if TYPE_CHECKING:
    from shapely import Geometry, Polygon

MAX_BYTES = 64 * 1024 * 1024
SCHEMAS = ("IFC2X3", "IFC4")
"""Begins of the names of schemas that are read."""
MAX_PRODUCTS = 20_000
"""Largest number of walls, doors, windows, openings and spaces of a storey."""
SCREEN_M = 0.03
"""Walls thinner than this inside one space, such as the glass of showers, divide no room, meters."""
SILL_M, LEAST_M, HEAD_M = 0.3, 0.5, 1.8
"""Greatest height of the lower edge of a way, its least width, and its least height, meters."""


@dataclass(frozen=True)
class Wall:
    """A wall: its footprint, meters, and its height."""

    area: Geometry
    height: float


@dataclass(frozen=True)
class Way:
    """An opening of a wall: a door, a window, or a passage without a leaf.

    Attributes:
        start, end: ends along its width, meters. across: unit vector to the side to which a door opens.
        hinge: the end at which the leaf turns, None if the model does not say. sill, height: meters.
    """

    kind: str
    start: Point
    end: Point
    across: Point
    hinge: Point | None
    sill: float
    height: float

    @property
    def middle(self) -> Point:
        """Its middle, meters."""
        return (self.start[0] + self.end[0]) / 2.0, (self.start[1] + self.end[1]) / 2.0

    @property
    def width(self) -> float:
        """Its width, meters."""
        return math.dist(self.start, self.end)


@dataclass(frozen=True)
class Room:
    """A space: its outline in meters, its name and use, and its height."""

    area: Polygon
    name: str
    use: str
    height: float


@dataclass(frozen=True)
class Storey:
    """A storey in its frame, in meters.

    Attributes:
        origin: pose of the frame in the world of the model.
        names: of all storeys, from the lowest. number: of this one, from 1.
        unread: products whose shapes are not read, by class.
    """

    walls: tuple[Wall, ...]
    ways: tuple[Way, ...]
    rooms: tuple[Room, ...]
    origin: PlanarPose
    names: tuple[str, ...]
    number: int
    unread: dict[str, int]


def read_storey(path: str | Path, storey: str | None = None) -> Storey:
    """Return a storey of a building model.

    Args:
        storey: its number from the lowest, from 1, or its name; by default the one with most spaces and walls.

    Raises:
        DocumentError: the file is missing, larger than 64 MB, no IFC file, or has too many products.
        UnknownNameError: it has no such storey.
        MissingDependencyError: ifcopenshell is not installed.
    """
    path = Path(path)
    model = _opened(path)
    from ifcopenshell.util.unit import calculate_unit_scale

    try:
        scale = float(calculate_unit_scale(model))
        products = _by_storey(model)
        storeys = sorted(products, key=lambda each: (_elevation(each), -1 if each is None else each.id()))
        names = tuple("" if each is None else str(each.Name or f"#{each.id()}")[:80] for each in storeys)
        chosen = _chosen(storeys, names, storey, products)
        found = products[chosen]
        if len(found) > MAX_PRODUCTS:
            raise DocumentError(path, "", f"{len(found)} products on a storey; at most {MAX_PRODUCTS} are read")
        return _Reader(chosen, scale).read(found, names, storeys.index(chosen) + 1)
    except (ArithmeticError, AssertionError, AttributeError, LookupError, RuntimeError, TypeError, ValueError) as error:
        if isinstance(error, DocumentError | UnknownNameError):
            raise
        raise DocumentError(path, "", f"a damaged IFC file ({type(error).__name__})") from None


def _opened(path: Path) -> Any:
    with optional_package("ifcopenshell", "building models (IFC)", "bim"):
        import ifcopenshell
    text = read_bytes(path, MAX_BYTES).decode("utf-8-sig", "replace")
    if not text.lstrip().startswith("ISO-10303-21"):
        raise DocumentError(path, "", "not an IFC file (STEP): save the model as .ifc")
    schema = re.search(r"FILE_SCHEMA\s{0,9}\(\s{0,9}\(\s{0,9}'([^']{1,40})'", text[:20_000])
    if schema is not None and not schema[1].startswith(SCHEMAS):
        raise DocumentError(path, "", f"schema {schema[1]} is not read: save the model as IFC4 or IFC2X3")
    try:
        return ifcopenshell.file.from_string(text)
    except Exception as error:  # noqa: BLE001 - ifcopenshell's own classes differ between versions
        raise DocumentError(path, "", f"not a readable IFC file ({type(error).__name__})") from None


def _by_storey(model: Any) -> dict[Entity | None, list[Entity]]:
    """Return walls, doors, windows, openings and spaces by their storey; None for those on no storey."""
    found: dict[Entity | None, list[Entity]] = {each: [] for each in model.by_type("IfcBuildingStorey")}
    for kind in ("IfcWall", "IfcCurtainWall", "IfcDoor", "IfcWindow", "IfcSpace", "IfcOpeningElement"):
        for product in model.by_type(kind):
            found.setdefault(_storey_of(product), []).append(product)
    if None in found and (len(found) > 1 or not found[None]):
        del found[None]
    return found or {None: []}


def _storey_of(product: Entity) -> Entity | None:
    """Return the storey that a product belongs to; an opening belongs to that of its wall."""
    here: Entity | None = product
    for _ in range(20):
        if here is None or here.is_a("IfcBuildingStorey"):
            return here
        voids = getattr(here, "VoidsElements", ())
        contained = getattr(here, "ContainedInStructure", ())
        parts = getattr(here, "Decomposes", ())
        if voids:
            here = voids[0].RelatingBuildingElement
        elif contained:
            here = contained[0].RelatingStructure
        else:
            here = parts[0].RelatingObject if parts else None
    return None


def _elevation(storey: Entity | None) -> float:
    return 0.0 if storey is None or storey.Elevation is None else float(storey.Elevation)


def _chosen(
    storeys: list[Entity | None],
    names: tuple[str, ...],
    wanted: str | None,
    products: dict[Entity | None, list[Entity]],
) -> Entity | None:
    if wanted is None:
        counts = [[sum(e.is_a(kind) for e in products[s]) for kind in ("IfcSpace", "IfcWall")] for s in storeys]
        return storeys[counts.index(max(counts))]
    if wanted in names:
        return storeys[names.index(wanted)]
    if wanted.isdecimal() and 1 <= int(wanted[:6]) <= len(storeys):
        return storeys[int(wanted) - 1]
    numbered = [f"{number} ({name})" for number, name in enumerate(names, start=1)]
    raise UnknownNameError("storey", wanted, numbered)


class _Reader:
    """Reads the products of a storey in the storey's frame."""

    def __init__(self, storey: Entity | None, scale: float) -> None:
        from ifcopenshell.util.placement import get_local_placement

        self._placed = get_local_placement
        world = np.eye(4) if storey is None else np.asarray(get_local_placement(storey.ObjectPlacement))
        self.origin = world[0, 3] * scale, world[1, 3] * scale, math.atan2(world[1, 0], world[0, 0])
        # The frame of the storey, level, in meters.
        cosine, sine = math.cos(self.origin[2]), math.sin(self.origin[2])
        turn = np.eye(4)
        turn[:2, :2] = (cosine, sine), (-sine, cosine)
        shift = np.eye(4)
        shift[:3, 3] = -world[:3, 3]
        self._frame = np.diag((scale, scale, scale, 1.0)) @ turn @ shift
        self.unread: dict[str, int] = {}

    def read(self, products: list[Entity], names: tuple[str, ...], number: int) -> Storey:
        """Return the storey of some products."""
        walls = [
            wall
            for each in products
            if each.is_a("IfcWall") or each.is_a("IfcCurtainWall")
            for wall in self._wall(each)
        ]
        rooms = [room for each in products if each.is_a("IfcSpace") for room in self._rooms(each)]
        walls = [wall for wall in walls if not _is_screen(wall, rooms)]
        ways = [
            way
            for each in products
            if each.is_a("IfcDoor") or each.is_a("IfcWindow") or each.is_a("IfcOpeningElement")
            for way in self._ways(each)
        ]
        x, y, yaw = (float(value) for value in self.origin)
        return Storey(tuple(walls), tuple(ways), tuple(rooms), (x, y, yaw), names, number, self.unread)

    def _matrix(self, product: Entity) -> Array:
        return np.asarray(self._frame @ self._placed(product.ObjectPlacement), dtype=np.float64)

    def _footprint(self, product: Entity) -> tuple[Geometry, float, float] | None:
        found = footprint(product, self._matrix(product)) if product.Representation else None
        if found is None:
            self.unread[product.is_a()] = self.unread.get(product.is_a(), 0) + 1
        return found

    def _wall(self, wall: Entity) -> Iterator[Wall]:
        """Yield a wall; of a curtain wall the hull of its parts."""
        parts = [part for relation in wall.IsDecomposedBy for part in relation.RelatedObjects]
        if parts and not wall.Representation:
            from labgym.geometry.polygons import union

            found = [footprint(part, self._matrix(part)) for part in parts if part.Representation]
            shapes = [each for each in found if each is not None]
            if shapes:
                hull = union(each[0] for each in shapes).convex_hull
                yield Wall(hull, max(each[2] for each in shapes) - min(each[1] for each in shapes))
            return
        shape = self._footprint(wall)
        if shape is not None:
            yield Wall(shape[0], shape[2] - shape[1])

    def _rooms(self, space: Entity) -> Iterator[Room]:
        shape = self._footprint(space)
        if shape is not None:
            name, use = str(space.Name or "")[:80], f"{space.LongName or ''} {space.ObjectType or ''}"[:200]
            for part in polygons(shape[0]):
                yield Room(part, name, use, shape[2] - shape[1])

    def _ways(self, product: Entity) -> Iterator[Way]:
        """Yield the way of a door or a window, measured at the opening that it fills, or of an empty opening."""
        kind = {"IfcDoor": "door", "IfcWindow": "window"}.get(product.is_a().replace("StandardCase", ""), "passage")
        opening = product
        if kind == "passage":
            if product.HasFillings or not any(v.RelatingBuildingElement.is_a("IfcWall") for v in product.VoidsElements):
                return
        elif product.FillsVoids:
            opening = product.FillsVoids[0].RelatingOpeningElement
        shape = (footprint(opening, self._matrix(opening)) if opening.Representation else None) or self._footprint(
            product
        )
        if shape is None:
            return
        area, low, high = shape
        if kind == "passage" and (low > SILL_M or high - low < HEAD_M):
            return
        along, across = self._axes(product, area, kind)
        places = np.array(area.convex_hull.exterior.coords) @ np.array(along)
        middle = np.array(area.convex_hull.centroid.coords[0])
        reach = (places.max() - places.min()) / 2.0
        if reach * 2.0 < LEAST_M:
            return
        center = middle + ((places.max() + places.min()) / 2.0 - middle @ np.array(along)) * np.array(along)
        start, end = (
            (float(p[0]), float(p[1])) for p in (center - reach * np.array(along), center + reach * np.array(along))
        )
        operation = _operation(product) if kind == "door" else ""
        hinge = start if operation.endswith("LEFT") else end if operation.endswith("RIGHT") else None
        yield Way(kind, start, end, across, hinge, max(low, 0.0), high - low)

    def _axes(self, product: Entity, area: Geometry, kind: str) -> tuple[Point, Point]:
        """Return unit vectors along the width of an opening and across it, by its filling's placement or its shape."""
        if kind != "passage":
            matrix = self._matrix(product)
            x, y = matrix[:2, 0], matrix[:2, 1]
            if min(np.hypot(*x), np.hypot(*y)) > 1e-9:
                x, y = x / np.hypot(*x), y / np.hypot(*y)
                return (float(x[0]), float(x[1])), (float(y[0]), float(y[1]))
        corners = np.array(area.minimum_rotated_rectangle.exterior.coords)
        sides = np.diff(corners, axis=0)[:2]
        along = sides[int(np.hypot(*sides.T).argmax())]
        along = along / np.hypot(*along)
        return (float(along[0]), float(along[1])), (float(-along[1]), float(along[0]))


def _is_screen(wall: Wall, rooms: list[Room]) -> bool:
    return grown(wall.area, -SCREEN_M / 2.0).is_empty and any(room.area.contains(wall.area.centroid) for room in rooms)


def _operation(door: Entity) -> str:
    """Return how a door opens: of IFC4 its own or its type's operation, of IFC2X3 its style's."""
    own = getattr(door, "OperationType", None)
    kinds = getattr(door, "IsTypedBy", ()) or getattr(door, "IsDefinedBy", ())
    styles = [getattr(getattr(each, "RelatingType", None), "OperationType", None) for each in kinds]
    return str(own or next(filter(None, styles), ""))
