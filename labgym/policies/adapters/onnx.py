"""An ONNX file as a policy, checked with the files of its weights before loading."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from labgym.documents import read_bytes
from labgym.errors import DocumentError, LabgymError, optional_package
from labgym.policies.adapters.inputs import Inputs, checked_action, checked_file
from labgym.policies.policy import EpisodeStart, Observation, Policy
from labgym.protobuf import sized_fields

MAX_GRAPH_BYTES = 256 * 2**20
"""Largest size of a graph."""

MAX_WEIGHTS_BYTES = 256 * 2**20
"""Largest sum of the other files of a graph."""

MAX_NODES = 10_000

MAX_FIELDS = 1_000_000
"""Largest number of fields of the parts of a graph that are searched; weights in a graph count as one each."""

PARTS: dict[str, dict[int, str]] = {
    "model": {7: "graph", 20: "training", 25: "function"},
    "graph": {1: "node", 5: "tensor", 15: "sparse tensor"},
    "node": {5: "attribute"},
    "attribute": {5: "tensor", 6: "graph", 10: "tensor", 11: "graph", 22: "sparse tensor", 23: "sparse tensor"},
    "sparse tensor": {1: "tensor", 2: "tensor"},
    "training": {1: "graph", 2: "graph"},
    "tensor": {13: "entry"},
    "entry": {},
}
"""Messages in messages of an ONNX file by field number (onnx.proto3); `entry` is a pair of `external_data`."""

KEY_FIELD, VALUE_FIELD = 1, 2


def graph_files(path: Path) -> tuple[Path, ...]:
    """Return the graph's file and the files that hold its weights, sorted by name.

    Raises:
        DocumentError: the file is damaged or exceeds a limit, has local functions, or names weights that are missing or
            outside of its folder.
    """
    content = read_bytes(path, MAX_GRAPH_BYTES)
    try:
        locations = sorted(set(_locations(path, content)))
    except ValueError:
        raise DocumentError(path, "", "is not an ONNX graph (no protocol buffer, or cut off)") from None
    files = [_weights_file(path, location) for location in locations]
    size = sum(file.stat().st_size for file in files)
    if size > MAX_WEIGHTS_BYTES:
        raise DocumentError(path, "external_data", f"weights take {size} bytes; at most {MAX_WEIGHTS_BYTES} are loaded")
    return (path, *files)


def _locations(path: Path, content: bytes) -> Iterator[str]:
    """Yield the location of each tensor whose data are in another file; count nodes and fields."""
    nodes = fields = 0
    waiting = [("model", 0, len(content))]
    while waiting:
        message, start, end = waiting.pop()
        key, values = b"", []
        for number, first, last in sized_fields(content, start, end):
            fields += 1
            part = PARTS[message].get(number)
            nodes += part == "node"
            if nodes > MAX_NODES or fields > MAX_FIELDS:
                raise DocumentError(path, "graph", f"has more than {MAX_NODES} nodes or {MAX_FIELDS} fields")
            if part == "function":
                raise DocumentError(path, "functions", "has local functions, which are not loaded: export it inlined")
            if part is not None:
                waiting.append((part, first, last))
            elif message == "entry" and number == KEY_FIELD:
                key = content[first:last]
            elif message == "entry" and number == VALUE_FIELD:
                values.append(content[first:last])
        if key == b"location":
            yield from (value.decode("utf-8", "replace") for value in values)


def _weights_file(path: Path, location: str) -> Path:
    """Return the file of some weights, which must lie in the folder of the graph or below it."""
    home = path.resolve().parent
    try:
        file = (home / location).resolve()
        inside = file.is_relative_to(home)
        exists = inside and file.is_file()
    except (OSError, ValueError, RuntimeError):
        inside = exists = False
    if not exists:
        problem = "is no file" if inside else "is outside of its folder"
        raise DocumentError(path, "external_data", f"{location[:80]!r} {problem}; export it with its weights inside")
    return home / location


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
        with optional_package("onnxruntime", f"policy {str(path)!r}", "onnx"):
            import onnxruntime
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
