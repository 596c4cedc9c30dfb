"""Rivals as proposers: every protocol, any floor, the same bytes for the same seed."""

from typing import get_args

import pytest

from labgym.assets import Catalog
from labgym.layouts.generate import generate, resolve_request
from labgym.layouts.method import Method
from labgym.layouts.model import Layout
from labgym.layouts.placement import FLOOR, WALL, Placement
from labgym.layouts.rules.arrangement import Arrangement
from labgym.layouts.rules.bounds import bounds_faults
from labgym.layouts.rules.collisions import collisions
from labgym.layouts.rules.whereabouts import missing_assets
from labgym.paper.rivals import HolodeckPlusProposer, HolodeckProposer, SceneWeaverProposer
from labgym.paper.rivals.holodeck.search import SearchLimits
from labgym.paper.rivals.piece import generator_of
from labgym.paper.rivals.plan import Grade, Large, household_plan, named_to
from labgym.paper.rivals.reading import assets_in
from labgym.protocols import protocols

QUICK = SearchLimits(first=1, expansions=40, density=8)
RIVALS = [HolodeckProposer(limits=QUICK), HolodeckPlusProposer(limits=QUICK), SceneWeaverProposer(steps=3)]
NAMES = [rival.name for rival in RIVALS]


@pytest.fixture(scope="module")
def catalog() -> Catalog:
    return Catalog.load()


@pytest.fixture(scope="module")
def layouts() -> dict[str, list[Layout]]:
    """One layout of every protocol from each rival, with small limits."""
    requests = [resolve_request(protocol, 7, "default", "default", None, ()) for protocol in protocols()]
    return {rival.name: [rival.propose(request) for request in requests] for rival in RIVALS}


@pytest.mark.parametrize("name", NAMES)
def test_every_protocol_gives_a_consistent_layout(name: str, layouts: dict[str, list[Layout]]) -> None:
    assert [layout.protocol_id for layout in layouts[name]] == list(protocols())
    for layout in layouts[name]:
        layout.check_references()
        assert len(layout.placements) > 10


@pytest.mark.parametrize("name", NAMES)
def test_furniture_neither_collides_nor_stands_outside(name: str, layouts: dict[str, list[Layout]]) -> None:
    for layout in layouts[name]:
        large = [placement for placement in layout.placements if placement.support in (FLOOR, WALL)]
        arrangement = Arrangement.of(layout.replace(placements=tuple(large)))
        assert bounds_faults(arrangement) == ()
        assert collisions(arrangement) == ()


def test_holodeck_plus_places_most_of_what_the_protocols_require(layouts: dict[str, list[Layout]]) -> None:
    missing = {}
    for name in NAMES:
        missing[name] = sum(
            len(missing_assets(Arrangement.of(layout), layout.protocol, frozenset()))
            for layout in layouts[name]
            if layout.protocol is not None
        )
    required = sum(len(protocol.required_assets()) for protocol in protocols().values())
    assert missing["holodeck+"] < 0.1 * required
    assert missing["holodeck"] > 0.4 * required  # a description names a few reagents and no locations
    assert missing["sceneweaver"] > 0.4 * required


@pytest.mark.parametrize("rival", RIVALS, ids=NAMES)
def test_equal_requests_give_equal_layouts_and_seeds_differ(rival: HolodeckProposer) -> None:
    def hash_of(seed: int) -> str:
        return rival.propose(resolve_request("cyc_04", seed, None, "default", None, ())).hash

    assert hash_of(3) == hash_of(3)
    assert hash_of(3) != hash_of(4)


@pytest.mark.parametrize("rival", RIVALS, ids=NAMES)
def test_on_a_floor_of_several_spaces_everything_stands_in_laboratories(rival: HolodeckProposer) -> None:
    layout = rival.propose(resolve_request("con_02", 5, None, "default", None, (), family="double"))
    spaces = {
        space.use
        for placement in layout.placements
        if placement.support == FLOOR and (space := layout.floor.space_at(*placement.position[:2])) is not None
    }
    assert spaces == {"laboratory"}
    arrangement = Arrangement.of(layout.replace(placements=tuple(p for p in layout.placements if p.support == FLOOR)))
    assert bounds_faults(arrangement) == ()


@pytest.mark.parametrize("rival", RIVALS, ids=NAMES)
def test_fixed_objects_stay_and_nothing_overlaps_them(rival: HolodeckProposer) -> None:
    sink = Placement(id="SinkBench_1", asset="SinkBench", position=(0.4, 4.0, 0.0), yaw=-1.570796)
    layout = rival.propose(resolve_request("red_01", 2, None, "default", None, [sink]))
    assert layout.placement("SinkBench_1").fixed
    arrangement = Arrangement.of(layout)
    assert not any("SinkBench_1" in collision.ids for collision in collisions(arrangement))


def test_reading_finds_whole_names_in_the_order_of_the_text(catalog: Catalog) -> None:
    text = "Phenol is alkylated with benzyl bromide in boiling acetone on a water bath; the salt is washed out."
    assert [asset.name for asset in assets_in(text, catalog)] == ["Phenol", "BenzylBromide", "Acetone", "WaterBath"]
    assert assets_in("Acetonide and phenolic oils", catalog) == ()


def test_the_household_plan_reads_the_description_and_no_lists(catalog: Catalog) -> None:
    request = resolve_request("sub_01", 1, None, "default", catalog, ())
    protocol = request.protocol
    bare = protocol.model_copy(
        update={"instruments": ("Beaker",), "steps": protocol.steps[:1], "reagents": protocol.reagents[:1]}
    )
    other = resolve_request(bare, 1, None, "default", catalog, ())
    plans = [household_plan(one, generator_of(request, 1)) for one in (request, other)]
    assert plans[0] == plans[1]
    assert "Phenol" in {top.name for large in plans[0].large for top in large.tops}


def test_a_higher_grade_tells_the_designer_the_stations_and_then_the_lists(catalog: Catalog) -> None:
    request = resolve_request("sub_01", 1, None, "default", catalog, ())
    protocol = request.protocol
    lists = {*protocol.instruments, *(use.name for use in protocol.reagents)}
    known = {grade: {asset.name for asset in named_to(request, grade)} for grade in get_args(Grade)}
    assert not set(protocol.locations) <= known["description"]
    assert known["stations"] == known["description"] | set(protocol.locations)
    assert known["list"] == known["stations"] | lists
    planned = {
        grade: {name for one in household_plan(request, generator_of(request, 1), grade).large for name in names(one)}
        for grade in known
    }
    assert all(known[grade] <= planned[grade] for grade in known)


def names(large: Large) -> set[str]:
    return {large.asset.name, large.asset.role, *(top.name for top in large.tops)}


@pytest.mark.filterwarnings("ignore::labgym.errors.UnrepairedWarning")
def test_generate_takes_a_rival_by_name_and_keeps_its_faults() -> None:
    layout = generate(
        "pro_01", 4, method=Method(proposer="sceneweaver", optimise=False, refine=False, on_failure="keep")
    )
    assert layout.provenance.generator == "SceneWeaverProposer"
    assert layout.provenance.options["failures"]["missing"]
