"""Values that the arguments of stable-baselines3's algorithms and of `VecNormalize` accept."""

from __future__ import annotations

import math
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

from labgym.counts import is_finite, is_whole
from labgym.errors import OptionError

LINEAR = "lin_"
"""A text such as "lin_0.001" is a number that falls linearly to 0."""
AUTOMATIC = "auto"
"""The value that SAC adjusts while it learns; "auto_0.1" begins with 0.1."""


@dataclass(frozen=True)
class Number:
    """Numbers of a range.

    Attributes:
        least, most: ends of the range. above: whether `least` itself is excluded.
        whole: whether only whole numbers are accepted.
        prefix: a number as a text with this prefix is also accepted.
        others: further values that are accepted.
    """

    least: float = -math.inf
    most: float = math.inf
    above: bool = False
    whole: bool = False
    prefix: str = ""
    others: tuple[Any, ...] = ()

    def check(self, name: str, value: Any) -> None:
        """Raise OptionError if a value is not accepted."""
        if any(type(value) is type(other) and value == other for other in self.others):
            return
        number = value
        if self.prefix and isinstance(value, str) and value.startswith(self.prefix):
            with suppress(ValueError):
                number = float(value.removeprefix(self.prefix))
        is_number = is_whole(number) if self.whole else is_finite(number)
        if not is_number or not self._contains(number):
            raise OptionError(f"{name} is {value!r}, expected {self._text()}")

    def _contains(self, number: float) -> bool:
        return (self.least < number if self.above else self.least <= number) and number <= self.most

    def _text(self) -> str:
        parts = ["a whole number" if self.whole else "a number"]
        if math.isfinite(self.least):
            parts.append(f"above {self.least:g}" if self.above else f"of at least {self.least:g}")
        if math.isfinite(self.most):
            parts.append(f"{'and ' if math.isfinite(self.least) else ''}of at most {self.most:g}")
        others = ["null" if other is None else str(other) for other in self.others]
        if self.prefix:
            others.append(f"{self.prefix}NUMBER, such as {self.prefix}0.001")
        return " ".join(parts) + "".join(f", or {other}" for other in others)


@dataclass(frozen=True)
class LimitKind:
    """Values of a type.

    Attributes:
        kind: the type. text: its name in messages. optional: whether null is accepted.
    """

    kind: Any
    text: str
    optional: bool = False

    def check(self, name: str, value: Any) -> None:
        """Raise OptionError if a value is not accepted."""
        if not isinstance(value, self.kind) and not (self.optional and value is None):
            raise OptionError(f"{name} is {value!r}, expected {self.text}")


@dataclass(frozen=True)
class Network:
    """Arguments of a policy's networks: a mapping, whose `net_arch` has at least one unit in each layer."""

    def check(self, name: str, value: Any) -> None:
        """Raise OptionError if a value is not accepted."""
        if value is None:
            return
        if not isinstance(value, Mapping):
            raise OptionError(f"{name} is {value!r}, expected a mapping of arguments")
        layers = value.get("net_arch")
        for key, sizes in layers.items() if isinstance(layers, Mapping) else [("net_arch", layers)]:
            if sizes is not None and not (isinstance(sizes, list) and all(map(_is_width, sizes))):
                raise OptionError(f"{key} of {name} is {sizes!r}, expected a list of whole numbers of at least 1")


def _is_width(size: object) -> bool:
    return is_whole(size) and size >= 1


Limit = Number | LimitKind | Network

_COUNT = Number(1, whole=True)
_NOT_NEGATIVE = Number(0.0)
_POSITIVE = Number(0.0, above=True)
_FRACTION = Number(0.0, 1.0)
_FLAG = LimitKind(bool, "true or false")
_MAPPING = LimitKind(Mapping, "a mapping of arguments", optional=True)

_COMMON: dict[str, Limit] = {
    "learning_rate": Number(0.0, above=True, prefix=LINEAR),
    "gamma": _FRACTION,
    "n_steps": _COUNT,
    "policy_kwargs": Network(),
    "sde_sample_freq": Number(-1, whole=True),
    "stats_window_size": _COUNT,
    "use_sde": _FLAG,
}
_PPO: dict[str, Limit] = {
    **_COMMON,
    "batch_size": Number(2, whole=True),
    "clip_range": Number(0.0, above=True, prefix=LINEAR),
    "clip_range_vf": Number(0.0, above=True, prefix=LINEAR, others=(None,)),
    "ent_coef": _NOT_NEGATIVE,
    "gae_lambda": _FRACTION,
    "max_grad_norm": _POSITIVE,
    "n_epochs": _COUNT,
    "normalize_advantage": _FLAG,
    "target_kl": Number(0.0, above=True, others=(None,)),
    "vf_coef": _NOT_NEGATIVE,
}
_SAC: dict[str, Limit] = {
    **_COMMON,
    "batch_size": _COUNT,
    "buffer_size": _COUNT,
    "ent_coef": Number(0.0, prefix=f"{AUTOMATIC}_", others=(AUTOMATIC,)),
    "gradient_steps": Number(1, whole=True, others=(-1,)),
    "learning_starts": Number(0, whole=True),
    "optimize_memory_usage": _FLAG,
    "target_entropy": Number(others=(AUTOMATIC,)),
    "target_update_interval": _COUNT,
    "tau": Number(0.0, 1.0, above=True),
    "train_freq": _COUNT,
    "use_sde_at_warmup": _FLAG,
}
ARGUMENTS: dict[str, dict[str, Limit]] = {
    "ppo": _PPO,
    "recurrent-ppo": _PPO,
    "sac": _SAC,
    "her": {**_SAC, "replay_buffer_kwargs": _MAPPING},
}
"""Arguments by algorithm that a file of hyperparameters can hold; labgym sets or leaves out the others."""

NORMALIZATION: dict[str, Limit] = {
    "clip_obs": _POSITIVE,
    "clip_reward": _POSITIVE,
    "epsilon": _POSITIVE,
    "gamma": _FRACTION,
    "norm_obs": _FLAG,
    "norm_obs_keys": LimitKind(list, "a list of entries of the observation", optional=True),
    "norm_reward": _FLAG,
}
"""Arguments of `VecNormalize`."""
