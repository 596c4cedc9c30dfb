"""PPO that begins as imitation: at first the network copies an expert that plans on what it saw, then it learns alone.

The expert labels each state with the action that it would take. At first it drives all episodes, then fewer and fewer,
and from the middle of the imitation on none; the network drives the others. This is DAgger (Ross et al. 2011) on the
states since the last checkpoint, so that a run resumes like PPO.
"""

from __future__ import annotations

import copy
from collections.abc import Iterable
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecEnv, VecEnvWrapper

from labgym.errors import OptionError
from labgym.training.explorer import Explorer


class Guided(VecEnvWrapper):
    """Environments that note what the expert would do in each state.

    Args:
        venv: environments with the attribute `state` that observe goal and lidar.

    Attributes:
        noting: whether they do. share: of the episodes that the expert drives meanwhile.

    Raises:
        OptionError: they do not observe goal and lidar.
    """

    def __init__(self, venv: VecEnv) -> None:
        super().__init__(venv)
        if not {"goal", "lidar"} <= set(getattr(venv.observation_space, "spaces", ())):
            raise OptionError("imitation needs environments that observe goal and lidar")
        self._experts = [Explorer() for _ in range(venv.num_envs)]
        self._seen: Any = None
        self._labels: list[NDArray[np.float32]] = []
        self._rng = np.random.default_rng(0)
        self._draws = np.ones(venv.num_envs)
        self.noting, self.share = False, 0.0

    def seed(self, seed: int | None = None) -> Any:
        """Seed the environments, and the choice of who drives."""
        self._rng = np.random.default_rng(seed)
        return self.venv.seed(seed)

    def reset(self) -> Any:
        """Begin the episodes of all environments."""
        self._begin(range(self.num_envs))
        self._seen = self.venv.reset()
        return self._seen

    def step_async(self, actions: NDArray[Any]) -> None:
        """Take actions, and note the expert's."""
        if self.noting:
            states = self.venv.get_attr("state")
            advice = [
                expert.action(state.task.layout, state.pose, state.velocity, goal, ranges, _people(state))
                for expert, state, goal, ranges in zip(
                    self._experts, states, self._seen["goal"], self._seen["lidar"], strict=True
                )
            ]
            self._labels.append(np.array(advice, dtype=np.float32))
            actions = np.where((self._draws < self.share)[:, None], self._labels[-1], actions)
        self.venv.step_async(actions)

    def step_wait(self) -> Any:
        """Carry out the actions."""
        result = self.venv.step_wait()
        self._seen = result[0]
        self._begin(np.flatnonzero(result[2]).tolist())
        return result

    def _begin(self, numbers: Iterable[int]) -> None:
        """Begin episodes of some environments."""
        for number in numbers:
            self._experts[number].restart()
            self._draws[number] = self._rng.random()

    def labels(self) -> NDArray[np.float32]:
        """Return the expert's actions since the last call, (steps, environments, 2)."""
        labels, self._labels = np.array(self._labels), []
        return labels


def guided(algorithm: type[PPO], imitation: float) -> type[PPO]:
    """Return an algorithm, PPO or RecurrentPPO, that imitates at first; its environments are `Guided`.

    Args:
        imitation: control steps in which it does.
    """

    class GuidedPPO(algorithm):  # type: ignore[misc, valid-type]
        """The algorithm, which begins by imitating the expert."""

        _earlier: list[Any]
        """Rollouts with the expert's actions, since the last checkpoint."""

        def set_random_seed(self, seed: int | None = None) -> None:
            """Seed all generators: a leg begins, in which no earlier rollout counts."""
            super().set_random_seed(seed)
            self._earlier = []

        def collect_rollouts(self, env: VecEnv, callback: Any, rollout_buffer: Any, n_rollout_steps: int) -> bool:
            """Collect a rollout; while the network imitates, the buffer holds the expert's actions."""
            guide = _guide(env)
            guide.noting = self.num_timesteps < imitation
            if guide.noting:
                guide.share = max(0.0, 1.0 - 2.0 * self.num_timesteps / imitation)
            goes_on = bool(super().collect_rollouts(env, callback, rollout_buffer, n_rollout_steps))
            if guide.noting and goes_on:
                rollout_buffer.actions[:] = guide.labels()
            return goes_on

        def train(self) -> None:
            """Update the network: by the expert's actions, later by PPO."""
            if _guide(self.env).noting:
                self._imitate()
            else:
                super().train()

        def _imitate(self) -> None:
            """Pass over this rollout and earlier ones: the mean action follows the expert's, the critic the returns."""
            policy: Any = self.policy
            policy.set_training_mode(True)
            self._update_learning_rate(policy.optimizer)
            losses = []
            chosen = np.random.default_rng([self.seed or 0, self.num_timesteps]).permutation(len(self._earlier))
            rollouts = [self._earlier[k] for k in chosen[: self.n_epochs - 1]]
            rollouts += [self.rollout_buffer] * (self.n_epochs - len(rollouts))
            self._earlier.append(copy.deepcopy(self.rollout_buffer))
            for rollout in rollouts:
                for data in rollout.get(self.batch_size):
                    if hasattr(data, "mask"):
                        counts = data.mask > 0.5
                        memory = data.lstm_states, data.episode_starts
                        action = policy.get_distribution(data.observations, memory[0].pi, memory[1])[0]
                        values = policy.predict_values(data.observations, memory[0].vf, memory[1])
                    else:
                        counts = torch.ones(len(data.actions), dtype=torch.bool, device=data.actions.device)
                        action = policy.get_distribution(data.observations)
                        values = policy.predict_values(data.observations)
                    copying = (action.distribution.mean - data.actions)[counts].abs().mean()
                    judging = (values.flatten() - data.returns)[counts].square().mean()
                    loss = copying + self.vf_coef * judging
                    policy.optimizer.zero_grad()
                    loss.backward()
                    torch.nn.utils.clip_grad_norm_(policy.parameters(), self.max_grad_norm)
                    policy.optimizer.step()
                    losses.append(float(copying.detach()))
                self._n_updates += 1
            self.logger.record("train/imitation_loss", float(np.mean(losses)))

    return GuidedPPO


def _people(state: Any) -> NDArray[np.float64] | None:
    """Return places and velocities of the people of an episode, (n, 4); None without any."""
    people = state.presences.get("people")
    return None if people is None else np.concatenate([people.positions, people.velocities], axis=1)


def _guide(environments: VecEnv) -> Guided:
    """Return the wrapper that notes the expert's actions."""
    while not isinstance(environments, Guided):
        assert isinstance(environments, VecEnvWrapper)
        environments = environments.venv
    return environments
