"""A TorchScript file as a policy."""

from __future__ import annotations

import pickletools
import re
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from labgym.errors import LabgymError, one_line, optional_package
from labgym.policies.adapters.inputs import Inputs, check_archive, check_trust, checked_action, checked_file
from labgym.policies.policy import EpisodeStart, Observation, Policy

ON_FILES = re.compile(rb"\b(?:from_file|load_tensor)\b|\.\s*save\s*\(")
"""Operators of TorchScript that open a file, in the source of a program."""
PROGRAMS, PICKLES = (".py",), (".pkl", ".debug_pkl")
"""Suffixes of the members of an archive that are checked."""
REMEDY = "write it with torch.jit.save, or export ONNX"


class TorchScriptPolicy(Policy):
    """Acts with a module written by `torch.jit.save`.

    Its `forward` takes observations by the names of its arguments (`labgym.policies.adapters.inputs.SHAPES`) and
    returns the action, two numbers in [-1, 1]. It runs on the CPU; no state is kept between steps. Pickled checkpoints
    (`torch.save`) are refused, because loading one can run any code in it.

    TorchScript is a program: its operators can write any file, at load and in `forward`. A file from outside labgym is
    therefore loaded in a box only (`labgym.policies.process.box`), unless `trust` is set. Programs that name operators
    on files (`torch.from_file`, `torch.save`) are refused in both cases, because results could not record what they
    read.

    Args:
        path: path of the file.
        inputs: observation by argument, for arguments with other names.
        trust: load the file outside of a box, although its program may do anything.

    Raises:
        LabgymError: the file is foreign and neither boxed nor trusted, is not TorchScript, or names operators on files.
        UnknownNameError: an argument is not an observation.
        MissingDependencyError: torch is not installed.
    """

    name: ClassVar[str] = "torchscript"

    def __init__(self, path: str | Path, inputs: Mapping[str, str] | None = None, trust: bool = False) -> None:
        with optional_package("torch", f"policy {str(path)!r}", "train"):
            import torch
        self._path, self._renamed = checked_file(path), dict(inputs or {})
        check_trust(self._path, trust, "TorchScript file", "its program has operators that open files")
        _check_members(self._path)
        try:
            self._module = torch.jit.load(str(self._path), map_location="cpu").eval()  # type: ignore[no-untyped-call]
        except Exception as error:  # noqa: BLE001 - torch raises many types for a damaged file
            reason = one_line(error, 120)
            raise LabgymError(f"policy {str(path)!r} is not TorchScript ({reason}); {REMEDY}") from None
        arguments = [argument.name for argument in self._module.forward.schema.arguments[1:]]
        self._inputs = Inputs(arguments, inputs, str(path))
        self.observation = self._inputs.sensors  # type: ignore[misc] # the file decides, not the class

    def reset(self, episode: EpisodeStart) -> None:
        """Do nothing: there is no state."""

    def act(self, observation: Observation) -> NDArray[np.floating[Any]]:
        """Run the module.

        Raises:
            LabgymError: the output is not an action.
        """
        import torch

        with torch.inference_mode():
            output = self._module(*(torch.from_numpy(array) for array in self._inputs.arrays(observation)))
        return checked_action(output.numpy() if isinstance(output, torch.Tensor) else output, str(self._path))

    def parameters(self) -> Mapping[str, Any]:
        """Return the options; the file counts by its bytes."""
        return {"inputs": self._renamed}

    def files(self) -> tuple[Path, ...]:
        """Return the module's file."""
        return (self._path,)


def _check_members(path: Path) -> None:
    """Refuse a program that names an operator on files, and pickles with texts that are longer than the file.

    torch reserves memory for a text before it finds that the file has ended.

    Raises:
        LabgymError: it does, a pickle is broken, or the file is no archive of reasonable size.
    """
    for name in check_archive(path):
        if not name.endswith(PROGRAMS + PICKLES):
            continue
        try:
            with zipfile.ZipFile(path) as archive:
                content = archive.read(name)
            if name.endswith(PICKLES):
                for _ in pickletools.genops(content):
                    pass
        except Exception as error:  # noqa: BLE001 - both raise many types for a damaged member
            reason = " ".join(f"{name[:80]}: {error}".split())[:120]
            raise LabgymError(f"policy {str(path)!r} is not TorchScript ({reason}); {REMEDY}") from None
        operator = None if name.endswith(PICKLES) else ON_FILES.search(content)
        if operator is not None:
            raise LabgymError(
                f"policy {str(path)!r}: its program opens files ({operator[0].decode()!r} in {name[:80]}), which "
                "results cannot record; keep all data in the module's parameters and buffers"
            )
