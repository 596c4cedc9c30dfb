"""An ONNX file as a policy."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from labgym.errors import LabgymError, MissingDependencyError
from labgym.policies.adapters.inputs import Inputs, checked_action, checked_file
from labgym.policies.adapters.onnx_file import graph_files
from labgym.policies.policy import EpisodeStart, Observation, Policy

MAX_MEMORY_BYTES = 640 * 2**20
"""Largest memory of all tensors of the graphs in a process, without those that onnxruntime folds."""
SESSION = {
    "session.load_model_format": "ONNX",
    "session.use_env_allocators": "1",
    "optimization.constant_folding_max_output_size_in_bytes": str(2**16),
}
"""Settings of a session: no other format, the arena with a limit, and no large constants that are computed at load."""


class OnnxPolicy(Policy):
    """Acts with an ONNX graph, run by onnxruntime on one CPU core.

    The inputs are observations by name (`labgym.policies.adapters.inputs.SHAPES`), float32. The first output is the
    action, two numbers in [-1, 1]. No state is kept between steps. Weights may be in other files, in the folder of the
    graph or below it; they count in the policy's identity. The graph may take `MAX_MEMORY_BYTES`.

    Args:
        path: path of the file.
        inputs: observation by input, for inputs with other names.

    Raises:
        LabgymError: the file is not an ONNX graph, or exceeds a limit.
        UnknownNameError: an input is not an observation.
        MissingDependencyError: onnxruntime is not installed.
    """

    name: ClassVar[str] = "onnx"

    def __init__(self, path: str | Path, inputs: Mapping[str, str] | None = None) -> None:
        try:
            import onnxruntime
        except ImportError:
            raise MissingDependencyError("onnxruntime", f"policy {str(path)!r}", "onnx") from None
        self._path, self._renamed = checked_file(path), dict(inputs or {})
        self._files = graph_files(self._path)
        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads = options.inter_op_num_threads = 1
        options.log_severity_level = 4
        _share_arena()
        for entry in SESSION.items():
            options.add_session_config_entry(*entry)
        try:
            self._session = onnxruntime.InferenceSession(str(self._path), options, ["CPUExecutionProvider"])
        except Exception as error:
            reason = " ".join(str(error).split())[:120]
            raise LabgymError(f"policy {str(path)!r} is not an ONNX graph for onnxruntime ({reason})") from error
        self._inputs = Inputs([entry.name for entry in self._session.get_inputs()], inputs, str(path))
        self.observation = self._inputs.sensors  # type: ignore[misc] # the file decides, not the class

    def reset(self, episode: EpisodeStart) -> None:
        """Do nothing: there is no state."""

    def act(self, observation: Observation) -> NDArray[np.floating[Any]]:
        """Run the graph.

        Raises:
            LabgymError: the graph fails, or its output is not an action.
        """
        feed = dict(zip(self._inputs.names, self._inputs.arrays(observation), strict=True))
        try:
            outputs = self._session.run(None, feed)
        except Exception as error:  # noqa: BLE001 - onnxruntime raises many types
            reason = " ".join(str(error).split())[:200]
            raise LabgymError(f"{self._path}: the graph fails ({reason})") from None
        return checked_action(outputs[0], str(self._path))

    def parameters(self) -> Mapping[str, Any]:
        """Return the options; the file counts by its bytes."""
        return {"inputs": self._renamed}

    def files(self) -> tuple[Path, ...]:
        """Return the graph's file and those of its weights."""
        return self._files


@cache
def _share_arena() -> None:
    """Let the sessions of this process share one arena with a limit."""
    import onnxruntime

    place = onnxruntime.OrtMemoryInfo(
        "Cpu", onnxruntime.OrtAllocatorType.ORT_ARENA_ALLOCATOR, 0, onnxruntime.OrtMemType.DEFAULT
    )
    limits = onnxruntime.OrtArenaCfg({"max_mem": MAX_MEMORY_BYTES, "arena_extend_strategy": 1})
    onnxruntime.create_and_register_allocator(place, limits)
