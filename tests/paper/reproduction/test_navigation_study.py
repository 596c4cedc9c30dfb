"""Navigation before and after refinement: every transition is a row, driven or not; differences are paired."""

from __future__ import annotations

from itertools import pairwise

import pytest

from labgym.cli import main
from labgym.errors import OptionError, UnknownNameError
from labgym.layouts import load_published
from labgym.layouts.method import Method
from labgym.layouts.moves import descendants
from labgym.paper.reproduction import drives
from labgym.paper.reproduction.cases import StudyVariant
from labgym.paper.reproduction.drives import StudyDriveRow
from labgym.paper.reproduction.everything import reproduce_all
from labgym.paper.reproduction.figures import PublishedFigures
from labgym.paper.reproduction.navigation import NavigationStudy
from labgym.paper.reproduction.protocols import ProtocolsStudy
from labgym.paper.reproduction.scope import scope_of
from labgym.paper.reproduction.study import parse_rows
from labgym.protocols import protocols

PROTOCOL = protocols()["sub_01"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """One laboratory of the solver, by astar: 2 s."""
    folder = tmp_path_factory.mktemp("reproduce") / "navigation"
    study = NavigationStudy(("astar",), "solver", (PROTOCOL,), range(1))
    reproduce_all((study,), folder, progress=False)
    return folder


def test_each_transition_is_driven_in_each_state(folder):
    rows = parse_rows((folder / "navigation/rows.jsonl").read_bytes(), StudyDriveRow)
    moves = list(pairwise(PROTOCOL.route))
    for variant in ("proposal", "before", "after"):
        own = [row for row in rows if row.variant == variant]
        assert [(row.start, row.goal) for row in own] == moves
        assert all(row.driven and row.path and row.success and row.spl > 0.9 for row in own)


def test_the_index_links_to_the_study_and_shows_its_table(folder):
    html = (folder / "index.html").read_text()
    assert 'href="navigation/index.html"' in html
    assert "iPlanner (w/o nav. opt.)" in html


def test_a_transition_to_a_place_that_is_missing_is_a_failure(monkeypatch):
    whole = load_published("test", "test-sub_01")
    (bench,) = (p.id for p in whole.placements if p.asset == "PreparationBench")
    removed = {bench, *descendants(whole, bench)}
    layout = whole.replace(placements=tuple(p for p in whole.placements if p.id not in removed))
    monkeypatch.setattr(drives, "layout_of", lambda *_: (layout, layout))
    output = drives.drive_case(
        "astar", "astar", (StudyVariant("raw", "raw", Method()),), PROTOCOL, 0, "without the bench"
    )
    rows = parse_rows(next(iter(output.files.values())), StudyDriveRow)
    assert [(row.start, row.goal) for row in rows] == list(pairwise(PROTOCOL.route))
    for row in rows:
        lost = "PreparationBench" in (row.start, row.goal)
        assert (row.driven, row.success, row.spl > 0.9) == (not lost,) * 3


def row(
    variant: str, protocol: str, success: bool, spl: float, contacts: int = 0, policy: str = "astar"
) -> StudyDriveRow:
    return StudyDriveRow(
        policy=policy,
        variant=variant,
        protocol=protocol,
        seed=0,
        index=0,
        start="a",
        goal="b",
        driven=True,
        path=success,
        success=success,
        spl=spl,
        contacts=contacts,
    )


def test_differences_are_paired_by_transition():
    study = NavigationStudy(("astar",), "solver", (PROTOCOL,), range(1))
    rows = [row("before", f"p{k}", k > 3, 0.5 * (k > 3)) for k in range(6)]
    rows += [row("after", f"p{k}", True, 1.0, contacts=k % 2) for k in range(5)]
    rows += [row("proposal", "p0", False, 0.0)]
    table, differences = study.figures(rows).tables
    means = {line.name: line.cells for line in table.lines}
    assert means["astar, without refinement"]["sr"].value == pytest.approx(2 / 6, abs=1e-6)
    assert means["astar, with refinement"]["free"].value == pytest.approx(3 / 5)
    first, second = differences.lines
    assert first.cells["sr"].value == pytest.approx(4 / 5)
    assert first.cells["spl"].value == pytest.approx((4 * 1.0 + 0.5) / 5)
    assert first.cells["sr"].low is not None
    assert (second.cells["sr"].value, second.cells["sr"].low) == (1.0, None)


def test_policies_are_compared_with_the_first_in_refined_laboratories():
    study = NavigationStudy(("astar", "straight"), "solver", (PROTOCOL,), range(1))
    rows = [row("after", f"p{k}", True, 1.0) for k in range(6)]
    rows += [row("after", f"p{k}", k > 1, 0.5 * (k > 1), policy="straight") for k in range(6)]
    line = study.figures(rows).tables[1].lines[-1]
    assert line.name == "straight minus astar, with refinement"
    assert line.cells["sr"].value == pytest.approx(-2 / 6, abs=1e-6)
    assert line.cells["spl"].value == pytest.approx((-2 - 4 * 0.5) / 6, abs=1e-6)


def test_policies_of_files_have_the_names_of_the_files():
    study = NavigationStudy(("astar", "runs/ppo-empty.safetensors"), "solver", (PROTOCOL,), range(1))
    assert [shard.name for shard in study.shards()] == ["astar/sub_01-0", "ppo-empty/sub_01-0"]
    with pytest.raises(OptionError, match="two have the same name"):
        NavigationStudy(("a/x.onnx", "b/x.onnx"), "solver", (PROTOCOL,), range(1)).shards()


def test_the_size_of_a_study():
    assert [p.id for p in scope_of("comparison", False).protocols] == sorted(protocols())
    quick = scope_of("comparison", True, seed=5)
    assert (list(quick.seeds), len(quick.protocols)) == ([5], len({p.id for p in quick.protocols}))
    assert list(scope_of("ablation", False, ["sub_01"], 3, 2).seeds) == [3, 4]
    with pytest.raises(UnknownNameError):
        scope_of("ablation", False, ["sub_99"])
    for arguments in ({"count": 0}, {"seed": -1}, {"names": ["sub_01", "sub_01"]}):
        with pytest.raises(OptionError):
            scope_of("ablation", False, **arguments)


def test_the_command_takes_protocols_seeds_and_policies(tmp_path, capsys):
    words = ["reproduce", "navigation", "--protocols", "sub_01", "--seeds", "1", "--policies", "nobody"]
    assert main([*words, "--out", str(tmp_path / "x")]) == 2
    assert "nobody" in capsys.readouterr().err
    assert main(["reproduce", "comparison", "--seeds", "0", "--out", str(tmp_path / "x")]) == 2


def test_all_studies_write_their_pages(tmp_path):
    (figures,) = reproduce_all((ProtocolsStudy(),), tmp_path / "all", progress=False, remarks=("A remark.",))
    assert figures == PublishedFigures.load(tmp_path / "all/protocols/figures.json")
    assert "A remark." in (tmp_path / "all/index.html").read_text()
