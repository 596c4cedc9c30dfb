"""The state of a model in training as tensors and numbers, for checkpoints that are read without unpickling code."""

from __future__ import annotations

from operator import attrgetter
from typing import Any

import numpy as np
import torch
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.buffers import ReplayBuffer
from stable_baselines3.common.off_policy_algorithm import OffPolicyAlgorithm
from stable_baselines3.common.vec_env import VecNormalize
from torch import Tensor

from labgym.policies.learned.checkpoint import Stateful


def model_parts(model: BaseAlgorithm) -> dict[str, Stateful]:
    """Return everything that a checkpoint stores: networks, optimizers, replay buffer and statistics."""
    names, variables = model._get_torch_save_params()
    parts: dict[str, Stateful] = {name: attrgetter(name)(model) for name in names}
    parts |= {name: TensorState(attrgetter(name)(model)) for name in variables}
    if isinstance(model, OffPolicyAlgorithm) and model.replay_buffer is not None:
        parts["replay_buffer"] = BufferState(model.replay_buffer)
    normalize = model.get_vec_normalize_env()
    if normalize is not None:
        parts["normalize"] = StatisticsState(normalize)
    return parts


class TensorState:
    """A tensor that an optimizer refers to, such as the entropy coefficient of SAC."""

    def __init__(self, tensor: Tensor) -> None:
        self._tensor = tensor

    def state_dict(self) -> dict[str, Tensor]:
        """Return the value."""
        return {"value": self._tensor.detach().clone()}

    def load_state_dict(self, state_dict: dict[str, Tensor]) -> None:
        """Set the value in place."""
        self._tensor.data.copy_(state_dict["value"])


class StatisticsState:
    """The running statistics of a `VecNormalize`."""

    def __init__(self, normalize: VecNormalize) -> None:
        statistics: Any = normalize.obs_rms if normalize.norm_obs else {}
        named = statistics if isinstance(statistics, dict) else {"": statistics}
        self._statistics = {
            **{f"observation.{name}": each for name, each in named.items()},
            "return": normalize.ret_rms,
        }

    def state_dict(self) -> dict[str, Tensor]:
        """Return mean, variance and count of each, float64."""
        return {
            f"{name}.{part}": torch.tensor(getattr(each, part), dtype=torch.float64)
            for name, each in self._statistics.items()
            for part in ("mean", "var", "count")
        }

    def load_state_dict(self, state_dict: dict[str, Tensor]) -> None:
        """Set the statistics."""
        for name, each in self._statistics.items():
            each.mean, each.var = state_dict[f"{name}.mean"].numpy().copy(), state_dict[f"{name}.var"].numpy().copy()
            each.count = float(state_dict[f"{name}.count"])


class BufferState:
    """The transitions of a replay buffer."""

    ROWS = ("actions", "rewards", "dones", "timeouts", "ep_start", "ep_length")
    """Arrays with a row for each transition of all environments; the last two are of hindsight experience replay."""
    OBSERVATIONS = ("observations", "next_observations")

    def __init__(self, buffer: ReplayBuffer) -> None:
        self._buffer: Any = buffer

    def state_dict(self) -> dict[str, Any]:
        """Return the rows in use, and where the next transition goes."""
        rows = self._buffer.size()
        state: dict[str, Any] = {name: torch.from_numpy(array[:rows]) for name, array in self._arrays().items()}
        state |= {"pos": self._buffer.pos, "full": self._buffer.full}
        if hasattr(self._buffer, "_current_ep_start"):
            state["_current_ep_start"] = torch.from_numpy(self._buffer._current_ep_start)
        return state

    def load_state_dict(self, state_dict: dict[str, Any]) -> None:
        """Set the rows in use."""
        for name, array in self._arrays().items():
            rows = state_dict[name].numpy()
            if rows.shape[1:] != array.shape[1:] or len(rows) > len(array):
                raise ValueError(f"{name} of the replay buffer has shape {rows.shape}, expected {array.shape} or fewer")
            array[: len(rows)] = rows
        self._buffer.pos, self._buffer.full = state_dict["pos"], state_dict["full"]
        if hasattr(self._buffer, "_current_ep_start"):
            self._buffer._current_ep_start[:] = state_dict["_current_ep_start"].numpy()

    def _arrays(self) -> dict[str, np.ndarray[Any, Any]]:
        arrays = {name: getattr(self._buffer, name) for name in self.ROWS if hasattr(self._buffer, name)}
        for name in self.OBSERVATIONS:
            entries = getattr(self._buffer, name)
            named = entries if isinstance(entries, dict) else {"": entries}
            arrays |= {f"{name}.{key}": array for key, array in named.items()}
        return arrays
