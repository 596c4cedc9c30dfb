"""Model cards and ablation studies of the trained policies."""
