"""Published drives: they end as published, the site shows them, and those of another result are left out."""

from __future__ import annotations

import numpy as np
import pytest

from labgym.artefacts import artefacts
from labgym.cli import main
from labgym.envs.labnav.nuisances import prepared
from labgym.errors import DocumentError
from labgym.eval.labnav.suites import load_labnav
from labgym.eval.leaderboard import drives as module
from labgym.eval.leaderboard.drives import publish_drives, published_drives, suite_of_keys
from labgym.eval.leaderboard.labnav import published_results
from labgym.eval.reports import labnav_report
from labgym.eval.reports.labnav_report import write_leaderboard
from labgym.eval.reports.site.entries import Entry
from labgym.eval.reports.site.episodes import episodes_shown
from labgym.runs import ExecutorOptions

RESULTS = {one.summary.policy: one for one in published_results()}
KEYS = ("odometry-2/floors-test-0000/0", "people-2/floors-test-0000/0", "moved-2/floors-test-0000/1")


@pytest.fixture(scope="module")
def published(tmp_path_factory):
    home = tmp_path_factory.mktemp("drives")
    written = publish_drives(RESULTS["straight"], KEYS, home / "runs", ExecutorOptions(), home)
    return home, written


def test_a_drive_that_ends_as_published_has_its_route_and_people(published):
    home, written = published
    assert (written.count, written.differing) == (3, ())
    drives = published_drives(RESULTS["straight"], home)
    assert set(drives) == set(KEYS)
    episodes = load_labnav("labnav").by_key
    for key, drive in drives.items():
        first = np.array(drive.route.poses[:3]) / 100.0
        assert np.abs(first[:2] - np.array(episodes[key][1].start[:2])).max() <= 0.005 + 1e-9
        assert drive.route.seconds == pytest.approx(RESULTS["straight"].by_key[key].time)
    assert drives[KEYS[0]].people is None
    assert len(drives[KEYS[1]].people.yields) > 1
    part, episode = episodes[KEYS[2]]
    pushable = prepared(part.task, part.level, episode, part.layout(episode.floor)).pushable
    assert set() < set(drives[KEYS[2]].things.names) <= set(pushable)


def test_a_drive_that_ends_otherwise_is_named_and_left_out(tmp_path):
    result = RESULTS["straight"]
    changed = tuple(
        one.model_copy(update={"ending": "lost", "score": 0.5}) if one.key == KEYS[0] else one
        for one in result.outcomes
    )
    other = result.model_copy(update={"outcomes": changed})
    written = publish_drives(other, KEYS[:1], tmp_path / "runs", ExecutorOptions(), tmp_path)
    assert written.count == 0
    (sentence,) = written.differing
    assert sentence.startswith(f"straight, {KEYS[0]}: ")
    assert sentence.endswith("score 0.500")


def test_drives_of_another_result_are_left_out(published):
    home, _ = published
    result = RESULTS["straight"]
    better = tuple(one.model_copy(update={"score": one.score + 0.03}) for one in result.outcomes)
    assert published_drives(result.model_copy(update={"outcomes": better}), home) == {}
    touched = tuple(one.model_copy(update={"ending": "contact"}) for one in result.outcomes)
    kept = published_drives(result.model_copy(update={"outcomes": touched}), home)
    assert {drive.ending for drive in kept.values()} <= {"contact"}


def test_a_broken_file_is_named(published, tmp_path):
    _, written = published
    broken = tmp_path / "straight.jsonl"
    broken.write_bytes(written.path.read_bytes() + b'{"key": 1}\n')
    with pytest.raises(DocumentError, match=r"straight\.jsonl.*line 4"):
        published_drives(RESULTS["straight"], tmp_path)
    assert published_drives(RESULTS["stack"], tmp_path) == {}


def test_the_site_shows_the_published_routes(published, tmp_path):
    home, _ = published
    result = RESULTS["straight"]
    few = result.model_copy(update={"outcomes": tuple(result.by_key[key] for key in KEYS)})
    entry = Entry.of_result(few, published_drives(few, home))
    assert entry.moves
    runs = {one["key"]: one["runs"][0] for one in episodes_shown([entry], "labnav", tmp_path).episodes}
    assert all(run["route"]["poses"] for run in runs.values())
    assert ["people" in runs[key] for key in KEYS] == [False, True, False]
    assert ["things" in runs[key] for key in KEYS] == [False, False, True]
    assert all(run["driven"] > 0.0 for run in runs.values())


def test_episodes_by_key_keep_the_order_of_the_suite():
    keys = list(load_labnav("labnav").by_key)[::500]
    suite = suite_of_keys(keys[::-1])
    assert list(suite.by_key) == keys
    assert all(part.hash != whole.hash for part, whole in zip(suite.parts, load_labnav("labnav").parts, strict=False))


def test_unknown_policies_are_refused(capsys):
    assert main(["leaderboard", "--routes", "stak"]) == 2
    assert "built-in policy with a published result 'stak'" in capsys.readouterr().err


@pytest.mark.parametrize("policy", sorted(RESULTS))
def test_published_files_hold_drives_of_the_published_results(policy):
    path = artefacts("eval") / module.FOLDER / f"{policy}.jsonl"
    drives = published_drives(RESULTS[policy])
    assert len(drives) == len(path.read_bytes().splitlines())
    assert len(drives) >= 20
    assert {key.partition("-")[0] for key in drives} == {task.task for task in RESULTS[policy].summary.tasks}
    for drive in drives.values():
        poses = np.cumsum(np.array(drive.route.poses).reshape(-1, 3), axis=0)
        outcome = RESULTS[policy].by_key[drive.key]
        assert drive.time == pytest.approx(outcome.time, rel=0.1, abs=1.0)
        assert drive.route.seconds == pytest.approx(drive.time, abs=0.11)
        length = np.linalg.norm(np.diff(poses[:, :2], axis=0), axis=1).sum() / 100.0
        assert length == pytest.approx(drive.driven, rel=0.1, abs=0.3)


def test_a_site_without_routes_says_so(tmp_path, monkeypatch):
    monkeypatch.setattr(labnav_report, "published_drives", lambda result: {})
    page = write_leaderboard(tmp_path, [RESULTS["straight"]])
    assert "No routes of these results are published" in page.read_text()


@pytest.mark.slow
def test_the_leaderboard_has_routes_of_every_policy_and_stays_small(tmp_path):
    page = write_leaderboard(tmp_path)
    assert "No routes of these results are published" not in page.read_text()
    assert page.stat().st_size < 5_000_000
