"""What `generate` says when it returns no layout, or less than the full furnishing."""

from dataclasses import replace

import pytest
from floor_shapes import two_rooms

import labgym.layouts.interiors.furnisher as furnisher
from labgym.cli import main
from labgym.errors import InfeasibleError, SearchLimitError
from labgym.layouts import Door, Room, generate, room_presets
from labgym.layouts.floor import Floor, Rectangle, Space, Wall
from labgym.layouts.generate import resolve_request
from labgym.layouts.interiors import FloorProposer, proposer
from labgym.layouts.interiors.furnisher import FurnishedSpace

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


def bay_and_study(exit_of_study: bool, door: float = 0.8) -> Floor:
    """Return a laboratory of 8 x 8 m and a study behind a door `door` meters wide; the study may have its own exit."""
    floor = two_rooms(width=door)
    front, right, back, left, inner = floor.walls
    moved = {
        "front": front.model_copy(update={"end": (11.2, -0.1)}),
        "right": right.model_copy(
            update={
                "start": (11.2, -0.1),
                "end": (11.2, 8.1),
                "openings": right.openings if exit_of_study else (),
            }
        ),
        "back": back.model_copy(update={"start": (11.2, 8.1), "end": (-0.1, 8.1), "openings": ()}),
        "left": left.model_copy(update={"start": (-0.1, 8.1)}),
        "inner": inner.model_copy(update={"start": (8.05, 0.0), "end": (8.05, 8.0)}),
    }
    spaces = (
        Space(id="lab", region=(Rectangle(x1=8.0, y1=8.0),)),
        Space(id="study", x=8.1, region=(Rectangle(x1=3.0, y1=8.0),)),
    )
    return Floor(walls=tuple(moved.values()), spaces=spaces)


def test_a_space_behind_a_door_that_is_too_narrow_for_a_way_out_stays_empty():
    layout = generate("sub_01", floor=bay_and_study(exit_of_study=False))
    assert layout.provenance.options["empty"] == ["study"]
    assert all(item.position[0] < 8.1 for item in layout.placements if item.support == "floor")


def test_a_closet_stays_empty():
    floor = bay_and_study(exit_of_study=False)
    inner = floor.walls[4]
    door = inner.openings[0].model_copy(update={"position": 0.75, "width": 0.95})
    walls = (*floor.walls[:4], inner.model_copy(update={"openings": (door,)}))
    walls += (Wall(start=(8.1, 1.55), end=(11.1, 1.55), thickness=0.1),)
    closet = Space(id="closet", x=8.1, region=(Rectangle(x1=3.0, y1=1.5),))
    layout = generate("sub_01", floor=Floor(walls=walls, spaces=(floor.spaces[0], closet)))
    assert layout.provenance.options["empty"] == ["closet"]


def test_a_space_that_cannot_hold_its_share_stays_empty_unless_another_floor_can_be_drawn(monkeypatch):
    def furnish(request, needs, grounds, *rest):
        if any(ground.space == "study" for ground in grounds):
            return None, FurnishedSpace(None, space="study")
        return furnish_spaces(request, needs, grounds, *rest)

    furnish_spaces = proposer.furnish_spaces
    monkeypatch.setattr(proposer, "furnish_spaces", furnish)
    request = resolve_request("sub_01", floor=bay_and_study(exit_of_study=False, door=1.0))
    assert FloorProposer().plan(request).options["empty"] == ["study"]
    with pytest.raises(SearchLimitError, match="the furniture of 'study' found no places"):
        FloorProposer().plan(replace(request, family="bay"))


def test_exits_that_no_wide_way_joins_with_one_laboratory_are_refused_with_their_places():
    with pytest.raises(
        InfeasibleError, match=r"no way 0\.90 m wide leads from the exit of 'lab' at .* to 1 of 2"
    ) as caught:
        generate("sub_01", floor=bay_and_study(exit_of_study=True))
    assert "remove exits" in str(caught.value)


def test_walls_that_are_too_short_for_the_pieces_are_refused_without_a_search(monkeypatch):
    monkeypatch.setattr(proposer, "furnish_spaces", lambda *_: pytest.fail("a search began"))
    request = resolve_request(["sub_01", "cyc_03", "red_05"], room=Room(width=5.0, depth=4.0, doors=FRONT))
    with pytest.raises(InfeasibleError, match=r"m wide together; the walls at which they can stand are") as caught:
        FloorProposer(patience="short").plan(request)
    needed, usable = (float(part.split()[-1]) for part in str(caught.value).split(" m ") if part[-1].isdigit())
    assert usable <= 2.0 * (5.0 + 4.0) - 0.9
    assert usable < needed
