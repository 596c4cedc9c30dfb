"""PPO in one file, after CleanRL: the vector environment, one small network for actor and critic, one loss.

    pip install 'labgym-nav[fast,train]'
    python examples/ppo.py

The reward, the return of finished episodes and the share of successes are printed after every update.
"""

import time

import gymnasium as gym
import numpy as np
import torch
from torch import nn
from torch.distributions import Normal

ENVS, STEPS, UPDATES = 64, 64, 200
EPOCHS, MINIBATCHES = 4, 8
GAMMA, LAMBDA, CLIP, ENTROPY, RATE = 0.99, 0.95, 0.2, 0.0, 3e-4

torch.manual_seed(0)
torch.set_num_threads(1)
envs = gym.make_vec(
    "labgym:LabPointNav-v0",
    num_envs=ENVS,
    vectorization_mode="vector_entry_point",
    split="val",
    measures=["is_success"],
)


def flat(observation: dict[str, np.ndarray]) -> torch.Tensor:
    """Return goal, velocity and lidar side by side, scaled to about 1."""
    scaled = (observation["goal"] / [10.0, 1.0, 1.0], observation["velocity"], observation["lidar"] / 10.0)
    return torch.as_tensor(np.concatenate(scaled, axis=1), dtype=torch.float32)


class Agent(nn.Module):
    """Mean and deviation of the actions, and the value."""

    def __init__(self, inputs: int, actions: int) -> None:
        super().__init__()
        self.actor, self.critic = (
            nn.Sequential(nn.Linear(inputs, 128), nn.Tanh(), nn.Linear(128, 128), nn.Tanh(), nn.Linear(128, outputs))
            for outputs in (actions, 1)
        )
        self.log_std = nn.Parameter(torch.full((actions,), -0.5))

    def forward(self, x: torch.Tensor) -> tuple[Normal, torch.Tensor]:
        """Return the distribution of the actions and the values."""
        return Normal(self.actor(x), self.log_std.exp()), self.critic(x)[:, 0]


observation, _ = envs.reset(seed=0)
x = flat(observation)
agent = Agent(x.shape[1], 2)
optimizer = torch.optim.Adam(agent.parameters(), lr=RATE, eps=1e-5)
ended = torch.zeros(ENVS)
begin = time.perf_counter()
for update in range(UPDATES):
    batch: dict[str, list[torch.Tensor]] = {
        name: [] for name in ("x", "action", "logp", "value", "reward", "terminated", "ended", "skip")
    }
    episodes = successes = 0
    for _ in range(STEPS):
        with torch.no_grad():
            policy, values = agent(x)
            action = policy.sample()
        observation, reward, terminated, truncated, infos = envs.step(action.clamp(-1.0, 1.0).numpy())
        done = torch.as_tensor(terminated | truncated, dtype=torch.float32)
        # With NEXT_STEP autoreset, the step after the end of an episode only resets: it is left out of the losses.
        for name, column in (
            ("x", x),
            ("action", action),
            ("logp", policy.log_prob(action).sum(1)),
            ("value", values),
            ("reward", torch.as_tensor(reward, dtype=torch.float32)),
            ("terminated", torch.as_tensor(terminated, dtype=torch.float32)),
            ("ended", done),
            ("skip", ended),
        ):
            batch[name].append(column)
        episodes += int(done.sum())
        successes += int(infos["is_success"][terminated | truncated].sum())
        x, ended = flat(observation), done
    data = {name: torch.stack(columns) for name, columns in batch.items()}
    with torch.no_grad():
        following = agent(x)[1]
    advantages, last = torch.zeros(STEPS, ENVS), torch.zeros(ENVS)
    for t in reversed(range(STEPS)):
        error = data["reward"][t] + GAMMA * following * (1.0 - data["terminated"][t]) - data["value"][t]
        last = error + GAMMA * LAMBDA * (1.0 - data["ended"][t]) * (1.0 - data["skip"][t]) * last
        advantages[t], following = last, data["value"][t]
    returns = (advantages + data["value"]).flatten()
    rows = torch.nonzero(data["skip"].flatten() == 0.0)[:, 0]
    inputs, actions, logps = data["x"].flatten(0, 1), data["action"].flatten(0, 1), data["logp"].flatten()
    advantages = advantages.flatten()
    for _ in range(EPOCHS):
        for part in rows[torch.randperm(len(rows))].chunk(MINIBATCHES):
            policy, values = agent(inputs[part])
            ratio = (policy.log_prob(actions[part]).sum(1) - logps[part]).exp()
            gain = (advantages[part] - advantages[part].mean()) / (advantages[part].std() + 1e-8)
            loss = -torch.min(ratio * gain, ratio.clamp(1.0 - CLIP, 1.0 + CLIP) * gain).mean()
            loss = loss + 0.5 * (values - returns[part]).square().mean() - ENTROPY * policy.entropy().sum(1).mean()
            optimizer.zero_grad()
            loss.backward()
            nn.utils.clip_grad_norm_(agent.parameters(), 0.5)
            optimizer.step()
    steps = (update + 1) * STEPS * ENVS
    print(
        f"{steps:9,d} steps  {steps / (time.perf_counter() - begin):7,.0f} steps/s  "
        f"reward {data['reward'].mean():+.4f}  episodes {episodes:3d}  successes {successes / max(episodes, 1):.2f}",
        flush=True,
    )
envs.close()
