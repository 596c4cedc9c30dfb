"""Comparison and ablation: rows are the scores of their layouts, means follow from rows, failures by a stated rule."""

from __future__ import annotations

import json
from contextlib import nullcontext
from pathlib import Path

import numpy as np
import pytest

from labgym.assets import Catalog
from labgym.errors import InfeasibleError, UnknownNameError
from labgym.eval import score
from labgym.eval.reports.paper import paper
from labgym.eval.scoring.judge import Judge
from labgym.eval.scoring.judgement import JudgeOptions
from labgym.layouts import Layout
from labgym.layouts.generate import resolve_request
from labgym.layouts.method import Method
from labgym.layouts.rules.objective import evaluate_layout
from labgym.llm import LanguageModel
from labgym.llm.errors import LanguageModelError
from labgym.paper.reproduction import cases
from labgym.paper.reproduction.blindfold import bare_catalog, blindfolded, described
from labgym.paper.reproduction.cases import LayoutRow, StudyVariant, measure
from labgym.paper.reproduction.comparison import (
    ComparisonStudy,
    RepairAblation,
    ablation_variants,
    comparison_variants,
    proposers,
)
from labgym.paper.reproduction.figures import PublishedFigures
from labgym.paper.reproduction.layout_tables import fitted_figures, paper_table, second_table
from labgym.paper.reproduction.measures import report_metrics
from labgym.paper.reproduction.plates import failure_section
from labgym.paper.reproduction.ranking import GRADES, LEAST_RANKED, PAIRS, graded, ranking_lines, ranking_shards
from labgym.paper.reproduction.study import parse_rows, reproduce
from labgym.protocols import protocols

PROTOCOL = protocols()["sub_01"]
RAW = {"optimise": False, "refine": False, "on_failure": "keep"}
VARIANTS = (
    StudyVariant("sampler", "sampler", Method(proposer="sampler", **RAW)),
    StudyVariant("solver", "solver", Method(on_failure="keep")),
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Two generators, one protocol, one seed: 2 s, and 1 s for three pictures."""
    folder = tmp_path_factory.mktemp("reproduce") / "comparison"
    reproduce(ComparisonStudy(VARIANTS, (PROTOCOL,), range(7, 8)), folder, progress=False)
    return folder


@pytest.fixture(scope="module")
def rows(folder):
    return parse_rows((folder / "rows.jsonl").read_bytes(), LayoutRow)


def test_a_row_has_the_scores_of_its_layout(folder, rows):
    assert [(row.variant, row.protocol, row.seed) for row in rows] == [(v.key, "sub_01", 7) for v in VARIANTS]
    for row in rows:
        layout = Layout.load(folder / row.file)
        assert layout.hash == row.hash
        report = score(layout, PROTOCOL, rules="paper")
        assert (report.v, report.passed) == (row.v, row.valid)
        for name in ("ob", "cn", "asset", "step_nav", "flam", "glass"):
            assert row.metrics[name] == pytest.approx(getattr(report, name))
        assert row.metrics["gated_glass"] == pytest.approx(report.asset * report.glass)
        second = score(layout, PROTOCOL, rules="touchstone")
        assert (row.metrics_2["v"], row.metrics_2["facility"]) == (second.v, pytest.approx(second.facility))
    assert rows[0].v > 0
    assert rows[1].valid


def test_the_tables_have_our_lines_and_the_paper_s_with_every_column(folder):
    table = PublishedFigures.load(folder / "figures.json").tables[0]
    printed = {line.name: line.cells for line in table.lines if line.origin == "paper"}
    assert [line.name for line in table.lines] == ["sampler", "solver", *printed]
    for row in paper().layouts.rows:
        points = ("method", "real", "lay", "comp")  # columns of a judge, which has not run
        numbers = {key: value for key, value in row.items() if key not in points and value is not None}
        assert {key: cell.value for key, cell in printed[row["method"]].items()} == numbers


def ranking_rows(row, ordered):
    """Rows of a judge that scores as many layouts as `ordered` above their damaged selves, and the others alike."""
    grades = [(grade, index, float(grade == "sound" and index < ordered)) for grade in GRADES for index in range(PAIRS)]
    return [
        row.model_copy(
            update={"variant": f"ranking-{grade}", "seed": index, "file": None, "metrics": {"real": more, "lay": 1.0}}
        )
        for grade, index, more in grades
    ]


def test_the_columns_of_a_judge_appear_if_it_can_rank(folder, rows):
    for table in PublishedFigures.load(folder / "figures.json").tables:
        assert not {"real", "lay", "comp"} & {column.key for column in table.columns}
    assert not any(word in (folder / "figures.csv").read_text() for word in (",real,", ",lay,", ",comp,"))
    judged = rows[0].model_copy(update={"metrics": {**rows[0].metrics, "real": 7.0, "lay": 6.0, "comp": 5.0}})
    blind, ranks = (ranking_rows(rows[0], ordered) for ordered in (LEAST_RANKED - 1, LEAST_RANKED))
    table = paper_table([judged, rows[1], *blind], VARIANTS, paper().layouts, "T")
    assert not {"real", "lay", "comp"} & {column.key for column in table.columns}
    assert "15 damaged and 15 spoilt versions of them: below 16" in ranking_lines(blind)[0]
    assert ranking_lines(rows) == ()
    table = paper_table([judged, rows[1], *ranks], VARIANTS, paper().layouts, "T")
    assert [column.key for column in table.columns][-3:] == ["real", "lay", "comp"]
    assert table.lines[0].cells["real"].value == 7.0
    printed = {line.name: line.cells for line in table.lines if line.origin == "paper"}
    assert printed["LabBuilder"]["real"].value == 8.23


def test_layouts_that_a_judge_ranks_are_worse_with_more_damage():
    shards = ranking_shards(JudgeOptions())
    assert len({shard.name for shard in shards}) == 60
    assert ranking_shards(None) == ()
    for index in (0, 5):
        sound, damaged, spoilt = (graded(grade, index) for grade in GRADES)
        assert score(sound, rules="paper").v == 0 < score(damaged, rules="paper").v
        assert score(spoilt, rules="paper").v > 0
        changed = [sum(p not in one.placements for p in sound.placements) for one in (damaged, spoilt)]
        assert 0 < changed[0] < changed[1]
        assert graded("spoilt", index) == spoilt


def test_figures_that_the_sampler_was_fitted_to_are_marked_in_every_form(folder):
    figures = PublishedFigures.load(folder / "figures.json")
    sampler, solver = figures.tables[0].lines[:2]
    assert {name for name, cell in sampler.cells.items() if cell.fitted} == {"ob", "cn", "step_nav"}
    assert not any(cell.fitted for cell in solver.cells.values())
    text = figures.tables[0].table().text()
    assert text.count("(fitted)") == 3
    assert "were fitted to this figure of the paper" in text
    assert (folder / "index.html").read_text().count("<small>(fitted)</small>") == 3
    marked = [line for line in (folder / "figures.csv").read_text().splitlines() if line.endswith(",fitted")]
    assert len(marked) == 4  # the head has the name of the column


def test_the_ablation_marks_what_the_calibration_fitted():
    """By assets/layouts/sampler.json: OB, CN without optimization, step navigation without refinement and rules."""
    expected = {"optimization": {"ob", "cn"}, "refinement": {"step_nav"}}
    for variant in ablation_variants("sampler", "sampler"):
        key = variant.key.removeprefix("sampler-").removeprefix("pure-")
        assert fitted_figures(variant) == expected.get(key, set())
    assert not any(fitted_figures(variant) for variant in ablation_variants("llm", "llm"))
    fitted = {one.title: fitted_figures(one) for one in comparison_variants(proposers(model=False))}
    assert {title for title, names in fitted.items() if names} == {"sampler: raw"}


def test_the_documents_mark_every_fitted_cell():
    """docs/reproduction.md says so where it shows a figure of the sampler with the paper's to which it was fitted."""
    text = (Path(__file__).parents[3] / "docs" / "reproduction.md").read_text()
    rows = [line for line in text.splitlines() if line.startswith("|")]
    raw = [row for row in rows if row.startswith("| `sampler` raw |")]
    assert raw
    assert all(row.count("(fitted)") == 3 for row in raw)
    (optimization,) = [row for row in rows if row.startswith("| optimization |") and "2.99" in row]
    assert [word in optimization for word in ("(fitted to 2.73)", "(fitted to 1.43)")] == [True, True]
    (refinement,) = [row for row in rows if row.startswith("| refinement for navigation |") and "0.851" in row]
    assert "(fitted to 0.870)" in refinement


def test_the_page_shows_both_layouts_and_the_failures(folder):
    html = (folder / "index.html").read_text()
    assert html.count("data:image/png;base64,") == 3
    assert "<h2>Failures</h2>" in html


def made_row(variant: str, protocol: str, v: int | None, **more) -> LayoutRow:
    return LayoutRow(variant=variant, protocol=protocol, seed=0, v=v, file=None if v is None else "x", **more)


def test_means_are_over_layouts_and_drives_of_version_2_are_pooled():
    values = [0.25, 1.0, 0.5, 0.75, 1.0, 0.0]
    own = [
        made_row(
            "a",
            f"p{k}",
            k,
            valid=k == 0,
            metrics={"flam": value, "gated_flam": value / 2},
            metrics_2={"step_nav": value, "transitions": float(k)},
        )
        for k, value in enumerate(values)
    ]
    lost = made_row("a", "p9", None, failure="too small")
    variants = (StudyVariant("a", "A", Method()),)
    line = paper_table([*own, lost], variants, paper().layouts, "T").lines[0]
    assert line.cells["flam"].value == pytest.approx(np.mean(values) / 2, abs=1e-6)
    assert line.cells["flam"].cases == 6
    pooled = second_table([*own, lost], variants).lines[0].cells
    assert pooled["step_nav"].value == pytest.approx(np.dot(values, range(6)) / 15, abs=1e-6)
    assert pooled["step_nav"].cases == 15
    assert "A 1" in " ".join(paper_table([*own, lost], variants, paper().layouts, "T").notes)


def test_the_failure_shown_is_the_layout_with_the_greatest_v(folder, rows):
    twice = [*rows, rows[0].model_copy(update={"seed": 3, "v": 1}), rows[0].model_copy(update={"seed": 1})]
    section = failure_section(twice, VARIANTS, (PROTOCOL,), folder, "default")
    assert [plate.title for plate in section.plates] == ["sampler: sub_01, seed 1"]
    assert f"v = {rows[0].v}" in section.plates[0].lines[0]
    assert "solver (1 layouts)" in section.text[1]


def test_a_protocol_without_a_layout_is_a_row(monkeypatch):
    def impossible(*_):
        raise InfeasibleError("protocol 'sub_01'", ["no wall is free"], None)

    monkeypatch.setattr(cases, "layout_of", impossible)
    output = measure(StudyVariant("solver", "solver", Method(on_failure="keep")), PROTOCOL, 0, "default")
    (row,) = parse_rows(next(iter(output.files.values())), LayoutRow)
    assert row.file is None
    assert "no wall is free" in row.failure
    assert not row.valid


def test_a_judge_s_scores_are_in_the_paper_s_columns_and_unusable_answers_leave_them_empty(folder, rows, monkeypatch):
    layout = Layout.load(folder / rows[1].file)
    report = score(layout, PROTOCOL, rules="paper")
    monkeypatch.setattr(LanguageModel, "from_environment", classmethod(lambda _: nullcontext()))
    monkeypatch.setattr(Judge, "completed", lambda _, one, *__: one.model_copy(update={"real": 7.0}))
    assert report_metrics(cases.judged(report, layout, PROTOCOL, JudgeOptions()))["real"] == 7.0

    def unusable(*_):
        raise LanguageModelError(reason, "no answer")

    monkeypatch.setattr(Judge, "completed", unusable)
    reason = "malformed"
    assert cases.judged(report, layout, PROTOCOL, JudgeOptions()) == report
    reason = "unreachable"
    with pytest.raises(LanguageModelError):
        cases.judged(report, layout, PROTOCOL, JudgeOptions())


def test_the_language_model_of_a_layout_is_named(folder, rows):
    layout = Layout.load(folder / rows[0].file)
    for options, name in (({"designer": "table"}, "seeded table"), ({"model": "m"}, "m"), ({}, "")):
        provenance = layout.provenance.model_copy(update={"options": options})
        assert cases.made_by(layout.replace(provenance=provenance)) == name


def test_without_annotations_the_catalog_has_geometry_alone():
    catalog = Catalog.published()
    bare = bare_catalog(catalog)
    assert [asset.name for asset in bare.assets] == [asset.name for asset in catalog.assets]
    for asset in bare.assets:
        assert not any(value for _, value in asset.hazards)
        assert (asset.storage_class, asset.heat_class, asset.chemistry) == (None, None, None)
        assert asset.size == catalog.get(asset.name).size


@pytest.mark.parametrize("rules", ["paper", "touchstone"])
def test_without_annotations_no_rule_of_chemistry_applies(folder, rows, rules):
    layout = Layout.load(folder / rows[0].file)
    request = resolve_request(PROTOCOL, 7, "bay", None, None, (), rules=rules)
    known = evaluate_layout(layout, PROTOCOL, request.rules)
    assert known.of("storage")
    assert known.of("glass")
    blind = blindfolded(request, "annotations")
    bare = layout.replace(catalog=blind.catalog)
    relations = {"near", "ventilation"}  # Of the protocol, which is known.
    assert {instance.rule for instance in evaluate_layout(bare, PROTOCOL, blind.rules).instances} <= relations
    assert evaluate_layout(bare, PROTOCOL, request.rules).of("storage")


def test_without_the_protocol_its_description_is_all_that_is_left():
    left = described(PROTOCOL, Catalog.published())
    assert left.chemical_constraints == left.spatial_constraints == ()
    assert {"Phenol", "BenzylBromide"} <= {use.name for use in left.reagents}
    assert "EthylAcetate" not in {use.name for use in left.reagents}
    assert left.steps != PROTOCOL.steps
    other = PROTOCOL.model_copy(update={"reagents": PROTOCOL.reagents[:1], "instruments": ("GloveBox",)})
    assert described(other, Catalog.published()) == left.model_copy(update={"id": other.id})


def test_an_ablated_layout_is_scored_with_the_whole_catalog_and_protocol():
    variant = next(one for one in ablation_variants("sampler", "sampler") if one.hidden == "annotations")
    raw = StudyVariant(variant.key, variant.title, Method(proposer="sampler", **RAW), "annotations")
    output = measure(raw, PROTOCOL, 7, "default")
    layout = Layout.parse(json.loads(next(c for name, c in output.files.items() if name.startswith("layouts"))))
    assert layout.protocol == PROTOCOL
    assert layout.catalog == Catalog.published()


def test_every_proposer_is_compared_raw_with_the_phases_of_the_paper_and_with_all():
    variants = comparison_variants(proposers(False))
    keys = [variant.key for variant in variants]
    assert len(set(keys)) == len(keys)
    for name in ("nothing", "heap", "sampler", "solver", "holodeck", "holodeck-plus", "sceneweaver", "holodeck-list"):
        modes = {one.key.removeprefix(f"{name}-"): one for one in variants if one.key.startswith(f"{name}-")}
        raw, pure, full = modes["raw"], modes["pure"], modes["full"]
        assert (raw.method.optimise, raw.method.refine, raw.pure) == (False, False, False)
        assert (pure.method.optimise, pure.method.refine, pure.pure) == (True, True, True)
        assert (full.method.optimise, full.method.refine, full.pure) == (True, True, False)
    assert {"llm", "holodeck-llm"} <= set(proposers(True))
    assert list(proposers(False, ["heap", "nothing"], quick=True)) == ["heap", "nothing"]
    every, quick = list(proposers(False)), list(proposers(False, quick=True))
    assert quick == [name for name in every if not name.endswith(("-list", "-stations"))]
    assert len(quick) == len(every) - 4 == 7
    with pytest.raises(UnknownNameError, match="proposer 'hoard'"):
        proposers(False, ["hoard"])


def test_a_pure_layout_names_its_phases_and_has_no_object_that_was_not_proposed():
    (variant,) = (one for one in comparison_variants(proposers(False, ["heap"])) if one.pure)
    layout, proposal = cases.layout_of(variant, PROTOCOL, 0, "default")
    assert {one.id for one in layout.placements} == {one.id for one in proposal.placements}
    assert layout.provenance.options["phases"] == "pure"
    assert not {"failures", "optimise", "refine"} & set(layout.provenance.options)


def test_the_ablations_are_those_of_the_paper_with_all_phases_and_with_its_own():
    study = RepairAblation(ablation_variants("sampler", "sampler"), (PROTOCOL,), range(1))
    assert len({shard.name for shard in study.shards()}) == 12
    assert sum(variant.pure for variant in study.variants) == len(study.printed().rows) == 5


def test_each_ablation_differs_from_the_whole_method_by_what_it_removes():
    variants = {one.key.removeprefix("sampler-"): one for one in ablation_variants("sampler", "sampler")}
    removed = {
        key: set(variant.method.options.items())
        - set(variants["pure" if variant.pure else "whole"].method.options.items())
        for key, variant in variants.items()
    }
    assert removed == {
        "annotations": set(),
        "protocol": set(),
        "optimization": {("optimise", False)},
        "refinement": {("refine", False), ("facility", False)},
        "rules-alone": {("refine", False)},
        "refinement-alone": {("facility", False)},
        "whole": set(),
        "pure-annotations": set(),
        "pure-protocol": set(),
        "pure-optimization": {("optimise", False)},
        "pure-refinement": {("refine", False)},
        "pure": set(),
    }
    assert {key: one.hidden for key, one in variants.items() if one.hidden != "nothing"} == {
        f"{pure}{name}": name for pure in ("", "pure-") for name in ("annotations", "protocol")
    }
