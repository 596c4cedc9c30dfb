"""PPO: the training and the policy that drives with the trained weights. Nothing here is imported before it is used."""
