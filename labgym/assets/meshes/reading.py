"""Reading of all mesh formats: bounded reading, common checks, conversion to meters and z up."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from labgym.assets.meshes.glb import read_glb
from labgym.assets.meshes.model import (
    LIMITS,
    Axis,
    MeshError,
    MeshFile,
    MeshLimits,
    MeshPart,
    OptionSource,
    Points,
    RawMesh,
)
from labgym.assets.meshes.stage import read_usd
from labgym.assets.meshes.unitless import read_obj, read_stl
from labgym.errors import OptionError, UnknownNameError

UNITS = {"m": 1.0, "dm": 0.1, "cm": 0.01, "mm": 0.001, "um": 1e-6, "in": 0.0254, "ft": 0.3048, "yd": 0.9144}
"""Meters per unit."""
DEFAULT_UNITS = {".stl": "mm", ".obj": "m", ".glb": "m", ".usd": "cm", ".usda": "cm", ".usdc": "cm", ".usdz": "cm"}
"""Unit of a file that does not name it: by the standards of glTF and USD, by custom for STL and OBJ."""
DEFAULT_UP: dict[str, Axis] = {".stl": "Z", ".obj": "Y", ".usd": "Y", ".usda": "Y", ".usdc": "Y", ".usdz": "Y"}
"""Vertical axis of a file that does not name it: by the standard of USD, by custom for STL and OBJ."""
SCALES = (1e-6, 1e6)
"""Least and greatest scale factor."""
FORMATS = tuple(DEFAULT_UNITS)
MAX_COORDINATE_M = 1e6
"""Greatest coordinate in meters."""

_READERS: dict[str, Callable[[Path, bytes, MeshLimits], RawMesh]] = {
    ".stl": read_stl,
    ".obj": read_obj,
    ".glb": read_glb,
}
TO_Z_UP: dict[Axis, Points] = {
    "X": np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]),
    "Y": np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]),
    "Z": np.eye(3),
}
"""Rotation from axes with that one up to z up."""


def read_mesh(
    path: Path, unit: str | None = None, up: Axis | None = None, limits: MeshLimits = LIMITS, scale: float | None = None
) -> MeshFile:
    """Read a USD, GLB, OBJ or STL file into meters with z up. Textures and network addresses are never opened.

    Args:
        unit: name in `UNITS`; overrides the file's.
        up: axis that points up in the file; overrides that of the file or its format.
        limits: how large a file is accepted.
        scale: factor applied after the unit, for models drawn without a unit; within `SCALES`.

    Raises:
        MeshError: missing, of an unknown format, hostile, broken, without faces, or beyond the limits.
        UnknownNameError: no such unit.
        OptionError: the scale is out of bounds.
        MissingDependencyError: a USD file, and usd-core is not installed.
    """
    path = Path(path)
    if unit is not None and unit not in UNITS:
        raise UnknownNameError("unit", unit, UNITS)
    if scale is not None and not SCALES[0] <= scale <= SCALES[1]:
        raise OptionError(f"scale is {scale:g}, expected {SCALES[0]:g} to {SCALES[1]:g}")
    suffix = path.suffix.lower()
    if suffix not in FORMATS:
        raise MeshError(path, f"files of type {suffix or 'without a suffix'!r} are not read; use {', '.join(FORMATS)}")
    if not path.is_file():
        raise MeshError(path, "no such file" if not path.exists() else "not a regular file")
    size = path.stat().st_size
    if not 0 < size <= limits.bytes:
        raise MeshError(
            path, f"{size} bytes, expected 1 to {limits.bytes}; " + ("export it again", "simplify it")[size > 0]
        )
    raw = _READERS[suffix](path, path.read_bytes(), limits) if suffix in _READERS else read_usd(path, limits)
    return from_raw(path, raw, unit, up, scale)


def from_raw(
    path: Path, raw: RawMesh, unit: str | None = None, up: Axis | None = None, scale: float | None = None
) -> MeshFile:
    """Return the mesh of a format's reader in meters with z up, after the checks that all formats share.

    Raises:
        MeshError: no faces, faces or vertices out of order, or an implausible unit.
    """
    meters, name, unit_from = _unit(path, raw, unit, DEFAULT_UNITS[path.suffix.lower()])
    factor = 1.0 if scale is None else scale
    axis = up or raw.up_axis or DEFAULT_UP[path.suffix.lower()]
    up_from: OptionSource = "option" if up else "file metadata" if raw.up_axis else "format default"
    parts = tuple(_checked(path, part, factor * meters, TO_Z_UP[axis]) for part in raw.parts if len(part.faces))
    if not parts:
        raise MeshError(path, "has no faces; export the model's surface as a mesh")
    source: OptionSource = unit_from if scale is None else "option"
    return MeshFile(parts, raw.name or path.stem, str(path), name, source, axis, up_from, factor, raw.metadata)


def _unit(path: Path, raw: RawMesh, option: str | None, default: str) -> tuple[float, str, OptionSource]:
    """Return meters per unit, the unit's name and its source."""
    if option is not None:
        return UNITS[option], option, "option"
    if raw.unit is None:
        return UNITS[default], default, "format default"
    if not (np.isfinite(raw.unit) and 1e-9 <= raw.unit <= 1e6):
        raise MeshError(path, f"states a unit of {raw.unit:g} m; name the right one with --unit")
    names = [name for name, scale in UNITS.items() if abs(scale - raw.unit) <= 1e-6 * scale]
    return raw.unit, names[0] if names else f"{raw.unit:g} m", "file metadata"


def _checked(path: Path, part: MeshPart, scale: float, turn: Points) -> MeshPart:
    vertices, faces = np.asarray(part.vertices, dtype=np.float64), np.asarray(part.faces, dtype=np.int64)
    if not (faces.min() >= 0 and faces.max() < len(vertices)):
        problem = f"part {part.name!r}: a face names vertex {faces.max()}, {len(vertices)} vertices are given"
        raise MeshError(path, f"{problem}; export it again")
    if not np.isfinite(vertices).all():
        raise MeshError(path, f"part {part.name!r} has a vertex that is not a number or infinite; export it again")
    meters = scale * vertices
    if np.abs(meters).max() > MAX_COORDINATE_M:
        reach = f"{np.abs(meters).max():.3g} m from its origin, expected at most {MAX_COORDINATE_M:g} m"
        raise MeshError(path, f"part {part.name!r} reaches {reach}; check the unit")
    used, compact = np.unique(faces, return_inverse=True)
    return MeshPart(part.name, meters[used] @ turn.T, compact.reshape(-1, 3), part.color, part.material)
