"""USD stages as meshes, read in a separate process: the default prim as a renderer shows it at the first time."""

from __future__ import annotations

import importlib.util
import io
import json
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import asdict, replace
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from labgym.assets.meshes.colors import rgba_from_linear
from labgym.assets.meshes.isolated import answering, run_isolated
from labgym.assets.meshes.layers import check_layers, diagnostics
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
from labgym.assets.meshes.polygons import triangulate
from labgym.errors import MissingDependencyError

SOLIDS = ("Cube", "Sphere", "Cylinder", "Cone", "Capsule")
UNREAD = ("PointInstancer", "NurbsPatch", "BasisCurves", "NurbsCurves", "HermiteCurves", "TetMesh", "Volume")
_FROM_Z = {"X": (2, 0, 1), "Y": (1, 2, 0), "Z": (0, 1, 2)}
"""Which coordinate of a solid along z becomes x, y and z of one along that axis."""
MEMORY_BYTES = 1536 * 1024**2
"""Address space that USD takes for small files, bytes: 1.2 GiB, mostly of its libraries, and room for their content."""
MEMORY_PER_BYTE = 24
"""Further address space for each byte of the files: uncompressed content, and copies of it in NumPy arrays."""
MAX_FILES = 1000
SUFFIXES = (".usd", ".usda", ".usdc", ".usdz")


def read_usd(path: Path, limits: MeshLimits = LIMITS) -> RawMesh:
    """Return what `read_stage` reads, from a process with bounded memory and time.

    Raises:
        MeshError: as `read_stage`, and if the process takes too long, takes too much memory or crashes.
        MissingDependencyError: usd-core is not installed.
    """
    if importlib.util.find_spec("pxr") is None:
        raise MissingDependencyError("usd-core", f"reading {path.name}", "usd")
    limits = replace(limits, memory=memory_for(path, limits))
    try:
        child = run_isolated(__name__, (str(path), json.dumps(asdict(limits))), limits.seconds)
    except subprocess.TimeoutExpired:
        problem = f"took more than {limits.seconds} s to read; flatten the stage; it may instance itself recursively"
        raise MeshError(path, problem) from None
    if child.stdout.startswith(b"{"):
        raise MeshError(path, str(json.loads(child.stdout)["error"]))
    if child.returncode or not child.stdout:
        how = f"signal {-child.returncode}" if child.returncode < 0 else f"exit {child.returncode}"
        problem = f"USD's reader failed on it ({how}; it may take {limits.memory // 1024**2} MiB of memory)"
        raise MeshError(path, f"{problem}; flatten and simplify the stage or export it again")
    return unpack(child.stdout)


def memory_for(path: Path, limits: MeshLimits = LIMITS) -> int:
    """Return the address space for reading a file: it grows with the file and the USD files below its folder, bytes."""
    others = (file for file in islice(path.resolve().parent.rglob("*"), MAX_FILES) if file.suffix in SUFFIXES)
    size = path.stat().st_size + sum(file.stat().st_size for file in others if file.is_file())
    return min(limits.memory, MEMORY_BYTES + MEMORY_PER_BYTE * size)


def unpack(content: bytes) -> RawMesh:
    """Return the mesh in an npz archive of `pack`."""
    with np.load(io.BytesIO(content), allow_pickle=False) as arrays:
        head = json.loads(str(arrays["head"]))
        parts = tuple(
            MeshPart(
                part["name"],
                arrays[f"vertices{k}"],
                arrays[f"faces{k}"],
                tuple(part["color"]) if part["color"] else None,
                part["material"],
            )
            for k, part in enumerate(head["parts"])
        )
    return RawMesh(parts, head["name"], head["unit"], head["up_axis"], head["metadata"])


def pack(raw: RawMesh) -> bytes:
    """Return a mesh as an npz archive."""
    arrays = {f"{kind}{k}": getattr(part, kind) for k, part in enumerate(raw.parts) for kind in ("vertices", "faces")}
    parts = [{"name": part.name, "color": part.color, "material": part.material} for part in raw.parts]
    head = {"parts": parts, "name": raw.name, "unit": raw.unit, "up_axis": raw.up_axis, "metadata": raw.metadata}
    stream = io.BytesIO()
    np.savez(stream, allow_pickle=False, head=np.array(json.dumps(head)), **arrays)
    return stream.getvalue()


def main() -> None:
    """Read the file named by the first argument within the limits of the second, a JSON object; answer with `pack`."""
    limits = MeshLimits(**json.loads(sys.argv[2]))
    with answering(limits.memory) as stream:
        try:
            content = pack(read_stage(Path(sys.argv[1]), limits))
        except MeshError as error:
            content = json.dumps({"error": error.problem}).encode()
        stream.write(content)


def read_stage(path: Path, limits: MeshLimits = LIMITS) -> RawMesh:
    """Return the visible meshes and solids of a USD file with their transforms, one part for each material of each.

    Guides, proxies and invisible prims are skipped; instances are expanded; subdivision is not applied.

    Raises:
        MeshError: unreadable, composition errors (a missing reference, a cycle), files outside the folder, a type
            that is not read, indices out of range, or a limit exceeded.
    """
    from pxr import Tf, Usd, UsdGeom

    try:
        layers = check_layers(path, limits)
        stage = Usd.Stage.Open(str(path.resolve()))
        errors = stage.GetCompositionErrors()
        del layers  # held until the stage is composed
        if errors:
            more = f" (and {len(errors) - 1} more)" if len(errors) > 1 else ""
            problem = f"cannot be composed: {printable(errors[0])}{more}"
            raise MeshError(path, f"{problem}; fix the reference or flatten the stage")
        unit = float(UsdGeom.GetStageMetersPerUnit(stage)) if stage.HasAuthoredMetadata("metersPerUnit") else None
        up = str(UsdGeom.GetStageUpAxis(stage)) if stage.HasAuthoredMetadata("upAxis") else None
        root = stage.GetDefaultPrim()
        parts = _parts(path, root if root else stage.GetPseudoRoot(), limits)
        if not parts and root:
            parts = _parts(path, stage.GetPseudoRoot(), limits)
    except Tf.ErrorException as error:
        raise MeshError(path, f"cannot be read as USD ({diagnostics(error)}); export it again") from None
    name = printable(root.GetName()) if root else path.stem
    return RawMesh(tuple(parts), name, unit, "Y" if up == "Y" else "Z" if up == "Z" else None, _metadata(stage, root))


def _parts(path: Path, root: Any, limits: MeshLimits) -> list[MeshPart]:
    from pxr import Usd, UsdGeom

    time = Usd.TimeCode.EarliestTime()
    cache = UsdGeom.XformCache(time)
    parts: list[MeshPart] = []
    vertices = faces = 0
    for prim in _shown(path, root, limits):
        matrix = np.array(cache.GetLocalToWorldTransform(prim), dtype=np.float64)
        for part in _bodies(path, prim, time, limits):
            vertices, faces = vertices + len(part.vertices), faces + len(part.faces)
            if len(parts) >= limits.parts or vertices > limits.vertices or faces > limits.faces:
                most = f"{limits.vertices} vertices, {limits.faces} faces and {limits.parts} parts"
                raise MeshError(path, f"has more than {most}; simplify the mesh")
            # USD multiplies row vectors.
            placed = part.vertices @ matrix[:3, :3] + matrix[3, :3]
            turned = part.faces[:, ::-1] if np.linalg.det(matrix[:3, :3]) < 0.0 else part.faces
            parts.append(MeshPart(part.name, placed, turned, part.color, part.material))
    return parts


def _shown(path: Path, root: Any, limits: MeshLimits) -> Iterator[Any]:
    """Yield the prims that a renderer shows, instances included."""
    from pxr import Usd, UsdGeom

    walk = iter(Usd.PrimRange(root, Usd.TraverseInstanceProxies()))
    for count, prim in enumerate(walk, start=1):
        if count > limits.prims:
            raise MeshError(path, f"has more than {limits.prims} prims; flatten and simplify the stage")
        if prim.GetPath().pathElementCount > limits.depth:
            raise MeshError(path, f"nests prims deeper than {limits.depth}; flatten the stage")
        imageable = UsdGeom.Imageable(prim)
        if not imageable:
            continue
        if prim.GetTypeName() in UNREAD:
            where = printable(prim.GetPath(), 120)
            raise MeshError(path, f"{where} is a {prim.GetTypeName()}, which is not read; export it as meshes")
        invisible = imageable.GetVisibilityAttr().Get(Usd.TimeCode.EarliestTime()) == UsdGeom.Tokens.invisible
        if invisible or imageable.ComputePurpose() in (UsdGeom.Tokens.guide, UsdGeom.Tokens.proxy):
            walk.PruneChildren()
        else:
            yield prim


def _bodies(path: Path, prim: Any, time: Any, limits: MeshLimits) -> Iterator[MeshPart]:
    from pxr import UsdGeom

    name = printable(prim.GetName())
    color, material = _look(prim, prim, time)
    if prim.GetTypeName() in SOLIDS:
        yield MeshPart(name, *_solid(prim, time), color, material)
        return
    mesh = UsdGeom.Mesh(prim)
    if not mesh:
        return
    points = np.array(mesh.GetPointsAttr().Get(time) or (), dtype=np.float64).reshape(-1, 3)
    counts = np.array(mesh.GetFaceVertexCountsAttr().Get(time) or (), dtype=np.int64)
    corners = np.array(mesh.GetFaceVertexIndicesAttr().Get(time) or (), dtype=np.int64)
    where = printable(prim.GetPath(), 120)
    if (counts < 0).any() or counts.sum() != len(corners):
        raise MeshError(path, f"{where}: face counts add up to {counts.sum()}, {len(corners)} corners are given")
    if len(corners) and not (corners.min() >= 0 and corners.max() < len(points)):
        raise MeshError(path, f"{where}: a face names vertex {corners.max()}, {len(points)} vertices are given")
    if len(points) > limits.vertices or len(corners) > 4 * limits.faces:
        raise MeshError(path, f"{where}: {len(points)} vertices, expected at most {limits.vertices}; simplify the mesh")
    try:
        faces, polygons = triangulate(points, counts, corners)
    except ValueError as error:
        raise MeshError(path, f"{where}: {error}; triangulate the mesh before export") from None
    holes = np.array(mesh.GetHoleIndicesAttr().Get(time) or (), dtype=np.int64)
    kept = ~np.isin(polygons, holes)
    if mesh.GetOrientationAttr().Get(time) == UsdGeom.Tokens.leftHanded:
        faces = faces[:, ::-1]
    for subset in _subsets(mesh):
        of_subset = kept & np.isin(polygons, np.array(subset.GetIndicesAttr().Get(time) or (), dtype=np.int64))
        kept &= ~of_subset
        yield from _part(
            f"{name}/{printable(subset.GetPrim().GetName())}",
            points,
            faces[of_subset],
            *_look(subset.GetPrim(), prim, time),
        )
    yield from _part(name, points, faces[kept], color, material)


def _subsets(mesh: Any) -> list[Any]:
    from pxr import UsdGeom, UsdShade

    subsets = UsdGeom.Subset.GetAllGeomSubsets(mesh)
    family = [s for s in subsets if s.GetFamilyNameAttr().Get() == UsdShade.Tokens.materialBind]
    return [s for s in family if s.GetElementTypeAttr().Get() == UsdGeom.Tokens.face]


def _part(name: str, points: Points, faces: Faces, color: Rgba | None, material: str | None) -> Iterator[MeshPart]:
    if len(faces):
        used, compact = np.unique(faces, return_inverse=True)
        yield MeshPart(name, points[used], compact.reshape(-1, 3), color, material)


def _look(bound: Any, gprim: Any, time: Any) -> tuple[Rgba | None, str | None]:
    """Return color and name of the material bound to a prim; without one, its display color."""
    from pxr import UsdGeom, UsdShade

    material, _ = UsdShade.MaterialBindingAPI(bound).ComputeBoundMaterial()
    if material:
        name = printable(material.GetPrim().GetName())
        source = material.ComputeSurfaceSource()
        shader = source[0] if isinstance(source, tuple) else source
        if shader and shader.GetInput("diffuseColor"):
            color = shader.GetInput("diffuseColor").Get(time)
            opacity = shader.GetInput("opacity").Get(time) if shader.GetInput("opacity") else None
            if color is not None:
                return rgba_from_linear(color, 1.0 if opacity is None else opacity), name
        return None, name
    shape = UsdGeom.Gprim(gprim)
    colors = shape.GetDisplayColorAttr().Get(time) if shape else None
    if not colors:
        return None, None
    opacities = shape.GetDisplayOpacityAttr().Get(time)
    return rgba_from_linear(colors[0], opacities[0] if opacities else 1.0), None


def _metadata(stage: Any, root: Any) -> dict[str, str]:
    layer = stage.GetRootLayer()
    pairs: dict[str, object] = {"comment": layer.comment, "documentation": layer.documentation}
    if root:
        for attribute in root.GetAttributes():
            if attribute.IsCustom() and isinstance(attribute.Get(), str):
                pairs[attribute.GetName()] = attribute.Get()
    return bounded_metadata(pairs)


def _solid(prim: Any, time: Any) -> tuple[Points, Faces]:
    """Return vertices (n, 3) and faces (m, 3) of a Cube, Sphere, Cylinder, Cone or Capsule prim in its own frame."""
    from labgym.assets.shapes.parts import local_mesh  # brings trimesh, which plain meshes do without

    kind = prim.GetTypeName()

    def value(name: str) -> float:
        return float(prim.GetAttribute(name).Get(time))

    if kind == "Cube":
        return local_mesh("box", (value("size"),) * 3)
    if kind == "Sphere":
        return local_mesh("sphere", (2.0 * value("radius"),) * 3)
    radius, height = value("radius"), value("height")
    if kind == "Cylinder":
        vertices, faces = local_mesh("cylinder", (2.0 * radius, 2.0 * radius, height))
    elif kind == "Capsule":
        vertices, faces = local_mesh("capsule", (2.0 * radius, 2.0 * radius, height + 2.0 * radius))
    else:
        outline = ((0.0, -height / 2.0), (radius, -height / 2.0), (0.0, height / 2.0))
        vertices, faces = local_mesh("revolve", (0.0, 0.0, 0.0), outline)
    order = list(_FROM_Z[str(prim.GetAttribute("axis").Get(time))])
    return np.ascontiguousarray(vertices[:, order]), faces
