"""Checkpoints of a training run: tensors and plain numbers, read without unpickling code."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Protocol

import torch

from labgym.documents import write_bytes
from labgym.errors import DocumentError, one_line

MAX_BYTES = 512 * 1024**2
"""Largest size of a checkpoint, also when unpacked."""


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


def load_checkpoint(path: Path, parts: Mapping[str, Stateful], is_record: Callable[[Any], bool]) -> Any:
    """Load the state of all parts from a checkpoint and return its record.

    Only tensors and plain data are read (`weights_only`): a checkpoint that holds other objects is refused.

    Args:
        path: path of the checkpoint.
        parts: networks, optimizers and schedules by name.
        is_record: returns whether plain data are a record of this training.

    Raises:
        DocumentError: the file is missing, damaged or of another network, or holds NaN or infinite numbers.
    """
    if not path.is_file():
        raise DocumentError(path, "", "no such checkpoint; train from the start with --fresh")
    try:
        if path.stat().st_size > MAX_BYTES:
            raise ValueError(f"larger than {MAX_BYTES} bytes")
        if zipfile.is_zipfile(path):
            with zipfile.ZipFile(path) as archive:
                if sum(member.file_size for member in archive.infolist()) > MAX_BYTES:
                    raise ValueError(f"unpacks to more than {MAX_BYTES} bytes")
        state = torch.load(io.BytesIO(path.read_bytes()), weights_only=True)
        if not is_record(state["record"]):
            raise ValueError("its record is not one of this training")
        for name, part in parts.items():
            _check_state(name, state["parts"][name], part.state_dict())
            part.load_state_dict(state["parts"][name])
        return state["record"]
    except Exception as error:  # noqa: BLE001 - torch raises many types for a damaged file
        reason = one_line(error, 160)
        raise DocumentError(
            path, "", f"damaged, or of another network ({reason}); train from the start with --fresh"
        ) from None


def _check_state(name: str, state: Any, current: Any) -> None:
    """Raise ValueError if a state has other entries than a part has now, or a number that is not finite.

    Schedules set every entry of a state as an attribute and check none.
    """
    if not isinstance(state, dict) or set(state) != set(current):
        raise ValueError(f"the state of {name} has other entries")
    for key, value in state.items():
        _check_value(f"{name}.{key}", value, current[key])


def _check_value(name: str, value: Any, current: Any) -> None:
    """Raise ValueError if a value has another type than the present one, at any depth; new entries have no present."""
    if isinstance(value, torch.Tensor) and not bool(torch.isfinite(value).all()):
        raise ValueError(f"{name} holds NaN or infinite numbers")
    numbers = isinstance(value, int | float) and isinstance(current, int | float)
    if current is not None and not numbers and not isinstance(value, type(current)):
        raise ValueError(f"{name} is a {type(value).__name__}, expected {type(current).__name__}")
    if isinstance(value, dict):
        for key, item in value.items():
            _check_value(f"{name}.{key}", item, current.get(key) if isinstance(current, dict) else None)
    elif isinstance(value, list | tuple):
        for item in value:
            _check_value(name, item, current[0] if isinstance(current, list | tuple) and current else None)
