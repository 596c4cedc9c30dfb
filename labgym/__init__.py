"""labgym: from a chemistry protocol to a laboratory that a robot can work in, and a benchmark to trust."""

from gymnasium import register

__version__ = "0.2.0"

register(
    id="LabPointNav-v0",
    entry_point="labgym.envs.point_nav:LabPointNavEnv",
    max_episode_steps=600,
)
