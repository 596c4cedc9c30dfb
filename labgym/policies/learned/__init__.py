"""Shared parts of the trained policies: weights and checkpoints, the training loop, image stages, maps, maneuvers."""
