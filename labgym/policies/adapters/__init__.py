"""Policies from files that other tools write: stable-baselines3, TorchScript, ONNX."""
