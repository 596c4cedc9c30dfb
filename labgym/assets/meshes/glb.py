"""Binary glTF 2.0: triangles, colors and the scene's nodes. Images and external files are not read."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from labgym.assets.meshes.colors import rgba_from_linear
from labgym.assets.meshes.model import (
    LIMITS,
    Faces,
    MeshError,
    MeshLimits,
    MeshPart,
    Points,
    RawMesh,
    Rgba,
    bounded_metadata,
    printable,
)
from labgym.documents import parse_json
from labgym.errors import DocumentError

JSON_CHUNK, BINARY_CHUNK = 0x4E4F534A, 0x004E4942
TRIANGLES, STRIP, FAN = 4, 5, 6
READ_EXTENSIONS = {"KHR_mesh_quantization", "KHR_materials_unlit", "KHR_texture_transform"}
_COMPONENTS = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_WIDTHS = {"SCALAR": 1, "VEC3": 3}


def read_glb(path: Path, content: bytes, limits: MeshLimits = LIMITS) -> RawMesh:
    """Return the meshes of the default scene, one part for each primitive of each node that shows it.

    Raises:
        MeshError: not glTF 2.0, cut off, compressed by an extension, buffers in other files, a node that is its own
            ancestor, indices out of range, or a limit exceeded.
    """
    try:
        return _File(path, *_chunks(path, content), limits).mesh()
    except (KeyError, IndexError, TypeError, AttributeError, ValueError) as error:
        if isinstance(error, MeshError):
            raise
        reason = printable(error, 120)
        raise MeshError(
            path, f"its glTF contradicts itself ({type(error).__name__}: {reason}); export it again"
        ) from None


def _chunks(path: Path, content: bytes) -> tuple[dict[str, Any], bytes]:
    if content[:4] != b"glTF" or len(content) < 20:
        raise MeshError(path, "not a binary glTF file; export the model as GLB")
    version, stated = (int.from_bytes(content[k : k + 4], "little") for k in (4, 8))
    if version != 2 or stated != len(content):
        problem = f"glTF version {version} of {stated} bytes, expected version 2 of {len(content)} bytes"
        raise MeshError(path, f"{problem}; export it again")
    chunks: dict[int, bytes] = {}
    at = 12
    while at + 8 <= len(content):
        length, kind = (int.from_bytes(content[k : k + 4], "little") for k in (at, at + 4))
        if at + 8 + length > len(content):
            raise MeshError(path, "cut off within a chunk; export it again")
        chunks.setdefault(kind, content[at + 8 : at + 8 + length])
        at += 8 + length
    try:
        header = parse_json(chunks.get(JSON_CHUNK, b""), path)
    except DocumentError as error:
        raise MeshError(path, f"its glTF header cannot be read ({printable(error, 300)}); export it again") from None
    if not isinstance(header, dict):
        raise MeshError(path, "its glTF header is not an object; export it again")
    return header, chunks.get(BINARY_CHUNK, b"")


@dataclass
class _File:
    path: Path
    header: dict[str, Any]
    binary: bytes
    limits: MeshLimits

    def mesh(self) -> RawMesh:
        refused = set(self.header.get("extensionsRequired", ())) - READ_EXTENSIONS
        if refused:
            names = printable(", ".join(sorted(map(str, refused))))
            raise MeshError(self.path, f"needs {names}, which is not read; export it without compression")
        if any("uri" in buffer for buffer in self.header.get("buffers", ())):
            raise MeshError(self.path, "its buffers are outside its binary chunk; export it as one GLB file")
        parts: list[MeshPart] = []
        vertices = faces = primitives = 0
        for name, mesh, matrix in self._instances():
            for primitive in self.header["meshes"][mesh]["primitives"]:
                primitives += 1
                if primitives > self.limits.parts:
                    self._too_large()
                if primitive.get("mode", TRIANGLES) not in (TRIANGLES, STRIP, FAN):
                    continue  # points and lines
                part = self._part(name, primitive, matrix)
                vertices, faces = vertices + len(part.vertices), faces + len(part.faces)
                if vertices > self.limits.vertices or faces > self.limits.faces:
                    self._too_large()
                parts.append(part)
        asset, extras = self.header.get("asset", {}), self.header.get("asset", {}).get("extras", {})
        texts = {key: asset[key] for key in ("generator", "copyright") if key in asset}
        metadata = bounded_metadata(texts | (extras if isinstance(extras, dict) else {}))
        return RawMesh(tuple(parts), self._name(), 1.0, "Y", metadata)

    def _instances(self) -> Iterator[tuple[str, int, Points]]:
        """Yield name, mesh and matrix of every node of the scene that shows a mesh."""
        nodes = self.header.get("nodes", [])
        scenes = self.header.get("scenes", [])
        roots = scenes[self.header.get("scene", 0)].get("nodes", []) if scenes else range(len(nodes))
        stack = [(int(root), np.eye(4), 1) for root in roots]
        seen: set[int] = set()
        while stack:
            index, above, depth = stack.pop()
            # By the standard the nodes are trees; a node reached twice is a cycle or a bomb.
            if index in seen or not 0 <= index < len(nodes) or depth > self.limits.depth:
                raise MeshError(self.path, f"node {index} is missing, nested too deep or used twice; export it again")
            seen.add(index)
            node = nodes[index]
            matrix = above @ _node_matrix(node)
            if "mesh" in node:
                yield printable(node.get("name", "")) or f"node{index}", int(node["mesh"]), matrix
            stack += [(int(child), matrix, depth + 1) for child in reversed(node.get("children", []))]

    def _part(self, name: str, primitive: dict[str, Any], matrix: Points) -> MeshPart:
        points = self._accessor(primitive["attributes"]["POSITION"]).reshape(-1, 3).astype(np.float64)
        if "indices" in primitive:
            corners = self._accessor(primitive["indices"]).reshape(-1).astype(np.int64)
        else:
            corners = np.arange(len(points))
        faces = _triangles(corners, primitive.get("mode", TRIANGLES))
        if np.linalg.det(matrix[:3, :3]) < 0.0:
            faces = faces[:, ::-1]
        material, color = None, None
        if "material" in primitive:
            look = self.header["materials"][primitive["material"]]
            material = printable(look.get("name", "")) or None
            color = _color(look)
        return MeshPart(name, points @ matrix[:3, :3].T + matrix[:3, 3], faces, color, material)

    def _accessor(self, index: int) -> Points:
        accessor = self.header["accessors"][index]
        count, width = int(accessor["count"]), _WIDTHS[accessor["type"]]
        if count > 3 * max(self.limits.vertices, self.limits.faces):
            self._too_large()
        if "sparse" in accessor or "bufferView" not in accessor:
            raise MeshError(self.path, "has sparse accessors, which are not read; export it without them")
        view = self.header["bufferViews"][accessor["bufferView"]]
        kind = np.dtype(_COMPONENTS[accessor["componentType"]])
        start = int(view.get("byteOffset", 0)) + int(accessor.get("byteOffset", 0))
        stride = int(view.get("byteStride", kind.itemsize * width))
        end = start + stride * (count - 1) + kind.itemsize * width
        if start < 0 or count < 1 or stride < kind.itemsize * width or end > len(self.binary):
            raise MeshError(self.path, f"accessor {index} reaches outside the file's data; export it again")
        values = np.ndarray((count, width), kind, self.binary, start, (stride, kind.itemsize))
        if accessor.get("normalized") and kind.kind in "iu":
            return np.maximum(values / np.iinfo(kind).max, -1.0)
        return np.array(values)

    def _name(self) -> str:
        scenes = self.header.get("scenes") or [{}]
        return printable(scenes[self.header.get("scene", 0)].get("name", "")) or self.path.stem

    def _too_large(self) -> None:
        most = f"{self.limits.vertices} vertices, {self.limits.faces} faces and {self.limits.parts} parts"
        raise MeshError(self.path, f"has more than {most}; simplify the mesh")


def _node_matrix(node: dict[str, Any]) -> Points:
    if "matrix" in node:
        return np.array(node["matrix"], dtype=np.float64).reshape(4, 4).T
    matrix = np.eye(4)
    x, y, z, w = (float(value) for value in node.get("rotation", (0.0, 0.0, 0.0, 1.0)))
    rotation = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
    matrix[:3, :3] = rotation * np.array(node.get("scale", (1.0, 1.0, 1.0)), dtype=np.float64).reshape(3)
    matrix[:3, 3] = np.array(node.get("translation", (0.0, 0.0, 0.0)), dtype=np.float64).reshape(3)
    return matrix


def _triangles(corners: Faces, mode: int) -> Faces:
    if mode == TRIANGLES:
        return corners.reshape(-1, 3)
    if mode == FAN:
        return np.stack([np.full(len(corners) - 2, corners[0]), corners[1:-1], corners[2:]], axis=1)
    strip = np.stack([corners[:-2], corners[1:-1], corners[2:]], axis=1)
    strip[1::2] = strip[1::2, ::-1]
    return strip


def _color(material: dict[str, Any]) -> Rgba:
    factor = material.get("pbrMetallicRoughness", {}).get("baseColorFactor", (1.0, 1.0, 1.0, 1.0))
    opacity = float(factor[3]) if material.get("alphaMode", "OPAQUE") == "BLEND" else 1.0
    return rgba_from_linear(factor, opacity)
