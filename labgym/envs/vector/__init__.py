"""Many environments at once, on the planar kernel or in processes, for Gymnasium and stable-baselines3."""
