"""A catalogue is a value: it has a digest, compares, hashes, pickles small, and never mixes with another one."""

from __future__ import annotations

import multiprocessing
import pickle
from concurrent.futures import ProcessPoolExecutor

import pytest

from labgym.assets import Asset, AssetFile, Catalog, Size
from labgym.assets.catalog import OWN_ASSETS
from labgym.errors import LabgymError

PUBLISHED = Catalog.published()
BENCH = PUBLISHED.get("IslandBench")


def beaker(width: float = 0.8, **changes: object) -> Asset:
    data = PUBLISHED.get("Beaker").model_dump(mode="json")
    data |= {"name": "TestBeaker", "synonyms_en": ["test beaker"], "synonyms_zh": [], "core": False}
    data |= {"size": {"width": width, "depth": 0.1, "height": 0.12}, **changes}
    return Asset.model_validate(data)


def written(folder, *assets: Asset):
    for asset in assets:
        AssetFile(assets=(asset,)).save(folder / OWN_ASSETS / f"{asset.name}.json")
    return folder


def digest_and_width(catalog: Catalog) -> tuple[str, float]:
    return catalog.digest, catalog.get("TestBeaker").size.width


@pytest.mark.parametrize(
    "change",
    [
        {"size": Size(width=1.0, depth=1.0, height=1.0)},
        {"mass": 1.0},
        {"placing": "desktop"},
        {"clearance": 2.0},
        {"surfaces": ()},
        {"heat_class": "oven"},
        {"hazards": BENCH.hazards.model_copy(update={"flammable": True})},
        {"shape": BENCH.shape.model_copy(update={"parameters": {"drawers": 3.0}})},
        {"specs": BENCH.specs.model_copy(update={"load_kg": 1.0})},
        {"chemistry": PUBLISHED.get("Acetone").chemistry},
    ],
    ids=lambda change: next(iter(change)),
)
def test_the_digest_of_an_asset_changes_with_geometry_physics_and_chemistry(change):
    digest = BENCH.digest
    assert BENCH.model_copy(update=change).digest != digest


@pytest.mark.parametrize(
    "change",
    [
        {"name": "OtherBench"},
        {"synonyms_en": ("slab",)},
        {"synonyms_zh": ()},
        {"description": "Words."},
        {"caption": "Words."},
        {"specs": BENCH.specs.model_copy(update={"notes": "Words."})},
    ],
    ids=lambda change: next(iter(change)),
)
def test_the_digest_of_an_asset_does_not_change_with_its_words(change):
    assert BENCH.model_copy(update=change).digest == BENCH.digest


def test_the_digest_of_an_imported_asset_follows_its_geometry_and_not_its_file_name():
    mesh = {"name": "mesh", "parameters": {"file": "meshes/A-000000000000.npz", "sha256": "0" * 64}}
    renamed = {"name": "mesh", "parameters": {"file": "meshes/B-000000000000.npz", "sha256": "0" * 64}}
    other = {"name": "mesh", "parameters": {"file": "meshes/A-000000000000.npz", "sha256": "1" * 64}}
    digests = [beaker(shape=shape).digest for shape in (mesh, renamed, other)]
    assert digests[0] == digests[1] != digests[2]


def test_equal_assets_hash_alike_and_serve_as_keys():
    copy = Asset.model_validate(BENCH.model_dump())
    assert copy == BENCH
    assert {BENCH: 1}[copy] == 1
    assert BENCH.model_copy(update={"mass": 1.0}) not in {BENCH: 1}


def test_a_catalogue_digest_covers_names_and_entries():
    small, large = Catalog([beaker(0.2)]), Catalog([beaker(0.4)])
    assert small.digest != large.digest
    assert small.digest != Catalog([beaker(0.2, name="OtherBeaker")]).digest
    assert small.digest == Catalog([beaker(0.2, caption="Other words of a caption.")]).digest
    assert len({PUBLISHED.digest, small.digest, large.digest}) == 3


def test_catalogues_compare_by_their_assets():
    assert Catalog([beaker(0.2)]) == Catalog([beaker(0.2)])
    assert hash(Catalog([beaker(0.2)])) == hash(Catalog([beaker(0.2)]))
    assert Catalog([beaker(0.2)]) != Catalog([beaker(0.4)])
    assert Catalog([beaker(0.2)]) != Catalog([beaker(0.2, synonyms_en=["another word"])])


def test_two_folders_with_an_entry_of_one_name_never_mix(tmp_path):
    small = Catalog.load(written(tmp_path / "a", beaker(0.2)))
    large = Catalog.load(written(tmp_path / "b", beaker(0.4)))
    assert small.get("TestBeaker").size.width == 0.2
    assert large.get("TestBeaker").size.width == 0.4
    assert small.find("test beaker").size.width == 0.2
    assert "TestBeaker" not in PUBLISHED
    assert len({small, large, PUBLISHED}) == 3


def test_a_changed_folder_is_read_again_and_an_unchanged_one_is_not(tmp_path):
    folder = written(tmp_path / "a", beaker(0.2))
    before = Catalog.load(folder)
    assert Catalog.load(folder) is before
    written(folder, beaker(0.4))
    after = Catalog.load(folder)
    assert (before.get("TestBeaker").size.width, after.get("TestBeaker").size.width) == (0.2, 0.4)


def test_a_relative_folder_means_the_one_in_the_present_directory(tmp_path, monkeypatch):
    for name, width in (("a", 0.2), ("b", 0.4)):
        written(tmp_path / name / "own", beaker(width))
        monkeypatch.chdir(tmp_path / name)
        assert Catalog.load("own").get("TestBeaker").size.width == width


def test_loaded_catalogues_pickle_small_and_arrive_as_themselves(tmp_path):
    own = Catalog.load(written(tmp_path / "a", beaker(0.2)))
    for catalog in (PUBLISHED, own):
        content = pickle.dumps(catalog)
        assert len(content) < 1000
        assert pickle.loads(content) is catalog


def test_a_catalogue_made_from_assets_pickles_with_them():
    catalog = Catalog([beaker(0.2)])
    assert pickle.loads(pickle.dumps(catalog)) == catalog


def test_another_process_gets_the_same_catalogue(tmp_path, monkeypatch):
    monkeypatch.delenv("LABGYM_CATALOG", raising=False)
    catalogs = [Catalog.load(written(tmp_path / name, beaker(width))) for name, width in (("a", 0.2), ("b", 0.4))]
    with ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn")) as executor:
        assert list(executor.map(digest_and_width, catalogs)) == [digest_and_width(item) for item in catalogs]


def test_a_folder_that_changed_since_pickling_is_refused(tmp_path):
    folder = written(tmp_path / "a", beaker(0.2))
    content = pickle.dumps(Catalog.load(folder))
    written(folder, beaker(0.4))
    with pytest.raises(LabgymError, match="changed: its digest is"):
        pickle.loads(content)
