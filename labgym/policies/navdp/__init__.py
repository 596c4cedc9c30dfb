"""A NavDP-style policy: trajectories are drawn by diffusion and a critic chooses among them."""
