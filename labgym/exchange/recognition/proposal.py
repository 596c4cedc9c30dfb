"""Proposals of floors from files that no strict reader takes: a floor, what was left out, and questions."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence, Set
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field, ValidationError
from shapely import Polygon
from shapely.affinity import translate

from labgym.documents import Document, Growing
from labgym.errors import DocumentError, OptionError
from labgym.exchange.recognition.picture import Picture
from labgym.exchange.recognition.rooms import LEAST_AREA, Labels, rooms_of
from labgym.exchange.recognition.sides import outlines as outlines_of
from labgym.exchange.recognition.walls import (
    WIDEST_DOOR,
    PlanWall,
    add_door,
    add_openings,
    longest_wall,
    reached,
    trimmed,
    walls_around,
)
from labgym.exchange.regions import region_of
from labgym.exchange.strips import PASSABLE, tidy_point
from labgym.geometry.frames import PlanarPose, compose
from labgym.layouts.floor import Floor, Opening, Space, Wall
from labgym.layouts.floor.changes import closed_doors, walls_with

Pair = tuple[float, float]
Line = tuple[float, float, float, float]
Corners = Annotated[tuple[Pair, ...], Field(min_length=3, max_length=100)]
MAX_ROOMS = 60
"""Largest number of rooms of a proposal."""
MAX_SIZE = 100.0
"""Greatest extent of a floor, meters."""
IMAGES = (".png", ".pgm", ".bmp", ".tif", ".tiff", ".pdf")
"""Suffixes of images of floor plans."""
POINT = 0.0254 / 72.0 * 100.0
"""Length of a point of a PDF file at 1:100, with which the scale is sought for an area, meters."""
PIXEL = 0.02
"""Side of a pixel of an image with which the scale is sought for an area, meters."""
HEIGHT, DOOR_HEIGHT = 3.0, 2.1
"""Heights of walls and openings, meters."""
ROUNDS = 24
"""Largest number of parts that are left out until the rest forms a floor."""
BLOCKED_M = 0.1
"""Distance from a blocked place within which an opening is left out, more than widening moves it, meters."""
DRAWN_WALL = 0.1
"""Thickness of a wall of --split, meters."""
ROOM = re.compile(r"space '(room_[0-9]{1,3})'")
ACCESS = re.compile(r"has no door|no way leads")
BLOCKED = re.compile(r"position ([0-9.e+-]{1,20}) m of wall ([0-9]{1,4}) is blocked")


class Answers(Document, Growing):
    """Answers to the questions of a proposal; with them a run repeats.

    Attributes:
        scale: meters per unit of a drawing, or a factor on the resolution of a map.
        area: area of all rooms, from which the scale follows, square meters.
        layers: layers of a drawing with its walls.
        storey: number from the lowest, from 1, or name of a storey of a building model.
        doors: places of doors in the frame of the file, meters.
        splits: walls that divide rooms, x0, y0, x1, y1 in the frame of the file, meters.
        merges: numbers of rooms that are one room; with 0 those that are no rooms.
        furniture: areas without walls, x0, y0, x1, y1 of two corners in the frame of the file, meters.
        outlines: rooms by their corners in the frame of the file, in order, meters.
    """

    ADDED: ClassVar[frozenset[str]] = frozenset({"storey", "furniture", "outlines"})
    SCHEMA: ClassVar[str] = "labgym.outline-answers/1"

    scale: Annotated[float, Field(gt=0.0, le=1000.0)] | None = None
    area: Annotated[float, Field(gt=0.0, le=10_000.0)] | None = None
    layers: Annotated[tuple[str, ...], Field(max_length=50)] = ()
    storey: Annotated[str, Field(max_length=80)] | None = None
    doors: Annotated[tuple[Pair, ...], Field(max_length=100)] = ()
    splits: Annotated[tuple[Line, ...], Field(max_length=100)] = ()
    merges: Annotated[tuple[tuple[int, ...], ...], Field(max_length=50)] = ()
    furniture: Annotated[tuple[Line, ...], Field(max_length=100)] = ()
    outlines: Annotated[tuple[Corners, ...], Field(max_length=MAX_ROOMS)] = ()


@dataclass(frozen=True)
class Proposal:
    """A floor recognized from a file.

    Attributes:
        floor: the floor, along the main direction, with its lower left corner as origin.
        shift: position of the floor's origin in the turned frame of the picture, meters.
        rooms: outlines in that frame. walls: in that frame, with openings.
        skipped: parts that were left out. questions: what is not certain, each with the option that answers it.
    """

    floor: Floor
    picture: Picture
    rooms: Mapping[str, Polygon]
    walls: Sequence[PlanWall]
    shift: Pair
    skipped: tuple[str, ...] = ()
    questions: tuple[str, ...] = ()


@dataclass
class _Notes:
    frame: PlanarPose = (0.0, 0.0, 0.0)
    skipped: list[str] = field(default_factory=list)
    questions: list[str] = field(default_factory=list)


def recognize(path: str | Path, answers: Answers | None = None) -> Proposal:
    """Return the floor that a map of ROS, a drawing, an image of a plan or a building model probably shows.

    Unlike the strict readers it guesses: the unit and the layers of a drawing, rooms behind furniture, doors that are
    not seen. Everything that it guesses or leaves out is listed.

    Raises:
        DocumentError: the file is missing, damaged, too large, or shows no room.
        OptionError: an answer does not fit the file.
        MissingDependencyError: the extra `cad` is not installed.
    """
    path, answers = Path(path), answers or Answers()
    picture, notes = _picture(path, answers)
    if answers.area is not None and answers.scale is None:
        found = sum(room.area for room in _rooms(path, picture, _labels(picture, answers, _Notes())).values())
        picture, notes = _picture(path, answers.model_copy(update={"scale": _scale_of(picture, answers.area / found)}))
    labels = _labels(picture, answers, notes)
    return _assembled(path, picture, labels, answers, notes)


def _picture(path: Path, answers: Answers) -> tuple[Picture, _Notes]:
    """Return the picture of a file with --furniture, --split and --outline, and what is noted about it."""
    picture, notes = _file_picture(path, answers)
    areas, lines = (
        tuple(((x0, y0), (x1, y1)) for x0, y0, x1, y1 in values) for values in (answers.furniture, answers.splits)
    )
    outlines = tuple(picture.from_file(np.array(corners)) for corners in answers.outlines)
    for corners, stated in zip(outlines, answers.outlines, strict=True):
        if not Polygon(corners).is_valid or Polygon(corners).area < LEAST_AREA or not picture.inside(corners).any():
            x, y = stated[0]
            raise OptionError(
                f"--outline {x:g},{y:g},...: name the corners of a room of {LEAST_AREA:g} m² or more in the picture, "
                "in order, so that no two sides cross"
            )
    return replace(picture.with_floor(areas).with_walls(lines, DRAWN_WALL), outlines=outlines), notes


def _file_picture(path: Path, answers: Answers) -> tuple[Picture, _Notes]:
    if path.suffix.lower() == ".dxf":
        from labgym.exchange.recognition.plans import picture_of_drawing

        picture, skipped, questions = picture_of_drawing(path, answers.scale, answers.layers)
        return picture, _Notes(skipped=list(skipped), questions=list(questions))
    if path.suffix.lower() == ".ifc":
        from labgym.exchange.ifc.reading import picture_of_building

        if answers.layers or answers.scale is not None:
            raise OptionError(
                "--layers, --scale and --area are for drawings and maps; a building model states its unit"
            )
        picture, frame, left_out, asked = picture_of_building(path, answers.storey)
        return picture, _Notes(frame, left_out, asked)
    from labgym.exchange.recognition.scans import picture_of, picture_of_plan
    from labgym.exchange.ros_files import open_image, open_ros_map

    if answers.layers:
        raise OptionError("--layers is for drawings; a map of ROS and an image have none")
    if path.suffix.lower() in IMAGES:
        if answers.scale is None and answers.area is None:
            unit = "POINT (0.0353 for 1:100)" if path.suffix.lower() == ".pdf" else "PIXEL"
            raise OptionError(f"{path.name} states no scale: give --scale METERS_PER_{unit}, or --area of all rooms")
        scale = answers.scale or (POINT if path.suffix.lower() == ".pdf" else PIXEL)
        return replace(picture_of_plan(open_image(path, scale)), unit=scale), _Notes()
    grid = open_ros_map(path, lenient=True)
    factor = answers.scale or 1.0
    origin = (grid.origin[0] * factor, grid.origin[1] * factor, grid.origin[2])
    return picture_of(replace(grid, resolution=grid.resolution * factor, origin=origin)), _Notes()


def _scale_of(picture: Picture, ratio: float) -> float:
    """Return the scale with which areas grow by a ratio."""
    return picture.unit * math.sqrt(ratio)


def _labels(picture: Picture, answers: Answers, notes: _Notes) -> Labels:
    """Return the room of each cell."""
    labels, dropped = rooms_of(picture, answers.merges)
    for column, row in dropped:
        at = np.array([[picture.x + (column + 0.5) * picture.cell, picture.y + (row + 0.5) * picture.cell]])
        x, y = picture.to_file(at)[0].tolist()
        notes.skipped.append(f"the area at ({x:.1f}, {y:.1f}) m: few walls around it")
    rest = int(labels.max(initial=0)) - MAX_ROOMS
    if rest > 0:
        notes.skipped.append(f"the {rest} smallest rooms: at most {MAX_ROOMS} are proposed")
        labels = np.where(labels <= MAX_ROOMS, labels, 0).astype(np.int32)
    return labels


def _rooms(path: Path, picture: Picture, labels: Labels, coarse: Mapping[int, int] | None = None) -> dict[int, Polygon]:
    """Return the outlines of rooms by number, in the turned frame; those of some rooms with fewer corners."""
    rooms = outlines_of(picture, labels, coarse)
    if not rooms:
        raise DocumentError(path, "", _nothing(path, picture, labels))
    return rooms


def _nothing(path: Path, picture: Picture, labels: Labels) -> str:
    remedy = (
        "give the layers of the walls with --layers, or the scale with --scale"
        if picture.drawn
        else ("draw the walls as occupied, or give the scale with --scale")
    )
    if path.suffix.lower() == ".ifc":
        remedy = "give another storey with --storey"
    width, depth = (extent * picture.cell for extent in labels.shape[::-1])
    return f"no room of 2 m² or more is enclosed by walls in {width:.3g} x {depth:.3g} m: {remedy}"


def _assembled(path: Path, picture: Picture, labels: Labels, answers: Answers, notes: _Notes) -> Proposal:
    """Return the proposal; rooms and openings that do not fit a floor are left out one after another."""
    blocked: set[Pair] = set()
    # A drawing has no finer outlines to begin with.
    coarse = dict.fromkeys(range(1, int(labels.max(initial=0)) + 1), int(picture.drawn))
    left_out: set[int] = set()
    cut_off: set[int] = set()
    for _ in range(ROUNDS):
        rooms = {label: room for label, room in _rooms(path, picture, labels, coarse).items() if label not in left_out}
        if not rooms:
            break
        bounds = [room.bounds for room in rooms.values()]
        x0, y0 = min(b[0] for b in bounds), min(b[1] for b in bounds)
        size = max(b[2] for b in bounds) - x0, max(b[3] for b in bounds) - y0
        if max(size) > MAX_SIZE - 1.0:
            raise DocumentError(
                path, "", f"the rooms cover {size[0]:.0f} x {size[1]:.0f} m, over {MAX_SIZE:g} m: give --scale"
            )
        here = _Notes(notes.frame, list(notes.skipped), list(notes.questions))
        walls = _with_doors(picture, rooms, answers, here, cut_off, blocked)
        apart = sorted(set(rooms) - reached(walls, list(rooms)))
        for label in apart[len(apart) // 2 :]:  # the smaller ones: without them walls of the others may be outer ones
            notes.skipped.append(f"{_named(picture, label, rooms[label])}: no wall has place for a door")
            left_out.add(label)
        if not apart:
            try:
                floor = _floor(path, rooms, walls, (x0, y0))
            except (ValidationError, OptionError) as error:
                message = str(error)
                room = ROOM.search(message)
                if isinstance(error, _BlockedError):
                    wall, along = walls[error.wall], error.position
                    middles = [sum(each) / 2.0 for each in wall.openings]
                    blocked.add(wall.point(min(middles, key=lambda middle: abs(middle - along))))
                elif room is not None or isinstance(error, _RoomError):
                    label = error.label if isinstance(error, _RoomError) else int(room[1][5:] if room else 0)
                    if _eased(label, message, coarse, cut_off):
                        continue
                    reason = message.splitlines()[-2 if isinstance(error, ValidationError) else -1].strip()[:160]
                    notes.skipped.append(f"{_named(picture, label, rooms[label])}: {reason}")
                    left_out.add(label)
                elif "rectangles on one floor" in message:
                    if min((coarse[label] for label in rooms), default=3) < 3:
                        coarse = {label: coarse[label] + 1 for label in rooms}
                    else:
                        label = max(rooms)
                        notes.skipped.append(f"{_named(picture, label, rooms[label])}: the floor has too many corners")
                        left_out.add(label)
                else:
                    raise DocumentError(path, "", f"the recognized rooms form no floor ({message[:200]})") from None
                continue
            outlines_ = {f"room_{label}": room for label, room in rooms.items()}
            place = *picture.to_file(np.array([(x0, y0)]))[0].tolist(), picture.yaw
            floor = floor.model_copy(update={"origin": compose(notes.frame, place)})
            return Proposal(floor, picture, outlines_, walls, (x0, y0), tuple(here.skipped), tuple(here.questions))
    last = f" ({notes.skipped[-1]})" if notes.skipped else ""
    raise DocumentError(path, "", f"no recognized room can be part of a floor{last}: give --layers, --scale or --door")


def _eased(label: int, message: str, coarse: dict[int, int], cut_off: set[int]) -> bool:
    """Return whether a room that does not fit gets another try, with another door or with fewer corners."""
    if ACCESS.search(message) is not None:
        again = label not in cut_off
        cut_off.add(label)
    else:
        coarse[label] += 1
        again = coarse[label] <= 3
    return again


class _RoomError(OptionError):
    """A room whose outline gives no region."""

    def __init__(self, label: int, message: str) -> None:
        super().__init__(message)
        self.label = label


class _BlockedError(OptionError):
    """An opening at a position of a wall that another wall blocks."""

    def __init__(self, wall: int, position: float) -> None:
        super().__init__(f"an opening of wall {wall} is blocked")
        self.wall, self.position = wall, position


def _with_doors(
    picture: Picture,
    rooms: Mapping[int, Polygon],
    answers: Answers,
    notes: _Notes,
    cut_off: Set[int],
    blocked: Set[Pair],
) -> list[PlanWall]:
    """Return the walls with the doors that are seen, answered or proposed; rooms that are cut off get another one."""
    walls = walls_around(rooms)
    add_openings(picture, walls)
    for start, end in picture.doors:
        middle = ((start[0] + end[0]) / 2.0, (start[1] + end[1]) / 2.0)
        add_door(walls, middle, float(np.hypot(end[0] - start[0], end[1] - start[1])), 0.4)
    for point in answers.doors:
        x, y = picture.from_file(np.array([point]))[0].tolist()
        if not add_door(walls, (x, y)):
            raise OptionError(f"--door {point[0]:g},{point[1]:g}: no wall with place for a door lies within 0.8 m")
    for segment in walls:
        _revise(picture, segment, blocked, notes)
    inside = set(rooms)
    if not any(wall.openings and 0 in wall.rooms for wall in walls):
        first = next(iter(rooms))
        wall = longest_wall(walls, {first}, {0}, blocked) or longest_wall(walls, inside, {0}, blocked)
        if wall is not None:
            _propose(picture, wall, "no exit is seen; one is proposed", notes)
    for label in sorted(cut_off & inside):
        wall = longest_wall(walls, {label}, inside - cut_off, blocked) or longest_wall(walls, {label}, {0}, blocked)
        if wall is not None:
            _propose(picture, wall, f"no clear way to room {label} is seen; a door is proposed", notes)
    while True:
        there = reached(walls, list(rooms))
        missing = inside - there
        wall = longest_wall(walls, missing, there & inside, blocked) or longest_wall(walls, missing, {0}, blocked)
        if not missing or wall is None:
            return walls
        label = wall.rooms[0] if wall.rooms[0] in missing else wall.rooms[1]
        _propose(picture, wall, f"no door to room {label} is seen; one is proposed", notes)


def _revise(picture: Picture, wall: PlanWall, blocked: Set[Pair], notes: _Notes) -> None:
    """Leave out the openings of a wall that are blocked, and widen those that may be wide enough for the robot."""
    wall.openings = [
        way
        for way in wall.openings
        if all(math.dist(wall.point(sum(way) / 2.0), place) > BLOCKED_M for place in blocked)
    ]
    for index, (low, high) in enumerate(wall.openings):
        if high - low < PASSABLE <= high - low + 2.0 * picture.cell and wall.widen(index, PASSABLE):
            x, y = picture.to_file(np.array([wall.point((low + high) / 2.0)]))[0].tolist()
            notes.questions.append(
                f"the door at ({x:.2f}, {y:.2f}) m looks {high - low:.2f} m wide and is drawn {PASSABLE:g} m wide, "
                "as the accuracy of the file allows: correct the file if it is narrower"
            )


def _propose(picture: Picture, wall: PlanWall, what: str, notes: _Notes) -> None:
    at = wall.length / 2.0
    part = wall.free_part(at, 1.0)
    if part is not None:
        wall.openings.append(part)
        x, y = picture.to_file(np.array([wall.point(sum(part) / 2.0)]))[0].tolist()
        notes.questions.append(f"{what} at ({x:.2f}, {y:.2f}) m: give its place with --door X,Y")


def _named(picture: Picture, label: int, room: Polygon) -> str:
    point = room.representative_point()
    x, y = picture.to_file(np.array([(point.x, point.y)]))[0].tolist()
    return f"room {label} at ({x:.1f}, {y:.1f}) m of {room.area:.1f} m²"


def _floor(path: Path, rooms: Mapping[int, Polygon], walls: Sequence[PlanWall], corner: Pair) -> Floor:
    """Return the floor of rooms and walls, with a corner as its origin."""
    spaces = []
    for label, room in rooms.items():
        try:
            (x, y, yaw), region = region_of(translate(room, -corner[0], -corner[1]))
        except OptionError as error:
            raise _RoomError(label, str(error)) from None
        spaces.append(Space(id=f"room_{label}", x=x, y=y, yaw=yaw, region=region, ceiling=HEIGHT))
    parts = [
        Wall(
            start=tidy_point((wall.start[0] - corner[0], wall.start[1] - corner[1])),
            end=tidy_point((wall.end[0] - corner[0], wall.end[1] - corner[1])),
            thickness=round(max(wall.thickness, 0.05), 4),
            height=HEIGHT,
            openings=tuple(_opening(low, high) for low, high in sorted(wall.openings)),
        )
        for wall in walls
    ]
    kept = trimmed(parts, [translate(room, -corner[0], -corner[1]) for room in rooms.values()])
    name = path.parent.name if path.stem == "map" else path.stem
    try:
        floor = Floor(name=name[:80], walls=tuple(kept.values()), spaces=tuple(spaces))
    except ValidationError as error:
        blocked = BLOCKED.search(str(error))
        if blocked is None:
            raise
        raise _BlockedError(list(kept)[int(blocked[2])], float(blocked[1])) from None
    closed = closed_doors(floor)
    if closed:
        floor = Floor(name=name[:80], walls=walls_with(floor, closed, state="open"), spaces=tuple(spaces))
    return floor


def _opening(low: float, high: float) -> Opening:
    """Return a door for an opening as wide as one, else a passage; outer doors open inwards."""
    kind: Literal["door", "passage"] = "door" if high - low <= WIDEST_DOOR else "passage"
    middle, width = round((low + high) / 2.0, 4), round(high - low - 1e-4, 4)
    return Opening(kind=kind, position=middle, width=width, height=DOOR_HEIGHT, swing="left")
