"""Files of networks from other tools: checks before loading, and inputs filled from the observation."""

from __future__ import annotations

import io
import warnings
import zipfile
import zlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from labgym.artefacts import artefacts
from labgym.confinement import confined
from labgym.envs.sensors import IMAGE_SHAPE
from labgym.errors import LabgymError, OptionError, check_name
from labgym.policies.policy import Observation, Sensors

SHAPES: dict[str, tuple[int, ...]] = {
    "goal": (1, 3),
    "velocity": (1, 2),
    "odometry": (1, 3),
    "lidar": (1, 180),
    "depth": (1, 1, *IMAGE_SHAPE),
    "rgb": (1, 3, *IMAGE_SHAPE),
}
"""Shapes of the possible inputs, float32 with a batch of one: meters and radians as observed, colors in [0, 1]."""


class Inputs:
    """The observations that a network takes, in its order.

    Args:
        names: names of the inputs.
        renamed: observation by input, for inputs with other names than the observation.
        source: the file, for errors.

    Attributes:
        sensors: sensors that the environment must provide for them.

    Raises:
        UnknownNameError: an input is not an observation.
        OptionError: a renamed input does not exist, or the inputs need both lidar and camera.
    """

    def __init__(self, names: Sequence[str], renamed: Mapping[str, str] | None, source: str) -> None:
        renamed = dict(renamed or {})
        unknown = sorted(renamed.keys() - set(names))
        if unknown:
            raise OptionError(f"{source}: there is no input {unknown[0]!r} to rename; its inputs: {', '.join(names)}")
        self.names = tuple(names)
        self._observed = tuple(renamed.get(name, name) for name in names)
        for name in self._observed:
            check_name(f"{source}: observation of an input", name, SHAPES)
        self.sensors = sensors_for(self._observed, source)

    def arrays(self, observation: Observation) -> list[NDArray[np.float32]]:
        """Return the inputs for an observation, with the shapes of `SHAPES`."""
        return [_array(name, observation) for name in self._observed]


def sensors_for(names: Sequence[str], source: str) -> Sensors:
    """Return the environment's `observation` that contains all of some keys.

    Raises:
        OptionError: they need both lidar and camera, which no observation has.
    """
    camera: Sensors | None = "rgbd" if "rgb" in names else "depth" if "depth" in names else None
    if camera and "lidar" in names:
        raise OptionError(f"{source}: needs lidar and camera; the environment gives only one of them")
    return camera or "lidar"


def checked_file(path: str | Path) -> Path:
    """Return the path of a policy's file.

    Raises:
        LabgymError: the file does not exist.
    """
    path = Path(path)
    if not path.is_file():
        raise LabgymError(f"policy {str(path)!r}: no such file")
    return path


def check_trust(path: Path, trust: bool, kind: str, danger: str) -> None:
    """Refuse a file that can act outside of a box, unless it is labgym's own or the user trusts its author; then warn.

    Args:
        path: the file. trust: the user's option. kind: of the file. danger: why it can act.

    Raises:
        LabgymError: the file is foreign and not trusted, and this process has not entered the box.
    """
    if confined() or path.resolve().is_relative_to(artefacts("policies").resolve()):
        return
    acts = f"a {kind} can run any code of its author with your rights, because {danger}"
    if not trust:
        raise LabgymError(
            f"policy {str(path)!r}: {acts}; if you trust its author, pass the option trust=true; otherwise drive it in "
            "a box (labgym eval, on a kernel with Landlock), or export it to ONNX or safetensors, which hold data"
        )
    warnings.warn(f"{path}: {acts}; it is loaded, because trust is set", stacklevel=3)


def checked_action(output: object, source: str) -> NDArray[np.float64]:
    """Return a network's output as an action (2,), clipped to [-1, 1].

    Raises:
        LabgymError: the output is not two finite numbers.
    """
    try:
        action = np.asarray(output, dtype=np.float64).ravel()
    except (TypeError, ValueError):
        action = np.empty(0)
    if action.shape != (2,) or not np.isfinite(action).all():
        raise LabgymError(f"{source}: returned {str(output)[:60]!r}, expected two finite numbers: forward and turn")
    return np.clip(action, -1.0, 1.0)


def _array(name: str, observation: Observation) -> NDArray[np.float32]:
    value: NDArray[Any] = np.asarray(observation[name])
    if name == "rgb":
        value = value.transpose(2, 0, 1).astype(np.float32) / np.float32(255.0)
    return np.ascontiguousarray(value, dtype=np.float32).reshape(SHAPES[name])


MAX_UNPACKED_BYTES = 512 * 2**20
"""Largest sum of all members when unpacked, also of the members of archives inside."""

MAX_MEMBERS = 10_000

MAX_NESTING = 2
"""An archive of stable-baselines3 holds archives of torch."""


def check_archive(path: Path) -> tuple[str, ...]:
    """Return the names of the members of a policy's zip archive.

    Raises:
        LabgymError: the file is not a zip archive, is damaged, or unpacks to too much.
    """
    try:
        with zipfile.ZipFile(path) as archive:
            names = tuple(archive.namelist())
            _unpacked(path, archive, 1)
    except (zipfile.BadZipFile, zlib.error, ValueError, NotImplementedError, RuntimeError, OSError, EOFError) as error:
        raise LabgymError(f"policy {str(path)!r} is not a readable zip archive ({str(error)[:80]})") from None
    return names


def _unpacked(path: Path, archive: zipfile.ZipFile, depth: int) -> tuple[int, int]:
    """Return the number of members of an archive and their size when unpacked, bytes.

    Raises:
        LabgymError: they exceed the limits.
    """
    count, size = len(archive.infolist()), sum(member.file_size for member in archive.infolist())
    _check(path, count, size)
    for member in archive.infolist() if depth < MAX_NESTING else ():
        with archive.open(member) as stream:
            if stream.read(4) != b"PK\x03\x04":
                continue
        with zipfile.ZipFile(io.BytesIO(archive.read(member))) as inner:
            more = _unpacked(path, inner, depth + 1)
        count, size = count + more[0], size + more[1]
        _check(path, count, size)
    return count, size


def _check(path: Path, count: int, size: int) -> None:
    if count > MAX_MEMBERS or size > MAX_UNPACKED_BYTES:
        raise LabgymError(
            f"policy {str(path)!r} unpacks to {size} bytes in {count} files; at most {MAX_UNPACKED_BYTES} bytes in "
            f"{MAX_MEMBERS} files are loaded"
        )


NEAR_GOAL_M = 1.0
"""Distance from which on the input stays the same, meters."""

NEAR_GOAL_SCALE = 5.0
"""The input at that distance. A network that must stop within 0.36 m has to tell decimeters near the goal, which the
normalized distance of a whole drive shrinks to hundredths."""


def near_goal(goal: NDArray[Any]) -> NDArray[np.float32]:
    """Return distance, x and y of the goal in the robot frame, (..., 3): at most 5, which stands for a meter.

    Args:
        goal: distance, cosine and sine of the bearing, as of `GoalSensor`, shape (..., 3).
    """
    distance = NEAR_GOAL_SCALE / NEAR_GOAL_M * np.minimum(goal[..., :1], NEAR_GOAL_M)
    near: NDArray[np.float32] = np.concatenate([distance, distance * goal[..., 1:]], axis=-1).astype(np.float32)
    return near
