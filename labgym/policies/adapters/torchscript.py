"""A TorchScript file as a policy."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from labgym.errors import LabgymError, MissingDependencyError
from labgym.policies.adapters.inputs import Inputs, checked_action, checked_file
from labgym.policies.policy import EpisodeStart, Observation, Policy


class TorchScriptPolicy(Policy):
    """Acts with a module that `torch.jit.save` wrote.

    Its `forward` takes observations by the names of its arguments (`labgym.policies.adapters.inputs.SHAPES`) and
    returns the action: two numbers in [-1, 1]. It runs on the CPU and keeps no state from step to step. Pickled
    checkpoints (`torch.save`) are refused: to load one is to run whatever is in it.

    Args:
        path: the file.
        inputs: observation by argument, where the arguments have other names.

    Raises:
        LabgymError: the file is no TorchScript.
        UnknownNameError: an argument is no observation.
        MissingDependencyError: torch is not installed.
    """

    name: ClassVar[str] = "torchscript"

    def __init__(self, path: str | Path, inputs: Mapping[str, str] | None = None) -> None:
        try:
            import torch
        except ImportError:
            raise MissingDependencyError("torch", f"policy {str(path)!r}", "train") from None
        self._path = checked_file(path)
        try:
            self._module = torch.jit.load(str(self._path), map_location="cpu").eval()  # type: ignore[no-untyped-call]
        except (RuntimeError, ValueError, OSError) as error:
            reason = str(error).strip().splitlines()[0][:120] if str(error).strip() else type(error).__name__
            raise LabgymError(
                f"policy {str(path)!r} is no TorchScript file ({reason}); write it with torch.jit.save, or export ONNX"
            ) from None
        arguments = [argument.name for argument in self._module.forward.schema.arguments[1:]]
        self._inputs = Inputs(arguments, inputs, str(path))
        self.observation = self._inputs.sensors  # type: ignore[misc] # the file decides, not the class

    def reset(self, episode: EpisodeStart) -> None:
        """Nothing to forget."""

    def act(self, observation: Observation) -> NDArray[np.floating[Any]]:
        """Run the module.

        Raises:
            LabgymError: it returns what is no action.
        """
        import torch

        with torch.inference_mode():
            output = self._module(*(torch.from_numpy(array) for array in self._inputs.arrays(observation)))
        return checked_action(output.numpy() if isinstance(output, torch.Tensor) else output, str(self._path))

    def files(self) -> tuple[Path, ...]:
        """Return the module's file."""
        return (self._path,)
