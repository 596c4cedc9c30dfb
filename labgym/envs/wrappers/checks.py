"""Checks of what a wrapper is put around."""

from __future__ import annotations

from typing import Any

import gymnasium as gym
from gymnasium import spaces

from labgym.envs.point_nav import LabPointNavEnv
from labgym.errors import OptionError


def point_nav(env: gym.Env[Any, Any], wrapper: str) -> LabPointNavEnv:
    """Return the point navigation environment below all wrappers.

    Raises:
        OptionError: there is another one.
    """
    base = env.unwrapped
    if not isinstance(base, LabPointNavEnv):
        raise OptionError(f"{wrapper} is for point navigation environments, not for {type(base).__name__}")
    return base


def observed(env: gym.Env[Any, Any], wrapper: str, name: str | None, added: str | None) -> spaces.Dict:
    """Return the observation space of an environment, a Dict.

    Args:
        name: an entry that it must have; None for any. added: an entry that it must not have yet; None for any.

    Raises:
        OptionError: it is not so.
    """
    space = env.observation_space
    if not isinstance(space, spaces.Dict):
        raise OptionError(f"{wrapper} needs observations of the space Dict, not {type(space).__name__}")
    names = ", ".join(space.spaces)
    if name is not None and name not in space.spaces:
        raise OptionError(f"{wrapper} needs the entry {name!r} of the observation, which has: {names}")
    if added is not None and added in space.spaces:
        raise OptionError(f"{wrapper} cannot add the entry {added!r}: the observation has one of this name")
    return space
