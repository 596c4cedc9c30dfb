"""SceneWeaver's loop: it accepts nothing worse, and what remains neither collides nor lies outside."""

import itertools
import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from shapely import Polygon, box

from labgym.assets import Catalog
from labgym.layouts.floor import Door, Room
from labgym.layouts.generate import resolve_request
from labgym.paper.rivals.chamber import Chamber, chambers
from labgym.paper.rivals.piece import RivalPiece
from labgym.paper.rivals.sceneweaver.critic import Critique, Fault, SceneProblem, critique
from labgym.paper.rivals.sceneweaver.physics import cleared, collisions, settle
from labgym.paper.rivals.sceneweaver.policy import TablePlanner, Tool, WeaverAction
from labgym.paper.rivals.sceneweaver.proposer import STEPS, SceneWeaverProposer, WeaverStep
from labgym.paper.rivals.sceneweaver.scene import ROOM, WeaverItem, WeaverScene
from labgym.paper.rivals.sceneweaver.tools import Toolbox

SEEDS = range(4)


@pytest.fixture(scope="module")
def catalog() -> Catalog:
    return Catalog.load()


@pytest.fixture(scope="module")
def chamber() -> Chamber:
    room = Room(name="room", width=5.0, depth=4.0, doors=(Door(wall="front", offset=1.0),))
    return chambers(resolve_request("sub_01", 0, room, "default", None, ()))[0]


@pytest.fixture(scope="module")
def runs() -> list[tuple[Chamber, WeaverScene, list[WeaverStep]]]:
    results = []
    for seed in SEEDS:
        request = resolve_request("pro_03", seed, "tight", "default", None, ())
        space = chambers(request)[0]
        results.append((space, *SceneWeaverProposer().run(request, space)))
    return results


def piece(catalog: Catalog, asset: str, x: float, y: float, yaw: float = 0.0, number: int = 1) -> RivalPiece:
    return RivalPiece(f"{asset}_{number}", catalog.get(asset), x, y, yaw)


def polygon(one: RivalPiece) -> Polygon:
    return Polygon(one.box.corners())


def test_no_step_makes_the_scene_worse(runs: list[tuple[Chamber, WeaverScene, list[WeaverStep]]]) -> None:
    for _, _, history in runs:
        keys = [(step.critique.faults, -step.critique.total) for step in history]
        assert all(after <= (before[0], before[1] + 1e-6) for before, after in itertools.pairwise(keys))
        assert len(history) <= STEPS - 1


def test_some_steps_are_kept_and_some_are_rolled_back(
    runs: list[tuple[Chamber, WeaverScene, list[WeaverStep]]],
) -> None:
    kept = [step.kept for _, _, history in runs for step in history[1:]]
    assert any(kept)
    assert not all(kept)


def test_nothing_collides_or_lies_outside_at_the_end(runs: list[tuple[Chamber, WeaverScene, list[WeaverStep]]]) -> None:
    for space, scene, _ in runs:
        room = box(0.0, 0.0, space.ground.width, space.ground.depth).buffer(1e-6)
        large = [polygon(item.piece) for item in scene.large]
        assert all(room.contains(foot) for foot in large)
        for k, foot in enumerate(large):
            assert all(foot.intersection(other).area < 1e-3 for other in large[:k])
        for item in scene.items:
            if not item.large:
                carrier = scene.by_id[item.piece.support].piece
                top = carrier.surface(item.piece.slot or 0)
                surface = Polygon(replace(carrier.box, x=top.x, y=top.y, width=top.width, depth=top.depth).corners())
                assert surface.buffer(1e-6).contains(polygon(item.piece))
                assert item.piece.z == pytest.approx(top.z0)


def test_relations_hold_at_the_end(runs: list[tuple[Chamber, WeaverScene, list[WeaverStep]]]) -> None:
    for space, scene, _ in runs:
        for item in scene.large:
            if item.relation == "against_wall":
                width, depth = space.ground.width, space.ground.depth
                x, y = item.piece.box.to_world(0.0, -item.piece.asset.size.depth / 2.0)
                assert min(x, y, width - x, depth - y) == pytest.approx(0.02, abs=1e-6)


def test_an_object_that_overlaps_gives_way_to_the_larger_one(catalog: Catalog, chamber: Chamber) -> None:
    bench, trolley = piece(catalog, "IslandBench1800", 2.5, 2.0), piece(catalog, "ServiceTrolley", 3.2, 2.0)
    settled = settle(WeaverScene((WeaverItem(bench), WeaverItem(trolley))), chamber)
    assert settled.by_id["IslandBench1800_1"].piece == bench
    assert not polygon(settled.by_id["ServiceTrolley_1"].piece).intersects(polygon(bench).buffer(-1e-6))


def test_a_seat_goes_in_front_of_its_bench_and_faces_it(catalog: Catalog, chamber: Chamber) -> None:
    bench, stool = piece(catalog, "IslandBench1800", 2.5, 2.0), piece(catalog, "LabStool", 4.5, 2.2, 1.0)
    settled = settle(WeaverScene((WeaverItem(bench), WeaverItem(stool, "front_against", bench.id))), chamber)
    seat = settled.by_id["LabStool_1"].piece
    gap = polygon(seat).distance(polygon(bench))
    ahead = seat.box.to_world(0.0, seat.asset.size.depth / 2.0 + 0.1)
    assert gap == pytest.approx(0.03)
    assert abs(ahead[0] - 2.5) <= 0.9
    assert abs(ahead[1] - 2.0) <= 0.75


def test_furniture_against_the_wall_stays_out_of_the_door_area(catalog: Catalog, chamber: Chamber) -> None:
    bench = piece(catalog, "LabBench", 1.0, 0.5)
    settled = settle(WeaverScene((WeaverItem(bench, "against_wall", ROOM),)), chamber)
    foot = polygon(settled.by_id["LabBench_1"].piece)
    assert not foot.intersects(box(0.55, 0.0, 1.45, 1.0))  # the door is 0.91 m wide at 1.0 m


def test_what_still_collides_is_deleted_with_what_stands_on_it(catalog: Catalog, chamber: Chamber) -> None:
    first, second = piece(catalog, "LabBench", 2.5, 2.0), piece(catalog, "WritingDesk", 2.6, 2.0)
    third = piece(catalog, "LabStool", 4.3, 3.3)
    laptop = RivalPiece("Laptop_1", catalog.get("Laptop"), 2.6, 2.0, 0.0, 0.75, second.id, 0)
    scene = WeaverScene((WeaverItem(first), WeaverItem(second), WeaverItem(third), WeaverItem(laptop, "on", second.id)))
    assert [pair[:2] for pair in collisions(scene)] == [(first.id, second.id)]
    # Both share the same volume; the desk is the smaller one.
    assert [one.id for one in cleared(scene, chamber).pieces()] == [first.id, third.id]


def test_moving_furniture_carries_what_stands_on_it(catalog: Catalog) -> None:
    desk = piece(catalog, "WritingDesk", 1.0, 1.0)
    laptop = RivalPiece("Laptop_1", catalog.get("Laptop"), 1.2, 1.1, 0.0, 0.75, desk.id, 0)
    moved = WeaverScene((WeaverItem(desk), WeaverItem(laptop, "on", desk.id))).moved(desk.id, 3.0, 2.0, math.pi / 2.0)
    carried = moved.by_id["Laptop_1"].piece
    assert (carried.x, carried.y, carried.yaw) == pytest.approx((3.0 - 0.1, 2.0 + 0.2, math.pi / 2.0))


@pytest.fixture(scope="module")
def toolbox(chamber: Chamber) -> Toolbox:
    request = resolve_request("sub_01", 0, "bay", "default", None, ())
    return Toolbox(request, chamber, np.random.default_rng(0), Counter({"LabBench": 1}))


def act(toolbox: Toolbox, scene: WeaverScene, tool: Tool, fault: Fault, subject: str) -> WeaverScene:
    problem = SceneProblem("layout", fault, subject)
    return toolbox.act(scene, WeaverAction(problem, tool), Critique(0, {}, (problem,)))


def test_a_crowd_fills_a_bench_and_a_larger_bench_keeps_what_stands_on_it(catalog: Catalog, toolbox: Toolbox) -> None:
    bench = piece(catalog, "LabBench", 2.5, 2.0)
    crowd = act(toolbox, WeaverScene((WeaverItem(bench),)), "crowd", "bare", bench.id)
    assert len(crowd.on(bench.id)) > 5
    larger = act(toolbox, crowd, "resize", "empty", bench.id)
    smaller = act(toolbox, crowd, "resize", "blocked", bench.id)
    assert [scene.by_id[bench.id].piece.asset.size.width for scene in (smaller, larger)] == [1.2, 1.8]
    assert Counter(top.asset.name for top in larger.on(bench.id)) == Counter(t.asset.name for t in crowd.on(bench.id))
    stool = WeaverScene((WeaverItem(piece(catalog, "LabStool", 1.0, 1.0)),))
    assert act(toolbox, stool, "resize", "blocked", "LabStool_1") == stool


def kinds(verdict: Critique) -> Sequence[tuple[str, str]]:
    return [(problem.fault, problem.subject) for problem in verdict.problems if problem.criterion == "layout"]


def test_the_critic_finds_furniture_off_the_wall_blocked_or_facing_a_wall(catalog: Catalog, chamber: Chamber) -> None:
    island = WeaverItem(piece(catalog, "IslandBench1800", 2.5, 2.0))
    good = WeaverItem(piece(catalog, "LabBench", 2.5, 4.0 - 0.375, math.pi))
    assert kinds(critique(WeaverScene((good,)), chamber, ())) == []
    away = WeaverItem(piece(catalog, "SinkBench", 3.5, 1.0, 0.0))
    assert kinds(critique(WeaverScene((away,)), chamber, ())) == [("off the wall", "SinkBench_1")]
    turned = WeaverItem(piece(catalog, "IslandBench1800", 2.5, 4.0 - 0.8, 0.0))
    assert kinds(critique(WeaverScene((turned,)), chamber, ())) == [("facing a wall", "IslandBench1800_1")]
    near = WeaverItem(piece(catalog, "LabBench1800", 0.375, 2.0, -math.pi / 2.0))
    assert kinds(critique(WeaverScene((island, near)), chamber, ())) == []
    closer = WeaverItem(piece(catalog, "IslandBench1800", 2.0, 2.0))
    assert kinds(critique(WeaverScene((closer, near)), chamber, ())) == [("blocked", "LabBench1800_1")]


def test_functionality_is_at_most_5_while_something_named_is_missing(catalog: Catalog, chamber: Chamber) -> None:
    names = ("LabBench1800", "FumeHood", "GeneralCabinet", "SinkBench", "LabStool")
    scene = WeaverScene(tuple(WeaverItem(piece(catalog, name, 1.0 + 0.5 * k, 2.0)) for k, name in enumerate(names)))
    acetone = catalog.get("Acetone")
    assert critique(scene, chamber, ()).grades["functionality"] == 10.0
    assert critique(scene, chamber, (acetone,)).grades["functionality"] == 5.0
    assert SceneProblem("functionality", "missing", "Acetone") in critique(scene, chamber, (acetone,)).problems


def test_more_faults_are_worse_than_lower_grades() -> None:
    good, poor = {"layout": 10.0, "realism": 9.0}, {"layout": 5.0, "realism": 9.0}
    assert Critique(1, good, ()).worse_than(Critique(0, poor, ()))
    assert Critique(0, poor, ()).worse_than(Critique(0, good, ()))
    assert not Critique(0, good, ()).worse_than(Critique(0, good, ()))


def test_the_planner_turns_to_another_tool_when_one_fails() -> None:
    problem = SceneProblem("layout", "blocked", "LabBench_1")
    planner = TablePlanner(np.random.default_rng(0))
    verdict = Critique(0, {"layout": 5.0}, (problem,))
    tools = []
    while (action := planner.choose(verdict)) is not None:
        tools.append(action.tool)
        planner.failed(action)
    assert tools[0] == "move"
    assert "remove" in tools
    # Confidences 0.7, 0.4 and 0.3 fall to 0.4 of themselves with each failure, and end below 0.1.
    assert Counter(tools) == {"move": 3, "resize": 2, "remove": 2}
