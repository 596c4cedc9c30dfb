"""Weights of a network as `weights.safetensors`, a format that holds numbers and cannot run code."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

import torch
from safetensors import SafetensorError
from safetensors.torch import load, save
from torch import nn

from labgym.documents import check_safetensors_header, write_bytes
from labgym.errors import DocumentError

CONFIG = "config.json"
"""File of a trained policy's folder that describes its network and its training."""

WEIGHTS = "weights.safetensors"
"""File of a trained policy's folder that holds the network's weights."""

MAX_BYTES = 64 * 1024 * 1024

Network = TypeVar("Network", bound=nn.Module)


def save_weights(network: nn.Module, folder: str | Path) -> Path:
    """Write a network's weights into a folder atomically and return the path of the file."""
    tensors = {name: tensor.detach().contiguous() for name, tensor in network.state_dict().items()}
    return write_bytes(Path(folder) / WEIGHTS, save(tensors))


def check_size(make: Callable[[], nn.Module], config: Path) -> None:
    """Check that the network of a configuration can have weights of at most `MAX_BYTES`, without making it.

    Raises:
        DocumentError: the network is larger, or its options contradict each other.
    """
    try:
        with torch.device("meta"):
            network = make()
    except (RuntimeError, ValueError, AssertionError, TypeError, OverflowError) as error:
        raise DocumentError(config, "network", f"cannot be built ({' '.join(str(error).split())[:160]})") from None
    size = sum(tensor.numel() * tensor.element_size() for tensor in network.state_dict().values())
    if size > MAX_BYTES:
        raise DocumentError(config, "network", f"its weights take {size} bytes, at most {MAX_BYTES} are read")


def load_weights(network: Network, folder: str | Path) -> Network:
    """Load the weights in a folder into a network and return it in evaluation mode.

    Raises:
        DocumentError: the file is missing, too large or not a safetensors file, holds NaN or infinite numbers, or
            belongs to another network.
    """
    path = Path(folder) / WEIGHTS
    if not path.is_file():
        raise DocumentError(path, "", "no such file; `labgym train` writes it")
    if path.stat().st_size > MAX_BYTES:
        raise DocumentError(path, "", f"larger than {MAX_BYTES} bytes")
    try:
        check_safetensors_header(path)
        tensors = load(path.read_bytes())
        broken = [name for name, tensor in tensors.items() if not bool(torch.isfinite(tensor).all())]
        if broken:
            raise DocumentError(path, broken[0], "holds NaN or infinite weights; train the network again")
        network.load_state_dict(tensors)
    except (SafetensorError, RuntimeError) as error:
        reason = " ".join(str(error).split())[:200]
        raise DocumentError(path, "", f"not the weights of this network ({reason})") from None
    return network.eval()
