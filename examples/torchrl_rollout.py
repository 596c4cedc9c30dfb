"""The vector environment in TorchRL: 64 environments, a random policy, and 100 steps of each.

pip install 'labgym-nav[fast]' torchrl
python examples/torchrl_rollout.py
"""

import gymnasium as gym
from torchrl.envs import GymWrapper

envs = gym.make_vec(
    "labgym:LabPointNav-v0",
    num_envs=64,
    vectorization_mode="vector_entry_point",
    autoreset_mode="Disabled",  # TorchRL resets the environments that ended; it refuses the default, NextStep
    split="val",
)
env = GymWrapper(envs)
rollout = env.rollout(100, break_when_any_done=False)
ended = int(rollout["next", "done"].sum())
print(f"batch: {tuple(rollout.batch_size)}, lidar: {tuple(rollout['lidar'].shape)}")
print(f"mean reward: {rollout['next', 'reward'].mean():.3f}, episodes that ended: {ended}")
env.close()
