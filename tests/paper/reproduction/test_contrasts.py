"""Paired differences between proposers: signs, the test over protocols, and the verdict."""

from __future__ import annotations

from dataclasses import replace

import pytest

from labgym.layouts.method import Method
from labgym.paper.reproduction.cases import LayoutRow, StudyVariant
from labgym.paper.reproduction.comparison import ComparisonStudy
from labgym.paper.reproduction.contrasts import contrast_table, differences, losses, probability
from labgym.protocols import protocols

VERDICT = tuple(StudyVariant(key, key, Method()) for key in ("nothing", "sampler"))
BASE, OTHER = (StudyVariant(key, key, Method()) for key in ("base", "other"))


def rows(walks: list[float], reaches: list[float]) -> list[LayoutRow]:
    """Return rows of ten protocols in which the base walks 10 m and reaches all."""
    made = []
    for k, (walk, reach) in enumerate(zip(walks, reaches, strict=True)):
        for variant, outcome in ((BASE, (10.0, 1.0)), (OTHER, (10.0 + walk, 1.0 + reach))):
            metrics = dict(zip(("walk", "reach"), outcome, strict=True))
            made.append(LayoutRow(variant=variant.key, protocol=f"p{k}", seed=0, file="x", metrics=metrics))
    return made


def test_the_p_value_is_the_exact_one_of_a_sign_test_if_all_differences_have_one_sign():
    """All of ten ranks positive: one of 2^10 assignments of signs, two-sided."""
    values = [0.1 * k for k in range(1, 11)]
    assert probability(values, [f"p{k}" for k in range(10)]) == pytest.approx(2.0 / 2**10, abs=1e-6)


def test_laboratories_of_one_protocol_count_once():
    values = [0.1 * k for k in range(1, 11)]
    names = [f"p{k}" for k in range(10)]
    assert probability(values * 3, names * 3) == probability(values, names)
    assert probability(values[:4] * 9, names[:4] * 9) is None


def test_without_a_difference_the_p_value_is_one():
    assert probability([0.0] * 10, [f"p{k}" for k in range(10)]) == 1.0


def test_a_longer_walk_is_a_loss_and_a_better_reach_is_none():
    made = rows([1.0 + 0.1 * k for k in range(10)], [0.01 * k + 0.01 for k in range(10)])
    assert losses(made, OTHER, BASE) == ("walk",)
    assert losses(made, BASE, OTHER) == ("reach",)
    line = contrast_table(made, "full", (BASE, OTHER), BASE).lines
    assert [one.name for one in line] == ["other"]
    assert line[0].cells["walk"].value == pytest.approx(1.45)
    assert line[0].cells["facility"].value is None


def test_only_laboratories_that_both_have_are_compared():
    made = rows([1.0] * 10, [0.0] * 10)
    lost = made[1].model_copy(update={"metrics": {"walk": None}})
    values, names = differences([made[0], lost, *made[2:]], "other", "base", "walk")
    assert len(values) == 9
    assert "p0" not in names


def test_the_comparison_says_whether_no_proposal_loses_an_outcome():
    variants = tuple(replace(one, key=f"{one.key}-full", title=f"{one.key}: full") for one in VERDICT)
    for walk, verdict in ((1.0, "worse than sampler: full in walk."), (0.0, "in no outcome")):
        made = rows([walk + 0.1 * k * (walk > 0) for k in range(10)], [0.0] * 10)
        named = {"base": "sampler-full", "other": "nothing-full"}
        made = [row.model_copy(update={"variant": named[row.variant]}) for row in made]
        study = ComparisonStudy(variants, tuple(protocols().values()), range(1))
        figures = study.figures(made)
        assert verdict in figures.summary[-1]
        assert figures.tables[-1].key == "contrasts-full"
    few = ComparisonStudy(variants, tuple(protocols().values())[:2], range(1))
    assert len(few.summary(made)) == 1
