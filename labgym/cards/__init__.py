"""Model cards and ablations: how each trained policy is published."""
