"""PPO: how it is trained, and the policy that drives from its weights. Nothing here is imported before it is used."""
