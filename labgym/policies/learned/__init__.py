"""What the trained policies share: weights and checkpoints, the training loop, image stages, maps, maneuvers."""
