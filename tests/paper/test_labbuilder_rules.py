"""The rule set labbuilder: closed forms, and a scene for each quirk in which the two readings differ."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from released_evaluator import figures

from labgym.assets import Catalog
from labgym.cli import main
from labgym.errors import DocumentError
from labgym.layouts import load_published, published
from labgym.paper.labbuilder.study import LabBuilderStudy, measure_generated, measure_published
from labgym.paper.labbuilder_rules.chemistry import chemistry, satisfaction
from labgym.paper.labbuilder_rules.geometry import collisions, out_of_bounds
from labgym.paper.labbuilder_rules.library import UNKNOWN, Entry, Library, catalog_library, read_library
from labgym.paper.labbuilder_rules.quirks import CORRECTED, LITERAL, NUMBERS
from labgym.paper.labbuilder_rules.stage import Piece, RatedScene, Stage, layout_scene
from labgym.paper.labbuilder_rules.verdict import evaluate_scene


def entry(name, kind, short, long, height, *flags):
    return Entry(name, name, kind, short, long, height, frozenset(flags))


LIBRARY = Library([
    entry("LaboratoryRoom", "room_asset", 6.0, 8.0, 3.0),
    entry("ReagentCabinet", "room_asset", 0.4, 2.0, 2.0),
    entry("ExperimentalPlatform", "room_asset", 1.5, 3.0, 0.8),
    entry("Chair", "room_asset", 0.3, 0.3, 0.5),
    entry("Shelf", "room_asset", 0.5, 2.0, 1.6),
    entry("Beaker", "instrument", 0.1, 0.1, 0.1, "glass_container"),
    entry("GravityChromatographyColumn", "instrument", 0.2, 0.2, 0.5, "glass_container"),
    entry("HeatingPlate", "instrument", 0.2, 0.3, 0.1, "heat_source"),
    entry("Acetone", "reagent", 0.1, 0.1, 0.2, "flammable", "glass_container"),
    entry("NitricAcid", "reagent", 0.1, 0.1, 0.2, "acid", "oxidizer", "glass_container"),
    entry("Chair", "room_asset", 0.9, 0.9, 0.5),
])  # fmt: skip


def thing(name, x, y, z=0.0, turn=0.0, on="floor", own=None):
    return Piece(name, on, x, y, z, turn, own)


def scene(*pieces, places=()):
    """Return a room of 6 x 8 m, whose interior is 0.2 to 5.8 and 0.2 to 7.8; literally -0.8 to 6.8 and 1.2 to 6.8."""
    return RatedScene((thing("LaboratoryRoom", 3.0, 4.0), *pieces), (6.0, 8.0), (), places)


BENCH = thing("ExperimentalPlatform", 3.0, 4.0)
CASES = {
    "room": (scene(thing("Chair", 3.0, 1.0)), "ob", 1, 0),
    "oblique": (scene(thing("Shelf", 3.0, 6.5, turn=45.0)), "ob", 0, 1),
    "middle": (scene(thing("Chair", 3.0, 3.0), thing("HeatingPlate", 3.2, 3.0, 0.3)), "cn", 0, 1),
    "depth": (scene(thing("Chair", 3.0, 3.0), thing("Chair", 3.27, 3.0)), "cn", 0, 1),
    "groups": (
        scene(
            BENCH,
            thing("Beaker", 3.0, 4.0, 0.8, on="experimental_platform"),
            thing("Beaker", 3.0, 4.0, 0.8, on="ExperimentalPlatform"),
        ),
        "cn", 0, 1,
    ),
    "names": (
        scene(BENCH, thing("GravityChromatographyColumn", 4.5, 4.0, 0.8, on="experimental_platform")), "ob", 0, 1
    ),
    "obj": (scene(BENCH), "obj", 2, 1),
    "surface": (
        scene(
            thing("ExperimentalPlatform", 3.0, 2.2),
            thing("ExperimentalPlatform", 3.0, 5.0),
            thing("Beaker", 3.0, 5.0, 0.8, on="experimental_platform"),
        ),
        "ob", 1, 0,
    ),
    "unplaced": (scene(thing("Beaker", 3.0, 4.0, 0.8, on="nowhere")), "glass", 1.0, 0.0),
    "snake": (scene(BENCH, thing("Beaker", 3.0, 4.0, 1.0, on="experimental_platform")), "heights", 0, 1),
    "first": (
        scene(
            BENCH,
            thing("Beaker", 3.0, 4.0, 0.8, on="experimental_platform"),
            thing("Beaker", 3.0, 4.7, 0.8, on="experimental_platform"),
        ),
        "glass", 1.0, 0.5,
    ),
    "pairs": (scene(thing("Acetone", 1.0, 2.0), thing("NitricAcid", 4.0, 2.0)), "incomp_count", 2, 1),
    "cabinet": (
        scene(
            thing("ReagentCabinet", 1.5, 6.0),
            thing("ReagentCabinet", 4.5, 6.0),
            thing("Acetone", 4.5, 6.0, 1.3, on="reagent_cabinet"),
        ),
        "store", 0.0, 1.0,
    ),
    "jump": (
        scene(thing("Acetone", 1.0, 3.0), thing("HeatingPlate", 2.2, 3.0)), "flam", 0.45, 0.455
    ),
    "layers": (
        scene(
            thing("Acetone", 3.0, 3.0, 0.8, on="reagent_cabinet"),
            thing("NitricAcid", 3.3, 3.0, 1.3, on="reagent_cabinet"),
        ),
        "incomp", 1.0, 0.06,
    ),
    "empty": (scene(BENCH), "flam", 1.0, None),
    "walls": (
        scene(thing("Chair", 3.0, 2.0), thing("Shelf", 3.0, 6.9), places=("Chair", "Shelf")),
        "reachable_released", 1, 0,
    ),
    "exact": (
        scene(thing("Chair_1", 3.0, 2.0), thing("Shelf", 3.0, 5.0), places=("Chair_1", "Shelf")),
        "paths_released", 0, 1,
    ),
    "keys": (
        scene(thing("Chair", 3.0, 2.0), thing("Shelf", 3.0, 5.0), places=("Chair", "Shelf", "Chair", "Shelf")),
        "paths_released", 2, 3,
    ),
    "flip": (
        scene(thing("Chair", 3.0, 2.0), thing("Shelf", 3.0, 7.5), places=("Chair", "Shelf")),
        "reachable_released", 2, 0,
    ),
    "sizes": (
        scene(thing("Chair", 3.0, 3.0, own=(0.1, 0.1, 0.5)), thing("Chair", 3.2, 3.0, own=(0.1, 0.1, 0.5))), "cn", 1, 0
    ),
}  # fmt: skip
"""By quirk: a scene, a figure, its literal value, and its value with this quirk corrected."""


def test_every_quirk_has_a_case():
    assert set(CASES) == set(NUMBERS)


@pytest.mark.parametrize("quirk", CASES)
def test_literal_and_corrected_differ(quirk):
    each, figure, literal, corrected = CASES[quirk]
    values = [getattr(evaluate_scene(each, LIBRARY, r), figure) for r in (LITERAL, LITERAL.correcting(quirk))]
    assert values == [pytest.approx(literal), corrected if corrected is None else pytest.approx(corrected)]
    assert literal != corrected


NAMES = (*(each.id for each in LIBRARY.entries[1:]), "Chair_2", "Beaker_12", "hotbench", "reagent_cabinet", "acetone")
LABELS = ("floor", "experimental_platform", "ExperimentalPlatform", "reagent_cabinet", "ReagentCabinet", "Shelf", "x")


def drawn_scene(rng):
    """Return a scene of 15 random objects in the form of the authors' files."""

    def item(name, label, x, y, z, turn):
        position = {"x": x, "y": y, "z": z}
        return {"id": name, "initial_location": label, "position": position, "rotation": {"z": turn}}

    objects = [item("LaboratoryRoom", "floor", 3.0, 4.0, 0.0, 0.0)]
    for _ in range(15):
        x, y = rng.uniform((0.0, 0.5), (6.0, 7.5)).tolist()
        z = float(rng.choice([0.0, 0.8, 0.9, 1.1, 1.3, 1.5]))
        turn = float(rng.choice([0.0, 90.0, 180.0, 270.0, -90.0, 30.0]))
        objects.append(item(str(rng.choice(NAMES)), str(rng.choice(LABELS)), x, y, z, turn))
    return {"objects": objects}


def library_form() -> list[dict]:
    """Return the assets of the library in the form of LabBuilder's file."""
    return [
        {
            "id": each.id,
            "name": each.name,
            "type": each.kind,
            "geometry": {"bbox": {"short": each.short, "long": each.long, "height": each.height}},
            "props": dict.fromkeys(each.flags, True),
        }
        for each in LIBRARY.entries
    ]


def test_counts_and_scores_are_those_of_a_second_calculation():
    assets = library_form()
    rng, least = np.random.default_rng(0), dict.fromkeys(("ob", "cn", "heights", "incomp_count"), 0)
    for _ in range(30):
        drawn = drawn_scene(rng)
        pieces = tuple(
            thing(one["id"], *one["position"].values(), one["rotation"]["z"], one["initial_location"])
            for one in drawn["objects"]
        )
        expected = figures(drawn, assets)
        verdict = evaluate_scene(RatedScene(pieces, (6.0, 8.0)), LIBRARY).model_dump()
        assert {name: verdict[name] for name in expected} == pytest.approx(expected, abs=1e-9)
        least = {name: max(number, expected[name]) for name, number in least.items()}
    assert min(least.values()) > 1


def test_satisfaction_has_four_pieces():
    points = {1.2: 1.0, 1.0: 1.0, 0.95: 0.85, 0.9: 0.7, 0.8: 0.45, 0.7: 0.2, 0.69: 0.207, 0.5: 0.15, 0.0: 0.0}
    for ratio, value in points.items():
        assert satisfaction(ratio, LITERAL) == pytest.approx(value)
    assert satisfaction(0.7 - 1e-9, CORRECTED) == pytest.approx(satisfaction(0.7, CORRECTED), abs=1e-6)


def test_a_bottle_in_a_narrow_cabinet_cannot_score_more_than_its_ceiling():
    cabinet = thing("ReagentCabinet", 3.0, 4.0)
    result = chemistry(Stage(scene(cabinet, thing("Acetone", 3.2, 4.1, 1.3, on="reagent_cabinet")), LIBRARY, CORRECTED))
    # 0.2 m to the edge less 0.1 m off the middle and 0.05 m of the bottle; in the middle 0.15 m of 0.30 m.
    assert result.scores["glass"] == pytest.approx(0.3 * 0.05 / 0.3)
    assert result.ceiling == pytest.approx(0.3 * 0.15 / 0.3)
    assert result.glassware is None
    assert result.scores["store"] == 1.0


def test_flam_is_the_mean_of_the_worst_three():
    plate = thing("HeatingPlate", 1.0, 3.0)
    bottles = [thing(f"Acetone_{n}", 1.0 + d, 3.0) for n, d in enumerate((0.15, 0.3, 0.75, 3.0))]
    result = chemistry(Stage(scene(plate, *bottles), LIBRARY, LITERAL))
    assert result.count("flam") == 4
    assert result.scores["flam"] == pytest.approx((0.03 + 0.06 + 0.15) / 3)


def test_furniture_on_furniture_does_not_collide_unless_it_sticks_out():
    for x, count in ((3.0, 0), (4.3, 1)):
        pieces = scene(BENCH, thing("Shelf", x, 4.0, 0.1))
        assert len(collisions(Stage(pieces, LIBRARY, LITERAL))) == count


def test_an_oblique_piece_is_measured_by_its_corners():
    half = (2.0 + 0.5) / 2 * math.sqrt(0.5)
    for margin, count in ((0.006, 0), (-0.006, 1)):
        pieces = scene(thing("Shelf", 3.0, 7.8 - half - margin, turn=225.0))
        assert len(out_of_bounds(Stage(pieces, LIBRARY, CORRECTED))) == count


def test_published_goals_lie_farther_from_long_furniture():
    # In front of the shelf stands a chair: half of the short side and 0.5 m lead to it, half of the long one past it.
    pieces = (thing("Chair", 1.0, 2.0), thing("Shelf", 3.0, 3.0), thing("Beaker", 3.0, 3.75))
    verdict = evaluate_scene(scene(*pieces, places=("Chair", "Shelf")), LIBRARY, LITERAL)
    assert (verdict.reachable_released, verdict.reachable_published) == (0, 1)


def test_names_are_resolved_in_four_ways():
    assert LIBRARY.sized("Beaker_7") is LIBRARY.sized("beaker") is LIBRARY.sized("Beaker")
    assert LIBRARY.find("reagent_cabinet") is LIBRARY.find("ReagentCabinet")
    assert LIBRARY.find("beaker_7") is None
    assert LIBRARY.sized("Teapot") is UNKNOWN
    assert LIBRARY.flagged("Acetone_old").flags == {"flammable", "glass_container"}
    assert (LIBRARY.sized("Chair").long, LIBRARY.last("Chair").long) == (0.3, 0.9)


def test_a_broken_library_is_named(tmp_path):
    path = tmp_path / "assets.json"
    path.write_text("{}")
    with pytest.raises(DocumentError, match="assets_annotated"):
        read_library(path)
    path.write_text(json.dumps({"assets": [{"id": "A", "geometry": {"bbox": {"short": -1, "long": 1, "height": 1}}}]}))
    with pytest.raises(DocumentError, match="short"):
        read_library(path)


def test_a_layout_enters_with_its_cabinets_as_reagent_cabinets():
    layout = load_published("test", published("test")[0])
    library = catalog_library(Catalog.load())
    rated = layout_scene(layout, library)
    assert len(rated.pieces) == len(layout.placements) + 1
    by_class = [p for p in layout.placements if layout.asset(p.id).storage_class in ("Flammable", "Acid", "General")]
    assert {piece.id for piece in rated.pieces if piece.is_cabinet} >= {
        f"ReagentCabinet_{number}" for number in range(1, len(by_class) + 1)
    }
    corrected = chemistry(Stage(rated, library, CORRECTED))
    reagents = [placement for placement in layout.placements if layout.asset(placement.id).kind == "reagent"]
    assert corrected.count("store") == len(reagents)
    assert corrected.scores["store"] == 1.0
    lacking = layout_scene(layout, LIBRARY).further
    sizes = {e.id: e for e in lacking}
    shower = next(p for p in layout.placements if p.asset == "EmergencyShower")
    assert sizes[shower.id].long == layout.asset(shower.id).size.long
    assert not any(e.flags for e in lacking if e.name not in ("Chair",))


@pytest.fixture
def files(tmp_path):
    """A scene and a library as LabBuilder writes them."""
    objects = [
        {
            "id": name,
            "position": {"x": x, "y": y, "z": z},
            "rotation": {"x": 0, "y": 0, "z": 0},
            "initial_location": on,
        }
        for name, x, y, z, on in (
            ("LaboratoryRoom", 3, 4, 0, "floor"),
            ("ReagentCabinet", 3, 4, 0, "floor"),
            ("Acetone", 3, 4, 1.3, "reagent_cabinet"),
        )
    ]
    (tmp_path / "s.json").write_text(json.dumps({"room_size": {"w": 6, "d": 8, "h": 3}, "objects": objects}))
    (tmp_path / "assets.json").write_text(json.dumps({"assets": library_form()}))
    return tmp_path


def test_score_prints_both_modes(files, capsys):
    words = ["score", str(files / "s.json"), "--rules", "labbuilder"]
    assert main(words) == 2
    assert "--library" in capsys.readouterr().err
    assert main([*words, "--library", str(files / "assets.json"), "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    (modes,) = data["scenes"].values()
    assert data["rules"] == "labbuilder"
    assert (modes["literal"]["obj"], modes["corrected"]["obj"]) == (3, 2)
    assert modes["literal"]["glass"] == pytest.approx(0.15)
    assert main([*words, "--library", str(files / "assets.json")]) == 0
    assert "Glass ceiling" in capsys.readouterr().out


def test_the_study_says_what_each_quirk_is_worth(files):
    library = str(files / "assets.json")
    row = json.loads(next(iter(measure_published(published("test")[0], library).files.values())))
    study = LabBuilderStudy(files, library)
    figures = study.figures([study.row.model_validate(row)])
    both, quirks = figures.tables[-2:]
    assert [line.name.split(", ")[-1] for line in both.lines] == ["paper", "literal", "corrected"]
    assert [line.name for line in quirks.lines] == [f"{number} {name}" for name, number in NUMBERS.items()]
    obj = quirks.lines[NUMBERS["obj"] - 1].cells["obj"]
    assert obj.value == -1.0


def test_the_study_counts_generated_layouts_and_names_those_below_their_goals(files):
    library = str(files / "assets.json")
    outputs = measure_generated("alk_03", 0, library).files
    (text,) = (text for name, text in outputs.items() if name.endswith(".jsonl"))
    study = LabBuilderStudy(files, library, 1)
    assert sum(shard.name == "alk_03-0" for shard in study.shards()) == 1
    row = study.row.model_validate_json(text)
    assert "layouts/alk_03-0.json" in outputs
    low = row.model_copy(update={"scene": "low", "v": 2, "missed": ("glass",)})
    figures = study.figures([row, low])
    assert "1 of 2 generated layouts have no violation" in figures.summary[-1]
    assert figures.summary[-1].endswith("with a score below its goal: low (glass).")
    assert [line.name for line in figures.tables[-1].lines][-1] == "generated layouts, labbuilder, corrected"
