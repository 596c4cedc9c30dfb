"""The site of LabNav: what its data holds, and that hostile names do no harm."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from labnav_folders import line_to_goal, write_folder

from labgym.cli import main
from labgym.envs.labnav.episodes import published_episodes
from labgym.envs.labnav.worlds import prepared
from labgym.errors import OptionError
from labgym.eval.labnav.evaluation import LabNavEvaluation
from labgym.eval.labnav.suites import LabNavSuite
from labgym.eval.leaderboard.labnav import LabNavResult, published_results
from labgym.eval.reports.labnav_report import report_labnav, write_leaderboard
from labgym.eval.reports.site.card import card_html
from labgym.eval.reports.site.entries import Entry, card_of, kind_of_policy, ranked_entries, with_published
from labgym.eval.reports.site.episodes import chosen, episodes_shown, packed, packed_route
from labgym.eval.reports.site.page import embedded, render_site, site_of
from labgym.eval.reports.site.plans import place_name, plan_of_map, thing_name, world_of_episode
from labgym.policies.registry import BUILT_IN

HOSTILE = '</script><img src=x onerror="alert(1)">'


@pytest.fixture(scope="module")
def suite():
    return LabNavSuite("labnav-people-2", (published_episodes("people", 2).first(3, 2),))


@pytest.fixture(scope="module")
def evaluations(suite, tmp_path_factory):
    home = tmp_path_factory.mktemp("runs")
    good = write_folder(home / "good", suite, "good", "deployed", lambda _, one: 0.5 + 0.3 * one.number, line_to_goal)
    bad = write_folder(home / "bad", suite, HOSTILE, "mapless", lambda _, __: 0.0, line_to_goal)
    return [LabNavEvaluation.read(folder) for folder in (good, bad)]


@pytest.fixture(scope="module")
def site(evaluations, tmp_path_factory):
    return site_of(with_published(evaluations, ()), "labnav-people-2", tmp_path_factory.mktemp("home"))


def unpacked(flat, width):
    return np.cumsum(np.array(flat).reshape(-1, width), axis=0)


def test_routes_unpack_to_the_recorded_ones(evaluations):
    route = next(iter(evaluations[0].routes.values()))
    packed_up = packed_route(route)
    poses = unpacked(packed_up["poses"], 3)
    assert np.abs(poses[:, :2] / 100.0 - np.array(route)[:, :2]).max() <= 0.005 + 1e-9
    assert np.abs(np.radians(poses[:, 2]) - np.array(route)[:, 2]).max() < 0.01
    assert packed_up["seconds"] == pytest.approx((len(route) - 1) * 0.1)
    long = packed_route([(0.001 * k, 0.0, 0.0) for k in range(5000)])
    assert len(long["poses"]) <= 3 * 402
    assert unpacked(long["poses"], 3)[-1][0] == 500


def test_angles_are_continuous_where_the_heading_passes_pi():
    turns = unpacked(packed_route([(0.0, 0.0, 3.1), (0.0, 0.0, -3.1)])["poses"], 3)[:, 2]
    assert abs(turns[1] - turns[0]) < 10


def test_every_drive_of_a_folder_has_a_route_and_people_at_the_same_times(site, evaluations):
    assert {one["key"] for one in site.shown.episodes} == set(evaluations[0].scores)
    for episode in site.shown.episodes:
        for run in episode["runs"]:
            people = run["people"]
            count = len(people["places"]) // (2 * len(people["yields"]))
            assert (count - 1) * people["dt"] == pytest.approx(run["route"]["seconds"], abs=people["dt"])


def test_a_route_of_more_poses_than_any_drive_is_not_shown(evaluations, tmp_path):
    entry = Entry.driven(evaluations[0])
    key = next(iter(entry.outcomes))
    endless = Entry(**{**vars_of(entry), "routes": {key: [(0.0, 0.0, 0.0)] * 20_000}})
    shown = {one["key"]: one["runs"][0] for one in episodes_shown([endless], "labnav-people-2", tmp_path).episodes}
    assert "route" not in shown[key]
    assert "people" not in shown[key]


def test_people_start_where_the_episode_has_them(site, suite):
    episodes = {f"people-2/{one.key}": one for one in suite.parts[0].episodes}
    for shown in site.shown.episodes:
        roles = episodes[shown["key"]].conditions["people"]["people"]
        people = shown["runs"][0]["people"]
        starts = np.array(people["places"][: 2 * len(roles)]).reshape(-1, 2) / 100.0
        assert np.abs(starts - np.array([role["start"] for role in roles])).max() <= 0.005 + 1e-9
        assert people["yields"] == [int(role["yields"]) for role in roles]


def test_a_hostile_label_is_text_and_the_data_is_one_element(site):
    page = render_site(site)
    assert "<img" not in page
    data = page.split('<script type="application/json" id="data">')[1].split("</script>")[0]
    assert HOSTILE in json.loads(data)["policies"]
    assert "<" not in data
    assert embedded({"a": "</SCRIPT><!--"}).count("<") == 0


def test_learned_policies_come_first_and_each_track_apart(evaluations):
    entries = [Entry.driven(evaluations[0].named(name)) for name in ("a", "b", "c")]
    kinds = ("reference", "learned", "classical")
    entries = [Entry(**{**vars_of(one), "kind": kind}) for one, kind in zip(entries, kinds, strict=True)]
    assert [one.kind for one in ranked_entries(entries)] == ["learned", "classical", "reference"]


def vars_of(entry):
    return {name: getattr(entry, name) for name in Entry.__dataclass_fields__}


def test_every_built_in_policy_has_a_kind():
    kinds = {name: kind_of_policy(name) for name in BUILT_IN}
    assert "other" not in kinds.values()
    assert {name for name, entry in BUILT_IN.items() if entry.extra == "train"} <= {
        name for name, kind in kinds.items() if kind == "learned"
    }
    assert (kinds["clairvoyant"], kinds["stack"]) == ("reference", "classical")
    assert kind_of_policy("mine.onnx") == "learned"
    assert kind_of_policy("mine:Mine") == "other"


def test_published_results_of_the_same_episodes_are_rows_without_routes(evaluations):
    ours = LabNavResult.of(evaluations[0].folder)
    other = ours.model_copy(
        update={
            "summary": ours.summary.model_copy(update={"policy": "other"}),
            "outcomes": tuple(one.model_copy(update={"score": 0.25}) for one in ours.outcomes),
        }
    )
    entries = with_published(evaluations, [ours, other])
    assert sorted(one.name for one in entries if one.published) == ["other"]  # ours is in a folder already
    published = next(one for one in entries if one.published)
    assert not published.routes
    assert set(published.scores.values()) == {0.25}
    changed = ours.model_copy(update={"outcomes": other.outcomes})
    assert "good (published)" in [one.name for one in with_published(evaluations, [changed])]


def test_results_of_other_suites_are_left_out(evaluations):
    foreign = [one for one in published_results() if all(task.task != "people" for task in one.summary.tasks)]
    ours = LabNavResult.of(evaluations[0].folder)
    elsewhere = ours.model_copy(
        update={
            "summary": ours.summary.model_copy(
                update={
                    "policy": "elsewhere",
                    "tasks": tuple(
                        task.model_copy(update={"suite": "labnav-people-2/9"}) for task in ours.summary.tasks
                    ),
                }
            )
        }
    )
    assert not [one for one in with_published(evaluations, [elsewhere, *foreign]) if one.published]


def test_the_choice_of_episodes_shows_every_way_to_fail(evaluations):
    entry = Entry.driven(evaluations[0])
    keys = [f"{task}-2/floor-{number}/0" for task in ("aisle", "glass") for number in range(40)]
    rare = {keys[17]: "stuck", keys[55]: "lost", keys[71]: "frozen"}
    outcome = next(iter(entry.outcomes.values()))
    outcomes = {
        key: outcome.model_copy(update={"key": key, "ending": rare.get(key, "contact"), "score": 0.0}) for key in keys
    }
    one = Entry(**{**vars_of(entry), "outcomes": outcomes})
    picked = chosen([one], keys, 12)
    assert set(rare) <= set(picked)
    assert len(picked) <= 12
    assert picked == [key for key in keys if key in picked]
    assert chosen([one], keys[:5], 12) == keys[:5]


def test_changes_of_the_map_and_glass_are_named_in_words():
    for task, kinds in (("moved", {"added", "movable", "gone", "shut", "opened"}), ("glass", {"glass"})):
        part = published_episodes(task, 2)
        episode = part.episodes[0]
        layout = part.layout(episode.floor)
        world = world_of_episode(prepared(task, 2, episode, layout))
        assert world["changes"]
        assert {change[0] for change in world["changes"]} <= kinds
        assert not any("_" in change[1] for change in world["changes"])
        plan = plan_of_map(layout)
        names = " ".join(f"{item[7]} {item[8]}" for item in plan["items"])
        assert "_" not in names
        assert len(plan["items"]) == sum(1 for one in layout.placements if one.support == "floor")


def test_the_shortest_path_leads_from_the_start_to_the_goals():
    part = published_episodes("shift", 2)
    episode = part.episodes[0]
    world = world_of_episode(prepared("shift", 2, episode, part.layout(episode.floor)))
    path = np.array(world["path"]).reshape(-1, 2)
    assert np.abs(path[0] - world["start"][:2]).max() <= 1
    assert len(world["goals"]) == len(episode.lengths)
    assert np.linalg.norm(path[-1] - world["goals"][-1][:2]) <= 36 + 2


def test_places_and_things_are_named_in_words():
    assert place_name("RotaryEvaporatorStation") == "rotary evaporator station"
    assert place_name("entry-2") == "exit 2"
    assert place_name("anywhere") == ""
    assert thing_name("SmallCarton_3") == "small carton"
    assert thing_name("person 2") == "person 2"


def test_a_film_in_the_folder_is_linked(evaluations, tmp_path):
    entry = Entry.driven(evaluations[0])
    key = next(iter(entry.outcomes))
    film = evaluations[0].folder / "films" / (key.replace("/", "_") + ".mp4")
    film.parent.mkdir()
    film.write_bytes(b"film")
    try:
        shown = episodes_shown([entry], "labnav-people-2", tmp_path)
        links = {one["key"]: one["runs"][0].get("film") for one in shown.episodes}
    finally:
        film.unlink()
        film.parent.rmdir()
    assert (tmp_path / links.pop(key)).resolve() == film.resolve()
    assert set(links.values()) == {None}


def test_pairs_are_the_paired_differences_the_better_first(site):
    (pair,) = site.pairs
    assert (pair.first.entry.name, pair.second.entry.name) == ("good", HOSTILE)
    assert pair.value == pytest.approx(65.0)
    assert pair.apart == (pair.low > 0.0 or pair.high < 0.0)
    assert pair.episodes == 6


def test_a_report_of_one_folder_has_no_pairs(evaluations):
    report_labnav([evaluations[0].folder], published=())
    page = (evaluations[0].folder / "report.html").read_text()
    assert 'id="pairs"' not in page
    assert "good" in page


def test_the_site_of_published_results_is_one_small_file(tmp_path):
    results = published_results()
    page = write_leaderboard(tmp_path / "site", results)
    text = page.read_text()
    assert page.name == "index.html"
    assert page.stat().st_size < 5_000_000
    assert all(one.summary.policy in text for one in results)
    with pytest.raises(OptionError, match="no results of LabNav are published"):
        write_leaderboard(tmp_path / "none", ())


def test_a_folder_of_an_unknown_task_is_refused_in_one_line(evaluations, tmp_path, capsys):
    folder = tmp_path / "odd"
    folder.mkdir()
    for name in ("episodes.jsonl", "routes.jsonl", "times.jsonl"):
        (folder / name).write_text("")
    summary = json.loads((Path(evaluations[0].folder) / "summary.json").read_text())
    summary["tasks"][0]["task"] = "cooking"
    (folder / "summary.json").write_text(json.dumps(summary))
    assert main(["report", str(folder)]) == 2
    error = capsys.readouterr().err
    assert "'cooking'; the tasks of LabNav are aisle" in error
    assert error.count("\n") == 1


def test_model_cards_become_html_without_links_and_markup_of_their_text():
    text = "# ppo: lidar\n\nUses `a<b>` and **bold**,\nsee [page](http://x).\n\n![plot](x.png)\n\n"
    html = card_html(text + "| A | B |\n| --- | ---: |\n| <i>x</i> | 2 |\n\n- one\n  more\n- two\n\n```\na <b>\n```\n")
    assert html.split("\n") == [
        "<h4>ppo: lidar</h4>",
        "<p>Uses <code>a&lt;b&gt;</code> and <b>bold</b>, see page.</p>",
        '<div class="scroll"><table><thead><tr><th scope="col">A</th><th scope="col">B</th></tr></thead>'
        '<tbody><tr><th scope="row">&lt;i&gt;x&lt;/i&gt;</th><td>2</td></tr></tbody></table></div>',
        "<ul><li>one more</li><li>two</li></ul>",
        "<pre>a &lt;b&gt;</pre>",
    ]


def test_every_policy_with_a_model_card_shows_it():
    cards = {name: card_of(name) for name in BUILT_IN}
    shown = {name: card_html(path.read_text("utf-8")) for name, path in cards.items() if path is not None}
    assert {"ppo", "ppo-depth", "navdp", "iplanner"} <= set(shown)
    assert all("<h4>Results</h4>" in html and "<img" not in html and "<a " not in html for html in shown.values())


def test_packed_tables_are_the_differences_of_hundredths():
    assert packed(np.array([[1.0, 2.0], [1.01, 1.98]])) == [100, 200, 1, -2]
