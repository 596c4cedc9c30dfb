"""A scene, a library and a reading: the sizes, places and carriers that the rules take."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

from labgym.layouts import Layout
from labgym.layouts.placement import FLOOR
from labgym.layouts.rules.storage import STORAGE_CLASSES
from labgym.paper.labbuilder.frame import WALL_THICKNESS
from labgym.paper.labbuilder.scene import LabBuilderScene, key
from labgym.paper.labbuilder.writing import ROOM, scene_data
from labgym.paper.labbuilder_rules.bodies import Body, Span
from labgym.paper.labbuilder_rules.library import Entry, Library, catalog_entry
from labgym.paper.labbuilder_rules.quirks import Reading

CABINET = "ReagentCabinet"
FLOOR_KINDS = (
    "ExperimentalPlatform", "ValidationPlatform", "FumeHood", "GloveBox", CABINET, "RotaryEvaporator",
    "GravityChromatographyColumn",
)  # fmt: skip
"""Kinds that the released program takes as furniture on the floor."""
ROOM_WITHOUT_OBJECT = (9.0, 9.0)
"""Sides of the room, centered at the origin, if the scene has no object for it, meters."""
STORAGE = STORAGE_CLASSES - {"Refrigerator"}
"""Storage classes of the cabinets of labgym that are reagent cabinets here; refrigerators are another kind of asset."""
_WORDS = re.compile(r"(?<=.)(?=[A-Z][a-z])|(?<=[a-z0-9])(?=[A-Z])")
_QUARTERS = (90.0, 270.0)
_SPLIT = {name.lower(): _WORDS.sub("_", name).lower() for name in FLOOR_KINDS[:6]}


@dataclass(frozen=True)
class Piece:
    """An object of a scene.

    Attributes:
        id, label: its name, which others may share, and the name of what carries it (`initial_location`).
        x, y, z: middle of its bottom, meters.
        degrees: rotation about +z.
        own: extents along x and y at 0 degrees and height, if the scene states them, meters.
    """

    id: str
    label: str
    x: float
    y: float
    z: float
    degrees: float
    own: tuple[float, float, float] | None = None

    @property
    def is_room(self) -> bool:
        """Whether the object stands for the room."""
        return self.id == ROOM

    @property
    def on_floor(self) -> bool:
        """Whether the label says that it stands on the floor."""
        return self.label == FLOOR

    @property
    def is_cabinet(self) -> bool:
        """Whether its name has that of the reagent cabinet in it."""
        return names_cabinet(self.id)


@dataclass(frozen=True)
class RatedScene:
    """A scene as the rules take it.

    Attributes:
        pieces: its objects in their order, the room's included.
        room: outer extents along x and y, meters; None if the file does not state them.
        further: assets that libraries lack, for a layout of labgym.
        places: names of the places that the protocol visits, in order.
    """

    pieces: tuple[Piece, ...]
    room: tuple[float, float] | None
    further: tuple[Entry, ...] = ()
    places: tuple[str, ...] = ()


def scene_of(scene: LabBuilderScene, places: Iterable[str] = ()) -> RatedScene:
    """Return a scene file's content as the rules take it."""
    size = scene.room_size
    pieces = (
        Piece(each.id, each.initial_location, each.position.x, each.position.y, each.position.z, each.rotation.z)
        for each in scene.objects
    )
    return RatedScene(tuple(pieces), None if size is None else (size.w, size.d), (), tuple(places))


def layout_scene(layout: Layout, library: Library) -> RatedScene:
    """Return a layout of labgym as the rules take it, by way of the scene that labgym writes.

    Cabinets for reagents are called ReagentCabinet_1, ReagentCabinet_2, ...; items in them are labeled so. An object
    whose id the library lacks has the entry of its asset's name, and if that is missing, too, labgym's size without
    flags.

    Raises:
        LabgymError: the floor is not one rectangular room.
    """
    data = scene_data(layout)
    placements = {placement.id: placement for placement in layout.placements}
    cabinets = [name for name in placements if layout.asset(name).storage_class in STORAGE]
    renamed = {name: f"{CABINET}_{number}" for number, name in enumerate(cabinets, 1)}
    pieces, further = [], []
    for each in data["objects"]:
        name, label, own = each["id"], each["initial_location"], None
        if name in placements:
            asset, support = layout.asset(name), placements[name].support
            label = renamed.get(support, label)
            size = asset.size
            own = (size.width, size.depth, size.height)
            name = renamed.get(name, name)
            if library.find(name) is None:
                entry = library.find(asset.name)
                plain = Entry(name, name, catalog_entry(name, asset).kind, size.short, size.long, size.height)
                further.append(plain if entry is None else replace(entry, id=name, name=name))
        position = each["position"]
        pieces.append(Piece(name, label, position["x"], position["y"], position["z"], each["rotation"]["z"], own))
    protocol = layout.protocol
    found = [layout.find(step.location) for step in protocol.steps] if protocol is not None else []
    places = tuple(renamed.get(one.id, one.id) for one in found if one is not None)
    size = data["room_size"]
    return RatedScene(tuple(pieces), (size["w"], size["d"]), tuple(further), places)


def names_cabinet(text: str) -> bool:
    """Return whether a name or label has that of the reagent cabinet in it."""
    return CABINET in text or "reagent_cabinet" in text.lower()


def snake(name: str) -> str:
    """Return a name in snake case, as the geometry of the released program compares names."""
    words = _WORDS.sub("_", name).lower()
    return _SPLIT.get(words, words)


class Stage:
    """A scene, seen through a reading.

    Args:
        scene: the scene.
        library: sizes and flags; assets that it lacks are taken from the scene.
        reading: which quirks are corrected.
    """

    def __init__(self, scene: RatedScene, library: Library, reading: Reading) -> None:
        self.scene, self.reading = scene, reading
        self.library = library.with_entries(scene.further) if scene.further else library
        self.pieces: Sequence[Piece] = [piece for piece in scene.pieces if not piece.is_room]
        self.room_piece = next((piece for piece in scene.pieces if piece.is_room), None)

    def sides(self, piece: Piece, name: str | None = None) -> tuple[float, float, float]:
        """Return extents along x and y at 0 degrees, and height.

        Args:
            piece: the object. name: whose size in the library counts; by default that of its id.
        """
        return self.own_sides(piece, self.library.sized(piece.id if name is None else name))

    def own_sides(self, piece: Piece, entry: Entry) -> tuple[float, float, float]:
        """Return the sides that an object states, if they count; else those of an entry."""
        return entry.sides if piece.own is None or self.reading.literal("sizes") else piece.own

    def body(self, piece: Piece, name: str | None = None) -> Body:
        """Return the box of an object; `name` as in `sides`."""
        return self._body(piece, self.sides(piece, name), piece.degrees % 360.0 in _QUARTERS)

    def hollow(self, cabinet: Piece) -> Body | None:
        """Return the box that a reagent in a cabinet is in; None if its size is not known."""
        if not self.reading.literal("cabinet"):
            sides = self.sides(cabinet)
        else:
            entry = self.library.find(CABINET)
            if entry is None:
                return None
            sides = entry.sides
        body = self._body(cabinet, sides, abs(cabinet.degrees) in _QUARTERS)
        return Body(body.x, body.y, body.width, body.depth, body.yaw, cabinet.z, cabinet.z + sides[2])

    def _body(self, piece: Piece, sides: tuple[float, float, float], quarter: bool) -> Body:
        width, depth, height = sides
        yaw = 0.0
        if quarter:
            width, depth = depth, width
        elif not self.reading.literal("oblique"):
            yaw = math.radians(piece.degrees % 180.0)
        bottom = piece.z - height / 2 if self.reading.literal("middle") else piece.z
        return Body(piece.x, piece.y, width, depth, yaw, bottom, bottom + height)

    def stands(self, piece: Piece) -> bool:
        """Return whether an object counts as standing on the floor."""
        return piece.on_floor or (self.reading.literal("names") and piece.id in FLOOR_KINDS)

    def carrier(self, piece: Piece) -> Piece | None:
        """Return what carries an item: of the objects that its label names the nearest."""
        named = [other for other in self._called.get(key(piece.label), ()) if other is not piece]
        return min(named, key=lambda other: math.hypot(other.x - piece.x, other.y - piece.y), default=None)

    @cached_property
    def _called(self) -> dict[str, list[Piece]]:
        called: dict[str, list[Piece]] = {}
        for piece in self.pieces:
            called.setdefault(key(piece.id), []).append(piece)
        return called

    def carriers(self, piece: Piece) -> tuple[Piece, ...]:
        """Return what carries an item, what carries that, and so on."""
        chain: list[Piece] = []
        below = None if piece.on_floor else self.carrier(piece)
        while below is not None and below not in chain:
            chain.append(below)
            below = None if below.on_floor else self.carrier(below)
        return tuple(chain)

    @cached_property
    def interior(self) -> tuple[Span, Span]:
        """The bounds of the floor inside the walls."""
        literal, room = self.reading.literal("room"), self.room_piece
        if room is None and (literal or self.scene.room is None):
            x, y, width, depth = 0.0, 0.0, *ROOM_WITHOUT_OBJECT
        else:
            entry = self.library.sized(ROOM)
            width, depth = self.scene.room or (entry.short, entry.long)
            if literal and room is not None:
                body = self.body(room)
                width, depth = body.width, body.depth
            x, y = (width / 2, depth / 2) if room is None else (room.x, room.y)
        return (
            (1.0, 0.0, x - width / 2 + WALL_THICKNESS, x + width / 2 - WALL_THICKNESS),
            (0.0, 1.0, y - depth / 2 + WALL_THICKNESS, y + depth / 2 - WALL_THICKNESS),
        )
