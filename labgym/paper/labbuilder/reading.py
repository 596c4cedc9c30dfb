"""Reads a LabBuilder scene as a layout, with a note on everything that the file does not say."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from labgym import __version__
from labgym.assets import Catalog
from labgym.assets.plausibility import size_problem
from labgym.documents import validating
from labgym.errors import DocumentError
from labgym.layouts import Layout
from labgym.layouts.floor import Door, Floor, Room
from labgym.layouts.placement import FLOOR, Placement, resized
from labgym.layouts.records import Provenance
from labgym.paper.labbuilder.frame import WALL_THICKNESS, to_radians, to_room
from labgym.paper.labbuilder.names import Meaning, kind_of, meaning, unique_ids
from labgym.paper.labbuilder.scene import LabBuilderScene, RoomSize, SceneObject, identifier, key, read_scene
from labgym.paper.labbuilder.sizes import SIZES_FILE, AssetSize, read_sizes
from labgym.paper.labbuilder.supports import Bodies, SupportBody, support_of
from labgym.protocols import Protocol

MAX_LISTED = 20
"""Longest list of names in a message."""
CENTERED = 0.02
"""Greatest distance between the room's object and the middle of the room, meters."""
UPRIGHT = 0.1
"""Greatest rotation about x and y that is ignored, degrees."""
TURNS = 3
"""Least number of turned objects from which small angles are taken as a sign of radians."""


@dataclass(frozen=True)
class Imported:
    """A layout that was read, and notes on what was assumed, renamed or left out."""

    layout: Layout
    notes: tuple[str, ...]


def read_labbuilder(
    path: str | Path,
    sizes: str | Path | None = None,
    protocols: Sequence[Protocol] = (),
    doors: Sequence[Door] = (),
    mapping: Mapping[str, str] | None = None,
    skip_unknown: bool = False,
    catalog: Catalog | None = None,
) -> Imported:
    """Read a scene in LabBuilder's form.

    Poses and sizes are those of the files; nothing is moved, and nothing is added.

    Args:
        sizes: file of sizes; by default asset_bboxes.json next to the scene, if there is one. Sides that it does not
            state are the catalog's.
        protocols: embedded in the layout; the file has none.
        doors: doors of the interior, for a file without any.
        mapping: names in the catalog by names of the scene.
        skip_unknown: leave out objects that the catalog does not have, and what stands on them.
        catalog: by default `Catalog.load()`.

    Raises:
        DocumentError: a file is missing, too large or not of this form, an object is tilted, a size is implausible, or
            objects are unknown; lists all of these.
        UnknownNameError: the mapping names no asset.
    """
    path, catalog = Path(path), Catalog.load() if catalog is None else catalog
    file = read_scene(path)
    beside = path.with_name(SIZES_FILE)
    source = Path(sizes) if sizes is not None else beside if beside.is_file() else None
    table = {} if source is None else read_sizes(source)
    notes = [f"fields that are not read: {', '.join(file.unread[:MAX_LISTED])}"] if file.unread else []
    notes += [*file.notes, *_doubts(file.scene)]
    room, remarks = _room(path, file.scene, table, tuple(doors))
    notes += remarks
    bodies, locations, remarks = _bodies(path, file.scene, table, dict(mapping or {}), skip_unknown, catalog)
    notes += remarks
    notes.append(_size_note(bodies, source))
    placements, remarks = _supported(bodies, locations)
    notes += remarks
    if not protocols:
        notes.append("no protocol: scores leave out required assets and transitions")
    layout = _layout(path, file.scene, room.floor, placements, tuple(protocols), tuple(notes), catalog)
    return Imported(layout, tuple(notes))


def _room(
    path: Path, scene: LabBuilderScene, table: Mapping[str, AssetSize], doors: tuple[Door, ...]
) -> tuple[Room, list[str]]:
    notes = []
    size = scene.room_size
    if size is None:
        size = _stated_room(path, scene, table)
        notes.append(f"room_size is missing; taken from the sizes: {size.w:g} x {size.d:g} x {size.h:g} m")
    margin = 2.0 * WALL_THICKNESS
    doors = doors or scene.doors
    width, depth = round(size.w - margin, 9), round(size.d - margin, 9)
    with validating(f"{path}: room without its walls of {WALL_THICKNESS:.2f} m"):
        room = Room(name=path.stem[:80], width=width, depth=depth, height=size.h, doors=doors)
    notes.append(f"room of {width:.3f} x {depth:.3f} m inside walls of {WALL_THICKNESS:.2f} m")
    if not doors:
        notes.append("no doors: the file has none and none is assumed; add one with --door front,1.5")
    for each in scene.objects:
        off = max(abs(each.position.x - size.w / 2.0), abs(each.position.y - size.d / 2.0))
        if each.is_room and off > CENTERED:
            notes.append(f"{each.id} is {off:.2f} m off the middle of room_size; positions count from the outer corner")
    return room, notes


def _doubts(scene: LabBuilderScene) -> list[str]:
    """Return notes on numbers that suggest other units."""
    objects, notes, size = [each for each in scene.objects if not each.is_room], [], scene.room_size
    turns = [abs(each.rotation.z) for each in objects if each.rotation.z]
    if len(turns) >= TURNS and max(turns) <= 2.0 * math.pi + 1e-3:
        notes.append("no rotation is over 6.29: taken as degrees, but they may be radians")
    places = [] if size is None else [(each.position.x / size.w, each.position.y / size.d) for each in objects]
    outside = sum(not (0.0 <= x <= 1.0 and 0.0 <= y <= 1.0) for x, y in places)
    if 2 * outside > len(places):
        notes.append(f"{outside} of {len(objects)} objects lie outside of the room: check the units of positions")
    return notes


def _stated_room(path: Path, scene: LabBuilderScene, table: Mapping[str, AssetSize]) -> RoomSize:
    """Return the room's size of the file of sizes: its short side lies along x."""
    names = [each.id for each in scene.objects if each.is_room]
    entry = next((table[name] for name in names if name in table), None)
    if entry is None or entry.short is None or entry.long is None or entry.height is None:
        raise DocumentError(path, "room_size", f"missing, and {SIZES_FILE} has no short, long and height of the room")
    return RoomSize(w=entry.short, d=entry.long, h=entry.height)


def _bodies(
    path: Path,
    scene: LabBuilderScene,
    table: Mapping[str, AssetSize],
    mapping: Mapping[str, str],
    skip_unknown: bool,
    catalog: Catalog,
) -> tuple[list[SupportBody], list[str], list[str]]:
    """Return the objects of a scene, what their locations are called, and notes."""
    objects = [each for each in scene.objects if not each.is_room]
    names = [each.id for each in objects]
    meanings = {name: _meaning(path, name, table, mapping, catalog) for name in dict.fromkeys(names)}
    left_out = _unknown(path, objects, meanings, skip_unknown, catalog)
    bodies, locations = [], []
    ids = unique_ids([identifier(name) for name in names])
    for placement_id, each in zip(ids, objects, strict=True):
        meant = meanings[each.id]
        if meant is None or key(each.initial_location) in left_out:
            continue
        bodies.append(_body(path, placement_id, each, meant.asset, table, catalog))
        locations.append(each.initial_location)
    return bodies, locations, [*_renamed(names), *_mapped(meanings), *_skipped(objects, meanings, left_out)]


def _meaning(
    path: Path, name: str, table: Mapping[str, AssetSize], mapping: Mapping[str, str], catalog: Catalog
) -> Meaning | None:
    entry = _entry(table, name)
    if name not in mapping and kind_of(name) not in mapping and entry is not None and entry.asset is not None:
        if entry.asset not in catalog:
            raise DocumentError(path, name, f"asset {entry.asset!r} of {SIZES_FILE} is not in the catalog")
        return Meaning(entry.asset)
    return meaning(name, catalog, mapping)


def _entry(table: Mapping[str, AssetSize], name: str) -> AssetSize | None:
    return table.get(name, table.get(kind_of(name)))


def _body(
    path: Path, placement_id: str, each: SceneObject, name: str, table: Mapping[str, AssetSize], catalog: Catalog
) -> SupportBody:
    turn, at = each.rotation, each.position
    for axis, degrees in (("x", turn.x), ("y", turn.y)):
        if abs((degrees + 180.0) % 360.0 - 180.0) > UPRIGHT:
            problem = f"{each.id} is turned by {degrees:g} degrees about {axis}; objects can only be turned about z"
            raise DocumentError(path, f"objects.{placement_id}.rotation", problem)
    asset, entry = catalog.get(name), _entry(table, each.id)
    size = None if entry is None else entry.size(asset)
    placement = Placement(
        id=placement_id, asset=name, position=to_room(at.x, at.y, at.z), yaw=to_radians(turn.z), size=size
    )
    return SupportBody(placement, asset if size is None else resized(asset, size), each.id)


def _unknown(
    path: Path, objects: Sequence[SceneObject], meanings: Mapping[str, Meaning | None], skip: bool, catalog: Catalog
) -> frozenset[str]:
    """Return the keys of names that the catalog does not have.

    Raises:
        DocumentError: there are such names, and they are not to be skipped.
    """
    unknown = [name for name, meant in meanings.items() if meant is None]
    if unknown and not skip:
        near = [f"{name} (nearest: {', '.join(catalog.nearest(name, 2)) or 'none'})" for name in unknown[:MAX_LISTED]]
        more = f" and {len(unknown) - MAX_LISTED} more" if len(unknown) > MAX_LISTED else ""
        count = sum(meanings[each.id] is None for each in objects)
        problem = f"{count} of {len(objects)} objects are not in the catalog: {', '.join(near)}{more}"
        raise DocumentError(path, "objects", f"{problem}; name assets with --map NAME=ASSET, or use --skip-unknown")
    return frozenset(key(name) for name in unknown)


def _renamed(names: Sequence[str]) -> list[str]:
    ids: dict[str, list[str]] = {}
    for name, placement_id in zip(names, unique_ids([identifier(name) for name in names]), strict=True):
        ids.setdefault(name, []).append(placement_id)
    spelled = [f"{name!r} is called {own[0]}" for name, own in ids.items() if len(own) == 1 and own[0] != name]
    return spelled + [
        f"{len(own)} objects are called {name}: renamed {own[0]} to {own[-1]}"
        for name, own in ids.items()
        if len(own) > 1
    ]


def _mapped(meanings: Mapping[str, Meaning | None]) -> list[str]:
    return [
        f"{name} is the asset {meant.asset}" + (f": {meant.reason}" if meant.reason else "")
        for name, meant in meanings.items()
        if meant is not None and meant.asset != kind_of(name)
    ]


def _skipped(
    objects: Sequence[SceneObject], meanings: Mapping[str, Meaning | None], left_out: frozenset[str]
) -> list[str]:
    unknown = [each.id for each in objects if meanings[each.id] is None]
    notes = [f"left out, not in the catalog: {', '.join(unknown)}"] if unknown else []
    on_them = [each.id for each in objects if meanings[each.id] is not None and key(each.initial_location) in left_out]
    return notes + ([f"left out, on objects that are not in the catalog: {', '.join(on_them)}"] if on_them else [])


def _size_note(bodies: Sequence[SupportBody], source: Path | None) -> str:
    stated = sum(body.placement.size is not None for body in bodies)
    if source is None:
        return f"all {len(bodies)} objects have the catalog's sizes: there is no file of sizes"
    return f"{stated} of {len(bodies)} objects have a size of {source.name}, the others the catalog's"


def _supported(bodies: Sequence[SupportBody], locations: Sequence[str]) -> tuple[tuple[Placement, ...], list[str]]:
    placements, notes, index = [], [], Bodies(bodies)
    for body, location in zip(bodies, locations, strict=True):
        support = support_of(body, location, index)
        placement = body.placement.model_copy(update={"support": support.id, "slot": support.slot})
        problem = None if placement.size is None else size_problem(body.asset, on_floor=support.id == FLOOR)
        if problem is not None and support.id != FLOOR:
            notes.append(f"{placement.id} on {support.id}: {problem}; the catalog's size is taken")
            placement = placement.model_copy(update={"size": None})
        placements.append(placement)
        if support.note:
            notes.append(f"{body.placement.id}: {support.note}")
    return tuple(placements), notes


def _layout(
    path: Path,
    scene: LabBuilderScene,
    floor: Floor,
    placements: tuple[Placement, ...],
    protocols: tuple[Protocol, ...],
    notes: tuple[str, ...],
    catalog: Catalog,
) -> Layout:
    name = re.sub(r"[^A-Za-z0-9_.-]+", "-", path.stem).strip("-._")[:80]
    with validating(path):
        layout = Layout(
            id=scene.id or name or "scene",
            protocols=protocols,
            floor=floor,
            placements=placements,
            provenance=Provenance(
                generator="labbuilder",
                options={"query": scene.query, "notes": list(notes)},
                versions={"labgym": __version__},
            ),
            catalog=catalog,
        )
    layout.check_references(path)
    return layout
