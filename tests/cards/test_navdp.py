from __future__ import annotations

from pathlib import Path

import pytest

from labgym.artefacts import artefacts
from labgym.cards import navdp as navdp_card
from labgym.cards import navdp_ablation
from labgym.cards.iplanner_ablation import RESULTS, RUNS
from labgym.cards.navdp import write_navdp_card
from labgym.cards.navdp_ablation import SMALL, VARIANTS, ablate_navdp
from labgym.errors import OptionError
from labgym.eval.driving.record import NavigationSummary
from labgym.eval.driving.runner import evaluate
from labgym.eval.driving.suites import Suite
from labgym.policies.data import DataOptions, make_dataset
from labgym.policies.navdp.config import NavDPConfig, TrainOptions

SHORT = Suite(name="short", split="val", layouts=("val-alk_01",), max_steps=3)
PUBLISHED = artefacts("policies") / "navdp"


@pytest.fixture(scope="module")
def data(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("data")
    make_dataset(folder, DataOptions(samples=4, seed=4, layout=2), progress=False)
    return folder


@pytest.fixture(scope="module")
def ablation(data: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("ablation")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(navdp_ablation, "every_so_many", lambda every: SHORT)
        ablate_navdp(PUBLISHED, data, out, TrainOptions(epochs=1, samples=4), 2, progress=False)
    return out


def test_every_variant_is_driven_by_its_rules_with_the_weights_given_or_its_own(ablation: Path) -> None:
    for variant in VARIANTS:
        summary = NavigationSummary.load(ablation / RESULTS / variant.name / "summary.json")
        expected = ablation / RUNS / variant.name if variant.trained else PUBLISHED
        assert summary.options == {"weights": str(expected), "rules": variant.rules}
        assert summary.errors == 0
    trained = {path.name for path in (ablation / RUNS).iterdir()}
    assert trained == {variant.name for variant in VARIANTS if variant.trained}
    memory = NavDPConfig.load(ablation / RUNS / "memory" / "config.json")
    assert memory.network.memory == 1
    assert NavDPConfig.load(ablation / RUNS / SMALL / "config.json").network.memory > 1


def test_the_card_s_numbers_are_the_evaluation_s(
    data: Path, ablation: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(navdp_card, "SHOWN", 2)
    report = evaluate("navdp", SHORT, out=tmp_path / "eval", progress=False)
    card = write_navdp_card(PUBLISHED, data, tmp_path / "eval", tmp_path / "card", ablation).read_text()
    failed = sum(not row.success for row in report.rows)
    assert f"{failed} of {len(report.rows)} episodes failed" in card
    assert f"{report['success']:.3f}" in card
    assert "`labgym data --samples 4 --seed 4`" in card
    assert all(variant.title in card for variant in VARIANTS)
    for name in ("weights.safetensors", "config.json", "history.jsonl"):
        assert (tmp_path / "card" / name).read_bytes() == (PUBLISHED / name).read_bytes()
    for name in ("losses.png", "drives.png", "failures.png", "trajectories.png"):
        assert (tmp_path / "card" / name).read_bytes().startswith(b"\x89PNG"), name


def test_an_evaluation_of_another_policy_makes_no_card(data: Path, tmp_path: Path) -> None:
    evaluate("straight", SHORT, out=tmp_path / "eval", progress=False)
    with pytest.raises(OptionError, match="straight"):
        write_navdp_card(PUBLISHED, data, tmp_path / "eval", tmp_path / "card")
    assert not (tmp_path / "card").exists()
