from __future__ import annotations

from html.parser import HTMLParser
from pathlib import Path

import pytest

from labgym.errors import UnknownNameError
from labgym.eval.driving.evaluation import TransitionEvaluation
from labgym.eval.driving.files import EpisodeTime
from labgym.eval.driving.intervals import Estimate
from labgym.eval.driving.navigation_metrics import metrics_of
from labgym.eval.driving.record import NavigationSummary
from labgym.eval.reports.paper import paper
from labgym.eval.reports.tables import (
    LAYOUT_COLUMNS,
    NAVIGATION_ROWS,
    layout_table,
    leaderboard,
    navigation_table,
)
from labgym.eval.scoring.layout_report import LayoutSummary, MetricMean
from labgym.suites import Suite
from labgym.table import Table, number

TABLE = Table("T", ("name", "a|b"), (("x", "1.0"), ("<long>", "-")), ("A note.",))


class Cells(HTMLParser):
    def __init__(self) -> None:
        super().__init__()
        self.rows: list[list[str]] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag == "tr":
            self.rows.append([])

    def handle_data(self, data: str) -> None:
        if self.rows:
            self.rows[-1].append(data)


def summary(**means: float | None) -> LayoutSummary:
    metrics = {
        key: MetricMean(mean=means.get(key, 0.5), count=2 if key in means else 3, nulls=1 if key in means else 0)
        for key, _, _ in LAYOUT_COLUMNS
    }
    return LayoutSummary(layouts=3, profiles=("default",), rules=("paper",), metrics=metrics)


def test_text_columns_have_one_width_and_figures_are_right_aligned():
    lines = TABLE.text().splitlines()
    assert lines[2:6] == ["name    a|b", "------  ---", "x       1.0", "<long>    -"]


def test_markdown_has_as_many_cells_in_every_row_and_escapes_bars():
    lines = TABLE.markdown().splitlines()[:4]
    assert lines[0] == "| name | a\\|b |"
    assert {line.replace("\\|", "").count("|") for line in lines} == {3}


def test_html_shows_the_cells_and_nothing_of_them_is_markup():
    parser = Cells()
    parser.feed(TABLE.html())
    assert parser.rows[0] == ["name", "a|b"]
    assert parser.rows[1] == ["x", "1.0"]
    assert parser.rows[2][0] == "<long>"


@pytest.mark.parametrize(("value", "printed"), [(None, "-"), (0.07, "0.07"), (23.2, "23.20"), (1, "1.00")])
def test_numbers_have_fixed_digits_and_a_dash_for_none(value, printed):
    assert number(value, 2) == printed


def test_the_paper_s_row_is_as_printed():
    rows = layout_table(summary()).rows
    printed = ("23.2", "0.07", "0.17", "0.833", "0.966", "0.867", "0.725", "0.801", "0.716", "0.364")
    assert rows[1] == ("LabBuilder (paper)", *printed)


def test_our_row_holds_our_means_and_says_over_how_many_layouts():
    table = layout_table(summary(flam=None, glass=0.97), name="ours")
    row = dict(zip(table.columns, table.rows[0], strict=True))
    assert row["Method"] == "ours"
    assert row["Flam ↑"] == "-"
    assert row["Glass ↑"] == "0.970"
    assert "Flam 2 of 3, Glass 2 of 3" in " ".join(table.notes)


def test_the_paper_s_tables_agree_where_they_overlap():
    # Tables 2 and 4 print the full method's figures twice.
    assert paper().layouts.row("LabBuilder") == paper().ablation.row("LabBuilder")
    assert paper().navigation.row("NavDP")["sr"] == 0.517
    with pytest.raises(UnknownNameError, match=r"available: .*Holodeck"):
        paper().layouts.row("Holodek")


def test_navigation_figures_stand_with_their_intervals_one_column_a_policy():
    sure = Estimate(value=0.5, low=0.25, high=0.75, count=4, nulls=0)
    alone = Estimate(value=0.5, low=None, high=None, count=4, nulls=0)
    none = Estimate(value=None, low=None, high=None, count=0, nulls=4)
    names = [name for name, _, _ in NAVIGATION_ROWS]
    table = navigation_table(
        {"a": dict.fromkeys(names, sure) | {"time_to_goal": none}, "b": dict.fromkeys(names, alone)}, "s/1"
    )
    rows = {row[0]: row[1:] for row in table.rows}
    assert table.columns == ("Metric", "a", "b")
    assert table.title == "Navigation, s/1, 4 episodes per policy"
    assert rows["SPL ↑"] == ("0.500 [0.250, 0.750]", "0.500")
    assert rows["Time to goal, s ↓"] == ("-", "0.50")


def evaluation_of(policy: str, **changes) -> TransitionEvaluation:
    sure = Estimate(value=0.5, low=0.25, high=0.75, count=4, nulls=0)
    summary = NavigationSummary(
        suite=Suite(name="s", split="test"),
        policy=policy,
        options={},
        seed=0,
        layouts={},
        episodes=4,
        expected=4,
        errors=0,
        unreachable=0,
        complete=True,
        metrics=dict.fromkeys(metrics_of("touchstone"), sure),
        **({"privileged": False} | changes),
    )
    return TransitionEvaluation(
        Path(policy), policy, summary, rows=(), routes={}, times={"l/0/0": EpisodeTime(key="l/0/0", planning_ms=3.0)}
    )


def test_the_leaderboard_says_what_each_policy_sees_and_ends_with_the_paper_s_rows():
    table = leaderboard([evaluation_of("a", privileged=True, sensors="lidar"), evaluation_of("b", sensors="depth")])
    assert [row[:3] for row in table.rows[:2]] == [
        ("a", "map", "0.500 [0.250, 0.750]"),
        ("b", "depth", "0.500 [0.250, 0.750]"),
    ]
    printed = {row[0]: row[1:5] for row in table.rows[2:]}
    assert table.columns[2:5] == ("Collision-free SR ↑", "SR ↑", "SPL ↑")
    assert printed["NavDP, paper"] == ("rgbd", "-", "0.517", "0.446")
    assert printed["iPlanner (w/o nav. opt.), paper"] == ("depth", "-", "0.350", "0.332")
    assert len(printed) == 4


def test_markdown_holds_no_markup_of_a_policy_s_name():
    table = Table("T", ("Policy", "SR"), (("<img src=x>|\nb", "1.0"),), ("Run <b>twice</b>.",))
    lines = table.markdown().splitlines()
    assert lines[2] == "| &lt;img src=x&gt;\\| b | 1.0 |"
    assert lines[-1] == "Run &lt;b&gt;twice&lt;/b&gt;."
