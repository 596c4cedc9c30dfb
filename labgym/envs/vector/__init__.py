"""Many environments at once on the planar kernel, for Gymnasium and stable-baselines3."""
