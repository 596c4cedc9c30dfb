"""An action that lasts several steps."""

from __future__ import annotations

from typing import Any

import gymnasium as gym

from labgym.counts import whole_number


class ActionRepeat(gym.Wrapper[Any, Any, Any, Any], gym.utils.RecordConstructorArgs):
    """Carry out every action several times, and return the last observation with the sum of the rewards.

    The repetition ends with the episode. Of the info, `cost` and `reward_terms` are sums and `collision` says whether
    any step had one; the other entries are those of the last step. The limit of `gym.make` counts the steps of the
    environment inside, not those of this wrapper.

    Gymnasium's `MaxAndSkipObservation` also takes the maximum of the last two observations, which suits flickering
    screens and no range finder; its `StickyAction` repeats at random.

    Args:
        env: any environment.
        times: number of steps of an action.

    Raises:
        OptionError: `times` is not a whole number of at least 1.
    """

    def __init__(self, env: gym.Env[Any, Any], times: int = 4) -> None:
        whole_number("times", times)
        gym.utils.RecordConstructorArgs.__init__(self, times=times)
        gym.Wrapper.__init__(self, env)
        self._times = times
        self.metadata = {**env.metadata, "render_fps": env.metadata.get("render_fps", 10) / times}

    def step(self, action: Any) -> tuple[Any, Any, bool, bool, dict[str, Any]]:
        """Carry out one action until it has lasted, or the episode ends."""
        observation, first, terminated, truncated, info = self.env.step(action)
        reward: Any = first
        sums = _Sums(info)
        for _ in range(self._times - 1):
            if terminated or truncated:
                break
            observation, more, terminated, truncated, info = self.env.step(action)
            reward += more
            sums.add(info)
        return observation, reward, terminated, truncated, {**info, **sums.entries}


class _Sums:
    """The entries of the info that belong to all steps of an action."""

    def __init__(self, info: dict[str, Any]) -> None:
        self.entries: dict[str, Any] = {
            name: info[name] for name in ("cost", "collision", "reward_terms") if name in info
        }

    def add(self, info: dict[str, Any]) -> None:
        """Add a step."""
        for name, value in self.entries.items():
            if name == "collision":
                self.entries[name] = value or info[name]
            elif name == "cost":
                self.entries[name] = value + info[name]
            else:
                self.entries[name] = {term: value[term] + info[name][term] for term in value}
