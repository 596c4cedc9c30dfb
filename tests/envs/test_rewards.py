"""The reward's terms."""

from __future__ import annotations

from labgym.envs import RewardWeights


def test_each_term_is_its_weight_times_what_happened() -> None:
    terms = RewardWeights(progress=2.0, success=10.0, collision=-0.5, time=-0.01).terms(
        0.25, success=True, collision=True
    )
    assert terms == {"progress": 0.5, "success": 10.0, "collision": -0.5, "time": -0.01}


def test_a_reset_earns_nothing() -> None:
    assert set(RewardWeights().terms(0.0, success=False, collision=False, steps=0).values()) == {0.0}
