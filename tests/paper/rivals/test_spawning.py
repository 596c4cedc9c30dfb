"""Small objects on receptacles, and objects on walls."""

import math
from collections import Counter

import numpy as np
import pytest
from shapely import Polygon

from labgym.assets import Asset, Catalog
from labgym.layouts.floor import Door, Room
from labgym.layouts.generate import resolve_request
from labgym.layouts.placement import WALL
from labgym.paper.rivals.chamber import chambers
from labgym.paper.rivals.holodeck.proposer import mount
from labgym.paper.rivals.piece import RivalPiece
from labgym.paper.rivals.plan import Hung
from labgym.paper.rivals.spawning import admitted, spawn


@pytest.fixture(scope="module")
def catalog() -> Catalog:
    return Catalog.load()


def spawned(
    catalog: Catalog, furniture: str, names: list[str], seed: int = 0, upright: bool = False
) -> list[RivalPiece]:
    parent = RivalPiece(f"{furniture}_1", catalog.get(furniture), 2.0, 1.0, 0.7)
    assets = [catalog.get(name) for name in names]
    return spawn(parent, assets, np.random.default_rng(seed), Counter(), upright=upright)


def test_objects_rest_on_the_surface_without_overlaps_before_they_are_turned(catalog: Catalog) -> None:
    names = ["Microscope", "Beaker", "Beaker", "Centrifuge", "TestTubeRack", "ErlenmeyerFlask", "Laptop"]
    pieces = spawned(catalog, "LabBench1800", names, upright=True)
    assert sorted(piece.asset.name for piece in pieces) == sorted(names)
    surface = Polygon(RivalPiece("top", catalog.get("LabBench1800"), 2.0, 1.0, 0.7).surface(0).corners()).buffer(1e-9)
    feet = [Polygon(piece.box.corners()) for piece in pieces]
    assert all(surface.contains(foot) for foot in feet)
    assert all(feet[i].intersection(feet[k]).area < 1e-9 for i in range(len(feet)) for k in range(i))
    assert {piece.z for piece in pieces} == {0.9}
    sizes = [max(piece.asset.size.width, piece.asset.size.depth) for piece in pieces]
    assert sizes == sorted(sizes, reverse=True)


def test_only_small_objects_are_turned(catalog: Catalog) -> None:
    pieces = spawned(catalog, "IslandBench2400", ["Microscope", "Centrifuge", "Beaker", "RoundBottomFlask"])
    turned = {piece.asset.name for piece in pieces if not math.isclose(piece.yaw, 0.7)}
    assert turned == {"Beaker", "RoundBottomFlask"}


def test_a_tall_object_stands_on_a_surface_with_enough_headroom(catalog: Catalog) -> None:
    cabinet = catalog.get("GeneralCabinet")
    bottle = catalog.get("SolventBottle")
    rooms = [surface.headroom for surface in cabinet.surfaces]
    for seed in range(5):
        for piece in spawned(catalog, "GeneralCabinet", ["SolventBottle"], seed):
            headroom = rooms[piece.slot or 0]
            assert headroom is None or headroom >= bottle.size.height


def test_a_receptacle_takes_15_objects_and_90_percent_of_its_area(catalog: Catalog) -> None:
    bench, vial, rack = (catalog.get(name) for name in ("IslandBench", "SampleVial", "CoolingBathDewar"))
    assert len(admitted(bench, [vial] * 40)) == 15
    desk = catalog.get("WritingDesk")  # 1.2 x 0.6 m: 0.648 m² of 0.8 * 0.2 * 0.2 = 0.032 m² each
    assert len(admitted(desk, [rack] * 40)) == 15
    assert len(admitted(desk, [catalog.get("Laptop")] * 40)) == 11  # 0.8 * 0.32 * 0.23 = 0.0589 m²
    assert admitted(desk, [catalog.get("Centrifuge")]) == []  # 0.61 m deep


def test_wall_objects_hang_above_their_target_off_doors_and_below_the_ceiling(catalog: Catalog) -> None:
    room = Room(name="room", width=5.0, depth=4.0, height=2.6, doors=(Door(wall="front", offset=2.5, width=1.0),))
    chamber = chambers(resolve_request("sub_01", 0, room, "default", None, ()))[0]
    desk = RivalPiece("WritingDesk_1", catalog.get("WritingDesk"), 2.5, 3.7, math.pi)
    board: Asset = catalog.get("Whiteboard")
    hung = [Hung(board, "desk", 2.4), Hung(catalog.get("Clock"), "", 1.0), Hung(catalog.get("Clock"), "", 1.0)]
    for seed in range(6):
        pieces = mount(chamber, hung, [desk], {"desk": desk}, 0.25, np.random.default_rng(seed), Counter())
        assert [piece.asset.name for piece in pieces] == ["Whiteboard", "Clock", "Clock"]
        above = pieces[0]
        assert above.support == WALL
        assert above.y == pytest.approx(4.0 - 0.01 - board.size.depth / 2.0)
        assert abs(above.x - 2.5) <= 0.25
        assert above.z == pytest.approx(2.6 - 0.2 - board.size.height)
        for clock in pieces[1:]:
            assert clock.y > 0.5 or abs(clock.x - 2.5) >= 0.5 + 0.15 - 1e-6
