"""`generate` with other proposers, without phases, and with layouts that fail."""

from __future__ import annotations

import pickle
import warnings
from pathlib import Path
from typing import Any

import pytest
from fallible_proposer import Forgetful, Shaken

from labgym.cli import main
from labgym.errors import OptionError, UnknownNameError, UnrepairedError, UnrepairedWarning
from labgym.layouts import Layout, generate
from labgym.layouts.batch import generate_batch, read_rows
from labgym.layouts.generate import resolve_request
from labgym.layouts.method import PROPOSERS, Method, make_proposer, proposer_names
from labgym.layouts.moves import Move, apply
from labgym.layouts.refinement import refine_assessed
from labgym.layouts.rules import rule_set
from labgym.layouts.rules.objective import evaluate_layout
from labgym.layouts.rules.rule_sets import RuleSet
from labgym.layouts.trace import Recorder
from labgym.protocols import protocols

PROTOCOL = "sub_01"
AS_PROPOSED: dict[str, Any] = {"optimise": False, "refine": False}


@pytest.fixture
def shaken(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(PROPOSERS, "shaken", "fallible_proposer:Shaken")


@pytest.fixture(scope="module")
def kept() -> Layout:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UnrepairedWarning)
        return generate(PROTOCOL, 3, method=Method(proposer=Shaken(), on_failure="keep", **AS_PROPOSED))


@pytest.fixture(scope="module")
def published() -> Layout:
    return generate(PROTOCOL, 3)


def test_the_names_of_the_defaults_make_the_same_file(published: Layout) -> None:
    plain, named = published, generate(PROTOCOL, 3, method=Method(proposer="solver", adjuster="rules"))
    assert plain.to_json() == named.to_json()
    assert not {"proposer", "adjuster", "optimise", "refine", "dress"} & plain.provenance.options.keys()


def test_a_proposal_that_fails_is_an_error_that_recommends_no_room() -> None:
    with pytest.raises(UnrepairedError, match="could not be repaired") as caught:
        generate(PROTOCOL, 3, method=Method(proposer=Shaken(), **AS_PROPOSED))
    assert "preset" not in str(caught.value)
    assert "interpenetrate" in str(caught.value)
    assert caught.value.smallest_preset is None


def test_a_layout_that_is_kept_names_its_failures_and_warns(kept: Layout, tmp_path: Path) -> None:
    with pytest.warns(UnrepairedWarning, match=r"kept with \d+ violations"):
        again = generate(PROTOCOL, 3, method=Method(proposer=Shaken(), on_failure="keep", **AS_PROPOSED))
    assert again.hash == kept.hash
    assessment = evaluate_layout(kept, protocols()[PROTOCOL], navigation=True)
    failures = kept.provenance.options["failures"]
    assert assessment.v > 1
    assert (failures["v"], failures["facility"]) == (assessment.v, len(assessment.errors))
    assert failures["violations"] == [violation.message for violation in assessment.violations.items][:50]
    assert tuple(failures["missing"]) == assessment.missing
    assert Layout.load(kept.save(tmp_path / "kept.json")) == kept


def test_provenance_records_how_the_layout_was_made(kept: Layout) -> None:
    options = kept.provenance.options
    assert kept.provenance.generator == "Shaken"
    assert (options["proposer"], options["optimise"], options["refine"]) == ("Shaken", False, False)
    assert options["on_failure"] == "keep"


def test_without_phases_the_layout_is_the_proposal(kept: Layout) -> None:
    request = resolve_request(PROTOCOL, 3, None, "default", None, ())
    assert kept.placements == Shaken().propose(request).placements


def test_what_a_proposal_forgets_is_added_unless_optimization_is_left_out() -> None:
    with pytest.warns(UnrepairedWarning, match="missing asset"):
        bare = generate(PROTOCOL, 3, method=Method(proposer=Forgetful(), on_failure="keep", **AS_PROPOSED))
    (forgotten, *_) = bare.provenance.options["failures"]["missing"]
    assert not any(item.asset == forgotten for item in bare.placements)
    recorder = Recorder()
    complete = generate(PROTOCOL, 3, method=Method(proposer=Forgetful(), refine=False), trace=recorder)
    assert any(item.asset == forgotten for item in complete.placements)
    assert "complete" in {iteration.phase for iteration in recorder.trace().iterations}
    assert recorder.trace().final().placements == complete.placements


def test_accessories_are_left_out_on_request(published: Layout) -> None:
    bare = generate(PROTOCOL, 3, method=Method(dress="never"))
    assert {item.id for item in bare.placements} < {item.id for item in published.placements}
    assert bare.provenance.options["dress"] == "never"


def test_the_refinement_without_optimization_repairs_nothing(published: Layout) -> None:
    protocol, layout = protocols()[PROTOCOL], published
    hood, first, second = layout.box("FumeHood_1"), *_items(layout)
    x, y = hood.to_world(0.0, hood.depth / 2.0 + 0.6)
    rack = next(item for item in layout.placements if item.asset == "GlasswareCabinet")
    spoilt = apply(layout, Move(rack.id, x - rack.position[0], y - rack.position[1]))
    dx, dy = (spoilt.placement(first).position[i] - spoilt.placement(second).position[i] for i in (0, 1))
    spoilt = apply(spoilt, Move(second, dx, dy))
    before = evaluate_layout(spoilt, protocol, navigation=True, rules="paper")
    assert sum(not move.feasible for move in before.transitions or ()) > 0
    refined, after = refine_assessed(spoilt, before, protocol, repair=False)
    assert all(move.feasible for move in after.transitions or ())
    assert refined.placement(second) == spoilt.placement(second)
    assert any(set(collision.ids) == {first, second} for collision in after.collisions)


def _items(layout: Layout) -> tuple[str, str]:
    """Return two items that stand on the same bench."""
    bench = next(item for item in layout.placements if item.asset.startswith("IslandBench"))
    first, second = layout.children(bench.id)[:2]
    return first.id, second.id


def test_unknown_names_are_one_line_that_lists_what_exists() -> None:
    for name in proposer_names():
        assert callable(make_proposer(name).propose)
    with pytest.raises(UnknownNameError, match="solver"):
        generate(PROTOCOL, method=Method(proposer="oracle"))
    with pytest.raises(UnknownNameError, match="rules"):
        generate(PROTOCOL, method=Method(adjuster="oracle"))
    for option in ({"on_failure": "ignore"}, {"dress": "some"}):
        with pytest.raises(OptionError, match="expected one of"):
            generate(PROTOCOL, method=Method(**option))  # type: ignore[arg-type]


@pytest.mark.usefixtures("shaken")
def test_a_batch_keeps_failing_layouts_as_rows_and_is_identified_by_its_method(tmp_path: Path) -> None:
    method = Method("shaken", optimise=False, refine=False, on_failure="keep")
    batch = generate_batch([PROTOCOL], 2, tmp_path / "raw", method=method, progress=False)
    assert (batch.layouts, batch.infeasible, batch.failing) == (2, 0, 2)
    assert "2 kept with violations" in batch.summary
    for row in read_rows(batch.folder):
        layout = Layout.load(batch.folder / str(row.file))
        assert row.v == layout.provenance.options["failures"]["v"] > 0
        failures = layout.provenance.options["failures"]
        assert (row.missing, row.facility) == (len(failures["missing"]), failures["facility"])
    with pytest.raises(OptionError):
        generate_batch([PROTOCOL], 2, tmp_path / "raw", progress=False)
    refused = generate_batch([PROTOCOL], 1, tmp_path / "refused", method=Method("shaken", False, False), progress=False)
    (row,) = read_rows(refused.folder)
    assert row.proven is False
    assert "could not be repaired" in str(row.infeasible)
    with pytest.raises(OptionError, match="names"):
        generate_batch([PROTOCOL], 1, tmp_path / "object", method=Method(Shaken()), progress=False)


@pytest.mark.usefixtures("shaken")
def test_the_command_warns_of_a_kept_layout_and_refuses_it_otherwise(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["generate", PROTOCOL, "--seed", "3", "--proposer", "shaken", "--no-optimise", "--no-refine"]
    out = str(tmp_path / "lab.json")
    assert main([*words, "--out", out]) == 2
    captured = capsys.readouterr()
    assert captured.err.startswith("labgym: error: the proposed layout")
    assert captured.err.count("\n") == 1
    assert main([*words, "--keep", "--out", out]) == 0
    captured = capsys.readouterr()
    assert captured.err.startswith("labgym: warning: kept with ")
    assert captured.err.count("\n") == 1
    assert Layout.load(out).provenance.options["proposer"] == "shaken"


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (["--proposer", "oracle"], "solver"),
        (["--adjuster", "oracle"], "rules"),
        (["--trace", "t.json", "--count", "2", "--out", "f"], "--count"),
    ],
)
def test_a_bad_option_of_the_command_is_one_line(
    words: list[str], expected: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["generate", PROTOCOL, *words]) == 2
    err = capsys.readouterr().err
    assert err.startswith("labgym: error: ")
    assert err.count("\n") == 1
    assert expected in err


@pytest.mark.parametrize("rules", [rule_set("touchstone"), rule_set("paper", "strict")])
def test_workers_receive_rule_sets_by_name(rules: RuleSet) -> None:
    data = pickle.dumps(rules)
    assert len(data) < 2000
    assert pickle.loads(data) == rules
