"""USD stages as meshes: the default prim as a renderer shows it at the first time."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from labgym.assets.meshes.colors import rgba_from_linear
from labgym.assets.meshes.layers import check_layers, diagnostics
from labgym.assets.meshes.model import (
    LIMITS,
    Faces,
    Limits,
    MeshError,
    MeshPart,
    Points,
    RawMesh,
    Rgba,
    bounded_metadata,
    printable,
)
from labgym.assets.meshes.polygons import triangulate

SOLIDS = ("Cube", "Sphere", "Cylinder", "Cone", "Capsule")
UNREAD = ("PointInstancer", "NurbsPatch", "BasisCurves", "NurbsCurves", "HermiteCurves", "TetMesh", "Volume")


def read_stage(path: Path, limits: Limits = LIMITS) -> RawMesh:
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


def _parts(path: Path, root: Any, limits: Limits) -> list[MeshPart]:
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


def _shown(path: Path, root: Any, limits: Limits) -> Iterator[Any]:
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


def _bodies(path: Path, prim: Any, time: Any, limits: Limits) -> Iterator[MeshPart]:
    from pxr import UsdGeom

    name = printable(prim.GetName())
    color, material = _look(prim, prim, time)
    if prim.GetTypeName() in SOLIDS:
        from labgym.assets.meshes.solids import solid  # brings trimesh, which plain meshes do without

        yield MeshPart(name, *solid(prim, time), color, material)
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
