"""LabBuilder scenes: poses, sizes and supports by hand, round trips, and files that are refused."""

from __future__ import annotations

import json
import math

import pytest

from labgym.cli import main
from labgym.errors import DocumentError, LabgymError, OptionError, UnknownNameError
from labgym.exchange.formats import compile_layout
from labgym.geometry import wrap_angle
from labgym.layouts import Layout, load_published, optimise, published, refine
from labgym.layouts.floor import Door
from labgym.layouts.floors import draw_floor
from labgym.layouts.rules import evaluate_layout
from labgym.paper.labbuilder.frame import heading, to_degrees, to_radians
from labgym.paper.labbuilder.names import kind_of, unique_ids
from labgym.paper.labbuilder.reading import read_labbuilder
from labgym.paper.labbuilder.writing import write_labbuilder
from labgym.protocols import Protocol

ROOM = {"w": 8.4, "d": 7.4, "h": 3.2}
SIZES = {
    "ExperimentalPlatform": {"short": 1.5, "long": 2.7, "height": 0.8, "type": "room_asset"},
    "ReagentCabinet": {"short": 0.44, "long": 1.8, "height": 2.36},
    "FumeHood": {"short": 0.9, "long": 3.0, "height": 2.37},
    "FumeHood2": {"short": 0.9, "long": 1.6, "height": 2.37},
    "Chair": {"short": 0.3, "long": 0.32, "height": 0.47},
    "HeatingPlate": {"short": 0.18, "long": 0.25},
}


def thing(name, x, y, z=0.0, turn=0.0, on="floor", **more):
    rotation = {"x": 0, "y": 0, "z": turn}
    return {"id": name, "position": {"x": x, "y": y, "z": z}, "rotation": rotation, "initial_location": on, **more}


OBJECTS = [
    thing("LaboratoryRoom", 4.2, 3.7),
    thing("FumeHood", 5.5, 6.75, turn=180),
    thing("ReagentCabinet", 1.5, 6.98, turn=180),
    thing("ExperimentalPlatform", 4.0, 4.0, turn=180),
    thing("Chair", 3.0, 1.0, turn=270),
    thing("Chair", 5.0, 1.0, turn=33.333333333333336),
    thing("Ethanol", 1.2, 6.98, 0.8, on="reagent_cabinet"),
    thing("HeatingPlate", 3.5, 4.1, 0.8, on="experimental_platform"),
    thing("Beaker", 4.5, 4.1, 0.8, 90, on="experimental_platform"),
]


@pytest.fixture
def folder(tmp_path):
    """A folder with a scene and its sizes."""

    def write(objects=OBJECTS, sizes=SIZES, **fields):
        scene = {"query": "An ester", "room_size": ROOM, "objects": objects, **fields}
        (tmp_path / "ester.json").write_text(json.dumps(scene))
        if sizes is not None:
            (tmp_path / "asset_bboxes.json").write_text(json.dumps(sizes))
        return tmp_path / "ester.json"

    return write


def route(*locations):
    """Return a protocol that only visits places."""
    steps = tuple({"index": k + 1, "location": name, "action": "go", "text": name} for k, name in enumerate(locations))
    reagents = ({"name": "Ethanol", "role": "solvent"},)
    fields = {"id": "tour", "name": "Tour", "reaction_type": "substitution", "instruments": ("Beaker",)}
    return Protocol(**fields, reagents=reagents, steps=steps)


TOUR = route("TallReagentCabinet", "FumeHood", "MainWorkbench")


def test_poses_and_sizes_are_those_of_the_file_in_the_frame_of_the_interior(folder):
    layout = read_labbuilder(folder()).layout
    assert (layout.room.width, layout.room.depth, layout.room.height) == (8.0, 7.0, 3.2)
    assert layout.placement("FumeHood").position == pytest.approx((5.3, 6.55, 0.0), abs=1e-9)
    # At 180 degrees the front looks along -y, at 270 along +x; the long side lies along x at 180.
    for name, front in (("FumeHood", (0, -1)), ("Chair_1", (1, 0)), ("Beaker", (-1, 0)), ("HeatingPlate", (0, 1))):
        assert layout.box(name).front == pytest.approx(front, abs=1e-9)
    x0, x1, y0, y1 = 5.3 - 1.5, 5.3 + 1.5, 6.55 - 0.45, 6.55 + 0.45
    corners = layout.box("FumeHood").corners()
    assert sorted({round(float(x), 6) for x, _ in corners}) == [x0, x1]
    assert sorted({round(float(y), 6) for _, y in corners}) == [y0, y1]
    assert layout.box("FumeHood").z1 == 2.37
    plate = layout.asset("HeatingPlate").size
    assert (plate.width, plate.depth, plate.height) == (
        0.25,
        0.18,
        layout.catalog.get("MagneticHotplateStirrer").size.height,
    )
    assert layout.placement("Beaker").size is None


def test_supports_are_the_objects_that_the_locations_name(folder):
    layout = read_labbuilder(folder()).layout
    assert [layout.placement(name).support for name in ("FumeHood", "HeatingPlate")] == [
        "floor",
        "ExperimentalPlatform",
    ]
    ethanol = layout.placement("Ethanol")
    assert ethanol.support == "ReagentCabinet"
    assert layout.surface("ReagentCabinet", ethanol.slot).z0 == pytest.approx(0.8)
    assert evaluate_layout(layout, rules="paper").v == 0


def test_of_two_carriers_of_one_name_the_nearest_carries(folder):
    objects = [thing("LabBench", 2.0, 2.0), thing("LabBench", 6.0, 2.0), thing("Beaker", 5.8, 2.0, 0.9, on="lab_bench")]
    assert read_labbuilder(folder(objects)).layout.placement("Beaker").support == "LabBench_2"


def test_a_location_without_a_surface_is_noted_and_the_pose_kept(folder):
    objects = [
        thing("Chair", 1.0, 1.0),
        thing("Beaker", 1.0, 1.0, 0.5, on="chair"),
        thing("Beaker", 2, 2, 0, on="moon"),
    ]
    objects.append(thing("RotaryEvaporator", 4.0, 4.0, 0.8))
    imported = read_labbuilder(folder(objects))
    assert imported.layout.placement("Beaker_1").support == "floor"
    assert imported.layout.placement("Beaker_1").position[2] == 0.5
    for words in ("'chair': LabStool has no surface", "'moon': no object has that name", "its bottom at 0.8 m"):
        assert any(words in note for note in imported.notes)
    assert evaluate_layout(imported.layout, rules="paper").out_of_bounds == {"Beaker_1", "RotaryEvaporator"}


def test_notes_say_what_the_file_does_not(folder):
    notes = "\n".join(read_labbuilder(folder([*OBJECTS, thing("FumeHood2", 1, 3, mass=3)])).notes)
    for words in (
        "no doors",
        "2 objects are called Chair: renamed Chair_1 to Chair_2",
        "ReagentCabinet is the asset TallReagentCabinet: ",
        "7 of 9 objects have a size of asset_bboxes.json",
        "no protocol",
        "not read: objects.mass",
    ):
        assert words in notes
    assert "FumeHood2" not in notes


def test_without_a_file_of_sizes_they_are_the_catalogs(folder):
    imported = read_labbuilder(folder(sizes=None))
    assert all(placement.size is None for placement in imported.layout.placements)
    assert any("catalog's sizes" in note for note in imported.notes)


def test_the_second_object_of_a_name_has_its_own_size(folder):
    layout = read_labbuilder(folder([thing("FumeHood", 2, 6, turn=180), thing("FumeHood2", 6, 6, turn=180)])).layout
    assert {name: layout.box(name).width for name in ("FumeHood", "FumeHood2")} == {"FumeHood": 3.0, "FumeHood2": 1.6}
    assert {placement.asset for placement in layout.placements} == {"FumeHood"}


def test_unknown_objects_are_listed_together_or_skipped_with_what_stands_on_them(folder):
    objects = [*OBJECTS, thing("Unobtainium", 2, 2, 0.8), thing("Gizmo", 6, 2), thing("Pipette", 6, 2, 0.8, on="gizmo")]
    with pytest.raises(DocumentError, match=r"2 of 11 objects are not in the catalog: Unobtainium .*, Gizmo .*--map"):
        read_labbuilder(folder(objects))
    imported = read_labbuilder(folder(objects), skip_unknown=True)
    assert imported.layout.by_id.keys() == read_labbuilder(folder()).layout.by_id.keys()
    assert "left out, not in the catalog: Unobtainium, Gizmo" in imported.notes
    assert any(note.endswith("Pipette") for note in imported.notes)
    mapped = read_labbuilder(folder(objects), mapping={"Gizmo": "lab bench", "Unobtainium": "ReagentBottle"})
    assert mapped.layout.placement("Pipette").support == "Gizmo"
    with pytest.raises(UnknownNameError):
        read_labbuilder(folder(objects), mapping={"Gizmo": "zzzzqqq"}, skip_unknown=True)


def test_a_layout_that_is_written_and_read_again_is_equal(folder, tmp_path):
    first = read_labbuilder(folder(), protocols=(TOUR,), doors=(Door(wall="front", offset=4.0),)).layout
    second = read_labbuilder(write_labbuilder(first, tmp_path / "out"), protocols=(TOUR,)).layout
    assert (second.id, second.placements, second.room.doors) == (first.id, first.placements, first.room.doors)
    assert second.hash == first.hash
    assert second.provenance.options["query"] == "An ester"


@pytest.mark.parametrize("name", published("test")[::9])
def test_a_generated_layout_keeps_poses_supports_and_hash(tmp_path, name):
    layout = load_published("test", name)
    path = compile_layout(layout, tmp_path / "out", ["labbuilder"])[0]
    other = read_labbuilder(path, protocols=layout.protocols).layout
    for placement in layout.placements:
        same = other.placement(placement.id)
        assert same.position == pytest.approx(placement.position, abs=1e-6)
        assert abs(wrap_angle(same.yaw - placement.yaw)) < 1e-6
        assert (same.asset, same.support, same.slot) == (placement.asset, placement.support, placement.slot)
    assert other.hash == layout.replace(seed_hash=None).hash


def test_goal_pairs_are_in_front_of_the_faces_in_the_frame_of_the_scene(folder, tmp_path):
    layout = read_labbuilder(folder(), protocols=(TOUR,)).layout
    write_labbuilder(layout, tmp_path / "out")
    data = json.loads((tmp_path / "out" / "goal_pairs.json").read_text())["tour"]
    assert (data["num_targets"], data["offset_radius"], len(data["pairs"])) == (3, 0.6, 2)
    first, second = data["pairs"]
    # In front of a face at y = center - short / 2, 0.6 m away, looking along +y, which is 0 in their files.
    assert first["start"] == pytest.approx([1.5, 6.98 - 0.22 - 0.6, 0.0], abs=1e-6)
    assert first["end"] == second["start"] == pytest.approx([5.5, 6.75 - 0.45 - 0.6, 0.0], abs=1e-6)
    assert first["distance"] == pytest.approx(math.dist(first["start"][:2], first["end"][:2]), abs=1e-4)
    assert heading(0.0) == pytest.approx(math.radians(270.0))


def test_places_that_are_missing_are_listed(folder, tmp_path):
    tour = route("FumeHood", "SinkBench", "MainWorkbench", "FumeHood")
    write_labbuilder(read_labbuilder(folder(), protocols=(tour,)).layout, tmp_path / "out")
    data = json.loads((tmp_path / "out" / "goal_pairs.json").read_text())["tour"]
    assert data["missing"] == ["SinkBench"]
    assert [(pair["from"], pair["to"]) for pair in data["pairs"]] == [("MainWorkbench", "FumeHood")]


def test_floors_of_other_shapes_are_refused(tmp_path):
    floor = draw_floor("ell", seed=1).floor
    with pytest.raises(LabgymError, match="one rectangular room"):
        write_labbuilder(Layout(id="ell", floor=floor, placements=()), tmp_path / "out")


def test_a_crowded_scene_can_be_repaired(folder):
    objects = [*OBJECTS, thing("Chair", 5.5, 5.7), thing("Pipette", 4.52, 4.1, 0.8, on="experimental_platform")]
    objects[1] = thing("FumeHood", 7.0, 6.75, turn=180)
    layout = read_labbuilder(folder(objects), protocols=(TOUR,), doors=(Door(wall="front", offset=4.0),)).layout
    before = evaluate_layout(layout, TOUR, navigation=True, rules="paper")
    assert before.out_of_bounds == {"FumeHood"}
    assert [collision.ids for collision in before.collisions] == [("Beaker", "Pipette")]
    after = refine(optimise(layout, TOUR, rules="paper"), TOUR, rules="paper")
    assert evaluate_layout(after, TOUR, navigation=True, rules="paper").v == 0
    assert [placement.size for placement in after.placements] == [placement.size for placement in layout.placements]


def without(data, *keys):
    return {name: value for name, value in data.items() if name not in keys}


BAD = {
    "not a number": ([{**thing("Chair", 1, 1), "position": {"x": "left", "y": 0}}], "objects.0.position.x"),
    "infinite": ([thing("Chair", 1e400, 1)], "not finite"),
    "far away": ([thing("Chair", 1e6, 1)], "objects.0.position.x"),
    "without a position": ([without(thing("Chair", 1, 1), "position")], "objects.0.position"),
    "a name with a path": ([thing("../../etc/passwd", 1, 1)], "objects.0.id"),
    "a long name": ([thing("C" * 5000, 1, 1)], "objects.0.id"),
    "tilted": ([{**thing("Chair", 1, 1), "rotation": {"x": 5, "y": 0, "z": 0}}], "5 degrees about x"),
    "a list": ([[1, 2]], "objects.0"),
    "too many": ([thing("Chair", 1, 1)] * 2001, "objects"),
}


@pytest.mark.parametrize(("objects", "words"), BAD.values(), ids=BAD)
def test_bad_scenes_are_one_line_that_names_the_field(folder, objects, words):
    with pytest.raises(DocumentError) as error:
        read_labbuilder(folder(objects))
    assert words in str(error.value)
    assert "\n" not in str(error.value)
    assert len(str(error.value)) < 500


def test_objects_that_carry_each_other_are_refused(folder):
    objects = [thing("LabBench", 1, 1, on="writing_desk"), thing("WritingDesk", 1, 1, on="lab_bench")]
    with pytest.raises(DocumentError, match="cycle"):
        read_labbuilder(folder(objects))


@pytest.mark.parametrize(
    ("sizes", "words"),
    [
        ({"Chair": {"short": -1.0}}, "Chair.short"),
        ({"Chair": {"short": 0.5, "long": 0.4}}, "long must be the longer side"),
        ({"Chair": {"short": 0.01, "long": 0.4}}, "size 0.4 x 0.01 x 0.65 m of 'LabStool'"),
        ({"Chair": {"asset": "Throne"}}, "'Throne' of asset_bboxes.json is not in the catalog"),
        ({"Chair": 3}, "Chair"),
        ([1], "sizes must be a JSON object"),
    ],
)
def test_bad_sizes_are_one_line_that_names_the_asset(folder, sizes, words):
    with pytest.raises(DocumentError) as error:
        read_labbuilder(folder(sizes=sizes))
    assert words in str(error.value)


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"objects": 3}', '{"objects": null}', "[" * 1000, '{"objects": []'])
def test_files_that_are_no_scenes_are_refused(tmp_path, text):
    (tmp_path / "scene.json").write_text(text)
    with pytest.raises(DocumentError):
        read_labbuilder(tmp_path / "scene.json")


def test_the_room_may_come_from_the_sizes(folder):
    room = {"LaboratoryRoom": {"short": 6.0, "long": 8.0, "height": 3.0}}
    path = folder(sizes={**SIZES, **room}, room_size=None)
    layout = read_labbuilder(path).layout
    assert (layout.room.width, layout.room.depth) == (5.6, 7.6)
    with pytest.raises(DocumentError, match="room_size"):
        read_labbuilder(folder(room_size=None))
    with pytest.raises(DocumentError, match="width"):
        read_labbuilder(folder(room_size={"w": 1.0, "d": 8.0, "h": 3.0}))


def test_angles_return_after_a_round_trip():
    for degrees in (0.0, 90.0, 180.0, 270.0, 359.99999999, 12.3456789, -90.0, 720.0):
        yaw = to_radians(degrees)
        assert -math.pi < yaw <= math.pi
        assert to_radians(to_degrees(yaw)) == yaw
        assert math.cos(yaw) == pytest.approx(math.cos(math.radians(degrees)), abs=1e-8)
        assert 0.0 <= to_degrees(yaw) < 360.0


def test_repeated_names_get_numbers_that_are_free():
    assert unique_ids(["Chair", "Bench", "Chair", "Chair_1"]) == ("Chair_2", "Bench", "Chair_3", "Chair_1")
    assert len(set(unique_ids(["a" * 80] * 50))) == 50
    assert [kind_of(name) for name in ("FumeHood2", "Chair_12", "Chair", "12")] == ["FumeHood", "Chair", "Chair", "12"]


def test_the_command_imports_exports_and_never_replaces_the_scene(folder, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    folder()
    before = (tmp_path / "ester.json").read_bytes()
    assert main(["import", "labbuilder", "ester.json", "--overwrite"]) == 2
    words = [
        "import",
        "labbuilder",
        "ester.json",
        "--out",
        "lab.json",
        "--door",
        "front,4",
        "--map",
        "Beaker=Erlenmeyer",
    ]
    assert main(words) == 0
    captured = capsys.readouterr()
    assert captured.out == "lab.json\n"
    assert "note: 2 objects are called Chair" in captured.err
    layout = Layout.load(tmp_path / "lab.json")
    assert layout.placement("Beaker").asset == "ErlenmeyerFlask"
    assert layout.room.doors == (Door(wall="front", offset=4.0),)
    assert main(["compile", "lab.json", "--format", "labbuilder", "--out", "again"]) == 0
    assert {path.name for path in (tmp_path / "again").iterdir()} == {
        "scene.json",
        "asset_bboxes.json",
        "goal_pairs.json",
    }
    assert (tmp_path / "ester.json").read_bytes() == before


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--door", "front"], "--door"),
        (["--door", "roof,1"], "--door"),
        (["--door", "front,nan"], "--door"),
        (["--map", "Beaker"], "NAME=ASSET"),
        (["--out", "lab.txt"], ".json"),
        (["--door", "front,30"], "does not fit"),
        (["--sizes", "none.json"], "no such file"),
    ],
)
def test_bad_arguments_are_one_line(folder, tmp_path, monkeypatch, capsys, words, message):
    monkeypatch.chdir(tmp_path)
    folder()
    assert main(["import", "labbuilder", "ester.json", "--out", "lab.json", *words]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert message in error
    assert not (tmp_path / "lab.json").exists()


def test_formats_are_named_in_errors(tmp_path):
    layout = Layout(id="empty", floor=load_published("test", published("test")[0]).floor, placements=())
    with pytest.raises(OptionError):
        compile_layout(layout, tmp_path / "out", ["labbuilder", "labbuilder"])


def as_list(vector):
    return [vector[name] for name in ("x", "y", "z")]


OTHER_FORMS = {
    "lists": ({}, lambda each: {**each, "position": as_list(each["position"]), "rotation": as_list(each["rotation"])}),
    "nulls": ({"query": None}, lambda each: {**each, "mass": None}),
    "an empty location": ({}, lambda each: each | ({"initial_location": ""} if each["id"] == "Chair" else {})),
    "the room's sides as a list": ({"room_size": [8.4, 7.4, 3.2]}, dict),
    "the room's sides by other names": ({"room_size": {"width": 8.4, "depth": 7.4, "height": 3.2}}, dict),
    "turned by whole circles": ({}, lambda each: {**each, "rotation": {**each["rotation"], "x": 360.0, "y": 0.01}}),
}


@pytest.mark.parametrize(("fields", "change"), OTHER_FORMS.values(), ids=OTHER_FORMS)
def test_a_scene_in_another_form_is_the_same_layout(folder, fields, change):
    plain = read_labbuilder(folder())
    other = read_labbuilder(folder([change(each) for each in OBJECTS], **fields))
    assert other.layout.placements == plain.layout.placements
    assert other.layout.floor == plain.layout.floor


def test_objects_by_name_are_read_in_their_order(folder, tmp_path):
    scene = json.loads(folder().read_text())
    scene["objects"] = {f"{each['id']}__{number}": without(each, "id") for number, each in enumerate(OBJECTS)}
    (tmp_path / "ester.json").write_text(json.dumps(scene))
    imported = read_labbuilder(tmp_path / "ester.json", skip_unknown=True)
    assert "objects are listed by name" in " ".join(imported.notes)


def test_names_with_other_characters_become_ids(folder):
    imported = read_labbuilder(folder([*OBJECTS, thing("N,N-Dimethylformamide", 1.4, 6.98, 0.8, on="reagent_cabinet")]))
    added = imported.layout.placements[-1]
    assert (added.id, added.asset) == ("N_N-Dimethylformamide", "NNDimethylformamide")
    assert any("is called N_N-Dimethylformamide" in note for note in imported.notes)


def test_an_item_too_large_for_its_bench_gets_the_catalog_s_size(folder):
    objects = [*OBJECTS, thing("RotaryEvaporator", 4.0, 4.0, 0.8, on="experimental_platform")]
    sizes = {**SIZES, "RotaryEvaporator": {"short": 0.9, "long": 2.3, "height": 2.37}}
    imported = read_labbuilder(folder(objects, sizes))
    assert imported.layout.placement("RotaryEvaporator").size is None
    assert any("RotaryEvaporator on ExperimentalPlatform" in note for note in imported.notes)
    objects[-1] = thing("RotaryEvaporator", 7.0, 2.0)
    assert read_labbuilder(folder(objects, sizes)).layout.placement("RotaryEvaporator").size.width == 2.3


def test_numbers_in_other_units_are_doubted(folder):
    radians = [{**each, "rotation": {"z": math.radians(each["rotation"]["z"])}} for each in OBJECTS]
    assert any("may be radians" in note for note in read_labbuilder(folder(radians)).notes)
    tens = [{**each, "position": {k: 10 * v for k, v in each["position"].items()}} for each in OBJECTS]
    assert any("outside of the room" in note for note in read_labbuilder(folder(tens)).notes)
    plain = " ".join(read_labbuilder(folder()).notes)
    assert "radians" not in plain
    assert "outside of the room" not in plain


@pytest.mark.parametrize(("factor", "unit"), [(1000, "millimeters: divide all lengths by 1000"), (100, "centimeters")])
def test_a_scene_in_another_unit_is_refused_with_a_hint(folder, factor, unit):
    def scaled(vector):
        return {name: factor * value for name, value in vector.items()}

    objects = [each | {"position": scaled(each["position"])} for each in OBJECTS]
    with pytest.raises(DocumentError, match=rf"meters, and up to {8.4 * factor:g} looks like {unit}") as caught:
        read_labbuilder(folder(objects, room_size=scaled(ROOM)))
    assert "\n" not in str(caught.value)
    sizes = {name: scaled({key: value for key, value in size.items() if key != "type"}) for name, size in SIZES.items()}
    with pytest.raises(DocumentError, match=r"asset_bboxes\.json.*meters, and up to"):
        read_labbuilder(folder(sizes=sizes))


def test_an_angle_out_of_range_says_nothing_about_units(folder):
    with pytest.raises(DocumentError, match="rotation") as caught:
        read_labbuilder(folder([*OBJECTS, thing("Chair", 2.0, 2.0, turn=5000.0)]))
    assert "meters" not in str(caught.value)
