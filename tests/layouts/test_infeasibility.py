"""What `generate` says when it returns no layout, or less than the full furnishing."""

import pytest

import labgym.layouts.interiors.furnisher as furnisher
from labgym.cli import main
from labgym.errors import InfeasibleError, SearchLimitError
from labgym.layouts import Door, Room, generate, room_presets

FRONT = (Door(wall="front", offset=1.5),)


def test_a_ceiling_that_is_too_low_is_named_with_the_height_that_is_required():
    with pytest.raises(
        InfeasibleError, match=r"FumeHood is 2\.35 m high, but the ceiling is 2\.20 m: at least 2\.35 m"
    ):
        generate("sub_01", room=Room(width=8.0, depth=8.0, height=2.2, doors=FRONT))


def test_one_exit_is_refused_under_the_profile_code_and_two_are_accepted():
    with pytest.raises(
        InfeasibleError, match=r"only one exit for 64 m²; above 18\.6 m² two are required .* add a door"
    ):
        generate("sub_01", room="default", profile="code")
    assert generate("sub_01", room="bay", profile="code").provenance.options["profile"] == "code"


@pytest.mark.slow
def test_walls_that_are_too_short_are_compared_with_what_can_be_used_of_them():
    with pytest.raises(InfeasibleError) as caught:
        generate("alk_02", room=Room(width=4.0, depth=4.0, doors=FRONT))
    assert not isinstance(caught.value, SearchLimitError)
    (conflict,) = caught.value.conflicts
    numbers = [float(word) for word in conflict.split() if word.replace(".", "", 1).isdigit()]
    needed, usable = numbers[1], numbers[2]
    assert usable < needed
    assert usable < 16.0 - 1.2


def test_a_solver_that_stops_at_its_limit_says_so_and_not_that_the_room_is_too_small(monkeypatch):
    for name, value in (("QUICK", 1e-7), ("THOROUGH", 1e-7), ("ATTEMPTS", 3), ("FREE_ATTEMPTS", 1)):
        monkeypatch.setattr(furnisher, name, value)
    with pytest.raises(SearchLimitError, match=r"a layout may exist.* reached the solver's effort limit") as caught:
        generate("sub_01", room="bay")
    assert "cannot hold" not in str(caught.value)


@pytest.mark.parametrize(
    ("room", "rules"),
    [pytest.param("40x40", "paper", marks=pytest.mark.slow), ("20x30", "touchstone")],
)
def test_a_large_room_is_fully_furnished(room, rules):
    assert generate("sub_01", 1, room, rules=rules).provenance.options["furnishing"] == "full"


def test_reduced_furnishing_is_explained_by_the_command(tmp_path, capsys):
    assert main(["generate", "sub_01", "--room", "5.5x5.5", "--out", str(tmp_path)]) == 0
    assert "reduced furnishing only: no place for" in capsys.readouterr().err


def test_every_preset_for_new_layouts_has_two_exits_far_apart():
    for name in ("bay_small", "bay", "bay_large"):
        room = room_presets()[name]
        (x, _), (_, y) = [(door.offset, door.offset) for door in room.doors]
        assert [door.wall for door in room.doors] == ["front", "right"]
        apart = ((room.width - x) ** 2 + y**2) ** 0.5
        assert apart > (room.width**2 + room.depth**2) ** 0.5 / 2.0
