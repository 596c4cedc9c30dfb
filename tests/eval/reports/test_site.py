"""The site of LabNav: what its data holds, and that hostile names do no harm."""

from __future__ import annotations

import json
import math
import re
from collections import Counter
from functools import partial
from html.parser import HTMLParser
from itertools import combinations, cycle, islice
from pathlib import Path
from statistics import fmean
from typing import get_args

import numpy as np
import pytest
import shapely
from labnav_folders import line_to_goal, write_folder
from laboratories import island_laboratory

from labgym.artefacts import artefacts
from labgym.assets.model import Size
from labgym.cli import main
from labgym.envs.labnav.episodes import published_episodes
from labgym.envs.labnav.nuisances import prepared
from labgym.errors import OptionError
from labgym.eval.driving.episode_row import Ending
from labgym.eval.labnav.evaluation import LabNavEvaluation
from labgym.eval.labnav.shown_drive import packed, shown_route
from labgym.eval.labnav.suites import LabNavSuite
from labgym.eval.leaderboard.labnav import LabNavResult, published_results
from labgym.eval.reports.labnav_report import report_labnav, write_leaderboard
from labgym.eval.reports.site.entries import (
    Entry,
    card_of,
    kind_of_policy,
    ranked_entries,
    short_commit,
    with_published,
)
from labgym.eval.reports.site.episodes import chosen, episodes_shown
from labgym.eval.reports.site.notes import MEANINGS, card_html, detail_of
from labgym.eval.reports.site.page import embedded, render_site, site_of
from labgym.eval.reports.site.plans import place_name, plan_of_map, thing_name, world_of_episode
from labgym.layouts import load_published
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


@pytest.fixture(scope="module")
def published_page(tmp_path_factory):
    return write_leaderboard(tmp_path_factory.mktemp("published") / "site")


def unpacked(flat, width):
    return np.cumsum(np.array(flat).reshape(-1, width), axis=0)


def test_routes_unpack_to_the_recorded_ones(evaluations):
    route = next(iter(evaluations[0].routes.values()))
    shown = shown_route(route)
    poses = unpacked(shown.poses, 3)
    assert np.abs(poses[:, :2] / 100.0 - np.array(route)[:, :2]).max() <= 0.005 + 1e-9
    assert np.abs(np.radians(poses[:, 2]) - np.array(route)[:, 2]).max() < 0.01
    assert shown.seconds == pytest.approx((len(route) - 1) * 0.1)
    long = shown_route([(0.001 * k, 0.0, 0.0) for k in range(5000)])
    assert len(long.poses) <= 3 * 402
    assert unpacked(long.poses, 3)[-1][0] == 500


def test_angles_are_continuous_where_the_heading_passes_pi():
    turns = unpacked(shown_route([(0.0, 0.0, 3.1), (0.0, 0.0, -3.1)]).poses, 3)[:, 2]
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


def test_policies_are_ranked_by_the_figure_within_their_track():
    entries = ranked_entries([Entry.of_result(one) for one in published_results()])
    tracks = [one.summary.track for one in entries]
    assert tracks == sorted(tracks, key=["deployed", "mapless", "privileged"].index)
    for track in set(tracks):
        figures = [one.summary.headline.value for one in entries if one.summary.track == track]
        assert figures == sorted(figures, reverse=True)


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
    mine = next(one for one in entries if not one.published)
    assert (detail_of(published, 6, True), detail_of(mine, 6, True)) == ("lidar, published", "lidar")
    assert detail_of(published, 300, False) == "lidar, 6 episodes a task"
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


def test_the_bars_of_pairs_share_a_scale_that_holds_0_and_every_interval(site):
    (pair,) = site.pairs
    places = [site.along(value) for value in (0.0, pair.low, pair.value, pair.high)]
    assert all(0.0 <= place <= 100.0 for place in places)
    assert places[1] < places[2] < places[3]
    assert (places[2] - places[0]) / pair.value == pytest.approx((places[3] - places[1]) / (pair.high - pair.low))


def test_pairs_that_the_figure_orders_differently_are_named(published_page):
    entries = [Entry.of_result(one) for one in published_results()]
    figures = {one.name: one.summary.headline.value for one in entries}
    scores = {one.name: one.scores for one in entries}
    other = set()
    for a, b in combinations(figures, 2):
        shared = scores[a].keys() & scores[b].keys()
        difference = fmean(scores[a][key] for key in shared) - fmean(scores[b][key] for key in shared)
        if difference * (figures[a] - figures[b]) < 0.0:
            other.add(frozenset((a, b)))
    sentence = published_page.read_text().partition("orders these pairs the other way round: ")[2].partition(".")[0]
    assert {frozenset(words.split(" and ")) for words in sentence.split(", ") if words} == other


def test_a_report_of_one_folder_has_no_pairs(evaluations):
    report_labnav([evaluations[0].folder], published=())
    page = (evaluations[0].folder / "report.html").read_text()
    assert 'id="pairs"' not in page
    assert "good" in page


def test_the_site_of_published_results_is_one_small_file(published_page, tmp_path):
    text = published_page.read_text()
    assert published_page.name == "index.html"
    assert published_page.stat().st_size < 5_000_000
    assert not re.search(r"(?:src|href)=\W*(?:https?:)?//|@import|url\(", text)
    assert all(one.summary.policy in text for one in published_results())
    with pytest.raises(OptionError, match="no results of LabNav are published"):
        write_leaderboard(tmp_path / "none", ())


class Board(HTMLParser):
    """The rows of the leaderboard: kind, attributes of the cells by their labels, and text."""

    def __init__(self, text):
        super().__init__()
        self.rows, self._row, self._name = {}, None, None
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        values = dict(attributes)
        if tag == "tr":
            self._row = {"kind": values["data-kind"], "words": ""} if "data-kind" in values else None
        if self._row is not None and values.get("scope") == "row":
            self.rows[values["data-value"]] = self._row
        if self._row is not None and "data-label" in values:
            self._row[values["data-label"]] = float(values["data-value"])

    def handle_data(self, data):
        if self._row is not None:
            self._row["words"] += f" {data}"


def test_the_leaderboard_has_the_figures_of_the_published_files(published_page):
    rows = Board(published_page.read_text()).rows
    files = [json.loads(path.read_text()) for path in (artefacts("eval") / "leaderboard" / "labnav").glob("*.json")]
    assert rows.keys() == {one["summary"]["policy"] for one in files}
    most = max(task["episodes"] for one in files for task in one["summary"]["tasks"])
    for one in files:
        row, tasks = rows[one["summary"]["policy"]], one["summary"]["tasks"]
        scores = {task["task"]: [] for task in tasks}
        for outcome in one["outcomes"]:
            scores[outcome["key"].partition("-")[0]].append(outcome["score"])
        means = {task: fmean(values) for task, values in scores.items()}
        assert {task: row[task] for task in means} == pytest.approx({task: 100 * mean for task, mean in means.items()})
        labnav = 100 * (math.exp(fmean(math.log(mean + 0.05) for mean in means.values())) - 0.05)
        assert row["LabNav"] == pytest.approx(labnav, abs=1e-6)
        assert row["Mean"] == pytest.approx(100 * fmean(means.values()))
        counts = [task["episodes"] for task in tasks]
        for label, quantity in (("SR", "success"), ("Collision rate", "contacts")):
            whole = sum(task[quantity]["value"] * count for task, count in zip(tasks, counts, strict=True))
            assert row[label] == pytest.approx(whole / sum(counts))
        assert one["summary"]["sensors"] in row["words"]
        assert (f"{max(counts)} episodes a task" in row["words"]) == (max(counts) < most)


def test_a_task_has_the_endings_of_its_episodes_the_best_policy_first(site, evaluations):
    (board,) = site.boards
    assert board.name == "people-2"
    assert [one.entry.name for one, _ in board.rows] == ["good", HOSTILE]
    for one, line in board.rows:
        rows = next(each for each in evaluations if each.name == one.entry.name).rows
        assert {name: count for name, count, _ in line.endings if count} == Counter(row.ending for row in rows)
        assert line.episodes == len(rows)
    assert board.endings == ("success", "contact")
    assert board.episode == "#e0"


def test_any_number_of_policies_has_rows_sections_and_looks_of_their_own(tmp_path, monkeypatch):
    monkeypatch.setattr("labgym.eval.reports.site.page.episodes_shown", partial(episodes_shown, most=2))
    results = published_results()
    more = [
        one.model_copy(update={"summary": one.summary.model_copy(update={"policy": f"another-policy-{number}"})})
        for number, one in enumerate(islice(cycle(results), 21 - len(results)))
    ]
    entries = ranked_entries([Entry.of_result(one) for one in [*results, *more]])
    site = site_of(entries, "labnav", tmp_path)
    assert len(entries) == len({one.look for one in site.sections}) == 21
    page = render_site(site)
    assert Board(page).rows.keys() == {one.name for one in entries}
    assert page.count('<article class="policy"') == 21
    assert len(site.pairs) == 21 * 20 // 2


def test_the_viewer_says_how_many_episodes_it_has_and_which(site, published_page):
    assert site.choice == ""
    text = published_page.read_text()
    data = json.loads(text.split('id="data">')[1].split("</script>")[0])
    driven = {outcome.key for result in published_results() for outcome in result.outcomes}
    assert f"{len(data['episodes'])} of {len(driven)} episodes: of each task" in text


def test_a_commit_with_changes_stays_marked(evaluations):
    commit = "0123456789abcdef0123456789abcdef01234567"
    assert (short_commit(commit), short_commit(f"{commit}-dirty")) == ("0123456789ab", "0123456789ab-dirty")
    result = next(one for one in published_results() if len(one.summary.tasks) == 8)
    labels = [task.suite for task in result.summary.tasks]
    commits = dict.fromkeys(labels, (commit,)) | {labels[2]: (f"{commit}-dirty",)}
    words = Entry.of_result(result.model_copy(update={"commits": commits})).commit_words
    assert words.endswith(f"0123456789ab-dirty ({result.summary.tasks[2].task})")
    same = Entry.of_result(result.model_copy(update={"commits": dict.fromkeys(labels, (commit,))}))
    assert same.commit_words == "0123456789ab"


def test_the_page_explains_each_ending_as_the_documentation_does(site):
    page = render_site(site)
    text = (Path(__file__).parents[3] / "docs" / "labnav.md").read_text()
    table = text.split("## How episodes end")[1].split("## ")[0]
    documented = [line.split("|")[1].strip() for line in table.splitlines() if line.startswith("| ")][1:]
    assert list(MEANINGS) == list(get_args(Ending)) == documented
    assert all(f"<dt>{ending}</dt>" in page for ending in documented)


def test_names_of_spaces_stand_on_free_floor():
    layout = load_published("floors-test", "floors-test-0005")
    boxes = [layout.box(each.id) for each in layout.placements if each.support == "floor"]
    furniture = shapely.union_all([shapely.Polygon(box.corners()) for box in boxes])
    names = plan_of_map(layout)["names"]
    assert len(names) == len(layout.floor.spaces)
    for x, y, _, width in names:
        line = shapely.box((x - width / 2) / 100, y / 100 - 0.14, (x + width / 2) / 100, y / 100 + 0.14)
        assert width > 0
        assert shapely.intersection(line, furniture).area < 0.02


def test_a_room_without_free_floor_is_named_in_its_middle():
    layout = island_laboratory()
    cover = next(each for each in layout.placements if each.support == "floor")
    size = Size(width=9.0, depth=7.0, height=0.9)
    full = layout.replace(
        placements=(cover.model_copy(update={"position": (4.0, 3.0, 0.0), "yaw": 0.0, "size": size}),)
    )
    ((x, y, _, width),) = plan_of_map(full)["names"]
    assert abs(x - 400) <= 50
    assert 100 <= y <= 500
    assert width > 0


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
    assert "LabNav task 'cooking' not found; available: aisle" in error
    assert error.count("\n") == 1


def test_model_cards_become_html_without_links_and_markup_of_their_text():
    text = "# ppo: lidar\n\nUses `a<b>` and **bold**,\nsee [page](http://x).\n\n![plot](x.png)\n\n"
    html = card_html(
        text + "| A | B | C |\n| --- | ---: | --- |\n| <i>x</i> | 2 | y |\n\n- one\n  more\n- two\n\n```\na <b>\n```\n"
    )
    assert html.split("\n") == [
        "<h4>ppo: lidar</h4>",
        "<p>Uses <code>a&lt;b&gt;</code> and <b>bold</b>, see page.</p>",
        '<div class="scroll" tabindex="0"><table><thead><tr><th scope="col">A</th><th scope="col">B</th>'
        '<th scope="col" class="words">C</th></tr></thead>'
        '<tbody><tr><th scope="row">&lt;i&gt;x&lt;/i&gt;</th><td>2</td><td class="words">y</td></tr></tbody>'
        "</table></div>",
        "<ul><li>one more</li><li>two</li></ul>",
        "<pre>a &lt;b&gt;</pre>",
    ]


def test_every_policy_with_a_model_card_shows_it():
    cards = {name: card_of(name) for name in BUILT_IN}
    shown = {name: card_html(path.read_text("utf-8")) for name, path in cards.items() if path is not None}
    assert {"ppo", "ppo-depth", "navdp", "iplanner"} <= set(shown)
    assert all("<h4>Results</h4>" in html and "<img" not in html and "<a " not in html for html in shown.values())


def test_packed_tables_are_the_differences_of_hundredths():
    assert packed(np.array([[1.0, 2.0], [1.01, 1.98]])) == (100, 200, 1, -2)
