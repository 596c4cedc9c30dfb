"""Publication of the suites on two floors: files, hashes, resume, and the sealed suites."""

from __future__ import annotations

import json

import pytest
from labnav_suites import draw_suite

from labgym.cli import main
from labgym.envs.labnav.episodes import Draws, LabNavEpisodes
from labgym.errors import LabgymError
from labgym.eval.labnav import publication
from labgym.eval.labnav.publication import (
    MANIFEST,
    LabNavManifest,
    Publication,
    SuiteName,
    draw_suites,
    publish,
    published_manifest,
)
from labgym.eval.labnav.suites import load_labnav
from labgym.layouts import load_published
from labgym.layouts.sealed import Commitment, SealedFloor
from labgym.runs import ExecutorOptions

FLOORS = ("floors-val-0004", "floors-val-0009")
DRAWN = Publication("floors-val", 2, 2, ("odometry", "dock"), (2,), version=1)
"""Four shards of small floors."""


@pytest.fixture(scope="module", autouse=True)
def two_floors():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(publication, "published", lambda split: FLOORS)
        yield


@pytest.fixture(scope="module")
def drawn(two_floors, tmp_path_factory):
    out = tmp_path_factory.mktemp("suites")
    return draw_suites(DRAWN, out, progress=False), out


def test_the_suites_are_those_of_the_draw_and_have_the_hashes_of_the_manifest(drawn):
    manifest, out = drawn
    assert set(manifest.suites) == {"odometry-2", "dock-2", "odometry-2-unfiltered", "dock-2-unfiltered"}
    for name, entry in manifest.suites.items():
        suite = LabNavEpisodes.load(out / f"{name}.json")
        assert (suite.hash, suite.version, suite.draft) == (entry.hash, 1, False)
        assert suite.name == f"labnav-{name}"
        assert entry.drawn == sum(each.drawn for each in suite.draws.values())
    suite = LabNavEpisodes.load(out / "dock-2.json")
    other = draw_suite("dock", 2, "floors-val", 2, 2, seed=14, attempts=1000, names=FLOORS)
    assert suite.episodes == other.episodes
    assert suite.draws == other.draws


def test_a_file_has_an_episode_a_line(drawn):
    lines = (drawn[1] / "dock-2.json").read_text().splitlines()
    assert sum("floor_hash" in line for line in lines) == 4
    json.loads("\n".join(lines))


def test_an_interrupted_draw_resumes_to_the_same_files_at_any_number_of_workers(drawn, tmp_path, monkeypatch):
    calls = []

    def failing(*arguments):
        calls.append(arguments)
        if len(calls) == 3:
            raise KeyboardInterrupt
        return draw(*arguments)

    draw = publication.draw_shard
    monkeypatch.setattr(publication, "draw_shard", failing)
    with pytest.raises(KeyboardInterrupt):
        draw_suites(DRAWN, tmp_path, progress=False)
    monkeypatch.setattr(publication, "draw_shard", draw)
    manifest = draw_suites(DRAWN, tmp_path, ExecutorOptions(workers=2), progress=False)
    assert manifest == drawn[0]
    for name in manifest.suites:
        assert (tmp_path / f"{name}.json").read_bytes() == (drawn[1] / f"{name}.json").read_bytes()


def test_published_suites_are_copies_with_a_manifest_and_a_broken_one_is_refused(drawn, tmp_path):
    manifest, out = drawn
    paths = publish(manifest, out, tmp_path)
    assert len(paths) == 5
    assert LabNavManifest.load(tmp_path / "suites.json") == manifest
    assert (tmp_path / "dock-2.json").read_bytes() == (out / "dock-2.json").read_bytes()
    broken = {**manifest.suites, "dock-2": manifest.suites["odometry-2"]}
    with pytest.raises(LabgymError, match="not the manifest's"):
        publish(manifest.model_copy(update={"suites": broken}), out, tmp_path)


def test_a_split_without_enough_floors_gives_a_suite_with_fewer_or_is_refused(tmp_path, monkeypatch):
    one = Publication("floors-val", 3, 1, ("dock",), (2,), False)
    assert draw_suites(one, tmp_path / "some", progress=False).suites["dock-2"].floors == 2
    monkeypatch.setattr(publication, "draw_floor", lambda *arguments: ((), Draws(drawn=9, accepted=0)))
    with pytest.raises(LabgymError, match="no floor of floors-val has 1 episodes"):
        draw_suites(one, tmp_path / "none", progress=False)


@pytest.mark.parametrize(
    "fields",
    [
        {"tasks": ("fly",)},
        {"levels": (4,)},
        {"floors": 0},
        {"per_floor": 101},
        {"seed": -1},
        {"split": "floors-sealed"},
        {"secret": bytes(32)},
    ],
)
def test_wrong_fields_are_refused_in_one_line(fields):
    with pytest.raises(LabgymError) as caught:
        Publication(**{"split": "floors-val", **fields})
    assert "\n" not in str(caught.value)


def test_sealed_suites_depend_on_the_secret_and_only_their_hashes_are_published(tmp_path, monkeypatch):
    layouts = [load_published("floors-val", name) for name in FLOORS]
    floors = tuple(SealedFloor(id=each.id, hash=each.hash) for each in layouts)
    committed = Commitment(secret="a" * 64, furnisher=1, labgym="0", floors=floors, suite="b" * 64)
    monkeypatch.setattr(publication, "commitment", lambda: committed)
    for each in layouts:
        each.save(tmp_path / "layouts" / f"{each.id}.json")
    manifests = []
    for number, secret in enumerate((bytes(32), bytes(31) + b"x")):
        one = Publication("floors-sealed", 2, 1, ("dock",), (2,), False, secret=secret, layouts=tmp_path / "layouts")
        manifests.append(draw_suites(one, tmp_path / str(number), progress=False))
    first, second = manifests
    assert first.suites["dock-2"].hash != second.suites["dock-2"].hash
    assert first.secret != second.secret
    assert {path.name for path in publish(first, tmp_path / "0", tmp_path / "published")} == {"sealed.json"}
    assert [path.name for path in (tmp_path / "published").iterdir()] == ["sealed.json"]
    assert first.differences(first) == ()
    assert len(first.differences(second)) == 2
    broken = committed.model_copy(update={"floors": (SealedFloor(id=FLOORS[0], hash="c" * 64), floors[1])})
    monkeypatch.setattr(publication, "commitment", lambda: broken)
    with pytest.raises(LabgymError, match="not that of the commitment"):
        draw_suites(one, tmp_path / "2", progress=False)


@pytest.mark.cases(1)
@pytest.mark.parametrize("folder", ["", "val/"])
def test_the_published_files_have_the_hashes_of_their_manifest(folder):
    manifest = published_manifest(f"{folder}{MANIFEST}")
    for name, entry in ({} if manifest is None else manifest.suites).items():
        (suite,) = load_labnav(f"labnav-{folder.replace('/', '-')}{name}").parts
        assert suite.hash == entry.hash
        assert (suite.version, suite.draft) == (manifest.version, manifest.draft)


def test_the_command_draws_and_prints_the_acceptance(tmp_path, capsys):
    command = ["labnav", "--split", "floors-val", "--out", str(tmp_path), "--floors", "2", "--episodes", "1"]
    assert main([*command, "--tasks", "dock", "--level", "2", "--no-unfiltered", "--draft", "--version", "0"]) == 0
    assert "dock-2: 2 episodes on 2 of 2 floors" in capsys.readouterr().out
    assert LabNavEpisodes.load(tmp_path / "dock-2.json").draft


def test_names_of_suites():
    assert str(SuiteName("glass", 2, False)) == "glass-2-unfiltered"
