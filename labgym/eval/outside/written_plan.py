"""A written layout as polygons with heights, read from its JSON file and the catalog's files alone.

It shares no code with the layout model and its rules: what this module misreads, they do not share.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any

import shapely
from shapely.affinity import rotate, translate
from shapely.geometry import Point, Polygon

from labgym.artefacts import artefacts
from labgym.errors import DocumentError

SCHEMA = "labgym.layout/2"
BOARD = 0.02
"""Thickness of the shelves of a hollow asset, meters."""
LEAF = 0.05
PANE = 0.03
"""Thickness of door leaves and of panes, meters."""
STAIRS = 0.06
"""Regions of spaces keep up to this distance from oblique walls, meters."""
ROBOT_STANDS = 0.60
"""Distance of a place of work from the front of its furniture, meters."""


@dataclass(frozen=True)
class Block:
    """A solid prism of an object or of the building."""

    owner: str
    polygon: Polygon
    z0: float
    z1: float


@dataclass(frozen=True)
class WrittenItem:
    """A placement with its catalog entry."""

    id: str
    entry: dict[str, Any]
    x: float
    y: float
    z: float
    yaw: float
    support: str
    slot: int | None
    width: float
    depth: float
    height: float

    def rectangle(self, x0: float, x1: float, y0: float, y1: float) -> Polygon:
        """A rectangle of the object's frame, on the floor."""
        local = Polygon([(x0, y0), (x1, y0), (x1, y1), (x0, y1)])
        return translate(rotate(local, self.yaw, origin=(0, 0), use_radians=True), self.x, self.y)

    @cached_property
    def footprint(self) -> Polygon:
        """The outline of the bounding box on the floor."""
        return self.rectangle(-self.width / 2, self.width / 2, -self.depth / 2, self.depth / 2)

    def in_front(self, distance: float) -> Point:
        """The point at a distance from the middle of the front; the front looks along +y of the object's frame."""
        reach = self.depth / 2 + distance
        return Point(self.x - math.sin(self.yaw) * reach, self.y + math.cos(self.yaw) * reach)

    @property
    def scale(self) -> tuple[float, float, float]:
        """Factors of width, depth and height by which the object differs from its catalog entry."""
        size = self.entry["size"]
        return self.width / size["width"], self.depth / size["depth"], self.height / size["height"]

    def surfaces(self) -> list[tuple[Polygon, float]]:
        """The surfaces that carry objects, with their heights above the floor."""
        kx, ky, kz = self.scale
        carriers = []
        for surface in self.entry.get("surfaces", ()):
            x, y = surface.get("x", 0.0) * kx, surface.get("y", 0.0) * ky
            hw, hd = surface["width"] * kx / 2, surface["depth"] * ky / 2
            carriers.append((self.rectangle(x - hw, x + hw, y - hd, y + hd), self.z + surface["z"] * kz))
        return carriers

    def blocks(self) -> Iterator[Block]:
        """The solid parts: the bounding box, or the shell and the shelves of a hollow object, and fittings on top."""
        hw, hd = self.width / 2, self.depth / 2
        for x0, x1, y0, y1, z0, z1 in self._shell(hw, hd):
            if x1 - x0 > 1e-6 and y1 - y0 > 1e-6 and z1 - z0 > 1e-6:
                yield Block(self.id, self.rectangle(x0, x1, y0, y1), self.z + z0, self.z + z1)
        for part in self.entry.get("fittings", ()):
            x, y = part.get("x", 0.0), part.get("y", 0.0)
            w, d = part["width"] / 2, part["depth"] / 2
            yield Block(self.id, self.rectangle(x - w, x + w, y - d, y + d), self.z + part["z0"], self.z + part["z1"])

    def _shell(self, hw: float, hd: float) -> Iterator[tuple[float, float, float, float, float, float]]:
        hollow = self.entry.get("cavity")
        if hollow is None:
            yield -hw, hw, -hd, hd, 0.0, self.height
            return
        kx, ky, kz = self.scale
        left, right = ((hollow.get("x", 0.0) + side * hollow["width"] / 2) * kx for side in (-1, 1))
        back, front = ((hollow.get("y", 0.0) + side * hollow["depth"] / 2) * ky for side in (-1, 1))
        low, high = hollow["z0"] * kz, hollow["z1"] * kz
        yield -hw, hw, -hd, hd, 0.0, low
        yield -hw, hw, -hd, hd, high, self.height
        yield -hw, left, -hd, hd, low, high
        yield right, hw, -hd, hd, low, high
        yield left, right, -hd, back, low, high
        if not hollow.get("open_front", False):
            yield left, right, front, hd, low, high
        for surface in self.entry.get("surfaces", ()):
            z = surface["z"] * kz
            if low + BOARD < z < high:
                yield left, right, back, front, z - BOARD, z


@dataclass(frozen=True)
class Exit:
    """A door to the outside: the middle of its inner face, and the unit vector into the floor."""

    x: float
    y: float
    inward: tuple[float, float]

    def inside(self, distance: float) -> Point:
        """The point at a distance from the door into the floor, meters."""
        return Point(self.x + self.inward[0] * distance, self.y + self.inward[1] * distance)


class WrittenPlan:
    """A layout file of schema `labgym.layout/2`.

    Raises:
        DocumentError: another schema, or two placements of one id.
    """

    def __init__(self, data: dict[str, Any]) -> None:
        if data.get("schema") != SCHEMA:
            raise DocumentError("layout", "schema", f"expected {SCHEMA!r}, got {str(data.get('schema'))[:80]!r}")
        self.data, floor = data, data["floor"]
        self.items = [_item(placement) for placement in data["placements"]]
        self.by_id = {item.id: item for item in self.items}
        if len(self.by_id) != len(self.items):
            raise DocumentError("layout", "placements", "two placements have the same id; ids must be unique")
        self.spaces = shapely.union_all([polygon for space in floor["spaces"] for polygon in _region(space)])
        self.exits: list[Exit] = []
        self.ways: list[Polygon] = []
        """Floor of the doors and passages between spaces."""
        self.building: list[Block] = []
        for number, wall in enumerate(floor["walls"]):
            self._add_wall(f"wall {number}", wall)
        ceiling = max(space["ceiling"] for space in floor["spaces"])
        for column in floor.get("columns", ()):
            box = _rectangle(column["width"], column["depth"], column["x"], column["y"], column.get("yaw", 0.0))
            self.building.append(Block(f"column {column['id']}", box, 0.0, ceiling))

    @classmethod
    def load(cls, path: str | Path) -> WrittenPlan:
        """Read a layout file."""
        return cls(json.loads(Path(path).read_text()))

    @cached_property
    def domain(self) -> Polygon:
        """The floor on which things stand and move, doorways included."""
        return shapely.union_all([self.spaces.buffer(STAIRS, join_style="mitre"), *self.ways])

    def root(self, item: WrittenItem) -> WrittenItem:
        """The object on the floor or on a wall that carries an object in the end."""
        while item.support not in ("floor", "wall"):
            item = self.by_id[item.support]
        return item

    def assembled(self, first: str, second: str) -> bool:
        """Whether two owners of blocks are a stand and what it holds, or two pieces that one stand holds."""
        stands = {self._stand(owner) for owner in (first, second)}
        return len(stands) == 1 and None not in stands

    def _stand(self, owner: str) -> str | None:
        """The stand that holds an object, or the object itself if it is one: one apparatus is one object."""
        for candidate in (owner, self.by_id[owner].support if owner in self.by_id else ""):
            if candidate in self.by_id and self.by_id[candidate].entry["subtype"] == "apparatus_stand":
                return candidate
        return None

    def at_location(self, location: str) -> WrittenItem | None:
        """The first object of an asset, or of a variant of it."""
        names = (item for item in self.items if location in (item.entry["name"], item.entry.get("variant_of")))
        return next(names, None)

    def goals(self) -> dict[str, Point]:
        """The place of work at each location of the protocols."""
        goals = {}
        for protocol in self.data["protocols"]:
            for step in protocol["steps"]:
                item = self.at_location(step["location"])
                if item is not None:
                    carrier = self.root(item)
                    larger = carrier.width * carrier.depth > item.width * item.depth
                    goals[step["location"]] = (carrier if larger else item).in_front(ROBOT_STANDS)
        return goals

    def _add_wall(self, name: str, wall: dict[str, Any]) -> None:
        (ax, ay), (bx, by) = wall["start"], wall["end"]
        length, yaw, thick = math.hypot(bx - ax, by - ay), math.atan2(by - ay, bx - ax), wall["thickness"]

        def piece(u0: float, u1: float, v0: float, v1: float) -> Polygon:
            local = Polygon([(u0, v0), (u1, v0), (u1, v1), (u0, v1)])
            return translate(rotate(local, yaw, origin=(0, 0), use_radians=True), ax, ay)

        def solid(u0: float, u1: float, z0: float, z1: float, half: float = thick / 2) -> None:
            if u1 - u0 > 1e-9 and z1 - z0 > 1e-9:
                self.building.append(Block(name, piece(u0, u1, -half, half), z0, z1))

        at = 0.0
        for opening in sorted(wall["openings"], key=lambda opening: opening["position"]):
            low, high = opening["position"] - opening["width"] / 2, opening["position"] + opening["width"] / 2
            sill = opening.get("sill", 0.0)
            solid(at, low, 0.0, wall["height"])
            solid(low, high, 0.0, sill)
            solid(low, high, sill + opening["height"], wall["height"])
            at = high
            if opening["kind"] in ("window", "glazing"):
                solid(low, high, sill, sill + opening["height"], min(PANE, thick) / 2)
                continue
            normal = -math.sin(yaw), math.cos(yaw)
            x, y = ax + math.cos(yaw) * opening["position"], ay + math.sin(yaw) * opening["position"]
            sides = [
                any(
                    self.spaces.covers(Point(x + sign * normal[0] * reach, y + sign * normal[1] * reach))
                    for reach in (thick / 2 + 0.02, thick / 2 + 0.1, thick / 2 + 0.3)
                )
                for sign in (1, -1)
            ]
            if all(sides):
                self.ways.append(piece(low, high, -thick / 2 - 0.07, thick / 2 + 0.07))
                if opening["kind"] == "door":
                    leaf = _leaf(piece, opening, low, high, thick)
                    self.building.append(Block(f"{name} leaf", leaf, 0.0, opening["height"]))
            else:
                sign = 1 if sides[0] else -1
                solid(low, high, 0.0, opening["height"])
                inward = sign * normal[0], sign * normal[1]
                self.exits.append(Exit(x + inward[0] * thick / 2, y + inward[1] * thick / 2, inward))
        solid(at, length, 0.0, wall["height"])


def _leaf(piece: Any, opening: dict[str, Any], low: float, high: float, thick: float) -> Polygon:
    """The leaf of an interior door: hinged at the face of the wall toward which it opens."""
    toward = 1 if opening["hinge"] == "start" else -1
    side = 1 if opening["swing"] == "left" else -1
    hinge = low if toward == 1 else high
    depth = min(LEAF, thick)
    spans = sorted((hinge, hinge + toward * opening["width"])), sorted((side * thick / 2, side * (thick / 2 - depth)))
    closed = piece(*spans[0], *spans[1])
    if opening.get("state", "closed") == "closed":
        return closed
    pivot = piece(hinge, hinge + 1e-3, side * thick / 2, side * thick / 2 + 1e-3).exterior.coords[0]
    turn = opening.get("angle", math.pi / 2) * toward * side
    return rotate(closed, turn, origin=pivot, use_radians=True)


def _region(space: dict[str, Any]) -> Iterator[Polygon]:
    for r in space["region"]:
        box = shapely.box(r.get("x0", 0.0), r.get("y0", 0.0), r["x1"], r["y1"])
        yaw = space.get("yaw", 0.0)
        yield translate(rotate(box, yaw, origin=(0, 0), use_radians=True), space.get("x", 0.0), space.get("y", 0.0))


def _rectangle(width: float, depth: float, x: float, y: float, yaw: float) -> Polygon:
    box = shapely.box(-width / 2, -depth / 2, width / 2, depth / 2)
    return translate(rotate(box, yaw, origin=(0, 0), use_radians=True), x, y)


def _item(placement: dict[str, Any]) -> WrittenItem:
    entry = entries()[placement["asset"]]
    size = placement.get("size") or entry["size"]
    x, y, z = placement["position"]
    return WrittenItem(
        placement["id"], entry, x, y, z, placement["yaw"], placement["support"], placement["slot"],
        size["width"], size["depth"], size["height"],
    )  # fmt: skip


@lru_cache(maxsize=1)
def entries() -> dict[str, dict[str, Any]]:
    """The catalog's entries by name."""
    files = sorted((artefacts("assets") / "catalog").rglob("*.json"))
    return {entry["name"]: entry for file in files for entry in json.loads(file.read_text())["assets"]}
