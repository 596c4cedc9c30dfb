"""Checkpoints of a training run: tensors and plain numbers, read without unpickling code."""

from __future__ import annotations

import io
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Protocol

import torch

from labgym.documents import write_bytes
from labgym.errors import DocumentError


class Stateful(Protocol):
    """A network, an optimizer or a schedule."""

    def state_dict(self) -> Any:
        """Return its state as tensors and plain numbers."""

    def load_state_dict(self, state_dict: Any) -> Any:
        """Restore a state."""


def save_checkpoint(path: Path, parts: Mapping[str, Stateful], record: Any) -> None:
    """Write the state of all parts and a record atomically; a crash leaves the previous checkpoint.

    Args:
        path: path of the checkpoint.
        parts: networks, optimizers and schedules by name.
        record: plain data to store with them, such as the losses so far.
    """
    buffer = io.BytesIO()
    torch.save({"parts": {name: part.state_dict() for name, part in parts.items()}, "record": record}, buffer)
    write_bytes(path, buffer.getvalue())


def load_checkpoint(path: Path, parts: Mapping[str, Stateful]) -> Any:
    """Load the state of all parts from a checkpoint and return its record.

    Only tensors and plain data are read (`weights_only`): a checkpoint that holds other objects is refused.

    Raises:
        DocumentError: the file is missing, damaged or of another network.
    """
    if not path.is_file():
        raise DocumentError(path, "", "no such checkpoint; remove the folder to train from the start")
    try:
        state = torch.load(io.BytesIO(path.read_bytes()), weights_only=True)
        for name, part in parts.items():
            part.load_state_dict(state["parts"][name])
        return state["record"]
    except Exception as error:  # noqa: BLE001 - torch raises many types for a damaged file
        reason = " ".join(f"{type(error).__name__}: {error}".split())[:160]
        raise DocumentError(
            path, "", f"damaged, or of another network ({reason}); remove the folder to train from the start"
        ) from None
