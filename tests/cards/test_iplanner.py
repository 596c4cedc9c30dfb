from __future__ import annotations

from pathlib import Path

import pytest

from labgym.artefacts import artefacts
from labgym.cards import ablation
from labgym.cards import iplanner as iplanner_card
from labgym.cards.ablation import IPLANNER, PolicyAblation, ablate_iplanner
from labgym.cards.iplanner import differences_section, introduction, training_section, write_iplanner_card
from labgym.cards.planner_run import PlannerRun
from labgym.errors import OptionError
from labgym.eval.driving.evaluation import TransitionEvaluation
from labgym.eval.evaluator import evaluate
from labgym.layouts import load_published
from labgym.policies.data import DataOptions, make_dataset
from labgym.policies.iplanner.config import IPlannerConfig, IPlannerLossOptions, IPlannerTrainOptions
from labgym.policies.iplanner.network import load_iplanner
from labgym.suites import Suite

SHORT = Suite(name="short", split="val", max_steps=3).first([load_published("val", "val-alk_01")], 2)


@pytest.fixture(scope="module")
def run() -> Path:
    return artefacts("policies") / "iplanner"


@pytest.fixture(scope="module")
def data(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("data")
    make_dataset(folder, DataOptions(samples=2, seed=4), progress=False)
    return folder


def test_the_published_weights_are_small_and_load(run: Path) -> None:
    network = load_iplanner(run)
    assert 100_000 < sum(value.numel() for value in network.parameters()) < 2_000_000
    assert (run / "weights.safetensors").stat().st_size < 8_000_000


@pytest.mark.slow
def test_the_card_s_numbers_are_the_evaluation_s(run: Path, data: Path, tmp_path: Path) -> None:
    report = evaluate("iplanner", SHORT, out=tmp_path / "eval", progress=False)
    card = write_iplanner_card(run, data, tmp_path / "eval", tmp_path / "card").read_text()
    failed = sum(not row.success for row in report.rows)
    assert f"{failed} of {len(report.rows)} episodes failed" in card
    assert f"{report['success']:.3f}" in card
    assert "`labgym data --samples 2 --seed 4`" in card
    for name in ("weights.safetensors", "config.json"):
        assert (tmp_path / "card" / name).read_bytes() == (run / name).read_bytes()
    for name in ("losses.png", "drives.png", "failures.png"):
        assert (tmp_path / "card" / name).read_bytes().startswith(b"\x89PNG"), name


def test_each_variant_drives_with_its_own_weights_or_those_of_the_unchanged_policy(
    data: Path, run: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    chosen = tuple(variant for variant in IPLANNER.variants if variant.name in {"whole", "obstacle", "glance"})
    monkeypatch.setattr(ablation, "IPLANNER", PolicyAblation("iplanner", chosen))
    monkeypatch.setattr(iplanner_card, "IPLANNER", PolicyAblation("iplanner", chosen))
    monkeypatch.setattr(ablation, "thinned_suite", lambda every: SHORT)
    results = ablate_iplanner(data, tmp_path / "ablation", IPlannerTrainOptions(epochs=1, samples=2), 1, progress=False)
    weights = {
        name: TransitionEvaluation.read(results / name).summary.options["weights"] for name in ("whole", "obstacle")
    }
    assert load_iplanner(weights["obstacle"]).state_dict().keys() == load_iplanner(weights["whole"]).state_dict().keys()
    assert (
        weights["obstacle"]
        != weights["whole"]
        == TransitionEvaluation.read(results / "glance").summary.options["weights"]
    )
    evaluate("iplanner", SHORT, out=tmp_path / "eval", progress=False)
    card = write_iplanner_card(run, data, tmp_path / "eval", tmp_path / "card", tmp_path / "ablation").read_text()
    for variant in chosen:
        success = TransitionEvaluation.read(results / variant.name).summary.metrics["success"].value
        assert f"| {variant.title} | {success:.3f}" in card


def test_a_card_needs_an_evaluation_of_this_policy(run: Path, data: Path, tmp_path: Path) -> None:
    evaluate("straight", SHORT, out=tmp_path / "eval", progress=False)
    assert TransitionEvaluation.read(tmp_path / "eval").summary.policy == "straight"
    with pytest.raises(OptionError, match="straight"):
        write_iplanner_card(run, data, tmp_path / "eval", tmp_path / "card")


def test_the_published_card_is_what_the_template_writes_for_the_published_folder(run: Path) -> None:
    card = (run / "CARD.md").read_text(encoding="utf-8")
    published = PlannerRun.read(run, IPlannerConfig, run / "data.json")
    config = published.config
    title, _, text = introduction(config).partition("\n\n")
    assert card.startswith(f"{title}\n")
    for section in (text, training_section(published), differences_section(config)):
        assert section in card


@pytest.mark.parametrize("target", ["cost-to-go", "expert", "goal"])
def test_a_card_says_whether_its_targets_come_from_an_expert(target: str) -> None:
    config = IPlannerConfig(loss=IPlannerLossOptions.model_validate({"target": target}))
    text = introduction(config) + differences_section(config)
    assert ("on the expert's path" in text) == ("along the expert's path" in text) == (target == "expert")
    assert ("shortest path of the robot's disc" in text) == (target == "cost-to-go")
    assert ("Motion term" in text) == (target != "goal")
