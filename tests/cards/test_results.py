"""The sentence under an ablation table follows from the intervals of the paired differences."""

from __future__ import annotations

from pathlib import Path

import pytest
from episode_rows import row

from labgym.cards.results import ablation_table
from labgym.errors import OptionError
from labgym.eval.driving.files import record_line
from labgym.eval.driving.navigation_metrics import summarise
from labgym.eval.driving.record import NavigationSummary
from labgym.eval.evaluator import evaluate
from labgym.suites import Suite

TITLES = {"whole": "unchanged", "a": "without A", "b": "without B"}


@pytest.fixture(scope="module")
def summary(tmp_path_factory: pytest.TempPathFactory) -> NavigationSummary:
    folder = tmp_path_factory.mktemp("eval")
    evaluate("straight", Suite(name="s", split="val", layouts=("val-alk_01",), max_steps=2), out=folder, progress=False)
    return NavigationSummary.load(folder / "summary.json")


def study(folder: Path, summary: NavigationSummary, touched: dict[str, int]) -> Path:
    """Write a study of 24 episodes in 12 layouts whose variants touch something in the first of them."""
    layouts = [f"layout-{k % 12}" for k in range(24)]
    for name, count in touched.items():
        rows = [row(layout, pair=k // 12, contacts=int(k < count)) for k, layout in enumerate(layouts)]
        metrics = summarise(rows)
        summary.model_copy(update={"metrics": metrics}).save(folder / name / "summary.json")
        (folder / name / "episodes.jsonl").write_bytes(b"".join(record_line(each) for each in rows))
    return folder


@pytest.mark.parametrize(
    ("a", "b", "sentence"),
    [
        (14, 20, 'Every variant in the table differs from "unchanged" by an interval without zero'),
        (20, 1, 'Not distinguishable from "unchanged" (all intervals contain zero): without B.'),
        (0, 2, 'No variant differs from "unchanged" by an interval without zero'),
    ],
)
def test_the_sentence_names_the_variants_whose_paired_differences_contain_zero(
    summary: NavigationSummary, tmp_path: Path, a: int, b: int, sentence: str
) -> None:
    table = ablation_table(study(tmp_path, summary, {"whole": 1, "a": a, "b": b}), TITLES)
    assert sentence in table
    assert "Not driven" not in table
    (line,) = (line for line in table.splitlines() if line.startswith("| without A |"))
    assert f"{1.0 - a / 24.0:.3f} ({(1.0 - a) / 24.0:+.3f} [" in line


def test_variants_that_are_not_driven_are_named(summary: NavigationSummary, tmp_path: Path) -> None:
    table = ablation_table(study(tmp_path, summary, {"whole": 1, "a": 20}), TITLES)
    assert table.endswith("Not driven: without B.")
    assert "| without B |" not in table


def test_incomplete_evaluations_make_no_table(summary: NavigationSummary, tmp_path: Path) -> None:
    folder = study(tmp_path, summary, dict.fromkeys(TITLES, 2))
    summary.model_copy(update={"complete": False}).save(folder / "b" / "summary.json")
    with pytest.raises(OptionError, match="incomplete"):
        ablation_table(folder, TITLES)
