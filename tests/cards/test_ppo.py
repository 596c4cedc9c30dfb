from __future__ import annotations

import json

import numpy as np
import pytest

from labgym.artefacts import artefacts
from labgym.cards.ppo import INPUTS, training_section, write_ppo_card
from labgym.errors import DocumentError, OptionError
from labgym.eval import Suite, evaluate
from labgym.eval.driving.episode_row import TransitionRow
from labgym.eval.reports.route_figures import sampled, what_went_wrong
from labgym.layouts import load_published
from labgym.layouts.splits import published

pytest.importorskip("stable_baselines3")

from labgym.policies.ppo.options import PPOOptions, TrainingProgress
from labgym.policies.ppo.training import train

SUITE = Suite(name="short", split="val", max_steps=5).first([load_published("val", published("val")[0])], 3)


def row(**changes):
    values = {
        "suite": "s/1", "split": "val", "layout": "l", "layout_hash": "0", "protocol": "p", "pair": 0, "policy": "ppo",
        "seed": 0, "start": (0, 0, 0), "goal": (5, 0, 0), "success": False, "spl": 0.0, "soft_spl": 0.0,
        "path_length": 4.0, "shortest_path_length": 5.0, "final_distance": 1.0, "contacts": 0, "min_clearance": 0.1,
        "steps": 600, "time": 60.0,
    }  # fmt: skip
    return TransitionRow(**{**values, **changes})


@pytest.fixture(scope="module")
def trained(tmp_path_factory):
    """A run that learned next to nothing, and an evaluation of it that is too short to arrive."""
    folder = tmp_path_factory.mktemp("trained")
    options = PPOOptions(
        steps=64, layouts=1, environments=2, cloning_rounds=1, cloning_steps=64, rollout=32, leg=1, epochs=1, batch=32
    )
    layouts = (load_published("val", published("val")[0]),)
    best = train(options, folder / "run", lambda policy: 0.25, layouts)
    evaluate("ppo", SUITE, out=folder / "results", progress=False, options={"weights": str(best)})
    return folder


def test_the_card_has_the_numbers_of_the_evaluation_and_says_how_it_was_trained(trained, tmp_path):
    card = write_ppo_card(trained / "run", trained / "results", tmp_path).read_text(encoding="utf-8")
    summary = json.loads((trained / "results" / "summary.json").read_text())
    success, episodes = summary["metrics"]["success"]["value"], summary["episodes"]
    assert f"| SR ↑ | {success:.3f}" in card
    assert f"{episodes} episodes" in card
    assert "DAgger" in card
    assert "0.250" in card
    for name in ("weights.safetensors", "config.json", "training.json", "learning.png", "drives.png", "failures.png"):
        assert (tmp_path / name).stat().st_size > 0
        assert name in card or not name.endswith(".png")
    assert (tmp_path / "weights.safetensors").read_bytes() == (trained / "run/best/weights.safetensors").read_bytes()
    assert card.count(f"| {SUITE.layouts[0]} |") == episodes * (1 - success)


def test_a_run_without_warm_start_is_shown_for_comparison(trained, tmp_path):
    options = PPOOptions.load(trained / "run" / "options.json")
    cold = options.model_copy(update={"cloning_rounds": 0})
    layouts = (load_published("val", published("val")[0]),)
    train(cold, tmp_path / "cold", lambda policy: 0.125, layouts)
    card = write_ppo_card(trained / "run", trained / "results", tmp_path / "card", tmp_path / "cold").read_text()
    assert "0.125 after 64 steps" in card
    with pytest.raises(OptionError, match="no-warm-start"):
        write_ppo_card(trained / "run", trained / "results", tmp_path / "card", trained / "run")


def test_a_card_is_made_of_a_complete_evaluation_of_the_policy_only(trained, tmp_path):
    evaluate("straight", SUITE, out=tmp_path / "other", progress=False)
    with pytest.raises(OptionError, match="straight"):
        write_ppo_card(trained / "run", tmp_path / "other", tmp_path)
    with pytest.raises(DocumentError):
        write_ppo_card(trained / "run", tmp_path / "nowhere", tmp_path)


@pytest.mark.parametrize(
    ("route", "changes", "text"),
    [
        ([(0.01 * min(k, 100), 0.0, 0.0) for k in range(601)], {}, "stopped 1.0 m"),
        ([(0.01 * k, 0.0, 0.0) for k in range(601)], {}, "time limit reached"),
        ([(np.sin(0.1 * k), 0.0, 0.0) for k in range(601)], {"path_length": 40.0}, "back and forth"),
        ([(0.0, 0.0, 0.0)] * 601, {"contacts": 500}, "in contact for 500 of 600 steps"),
        ([(0.0, 0.0, 0.0)], {"error": "ValueError: no"}, "raised: ValueError: no"),
    ],
)
def test_failures_are_classified_by_how_the_robot_moved(route, changes, text):
    assert text in what_went_wrong(row(**changes), tuple(route))


def test_sampled_episodes_are_spread_over_the_suite():
    rows = [row(pair=k) for k in range(129)]
    pairs = [each.pair for each in sampled(rows)]
    assert (len(pairs), pairs[0], pairs[-1]) == (10, 0, 128)
    assert max(np.diff(pairs)) <= 15
    assert len(sampled(rows[:3])) == 3


@pytest.mark.parametrize("name", ["ppo-lidar", "ppo-depth"])
def test_the_published_card_is_what_the_template_writes_for_the_published_folder(name):
    folder = artefacts("policies") / name
    options, progress = PPOOptions.load(folder / "config.json"), TrainingProgress.load(folder / "training.json")
    path = folder / "training-without-warm-start.json"
    cold = TrainingProgress.load(path) if path.exists() else None
    card = (folder / "CARD.md").read_text(encoding="utf-8")
    assert training_section(options, progress, cold) in card
    assert INPUTS[options.observation] in card
