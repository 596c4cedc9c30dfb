"""Training of the learned local planner: by imitation of the navigation stack, and by PPO from there."""
