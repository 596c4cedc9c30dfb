"""The published layouts are what their manifest says; training never uses them."""

import hashlib
import json

import numpy as np
import pytest

import labgym.layouts.splits as splits
from labgym.cli import main
from labgym.errors import DocumentError, UnknownNameError
from labgym.layouts import GENERATOR, Layout, generate, load_published, published, train_layout
from labgym.layouts.generate import FURNISHER
from labgym.layouts.places import layout_at, published_protocols
from labgym.navigation import goal_pairs
from labgym.protocols import protocols


@pytest.mark.parametrize("split", ["val", "test"])
def test_a_split_has_one_layout_a_protocol_and_every_hash_holds(split):
    names = published(split)
    layouts = [load_published(split, name) for name in names]
    assert sorted(layout.protocol_id for layout in layouts) == sorted(protocols())
    assert len({layout.hash for layout in layouts}) == 30


def test_the_manifests_name_the_generator():
    for split in ("val", "test"):
        assert splits.manifest(split).generator == 1
    assert generate("sub_02", 5).provenance.versions["generator"] == str(GENERATOR)


def test_a_layout_is_made_again_from_its_manifest_entry_whatever_else_the_library_holds(monkeypatch, tmp_path):
    library = protocols()
    entry = splits.PublishedLayout(id="mine", protocol="sub_02", room="roomy", seed=5, hash="0" * 64)
    layout = splits.make_again(entry)
    extended = {"aaa_first": library["alk_01"].model_copy(update={"id": "aaa_first"})} | library
    monkeypatch.setattr(splits, "protocols", lambda: extended)
    assert splits.make_again(entry) == layout
    assert (layout.id, layout.protocol_id, layout.room.name, layout.provenance.seed) == ("mine", "sub_02", "roomy", 5)
    written = splits.publish("test", [layout], tmp_path)
    assert written.generator == GENERATOR
    assert splits.make_again(written.layouts[0]).hash == written.layouts[0].hash


def test_training_seeds_are_apart_from_the_published_ones():
    used = [entry.seed for split in ("val", "test") for entry in splits.manifest(split).layouts]
    assert min(used) >= splits.TRAIN_SEEDS
    layout = train_layout(np.random.default_rng(0))
    assert layout.provenance.seed < splits.TRAIN_SEEDS
    assert layout.hash == train_layout(np.random.default_rng(0)).hash


def test_a_changed_file_is_refused(tmp_path, monkeypatch):
    source = load_published("test", published("test")[0])
    moved = source.replace(placements=source.placements[:-1])
    splits.publish("test", [source], tmp_path)
    (tmp_path / "test" / f"{source.id}.json").write_text(json.dumps(moved.to_json()))
    monkeypatch.setattr(splits, "artefacts", lambda folder: tmp_path)
    splits.manifest.cache_clear()
    try:
        with pytest.raises(DocumentError, match="hash"):
            load_published("test", source.id)
    finally:
        splits.manifest.cache_clear()


def test_unknown_splits_and_layouts_say_what_exists():
    with pytest.raises(UnknownNameError, match="val"):
        published("train")
    with pytest.raises(UnknownNameError, match="test-sub_01"):
        load_published("test", "sub_01")


def test_a_layout_survives_saving_and_loading(tmp_path):
    layout = load_published("val", published("val")[3])
    again = Layout.load(layout.save(tmp_path / "layout.json"))
    assert again == layout
    assert again.hash == layout.hash


@pytest.fixture
def small_split(tmp_path, monkeypatch):
    """A published split of one layout that this version's generator made."""
    splits.publish("test", [generate("sub_02", 5).replace(id="test-sub_02")], tmp_path)
    monkeypatch.setattr(splits, "artefacts", lambda folder: tmp_path)
    splits.manifest.cache_clear()
    yield tmp_path / "test"
    splits.manifest.cache_clear()


def edit(path, **changes):
    path.write_text(json.dumps(json.loads(path.read_text()) | changes))
    splits.manifest.cache_clear()


def test_reproduce_makes_the_layouts_again_if_the_generator_is_the_same(small_split, capsys):
    assert main(["reproduce"]) == 0
    entry = splits.manifest("test").layouts[0].model_dump()
    edit(small_split / "manifest.json", layouts=[entry | {"seed": 6}])
    assert main(["reproduce"]) == 1
    assert "test-sub_02: regenerated, its hash is" in capsys.readouterr().err


def test_reproduce_names_an_older_generator_and_checks_the_files(small_split, capsys):
    edit(small_split / "manifest.json", generator=1)
    assert main(["reproduce"]) == 0
    assert f"generator 1, this version has {GENERATOR}" in capsys.readouterr().out
    edit(small_split / "test-sub_02.json", placements=[])
    assert main(["reproduce"]) == 1
    assert "manifest's" in capsys.readouterr().err


def test_reproduce_of_the_published_files_succeeds(capsys):
    assert main(["reproduce", "--split", "val"]) == 0
    assert "made by generator 1" in capsys.readouterr().out


def test_the_manifest_of_floors_names_family_clutter_protocols_and_furnisher(tmp_path):
    floor = layout_at("floors-train", 0)
    written = splits.publish("floors-val", [floor], tmp_path)
    (entry,) = written.layouts
    assert (written.generator, written.furnisher, written.reproducible) == (GENERATOR, FURNISHER, True)
    assert (entry.family, entry.clutter) == ("bay", floor.provenance.options.get("clutter", 0))
    assert entry.protocols == tuple(protocol.id for protocol in floor.protocols)
    older = written.model_copy(update={"furnisher": 99, "generator": 1})
    assert not older.reproducible
    room = splits.publish("val", [load_published("val", published("val")[0])], tmp_path)
    assert "furnisher" not in room.to_json()


def test_published_rooms_keep_the_protocols_that_were_published_with_them():
    """The hash covers the embedded protocol; theirs was recorded before the library was corrected."""
    rooms = {name: load_published(split, name) for split in ("val", "test") for name in published(split)}
    text = "\n".join(f"{name} {rooms[name].replace(seed_hash=None).hash}" for name in sorted(rooms))
    assert hashlib.sha256(text.encode()).hexdigest() == (
        "fab866c3ff93d95f49259948fa01f00462096fcd0b68cb41bab9d12048f7de90"
    )
    corrected = rooms["test-red_03"]
    assert corrected.protocol == published_protocols()["red_03"]
    assert corrected.protocol != protocols()["red_03"]
    assert "HeatingMantle" in corrected.protocol.instruments
    pairs = goal_pairs(corrected)
    assert pairs == goal_pairs(corrected, "red_03") == goal_pairs(corrected, protocols()["red_03"])


def test_the_published_protocols_are_those_of_the_library_by_id():
    assert published_protocols().keys() == protocols().keys()
