"""The sentence under an ablation table follows from the intervals."""

from __future__ import annotations

from pathlib import Path

import pytest

from labgym.cards.results import ablation_table
from labgym.errors import OptionError
from labgym.eval.driving.intervals import Estimate
from labgym.eval.driving.record import NavigationSummary
from labgym.eval.driving.runner import evaluate
from labgym.suites import Suite

TITLES = {"whole": "unchanged", "a": "without A", "b": "without B"}


@pytest.fixture(scope="module")
def summary(tmp_path_factory: pytest.TempPathFactory) -> NavigationSummary:
    folder = tmp_path_factory.mktemp("eval")
    evaluate("straight", Suite(name="s", split="val", layouts=("val-alk_01",), max_steps=2), out=folder, progress=False)
    return NavigationSummary.load(folder / "summary.json")


def study(folder: Path, summary: NavigationSummary, intervals: dict[str, tuple[float, float]]) -> Path:
    """Write a study whose variants have these intervals in all columns."""
    for name, (low, high) in intervals.items():
        estimate = Estimate(value=(low + high) / 2.0, low=low, high=high, count=9, nulls=0)
        metrics = dict.fromkeys(("success", "spl", "collision_free"), estimate)
        summary.model_copy(update={"metrics": metrics}).save(folder / name / "summary.json")
    return folder


@pytest.mark.parametrize(
    ("a", "b", "sentence"),
    [
        ((0.1, 0.3), (0.2, 0.4), 'Every variant differs from "unchanged" by more than the intervals'),
        ((0.1, 0.3), (0.7, 0.9), 'Not distinguishable from "unchanged" within the intervals: without B.'),
        ((0.7, 0.9), (0.8, 1.0), 'No variant differs from "unchanged" by more than the intervals'),
    ],
)
def test_the_sentence_names_the_variants_within_the_intervals(
    summary: NavigationSummary, tmp_path: Path, a: tuple[float, float], b: tuple[float, float], sentence: str
) -> None:
    table = ablation_table(study(tmp_path, summary, {"whole": (0.6, 0.8), "a": a, "b": b}), TITLES)
    assert sentence in table
    assert "| without A | 0." in table


def test_incomplete_evaluations_make_no_table(summary: NavigationSummary, tmp_path: Path) -> None:
    folder = study(tmp_path, summary, dict.fromkeys(TITLES, (0.1, 0.2)))
    summary.model_copy(update={"complete": False}).save(folder / "b" / "summary.json")
    with pytest.raises(OptionError, match="incomplete"):
        ablation_table(folder, TITLES)
