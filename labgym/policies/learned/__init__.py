"""Shared parts of the trained policies: weights, checkpoints, training loop, images, maps, maneuvers, the expert."""
