"""The layout document: versions, hashes, embedded protocols, the catalogue that a layout is bound to."""

from __future__ import annotations

import hashlib
import json
import math
import pickle
import shutil

import pytest
from pydantic import Field, ValidationError

from labgym.artefacts import artefacts
from labgym.assets import Catalog
from labgym.assets.model import Size
from labgym.documents import json_bytes
from labgym.envs.tasks import resolve_layout
from labgym.errors import DocumentError, LabgymError, UnknownNameError
from labgym.geometry import OrientedBox
from labgym.layouts import Door, Floor, Layout, Placement, Room, generate, load_published
from labgym.layouts.floor import Opening, Rectangle, Space
from labgym.layouts.rules.arrangement import Arrangement
from labgym.layouts.rules.whereabouts import missing_assets
from labgym.layouts.splits import manifest
from labgym.navigation import resolve_protocol
from labgym.protocols import get

ENTRIES = [(split, entry) for split in ("val", "test") for entry in manifest(split).layouts]
OWN = get("sub_01").model_copy(update={"id": "mine"})
ROOM = Room(width=6.0, depth=5.0, doors=(Door(wall="left", offset=2.0), Door(wall="back", offset=1.5, width=1.2)))
BENCH = Placement(id="bench", asset="PreparationBench", position=(2.0, 2.0, 0.0), yaw=0.5)
ACETONE = Placement(id="acetone", asset="Acetone", position=(2.0, 2.0, 0.9), support="bench", slot=0)


def small(**changes) -> Layout:
    return Layout(**{"id": "small", "floor": ROOM.floor, "placements": (BENCH, ACETONE), "protocols": (OWN,)} | changes)


def file_of(split: str, layout_id: str):
    return artefacts("layouts") / split / f"{layout_id}.json"


@pytest.mark.parametrize("split, entry", ENTRIES, ids=[entry.id for _, entry in ENTRIES])
def test_a_published_file_keeps_its_hash_and_its_bytes(split, entry, tmp_path):
    path = file_of(split, entry.id)
    layout = Layout.load(path)
    assert layout.hash == entry.hash
    assert layout.replace(id="renamed").hash == entry.hash
    assert layout.save(tmp_path / "again.json").read_bytes() == path.read_bytes()


def test_the_seeds_of_the_published_rooms_are_those_of_their_first_publication():
    """Their digest was recorded from the manifests of that time."""
    text = "\n".join(f"{entry.id} {load_published(split, entry.id).seed_hash}" for split, entry in ENTRIES)
    assert hashlib.sha256(text.encode()).hexdigest() == (
        "56a199caa598f10b08c25b3dea6640b93886250641dd44a1347f96ad0632ad61"
    )


def test_draws_are_seeded_by_the_hash_unless_the_document_names_another():
    seeded = small(seed_hash="0123456789abcdef" + 48 * "f")
    assert seeded.draw_seed == 0x0123456789ABCDEF
    assert small().draw_seed == int(small().hash, 16) >> 192
    assert seeded.hash != small().hash
    assert "seed_hash" not in small().to_json()
    with pytest.raises(ValidationError, match="seed_hash"):
        small(seed_hash="0123")


def test_an_edit_draws_by_its_own_hash():
    layout = load_published("test", "test-sub_01")
    first, *rest = layout.placements
    moved = layout.replace(placements=(first.model_copy(update={"position": (1.0, 1.0, 0.0)}), *rest))
    assert (moved.seed_hash, moved.draw_seed) == (None, int(moved.hash[:16], 16))
    assert layout.replace(id="renamed", placements=layout.placements).seed_hash == layout.seed_hash is not None


def test_a_layout_embeds_its_protocols(tmp_path):
    layout = small(protocols=(OWN, get("alk_03")))
    again = Layout.load(layout.save(tmp_path / "own.json"))
    assert again.protocols == (OWN, get("alk_03"))
    assert again.protocol == OWN
    assert again.hash == layout.hash
    assert json.loads((tmp_path / "own.json").read_text())["protocols"][0]["schema"] == "labgym.protocol/1"


def test_a_protocol_is_named_by_its_id_among_those_of_the_layout_or_of_the_library():
    changed = get("sub_01").model_copy(update={"steps": get("sub_01").steps[:2]})
    layout = small(protocols=(OWN, changed))
    assert resolve_protocol(layout, None) == resolve_protocol(layout, "mine") == OWN
    assert resolve_protocol(layout, "sub_01") == changed
    assert resolve_protocol(layout, "alk_03") == get("alk_03")
    assert resolve_layout(layout, "sub_01").protocols == (changed, OWN)
    with pytest.raises(UnknownNameError, match="'other' not found"):
        resolve_protocol(layout, "other")


def test_generate_embeds_its_protocol():
    layout = generate(OWN, seed=3)
    assert layout.protocols == (OWN,)


@pytest.mark.parametrize(
    "changes",
    [
        {"protocols": ()},
        {"protocols": (OWN.model_copy(update={"steps": OWN.steps[:-1]}),)},
        {"floor": Room(width=6.0, depth=5.0, doors=ROOM.doors[:1]).floor},
        {"floor": ROOM.model_copy(update={"width": 6.001}).floor},
        {"placements": (BENCH.model_copy(update={"fixed": True}), ACETONE)},
        {"placements": (BENCH.model_copy(update={"yaw": 0.501}), ACETONE)},
        {"placements": (BENCH.model_copy(update={"size": Size(width=1.0, depth=0.7, height=0.8)}), ACETONE)},
    ],
    ids=lambda changes: next(iter(changes)),
)
def test_the_hash_covers_floor_placements_and_protocols(changes):
    assert small(**changes).hash != small().hash


def test_the_hash_rounds_to_a_tenth_of_a_millimetre_and_leaves_out_labels():
    moved = BENCH.model_copy(update={"position": (2.00001, 2.0, 0.0), "yaw": 0.5 + 2.0 * math.pi})
    named = ROOM.model_copy(update={"name": "other"}).floor
    assert small(id="other", floor=named, placements=(moved, ACETONE)).hash == small().hash


def test_a_field_added_with_a_default_changes_no_hash():
    class WiderPlacement(Placement):
        mood: str = "shut"
        notes: dict[str, str] = Field(default_factory=dict)

    wider = tuple(WiderPlacement(**dict(placement)) for placement in (BENCH, ACETONE))
    layout = small().model_copy(update={"placements": wider})
    assert layout.hash == small().hash
    opened = (wider[0].model_copy(update={"mood": "open"}), wider[1])
    assert small().model_copy(update={"placements": opened}).hash != small().hash


def test_the_hash_covers_the_catalogue_entries_that_are_placed_and_no_others():
    def changed(name: str, mass: float) -> Catalog:
        return Catalog([a.model_copy(update={"mass": mass}) if a.name == name else a for a in Catalog.published()])

    assert small(catalog=changed("Acetone", 0.123)).hash != small().hash
    assert small(catalog=changed("FumeHood", 123.0)).hash == small().hash


def test_a_document_that_is_no_layout_names_the_field():
    data = small().to_json()
    for field, value, match in (
        ("catalog", 1, "catalog"),
        ("self", 1, "self"),
        ("schema", "labgym.layout/3", "labgym.layout/2"),
        ("protocols", [data["protocols"][0] | {"schema": "labgym.protocol/9"}], "labgym.protocol/1"),
        ("protocols", data["protocols"] * 2, "different ids"),
        ("protocols", data["protocols"] * 6, "at most 5"),
    ):
        with pytest.raises(DocumentError, match=match):
            Layout.parse(data | {field: value})


# Floors


def test_a_rectangular_floor_is_the_room_that_it_was_made_of():
    doors = (Door(wall="front", offset=1.3, width=1.1, height=2.0), *ROOM.doors[::-1], Door(wall="right", offset=4.0))
    floor = Floor.rectangle(6.0, 5.0, 2.8, 0.15, doors, "lab")
    assert floor.room.model_copy(update={"doors": ()}) == Room(
        name="lab", width=6.0, depth=5.0, height=2.8, wall_thickness=0.15, doors=()
    )
    assert sorted(floor.room.doors, key=str) == sorted(doors, key=str)
    assert floor.room.floor == floor
    solids = [  # each wall's box, from its middle line
        OrientedBox((x0 + x1) / 2, (y0 + y1) / 2, math.dist((x0, y0), (x1, y1)), 0.15, math.atan2(y1 - y0, x1 - x0))
        for wall in floor.walls
        for (x0, y0), (x1, y1) in [(wall.start, wall.end)]
    ]
    assert sorted(tuple(round(v, 9) for v in box.bounds()) for box in solids) == [
        (-0.15, 0.0, 0.0, 5.0),
        (0.0, -0.15, 6.0, 0.0),
        (0.0, 5.0, 6.0, 5.15),
        (6.0, 0.0, 6.15, 5.0),
    ]


def test_the_direction_of_a_wall_does_not_matter():
    floor = ROOM.floor
    front, back, left, right = floor.walls
    opening = back.openings[0]
    turned = back.model_copy(
        update={
            "start": back.end,
            "end": back.start,
            "openings": (opening.model_copy(update={"position": 6.0 - opening.position, "swing": "left"}),),
        }
    )
    assert Floor(walls=(right, turned, left, front), spaces=floor.spaces).room.doors == (ROOM.doors[1], ROOM.doors[0])


def test_a_room_says_of_each_door_whether_it_opens_out_of_it():
    for outward in (True, False):
        doors = (Door(wall="front", offset=2.0, outward=outward), Door(wall="right", offset=2.0))
        room = Room(width=6.0, depth=5.0, doors=doors)
        assert room.floor.as_room == room


def test_other_floors_are_no_room_and_say_why():
    floor = ROOM.floor
    (space,), (front, *others) = floor.spaces, floor.walls
    cases = (
        ({"spaces": (space, space, space)}, r"one rectangular space; got 3 spaces"),
        ({"spaces": (Space(region=(Rectangle(x1=2, y1=2), Rectangle(x1=6, y1=1))),)}, "consists of 2 rectangles"),
        ({"spaces": (space.model_copy(update={"yaw": 0.1}),)}, "is moved"),
        ({"walls": others}, "got 3 walls"),
        ({"walls": (*floor.walls, front)}, "two walls lie along the front side"),
        ({"walls": (front.model_copy(update={"end": (5.0, -0.1)}), *others)}, "wall 0 lies along none"),
        ({"walls": (front.model_copy(update={"height": 2.5}), *others)}, "wall 0 differs"),
        (
            {"walls": (front.model_copy(update={"openings": (Opening(position=2.0, state="open"),)}), *others)},
            "the front wall has an open door",
        ),
    )
    for changes, message in cases:
        other = floor.model_copy(update=changes)
        assert other.as_room is None
        with pytest.raises(LabgymError, match=message) as caught:
            _ = other.room
        assert "\n" not in str(caught.value)


def test_fields_added_to_floors_change_neither_hash_nor_bytes_of_a_room():
    """Hash and SHA-256 of the file as release 0.2 wrote them before floors had columns, windows and finishes."""
    layout = Layout(id="plain", floor=ROOM.floor, placements=())
    assert layout.hash == "2d5e0b095acd88f82b89623181c3ead0626d14b70c93ed19c442b457e2fb70f1"
    assert (
        hashlib.sha256(json_bytes(layout.to_json())).hexdigest()
        == "c367259eb870b4a8ba1f31ccb438920893d50423523338ba9b35d826657adcd8"
    )


@pytest.mark.parametrize(
    "fields, message",
    [
        (
            {"doors": (Door(wall="front", offset=1.5), Door(wall="front", offset=2.2))},
            r"offsets 1\.5 and 2\.2 m of the front wall overlap by 0\.30 m: move one",
        ),
        (
            {"doors": (Door(wall="left", offset=4.8),)},
            r"does not fit the 5 m wall: .* must be 0\.5 to 4\.5 m",
        ),
        ({"height": 2.2, "doors": (Door(wall="front", offset=2.0, height=2.4),)}, r"2\.4 m high, above the ceiling"),
    ],
)
def test_impossible_doors_are_refused_with_the_numbers(fields, message):
    with pytest.raises(ValidationError, match=message):
        Room(width=6.0, depth=5.0, **fields)


# Sizes


def test_an_override_of_the_size_scales_box_surfaces_and_hollow():
    cabinet = Placement(id="c", asset="FlammableCabinet", position=(2.0, 2.0, 0.0))
    plain = Layout(id="a", floor=ROOM.floor, placements=(cabinet,))
    size = plain.asset("c").size
    wide = Size(width=size.width * 1.5, depth=size.depth, height=size.height * 0.5)
    scaled = plain.replace(placements=(cabinet.model_copy(update={"size": wide}),))
    assert (scaled.box("c").width, scaled.box("c").z1) == (size.width * 1.5, size.height * 0.5)
    for slot in range(len(plain.asset("c").surfaces)):
        before, after = plain.surface("c", slot), scaled.surface("c", slot)
        assert (after.width, after.z0) == pytest.approx((before.width * 1.5, before.z0 * 0.5))
    bounds = [solid.bounds() for solid in scaled.solids("c")]
    assert min(b[0] for b in bounds) == pytest.approx(2.0 - size.width * 0.75)
    assert Arrangement.of(scaled).boxes.half[0, 0] == pytest.approx(size.width * 0.75)


def test_a_size_outside_the_category_is_refused():
    data = small(placements=(BENCH,)).to_json()
    data["placements"][0]["size"] = {"width": 900.0, "depth": 0.7, "height": 0.9}
    with pytest.raises(DocumentError, match=r"placements\.0\.size"):
        Layout.parse(data)
    data["placements"][0]["size"]["width"] = 9.0
    with pytest.raises(DocumentError, match=r"placements\.0\.size: size 9 x 0\.7 x 0\.9 m of 'PreparationBench' is"):
        Layout.parse(data)


# The catalogue


def test_a_layout_is_bound_to_the_catalogue_that_it_was_read_with(tmp_path):
    bench = Catalog.published().get("PreparationBench")
    larger = bench.model_copy(update={"size": bench.size.model_copy(update={"width": bench.size.width + 0.5})})
    other = Catalog([larger if asset.name == bench.name else asset for asset in Catalog.published()])
    path = small().save(tmp_path / "small.json")
    plain, bound = Layout.load(path), Layout.load(path, other)
    assert bound.replace(id="again").catalog is other
    for layout in (plain, bound, plain, bound):  # interleaved: no cache may mix the two
        assert layout.box("bench").width == bench.size.width + 0.5 * (layout is bound)
        assert Arrangement.of(layout).boxes.half[0, 0] == layout.box("bench").width / 2.0


def test_caches_of_the_rules_and_stages_do_not_mix_catalogues():
    from labgym.envs.world import world_of

    hood = Catalog.published().get("FumeHood")
    assert hood.cavity is not None
    thick = hood.model_copy(update={"cavity": hood.cavity.model_copy(update={"width": hood.cavity.width - 0.2})})
    renamed = Catalog.published().get("Acetone").model_copy(update={"synonyms_en": ("nail varnish remover",)})
    other = Catalog([{"FumeHood": thick, "Acetone": renamed}.get(a.name, a) for a in Catalog.published()])
    placements = (Placement(id="hood", asset="FumeHood", position=(2.0, 4.5, 0.0), yaw=math.pi),)
    plain = Layout(id="a", floor=ROOM.floor, placements=placements)
    solid = plain.replace(catalog=other)

    def volume(layout: Layout) -> float:
        return sum(box.width * box.depth * (box.z1 - box.z0) for box in layout.solids("hood"))

    assert volume(solid) > volume(plain) + 0.01
    areas = [
        Arrangement.of(layout).solids(range(len(layout.placements))).boxes.half.prod(axis=1).sum()
        for layout in (plain, solid, plain)
    ]
    assert areas[1] > areas[0] == areas[2]
    assert world_of(plain) is not world_of(solid)
    assert world_of(plain) is world_of(plain.replace(id="b"))
    named = OWN.reagents[0].model_copy(update={"name": "NailVarnishRemover"})
    protocol = OWN.model_copy(update={"reagents": (named,)})
    assert "Acetone" in missing_assets(Arrangement.of(solid), protocol, frozenset())
    with pytest.raises(UnknownNameError, match="NailVarnishRemover"):
        missing_assets(Arrangement.of(plain), protocol, frozenset())


def test_a_layout_travels_to_another_process_with_a_reference_to_its_catalogue():
    layout = generate(OWN, seed=3)
    _ = layout.hash, layout.room, layout.by_id
    packed = pickle.dumps(layout)
    again = pickle.loads(packed)
    assert again == layout
    assert again.hash == layout.hash
    assert again.catalog is layout.catalog
    assert len(packed) < 2 * len(json.dumps(layout.to_json()))


def test_a_layout_of_a_user_s_catalogue_is_read_with_it(tmp_path, monkeypatch):
    own = tmp_path / "own"
    (own / "assets").mkdir(parents=True)
    asset = Catalog.published().get("PreparationBench").model_copy(update={"name": "MyBench", "synonyms_en": ("mine",)})
    (own / "assets" / "mine.json").write_text(
        json.dumps({"schema": "labgym.assets/1", "assets": [asset.model_dump(mode="json")]})
    )
    layout = small(placements=(BENCH.model_copy(update={"asset": "MyBench"}), ACETONE), catalog=Catalog.load(own))
    path = layout.save(tmp_path / "lab.json")
    with pytest.raises(DocumentError, match="MyBench"):
        Layout.load(path)
    assert Layout.load(path, Catalog.load(own)).hash == layout.hash
    monkeypatch.setenv("LABGYM_CATALOG", str(tmp_path / "nowhere"))
    assert Layout.load(path, Catalog.load(own)).catalog == Catalog.load(own)
    published = file_of("test", "test-sub_01")
    assert Layout.load(published, Catalog.published()).catalog is Catalog.published()
    monkeypatch.setenv("LABGYM_CATALOG", str(own))
    assert Layout.load(path).hash == layout.hash
    shutil.rmtree(own)
