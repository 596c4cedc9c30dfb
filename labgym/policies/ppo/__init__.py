"""PPO: training, and the policy that drives with the trained weights. Modules are imported on first use."""
