"""`labgym report` and `labgym compare` on folders of LabNav."""

from __future__ import annotations

import json
import re
from html.parser import HTMLParser

import pytest
from labnav_folders import write_folder

from labgym.cli import main
from labgym.envs.labnav.episodes import published_episodes
from labgym.errors import OptionError
from labgym.eval.labnav.evaluation import LabNavEvaluation
from labgym.eval.labnav.figure import paired_difference
from labgym.eval.labnav.suites import LabNavSuite
from labgym.eval.labnav.summary import classes
from labgym.eval.reports.comparison import Comparison, chosen_evaluations, compare
from labgym.eval.reports.labnav_report import report_labnav
from labgym.eval.reports.labnav_tables import labnav_tables

TASKS = ("aisle", "people")


@pytest.fixture(scope="module")
def suite():
    return LabNavSuite("labnav-aisle-2", tuple(published_episodes(task, 2).first(6, 2) for task in TASKS))


@pytest.fixture
def folders(tmp_path, suite):
    good = write_folder(tmp_path / "good", suite, "good", "deployed", lambda _, one: 0.8 + 0.1 * one.number)
    bad = write_folder(tmp_path / "bad", suite, "bad", "mapless", lambda part, _: 0.1 if part.task == "aisle" else 0.0)
    best = write_folder(tmp_path / "best", suite, "best", "privileged", lambda _, __: 0.95)
    return good, bad, best


class Page(HTMLParser):
    def __init__(self, text):
        super().__init__()
        self.open, self.links, self.scripts = [], [], []
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        self.links += [value for name, value in attributes if name in ("src", "href")]
        if tag == "script":
            self.scripts.append("")
        if tag not in ("meta", "img", "br", "input"):
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, text):
        if self.open and self.open[-1] == "script":
            self.scripts[-1] += text


def test_the_report_has_a_table_for_each_track_and_what_differs(folders):
    tables, paths, problems = report_labnav(folders, published=())
    titles = [table.title for table in tables]
    assert [title.split(":")[0] for title in titles[:3]] == ["Deployed", "Mapless", "Privileged"]
    assert tables[0].rows[0][:2] == ("good", "85.0")
    pairs = next(table for table in tables if table.title.startswith("Differences"))
    assert [cells[0] for cells in pairs.rows] == ["best - good", "best - bad", "good - bad"]
    assert [cells[-1] for cells in pairs.rows[1:]] == ["yes", "yes"]
    endings = next(table for table in tables if table.title.startswith("How"))
    assert endings.columns == ("policy", "success", "contact")
    assert endings.rows[-1] == ("bad", "12", "12")
    assert {path.name for path in paths} == {"tables.txt", "tables.md", "report.html"}
    assert all("manifest.json is missing" in problem for problem in problems)


def test_the_page_is_whole_and_loads_nothing_from_elsewhere(folders):
    report_labnav(folders[:2], published=())
    page = Page((folders[0] / "report.html").read_text())
    assert page.open == []
    assert {"#leaderboard", "#policies", "#episodes", "#pairs", "#p0", "#p1"} <= set(page.links)
    assert all(link.startswith("#") for link in page.links)
    data = json.loads(page.scripts[0])
    assert data["policies"] == ["good", "bad"]
    driven = set(LabNavEvaluation.read(folders[0]).scores)
    assert {one["key"] for one in data["episodes"]} == {key for key in driven if key.startswith("aisle-2/")}


def test_difficulty_is_computed_from_the_rows(folders):
    evaluation = LabNavEvaluation.read(folders[0])
    people = [each.score for each in evaluation.rows if each.task == "people"]
    assert evaluation.summary.by_task["people-2"].by_met == {"1 or 2": (pytest.approx(sum(people) / 12), 12)}
    assert evaluation.summary.by_task["aisle-2"].by_met == {}
    met = next(
        table for table in labnav_tables([evaluation]) if "necks" in table.title.lower() or "Short" in table.title
    )
    counts = [int(number) for number in re.findall(r"\((\d+)\)", " ".join(met.rows[0]))]
    assert sum(counts) == len(evaluation.rows)


def test_classes_are_in_the_order_of_difficulty(folders):
    rows = LabNavEvaluation.read(folders[0]).rows[:5]
    names = iter([">= 15 m", "< 10 m", "10 to 15 m", "< 10 m", ">= 15 m"])
    assert list(classes(rows, lambda _: next(names))) == ["< 10 m", "10 to 15 m", ">= 15 m"]
    assert list(classes(rows[:3], lambda one: {0: "3 and more", 1: "0"}.get(one.number, "1 or 2"))) == [
        "0",
        "3 and more",
    ]


def test_a_comparison_is_the_paired_difference_of_all_and_of_each_task(folders, tmp_path, capsys):
    good, bad, _ = folders
    comparison = compare(*chosen_evaluations([good, bad]))
    scores = [LabNavEvaluation.read(each).scores for each in (good, bad)]
    assert comparison.groups[0].metrics["score"] == paired_difference(*scores)
    tasks = {one.name: one for one in comparison.groups if one.grouping == "task"}
    assert list(tasks) == ["aisle-2", "people-2"]
    assert tasks["people-2"].metrics["score"].difference.value == pytest.approx(0.85)
    assert tasks["people-2"].metrics["success"].difference.value == 1.0
    assert tasks["people-2"].metrics["contacts"].difference.value == -1.0
    out = tmp_path / "comparison.json"
    assert main(["compare", str(good), str(bad), "--out", str(out)]) == 1  # no manifest
    assert Comparison.load(out) == comparison
    assert "good - bad, by task" in capsys.readouterr().out


def test_folders_of_different_episodes_are_not_reported_together(folders, suite, tmp_path):
    other = LabNavSuite("labnav-aisle-2", suite.parts[:1])
    folder = write_folder(tmp_path / "other", other, "other", "mapless", lambda _, __: 0.5)
    with pytest.raises(OptionError, match="different episodes"):
        report_labnav([folders[0], folder])
    comparison = compare(*chosen_evaluations([folders[0], folder]))
    assert comparison.a.shared == 12


def test_bad_input_is_one_line(folders, tmp_path, capsys):
    (tmp_path / "empty").mkdir()
    for words, message in (
        (["report", str(folders[0]), str(tmp_path / "empty")], "is of LabNav and"),
        (["compare", str(folders[0])], "do not name two evaluations"),
        (["compare", str(folders[0]), str(folders[1]), "--policies", "a", "b"], "policy"),
    ):
        assert main(words) == 2
        error = capsys.readouterr().err
        assert message in error
        assert error.count("\n") == 1


def test_a_folder_named_twice_counts_once(folders):
    tables, _, _ = report_labnav([folders[0], folders[0]], published=())
    assert not any(table.title.startswith("Differences") for table in tables)
