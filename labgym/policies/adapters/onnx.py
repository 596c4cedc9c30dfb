"""An ONNX file as a policy."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from labgym.errors import LabgymError, MissingDependencyError
from labgym.policies.adapters.inputs import Inputs, checked_action, checked_file
from labgym.policies.policy import EpisodeStart, Observation, Policy


class OnnxPolicy(Policy):
    """Acts with an ONNX graph, run by onnxruntime on one CPU core.

    The inputs are observations by name (`labgym.policies.adapters.inputs.SHAPES`), float32. The first output is the
    action, two numbers in [-1, 1]. No state is kept between steps.

    Args:
        path: path of the file.
        inputs: observation by input, for inputs with other names.

    Raises:
        LabgymError: the file is not an ONNX graph.
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
        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads = options.inter_op_num_threads = 1
        options.log_severity_level = 4
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
            LabgymError: the output is not an action.
        """
        feed = dict(zip(self._inputs.names, self._inputs.arrays(observation), strict=True))
        return checked_action(self._session.run(None, feed)[0], str(self._path))

    def parameters(self) -> Mapping[str, Any]:
        """Return the options; the file counts by its bytes."""
        return {"inputs": self._renamed}

    def files(self) -> tuple[Path, ...]:
        """Return the graph's file."""
        return (self._path,)
