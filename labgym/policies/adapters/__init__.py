"""Policies in files of other tools: stable-baselines3, TorchScript, ONNX."""
