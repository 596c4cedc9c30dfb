"""The steps of the protocol: a request for a trajectory, by the kind of goal that it carries."""

from __future__ import annotations

from typing import Literal

from labgym.policies.policy import GoalKind

Step = Literal["pointgoal", "imagegoal", "nogoal"]
"""Name of a step in the options of the client; its path is `/NAME_step`."""

PATHS: dict[str, GoalKind] = {"/pointgoal_step": "point", "/imagegoal_step": "image", "/nogoal_step": "none"}
"""Kind of the goal by the path of the request."""


def path_of(step: Step) -> str:
    """Return the path of the request of a step."""
    return f"/{step}_step"


def paths_of(kinds: tuple[GoalKind, ...]) -> str:
    """Return the paths of the steps with these kinds of goals, for messages."""
    return ", ".join(path for path, kind in PATHS.items() if kind in kinds)
