"""The published layouts are what their recorded seeds make; training never meets them."""

import json

import numpy as np
import pytest

import labgym.layouts.splits as splits
from labgym.cli import main
from labgym.errors import DocumentError, UnknownNameError
from labgym.layouts import Layout, generate, load_published, published, train_layout
from labgym.protocols import protocols


@pytest.mark.parametrize("split", ["val", "test"])
def test_a_split_has_one_layout_a_protocol_and_every_hash_holds(split):
    names = published(split)
    layouts = [load_published(split, name) for name in names]
    assert sorted(layout.protocol_id for layout in layouts) == sorted(protocols())
    assert len({layout.hash for layout in layouts}) == 30


@pytest.mark.parametrize("split, index", [("test", 0), ("test", 17), ("val", 9)])
def test_a_published_layout_can_be_made_again(split, index):
    entry = splits.manifest(split).layouts[index]
    assert generate(entry.protocol, entry.seed, entry.room).hash == entry.hash


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


@pytest.mark.parametrize("changed, code", [(False, 0), (True, 1)])
def test_reproduce_exits_1_where_a_hash_differs(monkeypatch, tmp_path, changed, code):
    whole = splits.manifest("test")
    first = whole.layouts[0].model_copy(update={"hash": "0" * 64} if changed else {})
    monkeypatch.setattr(splits, "manifest", lambda split: splits.Manifest(split=split, layouts=(first,)))
    assert main(["reproduce", "--split", "test", "--out", str(tmp_path)]) == code
    assert Layout.load(tmp_path / "test" / f"{first.id}.json").hash == whole.layouts[0].hash
