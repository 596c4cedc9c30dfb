"""Training with stable-baselines3: `labgym train ppo|sac|her`, and the parts of these scripts for scripts of your own.

    from labgym.training import ScoreCallback, make_environments, save_policy

`make_environments` returns a fast `VecEnv`, `ScoreCallback` is an `EvalCallback` that logs SR and SPL, `save_policy`
writes a trained model, with the statistics of `VecNormalize`, as a file that `labgym eval` loads.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from labgym.training.environments import make_environments
    from labgym.training.export import save_policy
    from labgym.training.scores import ScoreCallback

__all__ = ["ScoreCallback", "make_environments", "save_policy"]


def __getattr__(name: str) -> Any:
    """Import stable-baselines3 and torch when they are used: they take seconds."""
    if name == "make_environments":
        from labgym.training.environments import make_environments

        return make_environments
    if name == "save_policy":
        from labgym.training.export import save_policy

        return save_policy
    if name == "ScoreCallback":
        from labgym.training.scores import ScoreCallback

        return ScoreCallback
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
