from __future__ import annotations

from pathlib import Path

import pytest

from labgym.artefacts import artefacts
from labgym.cards import ablation, results
from labgym.cards import navdp as navdp_card
from labgym.cards.ablation import NAVDP, RESULTS, PolicyAblation, ablate_navdp
from labgym.cards.navdp import write_navdp_card
from labgym.cards.planner_run import PlannerRun
from labgym.errors import OptionError
from labgym.eval.driving.record import NavigationSummary
from labgym.eval.evaluator import evaluate
from labgym.layouts import load_published
from labgym.policies.data import DataOptions, make_dataset
from labgym.policies.navdp.config import NavDPConfig
from labgym.suites import Suite

SHORT = Suite(name="short", split="val", max_steps=3).first([load_published("val", "val-alk_01")], 2)
PUBLISHED = artefacts("policies") / "navdp"
STUDY = PolicyAblation("navdp", tuple(one for one in NAVDP.variants if one.name in {"whole", "critic", "present"}))
"""Unchanged, another choice of the sample, and without memory: each variant takes a process of its own."""


@pytest.fixture(scope="module")
def data(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("data")
    make_dataset(folder, DataOptions(samples=4, seed=4, layout=2), progress=False)
    return folder


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("ablation")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(ablation, "thinned_suite", lambda every: SHORT)
        patch.setattr(ablation, "NAVDP", STUDY)
        ablate_navdp(PUBLISHED, out, 1, progress=False)
    return out


@pytest.mark.slow
def test_variants_drive_by_its_options_with_the_same_weights(study: Path) -> None:
    assert len(STUDY.variants) == 3
    for variant in STUDY.variants:
        summary = NavigationSummary.load(study / RESULTS / variant.name / "summary.json")
        assert summary.options == {"weights": str(PUBLISHED), "options": variant.options}
        assert summary.errors == 0


@pytest.mark.slow
def test_the_card_s_numbers_are_the_evaluation_s(
    data: Path, study: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(results, "SHOWN_FAILURES", 2)
    monkeypatch.setattr(navdp_card, "NAVDP", STUDY)
    report = evaluate("navdp", SHORT, out=tmp_path / "eval", progress=False)
    card = write_navdp_card(PUBLISHED, data, tmp_path / "eval", tmp_path / "card", study).read_text()
    failed = sum(not row.success for row in report.rows)
    assert f"{failed} of {len(report.rows)} episodes failed" in card
    assert f"{report['success']:.3f}" in card
    assert "`labgym data --samples 4 --seed 4`" in card
    assert all(variant.title in card for variant in STUDY.variants)
    for name in ("weights.safetensors", "config.json", "history.jsonl"):
        assert (tmp_path / "card" / name).read_bytes() == (PUBLISHED / name).read_bytes()
    for name in ("losses.png", "drives.png", "failures.png", "trajectories.png"):
        assert (tmp_path / "card" / name).read_bytes().startswith(b"\x89PNG"), name


def test_an_evaluation_of_another_policy_makes_no_card(data: Path, tmp_path: Path) -> None:
    evaluate("straight", SHORT, out=tmp_path / "eval", progress=False)
    with pytest.raises(OptionError, match="straight"):
        write_navdp_card(PUBLISHED, data, tmp_path / "eval", tmp_path / "card")
    assert not (tmp_path / "card").exists()


def test_the_published_card_is_what_the_template_writes_for_the_published_folder() -> None:
    card = (PUBLISHED / "CARD.md").read_text(encoding="utf-8")
    trained = PlannerRun.read(PUBLISHED, NavDPConfig, PUBLISHED / "data.json")
    title, _, text = navdp_card.introduction(trained.config).partition("\n\n")
    assert card.startswith(f"{title}\n")
    sections = (
        text,
        navdp_card.TRAJECTORIES,
        navdp_card.training_section(trained),
        navdp_card.differences_section(trained.config),
    )
    for section in sections:
        assert section in card
