"""Meshes as read from a file and as physical bodies, and the limits on files."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from labgym.assets.model import Size
from labgym.errors import LabgymError

Points = NDArray[np.float64]
Faces = NDArray[np.int64]
Rgba = tuple[float, float, float, float]
Axis = Literal["X", "Y", "Z"]
OptionSource = Literal["file metadata", "option", "format default"]

MAX_METADATA, MAX_TEXT = 32, 200


class MeshError(LabgymError, ValueError):
    """A mesh file that cannot be used: names the file, what is wrong and the remedy.

    Attributes:
        file: the file as it was named. problem: what is wrong and what to do, without the file's name.
    """

    def __init__(self, file: object, problem: str) -> None:
        self.file = str(file)
        self.problem = problem
        super().__init__(f"{self.file}: {problem}")


@dataclass(frozen=True)
class MeshLimits:
    """Limits of a file; a file beyond them is refused, not truncated.

    Attributes:
        bytes: of the file, and of all files that a USD stage is composed of. vertices, faces, parts: of the mesh with
            all its instances. layers, prims, depth: of a USD stage; depth also of a glTF's nodes.
        seconds, memory: wall-clock time and bytes that a process for reading USD or for decomposition may take.
    """

    bytes: int = 256 * 1024**2
    vertices: int = 2_000_000
    faces: int = 2_000_000
    parts: int = 4_000
    layers: int = 256
    prims: int = 50_000
    depth: int = 64
    seconds: int = 120
    memory: int = 6 * 1024**3


LIMITS = MeshLimits()


@dataclass(frozen=True)
class MeshPart:
    """One body of a mesh file.

    Attributes:
        vertices: (n, 3) float64. faces: (m, 3) int64, wound outwards.
        color: red, green, blue as sRGB and opacity, in [0, 1]; None if the file gives none.
        material: the material's name in the file.
    """

    name: str
    vertices: Points
    faces: Faces
    color: Rgba | None = None
    material: str | None = None


@dataclass(frozen=True)
class RawMesh:
    """Parts in a file's own unit and axes, with its instances and transforms applied.

    Attributes:
        unit: meters per unit by the file, None if it does not say. up_axis: by the file or the standard of its format,
            None if neither says.
        metadata: at most 32 texts of at most 200 characters.
    """

    parts: tuple[MeshPart, ...]
    name: str
    unit: float | None
    up_axis: Axis | None
    metadata: dict[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class MeshFile:
    """A mesh file in meters, z up; origin and heading are the file's.

    Attributes:
        parts: bodies with vertices in meters.
        name: what the file calls its object, else the file's stem. path: the file as it was named.
        source_unit: name of the file's unit, or "N m" for one without a name. unit_from: where the unit is from.
        up_axis: the file's own vertical axis. up_from: its source.
        scale: additional factor that was applied.
        metadata: at most 32 texts of at most 200 characters; untrusted.
    """

    parts: tuple[MeshPart, ...]
    name: str
    path: str
    source_unit: str
    unit_from: OptionSource
    up_axis: Axis
    up_from: OptionSource
    scale: float = 1.0
    metadata: dict[str, str] = field(default_factory=dict)

    @property
    def bounds(self) -> Points:
        """Least and greatest coordinates, shape (2, 3), meters."""
        return np.array(
            [
                np.min([part.vertices.min(axis=0) for part in self.parts], axis=0),
                np.max([part.vertices.max(axis=0) for part in self.parts], axis=0),
            ]
        )


@dataclass(frozen=True)
class PhysicalMesh:
    """A mesh in the frame of an asset: meters, z up, front along +y, origin at the center of the bottom face.

    Attributes:
        size: bounding box.
        watertight: whether every part is closed and consistently wound.
        volume: of the parts together in cubic meters, overlaps counted twice; None if not watertight.
        convex: (vertices (n, 3), faces (m, 3)) of convex bodies that together stand for the mesh in collisions.
        decomposed_by: how they were made. note: why decomposition fell back to hulls, else "".
    """

    name: str
    parts: tuple[MeshPart, ...]
    size: Size
    watertight: bool
    volume: float | None
    convex: tuple[tuple[Points, Faces], ...]
    decomposed_by: Literal["coacd", "convex hull"]
    note: str = ""


def bounded_metadata(pairs: dict[str, object]) -> dict[str, str]:
    """Return the first 32 entries of metadata as printable text of bounded length."""
    texts: dict[str, str] = {}
    for key, value in pairs.items():
        text = printable(value)
        if text and len(texts) < MAX_METADATA:
            texts[printable(key)] = text
    return texts


def printable(text: object, limit: int = MAX_TEXT) -> str:
    """Return untrusted text as one printable line of at most `limit` characters."""
    return "".join(char if char.isprintable() else " " for char in str(text)[: 4 * limit]).strip()[:limit]
