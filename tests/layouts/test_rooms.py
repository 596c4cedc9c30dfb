from __future__ import annotations

import json
import math
from itertools import pairwise

import pytest

from labgym.cli import main
from labgym.errors import DocumentError, LabgymError, OptionError, UnknownNameError
from labgym.layouts import Door, Layout, Room, generate
from labgym.layouts.rooms import resolve_room, with_services
from labgym.layouts.rules.zones import door_pose


def test_a_size_is_a_room_with_two_doors_more_than_half_the_diagonal_apart():
    room = resolve_room("12x9.5")
    assert (room.width, room.depth, room.height) == (12.0, 9.5, 3.0)
    first, second = (door_pose(room, door) for door in room.doors)
    assert math.dist(first[:2], second[:2]) > math.hypot(12.0, 9.5) / 2.0
    assert resolve_room(" 6 X 5 ") == resolve_room("6x5")


def test_a_room_is_read_from_its_file(tmp_path):
    data = {
        "schema": "labgym.room/1",
        "name": "mine",
        "width": 9.0,
        "depth": 7.0,
        "height": 2.8,
        "doors": [{"wall": "left", "offset": 2.0, "width": 1.2}],
    }
    path = tmp_path / "room.json"
    path.write_text(json.dumps(data))
    expected = Room(name="mine", width=9.0, depth=7.0, height=2.8, doors=(Door(wall="left", offset=2.0, width=1.2),))
    assert resolve_room(path) == resolve_room(str(path)) == expected
    assert type(resolve_room(path)) is Room
    overlapping = {"doors": [{"wall": "left", "offset": 2.0}, {"wall": "left", "offset": 2.5}]}
    path.write_text(json.dumps(data | overlapping))
    with pytest.raises(DocumentError) as caught:
        resolve_room(path)
    overlap = "the doors at offsets 2 and 2.5 m of the left wall overlap by 0.50 m: move one"
    assert str(caught.value) == f"{path}: {overlap}"
    for change, field in (({"width": -1}, "width"), ({"schema": "labgym.layout/2"}, "schema"), ({"wide": 3}, "wide")):
        path.write_text(json.dumps(data | change))
        with pytest.raises(DocumentError, match=f"field {field}"):
            resolve_room(path)


@pytest.mark.parametrize(
    "room, error, message",
    [
        ("huge", UnknownNameError, "two_exits"),
        ("120x9", DocumentError, "room '120x9': field width: .* 50"),
        ("9x700", DocumentError, "room '9x700': field depth: .* 50"),
        ("1x9", DocumentError, "greater than or equal to 2"),
        (3.0, OptionError, "got float"),
        (Room(width=6.0, depth=6.0, doors=()), OptionError, "room 'custom' has no door: add one"),
    ],
)
def test_what_is_no_room_is_refused_in_one_line(room, error, message):
    with pytest.raises(error, match=message) as caught:
        generate("sub_01", room=room)
    assert isinstance(caught.value, LabgymError)
    assert "\n" not in str(caught.value)


def test_the_command_takes_sizes_and_files(tmp_path, capsys):
    out = tmp_path / "lab.json"
    assert main(["generate", "sub_01", "--room", "9x8", "--out", str(out)]) == 0
    room = Layout.load(out).room
    assert (room.width, room.depth, room.name) == (9.0, 8.0, "9x8")
    (tmp_path / "room.json").write_text(json.dumps({"schema": "labgym.room/1", "width": 9, "depth": 8, "doors": []}))
    assert main(["generate", "sub_01", "--room", str(tmp_path / "room.json"), "--out", str(out)]) == 2
    assert "has no door" in capsys.readouterr().err


def test_services_lie_on_their_wall_and_leave_no_stretch_of_it_without():
    room = resolve_room("12x9.5")
    floor = with_services(room, ("exhaust:back", "water:left:required", "gas:right"))
    walls = {"exhaust": ("y", 9.5, "x", 12.0), "water": ("x", 0.0, "y", 9.5), "gas": ("x", 12.0, "y", 9.5)}
    for kind, (across, at, along, length) in walls.items():
        points = [point for point in floor.services if point.kind == kind]
        assert all(getattr(point, across) == at for point in points)
        ends = sorted([*(getattr(point, along) for point in points), 0.0, length])
        assert max(b - a for a, b in pairwise(ends)) <= 2.0
        assert all(point.required == (kind == "water") for point in points)
    assert floor.walls == room.floor.walls


@pytest.mark.parametrize("text", ["exhaust", "steam:back", "water:north", "gas:left:maybe", ""])
def test_a_service_that_is_no_kind_and_wall_is_refused_in_one_line(text):
    with pytest.raises(OptionError, match="not KIND:WALL") as error:
        with_services(resolve_room("8x8"), (text,))
    assert "\n" not in str(error.value)
