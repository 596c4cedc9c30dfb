"""The sampler's published calibration: what it fits, and whether its figures can be had again."""

from __future__ import annotations

import math

import pytest

from labgym.eval.reports.paper import paper
from labgym.layouts.splits import FIRST_SEED, manifest
from labgym.paper.calibration import proposals, targets, value
from labgym.paper.sampler.rates import calibration
from labgym.protocols import protocols


def test_the_fitted_figures_are_the_papers() -> None:
    printed = {row["method"]: row for row in paper().ablation.rows}
    before, unrefined = printed["LabBuilder (w/o geom. & chem. opt.)"], printed["LabBuilder (w/o nav. opt.)"]
    expected = {"ob": before["ob"], "cn": before["cn"], "step_nav": unrefined["step_nav"]}
    assert expected == {"ob": 2.73, "cn": 1.43, "step_nav": 0.87}
    assert {target.figure: target.paper for target in targets()} == expected
    assert {figure.name: figure.paper for figure in calibration().figures if figure.fitted} == expected


def test_the_published_figures_reach_their_targets() -> None:
    for figure in calibration().figures:
        if figure.fitted:
            assert figure.reached == pytest.approx(figure.paper, rel=0.02)
            assert figure.low <= figure.reached <= figure.high


def test_the_figures_hold_on_val_within_their_spread() -> None:
    """The published seeds of val alone: 30 of the layouts of the calibration, one of each protocol."""
    seeds = [entry.seed for entry in manifest("val").layouts]
    assert all(FIRST_SEED["val"] <= seed < FIRST_SEED["test"] for seed in seeds)
    published = calibration()
    sample = proposals(published.rates, seeds=1)[0]
    assert {proposal.report.protocol for proposal in sample} == set(protocols())
    for figure in published.figures:
        if figure.name in ("ob", "cn", "obj"):
            assert figure.deviation is not None
            error = figure.deviation / math.sqrt(len(sample))
            assert abs(value(figure.name, sample) - figure.reached) < 3.0 * error
    step_nav = next(figure for figure in published.figures if figure.name == "step_nav")
    assert abs(value("step_nav", sample) - step_nav.reached) < 0.1
