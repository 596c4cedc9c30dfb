"""Fresh floors: the draw from a secret, the test on what a policy gains on published floors, receipts and rounds."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import nullcontext
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from labnav_folders import write_folder

from labgym.artefacts import artefacts
from labgym.cli import main
from labgym.envs.labnav.episodes import LabNavEpisodes
from labgym.errors import DocumentError, LabgymError, OptionError
from labgym.eval.driving import floor_suites
from labgym.eval.labnav.evaluation import LabNavEvaluation
from labgym.eval.labnav.gain import Gain, gain
from labgym.eval.labnav.suites import load_labnav
from labgym.eval.leaderboard import labnav, receipts, rounds
from labgym.eval.leaderboard.labnav import LabNavResult, published_results
from labgym.eval.leaderboard.receipts import FreshReceipt, published_rounds, receipt_of
from labgym.eval.leaderboard.rounds import publish_round
from labgym.eval.leaderboard.tables import published_table
from labgym.eval.reports.labnav_report import write_leaderboard
from labgym.eval.reports.site.entries import Entry, ranked_entries
from labgym.eval.submission.fresh import benchmark_suite, check_fresh, draw_fresh, fresh_floors, secret_of
from labgym.layouts.floors import SPLITS
from labgym.layouts.sealed import read_secret, secret_hash
from labgym.runs import ExecutorOptions, RunIdentity

SECRET, OTHER = bytes(range(32)), bytes(range(1, 33))
DOCK = "labnav-dock"
HERE = ExecutorOptions()


@pytest.fixture(scope="module", autouse=True)
def small_floors():
    """Fresh floors of two or three rooms."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(SPLITS, "floors-fresh", SPLITS["floors-train"][2:])
        yield


@pytest.fixture(scope="module")
def out(tmp_path_factory):
    """The folder of a check by the secret: two floors, drawn once."""
    folder = tmp_path_factory.mktemp("fresh") / "2026-11"
    secret_file = folder.parent / "secret.txt"
    secret_file.write_text(f"{SECRET.hex()}\n")
    assert secret_of(folder, secret_file) == SECRET
    fresh_floors(SECRET, 2, folder, HERE, False)
    return folder


@pytest.fixture(scope="module")
def submission(tmp_path_factory):
    """A result of `still` that claims a score of 0.5 in half of the episodes."""
    place = tmp_path_factory.mktemp("result") / "still"
    return write_folder(place, load_labnav(DOCK), "still", "mapless", lambda _, one: 0.5 * (one.number % 2))


@pytest.fixture(scope="module")
def receipt(out, submission):
    return check_fresh(submission, 2, out, progress=False)


def test_fresh_floors_and_episodes_follow_from_the_secret_alone_and_the_commands_draw_them_again(out, tmp_path):
    suite = benchmark_suite(DOCK)
    drawn = draw_fresh(suite, SECRET, fresh_floors(SECRET, 2, out, HERE, False), out, HERE, False)
    (part,) = drawn.parts
    assert (part.split, part.version, part.draft) == ("floors-fresh", suite.parts[0].version, False)
    assert [one.key for one in part.episodes] == [f"floors-fresh-000{floor}/{k}" for floor in (0, 1) for k in (0, 1)]
    assert part.layout(part.episodes[0].floor).hash == part.episodes[0].floor_hash
    secret = ["--split", "floors-fresh", "--secret-file", str(out / "secret.txt"), "--out"]
    assert main(["floors", *secret, str(tmp_path / "floors"), "--count", "1"]) == 0
    layouts = ["--layouts", str(tmp_path / "floors" / "layouts")]
    numbers = ["--floors", "1", "--episodes", "2", "--tasks", "dock", "--level", "2", "--no-unfiltered"]
    assert main(["labnav", *secret, str(tmp_path / "suites"), *layouts, *numbers]) == 0
    assert LabNavEpisodes.load(tmp_path / "suites" / "dock-2.json").episodes == part.episodes[:2]
    (other,) = fresh_floors(OTHER, 1, tmp_path / "other", HERE, False)
    assert other.hash != part.episodes[0].floor_hash


def scores_of(values: Mapping[str, Any], floors: str) -> dict[str, float]:
    return {
        f"{task}-2/floors-{floors}-{floor:04d}/{number}": float(value)
        for task, table in values.items()
        for (floor, number), value in np.ndenumerate(table)
    }


def test_the_standard_error_is_that_of_independent_floors():
    """For one task, it is the standard deviation of the floors' means over the root of their number."""
    rng = np.random.default_rng(0)
    sets = [rng.random((60, 2)) for _ in range(2)]
    one = gain(*(scores_of({"dock": values}, name) for values, name in zip(sets, ("test", "fresh"), strict=True)))
    error = np.sqrt(sum(values.mean(axis=1).var(ddof=1) / 60 for values in sets))
    assert one.error == pytest.approx(error, rel=0.05)
    assert one.difference == pytest.approx(sets[0].mean() - sets[1].mean())
    assert one.z == pytest.approx(one.difference / one.error, rel=1e-6)


def test_a_gain_on_published_floors_is_an_alarm_and_an_honest_difference_is_none():
    rng = np.random.default_rng(1)

    def drawn(low: float, high: float, name: str) -> dict[str, float]:
        return scores_of({task: rng.uniform(low, high, (60, 2)) for task in ("dock", "aisle")}, name)

    honest, fresh = drawn(0.3, 0.7, "test"), drawn(0.3, 0.7, "fresh")
    assert not gain(honest, fresh).alarm
    carried = {key: score + 0.2 * (1.0 - score) for key, score in honest.items()}
    assert gain(carried, fresh).alarm
    assert not gain(fresh, carried).alarm


@pytest.mark.parametrize(
    ("difference", "z", "alarm"), [(0.031, 3.1, True), (0.029, 9.0, False), (0.2, 2.9, False), (-0.2, -9.0, False)]
)
def test_an_alarm_needs_a_gain_beyond_chance_and_beyond_three_points(difference, z, alarm):
    assert Gain(published=0.5, fresh=0.5 - difference, difference=difference, error=0.01, z=z).alarm == alarm


def test_only_tasks_that_both_have_are_compared_and_one_floor_is_too_few():
    ours, theirs = scores_of({"dock": np.ones((4, 2)), "aisle": np.zeros((4, 2))}, "test"), np.ones((4, 2))
    assert gain(ours, scores_of({"dock": theirs}, "fresh")).difference == 0.0
    with pytest.raises(OptionError, match="share no task"):
        gain(ours, scores_of({"carry": theirs}, "fresh"))
    with pytest.raises(OptionError, match="at least 2 floors"):
        gain(ours, scores_of({"dock": theirs[:1]}, "fresh"))


def test_a_receipt_states_floors_scores_and_verdict_and_reads_back(out, submission, receipt):
    assert FreshReceipt.load(out / "receipts" / "still.json") == receipt
    assert receipt.secret == secret_hash(SECRET)
    assert [floor.id for floor in receipt.floors] == ["floors-fresh-0000", "floors-fresh-0001"]
    assert set(receipt.scores.values()) == {0.0}  # it stands still
    assert (receipt.gain.fresh, receipt.gain.published) == (
        0.0,
        pytest.approx(0.25),
    )  # half of the points in one of two episodes a floor
    assert receipt.verdict == "alarm"
    assert receipt.summary.suite == "labnav-floors-fresh"
    assert SECRET.hex() not in (out / "receipts" / "still.json").read_text()
    with pytest.raises(DocumentError, match="verdict"):
        FreshReceipt.parse({**receipt.to_json(), "verdict": "no alarm"})


def test_another_policy_of_the_same_name_gets_no_receipt(out, submission, receipt, monkeypatch):
    policy, read = receipt.fingerprint.model_dump(), LabNavEvaluation.read
    for files, refused in ((policy["files"], False), ("0" * 64, True)):
        identity = RunIdentity.of(LabNavEvaluation.KIND, policy={**policy, "files": files})
        stated = replace(read(submission), identity=identity)
        monkeypatch.setattr(
            LabNavEvaluation, "read", lambda folder, stated=stated: stated if folder == submission else read(folder)
        )
        with pytest.raises(OptionError, match="is not that of") if refused else nullcontext():
            check_fresh(submission, 2, out, progress=False)


def test_a_second_check_with_the_same_folder_draws_and_drives_nothing(out, submission, receipt, monkeypatch):
    monkeypatch.setattr(floor_suites, "make_floor", None)
    assert check_fresh(submission, 2, out, progress=False) == receipt


def test_secrets_are_kept_and_neither_exchanged_nor_used_once_they_are_public(out, tmp_path, monkeypatch):
    mine = secret_of(tmp_path / "own", None)
    assert secret_of(tmp_path / "own", None) == mine
    assert secret_of(tmp_path / "others", None) != mine
    assert (tmp_path / "own" / "secret.txt").stat().st_mode & 0o077 == 0
    with pytest.raises(OptionError, match="has another secret"):
        secret_of(tmp_path / "own", out / "secret.txt")
    (tmp_path / "rounds" / "first").mkdir(parents=True)
    (tmp_path / "rounds" / "first" / "secret.txt").write_text(f"{mine.hex()}\n")
    monkeypatch.setattr("labgym.eval.submission.fresh.published_rounds", lambda: published_rounds(tmp_path / "rounds"))
    with pytest.raises(OptionError, match="public since round first"):
        secret_of(tmp_path / "own", None)


@pytest.mark.parametrize("name", ["labnav-mini", "labnav-check", "labnav-val-odometry"])
def test_fresh_floors_are_compared_with_whole_drives_on_floors_test_alone(name):
    with pytest.raises(OptionError, match="is not compared with fresh floors"):
        benchmark_suite(name)


@pytest.fixture
def results(submission, receipt, tmp_path, monkeypatch):
    """The published results of another installation, `still` with its alarm among them."""
    place = tmp_path / "eval"
    for policy in ("astar", "stack"):
        one = next(each for each in published_results() if each.summary.policy == policy)
        one.save(place / labnav.FOLDER / f"{policy}.json")
    labnav.publish(submission, place / labnav.FOLDER)
    for module in (labnav, receipts, rounds):
        monkeypatch.setattr(module, "artefacts", lambda name: place if name == "eval" else artefacts(name))
    return place


def test_a_published_round_shows_fresh_scores_and_an_alarm_unranks_its_row(out, results, receipt, tmp_path):
    before = published_results()
    assert "Fresh ↑" not in published_table(before, published_rounds()).columns
    paths = publish_round(out)
    assert {path.relative_to(results / "leaderboard/fresh").as_posix() for path in paths} == {
        "2026-11/still.json",
        "2026-11/secret.txt",
    }
    assert read_secret(paths[-1]) == SECRET
    (own,) = published_rounds()
    after = published_results()
    assert after[-1].summary.policy == "still"
    assert receipt_of(after[-1].summary, [own]) == receipt
    table = published_table(after, [own])
    column = table.columns.index("Fresh ↑")
    assert [row[column] for row in table.rows] == ["-", "-", "-, alarm"]
    assert any(note.startswith("still is not ranked: mean score 0.250 on published floors") for note in table.notes)
    entries = ranked_entries([Entry.of_result(one, rounds=[own]) for one in before])
    assert (entries[-1].name, entries[-1].fresh) == ("still", receipt)
    assert receipt.sentence in write_leaderboard(tmp_path / "site", after).read_text()
    with pytest.raises(OptionError, match="round 2026-11 is published"):
        publish_round(out)


def test_a_receipt_of_other_published_figures_counts_for_nothing(out, results, receipt):
    publish_round(out)
    result = next(one for one in published_results() if one.summary.policy == "still")
    for fields in ({"hash": "0" * 64}, {"seed": 1}, {"latency": 0.1}):
        assert receipt_of(result.summary.model_copy(update=fields), published_rounds()) is None


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"secret": "0" * 64}, "another secret"),
        ({"episodes": "0" * 64}, "is not of the published result of still"),
        ({"gain": {"published": 0.1, "fresh": 0.1, "difference": 0.0, "error": 0.01, "z": 0.0}, "verdict": "no alarm"},
         "do not follow from its scores"),
    ],
)  # fmt: skip
def test_receipts_that_contradict_secret_or_result_are_not_published(change, message, results, receipt, tmp_path):
    folder = tmp_path / "round"
    (folder / "receipts").mkdir(parents=True)
    (folder / "secret.txt").write_text(f"{SECRET.hex()}\n")
    FreshReceipt.parse({**receipt.to_json(), **change}).save(folder / "receipts" / "still.json")
    with pytest.raises(LabgymError, match=message):
        publish_round(folder)
    assert not (results / "leaderboard/fresh").exists()


def test_rounds_have_plain_names_and_receipts(tmp_path, results):
    with pytest.raises(OptionError, match="a-z, 0-9 and hyphens"):
        publish_round(tmp_path / "My Round")
    secret_of(tmp_path / "empty", None)
    with pytest.raises(DocumentError, match="holds no receipts"):
        publish_round(tmp_path / "empty")


def test_real_rows_give_few_false_alarms_and_expose_a_table_that_gains_a_fifth_of_the_headroom():
    """Rows of published results, floors resampled: 20 honest and 20 dishonest comparisons of each of two policies."""
    rng = np.random.default_rng(33)
    false, caught = 0, 0
    for result in (each for each in published_results() if each.summary.policy in ("stack", "astar")):
        for _ in range(20):
            ours, theirs = (resampled(result, rng, per_floor) for per_floor in (2, 2))
            false += gain(ours, theirs).alarm
            caught += gain({key: score + 0.2 * (1.0 - score) for key, score in ours.items()}, theirs).alarm
    assert false <= 1
    assert caught >= 39


def resampled(result: LabNavResult, rng: np.random.Generator, per_floor: int) -> dict[str, float]:
    """Return the scores of as many floors, drawn with replacement, with their first episodes."""
    floors: dict[str, dict[str, float]] = {}
    for outcome in result.outcomes:
        floors.setdefault(outcome.key.split("/")[1], {})[outcome.key] = outcome.score
    names = sorted(floors)
    chosen = [floors[names[index]] for index in rng.integers(len(names), size=len(names))]
    return {
        key.replace("/floors-test-", f"/floors-{number}-"): score
        for number, scores in enumerate(chosen)
        for key, score in scores.items()
        if int(key.rpartition("/")[2]) < per_floor
    }
