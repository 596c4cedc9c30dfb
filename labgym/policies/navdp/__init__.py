"""NavDP-style: trajectories by diffusion, the best of them chosen by a critic."""
