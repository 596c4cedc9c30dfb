"""Geometry of imported assets, visible and colliding, in one file that is named by its hash."""

from __future__ import annotations

import hashlib
import io
import json
import re
import zipfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from labgym.assets.model import Asset
from labgym.errors import DocumentError, LabgymError

Points = NDArray[np.float64]
Faces = NDArray[np.int64]

SHAPE = "mesh"
"""Name of the shape of assets whose geometry is imported; its parameters are `file` and `sha256`."""
SAFE_NAME = re.compile(r"meshes/[A-Za-z0-9]{2,64}-[0-9a-f]{12}\.npz")
MAX_BYTES = 128 * 1024**2
"""Largest size of geometry, also when unpacked; two million vertices and faces take 48 MB."""
SAME_SIZE_M = 1e-3
"""Largest difference, in meters, between the extents of geometry and a size that it agrees with."""


@dataclass(frozen=True)
class MeshPiece:
    """Triangles of one material in an asset's frame: vertices (n, 3) in meters, faces (m, 3) wound outwards."""

    vertices: Points
    faces: Faces
    material: str


@dataclass(frozen=True)
class Geometry:
    """An imported asset's visible pieces, and the convex bodies (vertices, faces) that stand for it in collisions."""

    pieces: tuple[MeshPiece, ...]
    convex: tuple[tuple[Points, Faces], ...]


_contents: dict[str, Geometry | Path] = {}


def pack(geometry: Geometry) -> bytes:
    """Return geometry as the bytes of an npz file; equal geometry gives equal bytes."""
    bodies = [(piece.vertices, piece.faces) for piece in geometry.pieces] + list(geometry.convex)
    arrays: dict[str, NDArray[np.generic]] = {"materials": _text([piece.material for piece in geometry.pieces])}
    for k, (vertices, faces) in enumerate(bodies):
        arrays[f"vertices_{k}"] = vertices.astype(np.float32)
        arrays[f"faces_{k}"] = faces.astype(np.int32)
    stream = io.BytesIO()
    np.savez_compressed(stream, allow_pickle=False, **arrays)
    return stream.getvalue()


def unpack(content: bytes, source: object) -> Geometry:
    """Return the geometry of an npz file's bytes.

    Raises:
        DocumentError: not such a file, too large, or faces that name missing vertices.
    """
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as package:
            if sum(entry.file_size for entry in package.infolist()) > MAX_BYTES:
                raise DocumentError(source, "", f"unpacks to more than {MAX_BYTES} bytes")
        arrays = np.load(io.BytesIO(content), allow_pickle=False)
        materials = json.loads(arrays["materials"].tobytes())
        bodies = [_body(arrays, k) for k in range((len(arrays.files) - 1) // 2)]
        pieces = [MeshPiece(*body, str(name)) for body, name in zip(bodies, materials, strict=False)]
    except DocumentError:
        raise
    except Exception as error:  # noqa: BLE001 - zipfile, zlib and numpy raise many types for a damaged file
        raise DocumentError(source, "", f"not the geometry of an asset ({type(error).__name__})") from None
    return Geometry(tuple(pieces), tuple(bodies[len(pieces) :]))


def digest(content: bytes) -> str:
    """Return the hash that identifies geometry."""
    return hashlib.sha256(content).hexdigest()


def remember(content: bytes) -> str:
    """Make geometry known to this process and return its hash."""
    name = digest(content)
    _contents[name] = unpack(content, "geometry")
    return name


def find_geometry(asset: Asset, folder: Path) -> None:
    """Register the geometry of a catalog entry, from its file under the catalog's folder.

    Raises:
        DocumentError: an unsafe name, no such file, or contents other than recorded.
    """
    name, recorded = (str(asset.shape.parameters.get(key, "")) for key in ("file", "sha256"))
    if SAFE_NAME.fullmatch(name) is None:
        raise DocumentError(
            folder, f"{asset.name}.shape.file", f"{name[:80]!r} is not a file name in the folder meshes"
        )
    path = folder / name
    if path.is_symlink() or not path.is_file():
        raise DocumentError(path, "", f"missing; {asset.name} needs it: add the asset again with --overwrite")
    if path.stat().st_size > MAX_BYTES or digest(path.read_bytes()) != recorded:
        raise DocumentError(
            path, "", f"its contents changed since {asset.name} was added: add the asset again with --overwrite"
        )
    if not isinstance(_contents.get(recorded), Geometry):
        _contents[recorded] = path


def geometry(asset: Asset) -> Geometry:
    """Return the geometry of an imported asset, scaled along each axis to the asset's size.

    Raises:
        LabgymError: its catalog has not been read in this process.
    """
    name = str(asset.shape.parameters.get("sha256", ""))
    entry = _contents.get(name)
    if entry is None:
        raise LabgymError(
            f"geometry of {asset.name!r} is unknown; set LABGYM_CATALOG to the folder that it was added to"
        )
    if isinstance(entry, Path):
        content = entry.read_bytes()
        if digest(content) != name:
            raise DocumentError(entry, "", f"changed since {asset.name} was loaded; load the catalog again")
        entry = _contents[name] = unpack(content, entry)
    return _fitted(entry, asset)


def _fitted(geometry: Geometry, asset: Asset) -> Geometry:
    """Return geometry scaled to an asset's size; geometry that agrees with it within a millimeter is unchanged."""
    corners = np.concatenate([piece.vertices for piece in geometry.pieces])
    extents = np.ptp(corners, axis=0)
    size = np.array([asset.size.width, asset.size.depth, asset.size.height])
    factor = np.where(np.abs(size - extents) > SAME_SIZE_M, size / np.maximum(extents, 1e-9), 1.0)
    if (factor == 1.0).all():
        return geometry
    pieces = tuple(MeshPiece(piece.vertices * factor, piece.faces, piece.material) for piece in geometry.pieces)
    return Geometry(pieces, tuple((vertices * factor, faces) for vertices, faces in geometry.convex))


def convex_bodies(asset: Asset) -> tuple[tuple[Points, Faces], ...]:
    """Return the convex bodies of an imported asset, in its frame; none for a parametric one, whose boxes collide."""
    return geometry(asset).convex if asset.shape.name == SHAPE else ()


def _body(arrays: np.lib.npyio.NpzFile, k: int) -> tuple[Points, Faces]:
    vertices = arrays[f"vertices_{k}"].astype(np.float64)
    faces = arrays[f"faces_{k}"].astype(np.int64)
    shaped = vertices.ndim == faces.ndim == 2 and vertices.shape[1] == faces.shape[1] == 3
    if (
        not shaped
        or not len(faces)
        or faces.min() < 0
        or faces.max() >= len(vertices)
        or not np.isfinite(vertices).all()
    ):
        raise ValueError("faces and vertices do not agree")
    return vertices, faces


def _text(names: list[str]) -> NDArray[np.uint8]:
    return np.frombuffer(json.dumps(names).encode(), dtype=np.uint8)
