"""An actor on disk: `weights.safetensors`, which holds numbers and nothing else."""

from __future__ import annotations

from pathlib import Path

import torch
from safetensors import SafetensorError
from safetensors.torch import load, save

from labgym.documents import write_bytes
from labgym.errors import DocumentError
from labgym.policies.ppo.inputs import Sensor
from labgym.policies.ppo.network import Actor

WEIGHTS = "weights.safetensors"
MAX_BYTES = 64 * 1024 * 1024


def save_actor(actor: Actor, folder: str | Path) -> Path:
    """Write an actor's weights into a folder, atomically, and return the file's path."""
    tensors = {name: tensor.detach().contiguous() for name, tensor in actor.state_dict().items()}
    return write_bytes(Path(folder) / WEIGHTS, save(tensors))


def load_actor(folder: str | Path, sensor: Sensor) -> Actor:
    """Return the actor of a sensor whose weights are in a folder.

    Raises:
        DocumentError: there is no such file, it is too large or no safetensors file, or its tensors are not this
            network's.
    """
    path = Path(folder) / WEIGHTS
    if not path.is_file():
        raise DocumentError(path, "", "no such file; `labgym train ppo` makes it")
    if path.stat().st_size > MAX_BYTES:
        raise DocumentError(path, "", f"larger than {MAX_BYTES} bytes")
    actor = Actor(sensor)
    try:
        tensors = load(path.read_bytes())
        if not all(bool(torch.isfinite(tensor).all()) for tensor in tensors.values()):
            raise DocumentError(path, "", "holds numbers that are not finite")
        actor.load_state_dict(tensors)
    except (SafetensorError, RuntimeError) as error:
        raise DocumentError(
            path, "", f"holds no weights of this network ({' '.join(str(error).split())[:200]})"
        ) from None
    return actor.eval()
