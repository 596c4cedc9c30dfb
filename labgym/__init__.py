"""labgym: chemistry laboratories generated from protocols, and a benchmark of robot navigation in them."""

from gymnasium import register

__version__ = "0.2.0"

register(
    id="LabPointNav-v0",
    entry_point="labgym.envs.point_nav:LabPointNavEnv",
    max_episode_steps=600,
)
