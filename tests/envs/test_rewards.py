"""The reward's terms."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from labgym.envs import LabPointNavEnv, RewardWeights
from labgym.envs.parts.registry import kinds_of
from labgym.envs.parts.rewards import ClearanceTerm, FailureTerm, FunctionTerm, ProgressTerm, SuccessTerm, checked_terms
from labgym.envs.state import State
from labgym.errors import OptionError
from labgym.layouts import Layout

SPIN = np.array([0.0, 1.0], np.float32)


def turn_rate(state: State) -> float:
    return state.velocity[1]


def reached(layout: Layout, **arguments: Any) -> tuple[float, dict[str, float]]:
    """Start within the success distance of a goal; return the reward of the first step and its terms."""
    env = LabPointNavEnv(layout=layout, **arguments)
    env.reset(seed=0, options={"start": (4.0, 5.4, 0.0), "goal": (4.2, 5.4)})
    _, reward, terminated, _, info = env.step(SPIN)
    assert terminated
    return reward, info["reward_terms"]


def test_each_term_is_its_weight_times_what_happened(layout: Layout) -> None:
    reward, terms = reached(layout, weights=RewardWeights(progress=0.0, success=3.0, collision=-0.5, time=-0.25))
    assert terms == {"progress": 0.0, "success": 3.0, "collision": 0.0, "time": -0.25}
    assert reward == 2.75


def test_a_reset_earns_nothing(layout: Layout) -> None:
    _, info = LabPointNavEnv(layout=layout).reset(seed=0)
    assert set(info["reward_terms"].values()) == {0.0}


def test_weights_may_be_passed_as_a_mapping(layout: Layout) -> None:
    assert reached(layout, weights={"success": 3.0, "time": -0.25}) == reached(
        layout, weights=RewardWeights(success=3.0, time=-0.25)
    )


@pytest.mark.parametrize("function", [turn_rate, f"{__name__}:turn_rate"])
def test_a_function_of_the_user_s_own_is_a_term(layout: Layout, function: Any) -> None:
    env = LabPointNavEnv(layout=layout, rewards=["time", FunctionTerm("spin", function, weight=2.0)])
    env.reset(seed=0)
    for _ in range(3):
        observation, reward, _, _, info = env.step(SPIN)
        assert info["reward_terms"] == {"time": -0.01, "spin": pytest.approx(2.0 * observation["velocity"][1])}
        assert reward == pytest.approx(sum(info["reward_terms"].values()))


@pytest.mark.parametrize(
    ("rewards", "message"),
    [
        (["happiness"], "happiness"),
        (["time", "time"], "two reward terms are named 'time'"),
        ([{"kind": "time", "weight": "much"}], "expected a finite number"),
        ([{"kind": "time", "mass": 1.0}], "mass"),
        ([{"kind": "function", "name": "f", "function": "nowhere:f"}], "cannot be imported"),
        ([object()], "it lacks name, reset, value, weight"),
        ("time", "expected a list"),
        (3, "expected a list"),
    ],
)
def test_a_reward_that_is_none_is_refused(rewards: Any, message: str) -> None:
    with pytest.raises((OptionError, KeyError), match=message):
        LabPointNavEnv(rewards=rewards)


def test_weights_and_rewards_exclude_each_other() -> None:
    with pytest.raises(OptionError, match="not both"):
        LabPointNavEnv(rewards=["time"], weights=RewardWeights())


def test_the_usual_reward_weighs_as_documented() -> None:
    usual = {"progress": 1.0, "success": 10.0, "collision": -0.1, "time": -0.01}
    assert {term.name: term.weight for term in RewardWeights().terms()} == usual
    alone = {
        name: kind("f", turn_rate) if name == "function" else kind() for name, kind in kinds_of("reward term").items()
    }
    weights = {name: term.weight for name, term in alone.items() if name in (*usual, "failure", "clearance")}
    assert weights == {**usual, "failure": -10.0, "clearance": -0.1}


@pytest.mark.parametrize(("clearance", "share"), [(0.0, 1.0), (0.075, 0.75), (0.15, 0.5), (0.3, 0.0), (0.9, 0.0)])
def test_clearance_costs_from_contact_to_30_centimeters(clearance: float, share: float) -> None:
    near: Any = SimpleNamespace(clearance=clearance)
    assert ClearanceTerm().value(near) == pytest.approx(share)


@pytest.mark.parametrize("verdict", [None, "success", "failure", "truncation"])
def test_success_and_failure_pay_by_the_verdict(layout: Layout, verdict: Any) -> None:
    env = LabPointNavEnv(layout=layout)
    env.reset(seed=0)
    state = replace(env.state, verdict=verdict)
    assert SuccessTerm().value(state) == (verdict == "success")
    assert FailureTerm().value(state) == (verdict == "failure")


@pytest.mark.parametrize("method", ["grid", "exact"])
def test_progress_adds_up_to_the_meters_by_which_the_way_to_the_goal_became_shorter(
    layout: Layout, method: Any
) -> None:
    env = LabPointNavEnv(layout=layout, rewards=[ProgressTerm(2.0, method)])
    env.reset(seed=0, options={"start": (4.0, 5.4, 0.0), "goal": (6.5, 5.4)})
    to_go, earned = env.state.to_go(method), 0.0
    before = to_go.at(*env.state.pose[:2])
    for forward in (1.0, 1.0, 1.0, -1.0, 0.5, 1.0):
        earned += float(env.step(np.array([forward, 0.0], np.float32))[1])
    shorter = before - to_go.at(*env.state.pose[:2])
    assert shorter > 0.1
    assert earned == pytest.approx(2.0 * shorter)


def test_terms_with_finite_weights_are_taken_as_they_are() -> None:
    terms = RewardWeights().terms()
    assert checked_terms(terms) is terms
