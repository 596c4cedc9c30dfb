"""Parts and boxes as UsdGeom prims: exact solids if USD has them, otherwise triangle meshes."""

from __future__ import annotations

from typing import Any

import numpy as np

from labgym.assets.meshes.model import Faces, Points
from labgym.assets.meshes.normals import corner_normals
from labgym.assets.shapes import Part, tessellate
from labgym.assets.textures import Texture, corner_coordinates
from labgym.geometry import OrientedBox

DECIMALS = 5
"""Decimals of coordinates in meters: a grid of 0.01 mm."""
NORMAL_DECIMALS = 4
_NUDGE = 1e-3
EXACT = ("box", "cylinder", "sphere", "capsule")
"""Primitives of parts that USD has as solids."""


def rounded(values: Any, decimals: int = DECIMALS) -> Points:
    """Return values rounded to a number of decimals, the same on every machine.

    Values halfway between two steps, or below that by no more than rounding noise, are rounded up.
    """
    step = 10.0**-decimals
    steps = np.floor(np.asarray(values, dtype=np.float64) / step + 0.5 + _NUDGE)
    # To the nearest double of so few decimals, and no negative zero.
    return np.asarray(np.round(steps * step, decimals) + 0.0)


def write_part(stage: Any, path: str, part: Part, image: Texture | None = None) -> Any:
    """Define a part's prim in the asset's frame and return it.

    It is an exact solid if USD has it, otherwise a mesh; with a texture, which needs coordinates, always a mesh.
    """
    if part.primitive not in EXACT or image is not None:
        return write_mesh(stage, path, *tessellate(part), image)
    solid = _solid(stage, path, part)
    _place(solid, part.position, part.quaternion, part.size if part.primitive == "box" else None)
    return solid.GetPrim()


def write_mesh(stage: Any, path: str, vertices: Points, faces: Faces, image: Texture | None = None) -> Any:
    """Define a mesh of triangles with normals on the grid of `rounded`, and return its prim.

    Vertices that no face uses are left out.

    Args:
        image: texture for which the mesh gets coordinates `st`.
    """
    from pxr import Gf, Sdf, UsdGeom, Vt

    mesh = UsdGeom.Mesh.Define(stage, path)
    used, corners = np.unique(faces, return_inverse=True)
    points, faces = rounded(vertices[used]), corners.reshape(-1, 3)
    mesh.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(points.astype(np.float32)))
    mesh.CreateFaceVertexCountsAttr(Vt.IntArray.FromNumpy(np.full(len(faces), 3, dtype=np.int32)))
    mesh.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(faces.ravel().astype(np.int32)))
    mesh.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    low, high = points.min(axis=0).tolist(), points.max(axis=0).tolist()
    mesh.CreateExtentAttr([Gf.Vec3f(*low), Gf.Vec3f(*high)])
    _write_normals(mesh.GetPrim(), np.asarray(vertices[used], dtype=np.float64), faces)
    if image is not None:
        places = rounded(corner_coordinates(vertices[used], faces, image).reshape(-1, 2))
        values, indices = np.unique(places, axis=0, return_inverse=True)
        varying = UsdGeom.Tokens.faceVarying
        coordinates = UsdGeom.PrimvarsAPI(mesh).CreatePrimvar("st", Sdf.ValueTypeNames.TexCoord2fArray, varying)
        coordinates.Set(Vt.Vec2fArray.FromNumpy(values.astype(np.float32)))
        coordinates.SetIndices(Vt.IntArray.FromNumpy(indices.ravel().astype(np.int32)))
    return mesh.GetPrim()


def _write_normals(prim: Any, vertices: Points, faces: Faces) -> None:
    """Author indexed normals: one for each face if all edges are sharp, otherwise one for each face corner."""
    from pxr import Sdf, UsdGeom, Vt

    normals = corner_normals(vertices, faces)
    # Corners of faces without area have no normal.
    normals[~normals.any(axis=2)] = (0.0, 0.0, 1.0)
    normals = rounded(normals, NORMAL_DECIMALS)
    sharp = bool((normals == normals[:, :1]).all())
    values, indices = np.unique(normals[:, 0] if sharp else normals.reshape(-1, 3), axis=0, return_inverse=True)
    interpolation = UsdGeom.Tokens.uniform if sharp else UsdGeom.Tokens.faceVarying
    primvar = UsdGeom.PrimvarsAPI(prim).CreatePrimvar("normals", Sdf.ValueTypeNames.Normal3fArray, interpolation)
    primvar.Set(Vt.Vec3fArray.FromNumpy(values.astype(np.float32)))
    primvar.SetIndices(Vt.IntArray.FromNumpy(indices.ravel().astype(np.int32)))


def write_collider(stage: Any, path: str, box: OrientedBox) -> Any:
    """Define an invisible collision box and return its prim."""
    from pxr import UsdPhysics

    cube = _unit_cube(stage, path)
    size = (box.width, box.depth, box.z1 - box.z0)
    _place(cube, (box.x, box.y, (box.z0 + box.z1) / 2.0), (1.0, 0.0, 0.0, 0.0), size)
    UsdPhysics.CollisionAPI.Apply(cube.GetPrim())
    return cube.GetPrim()


def write_convex(stage: Any, path: str, vertices: Points, faces: Faces) -> Any:
    """Define a convex collision mesh and return its prim."""
    from pxr import UsdPhysics

    prim = write_mesh(stage, path, vertices, faces)
    UsdPhysics.CollisionAPI.Apply(prim)
    UsdPhysics.MeshCollisionAPI.Apply(prim).CreateApproximationAttr(UsdPhysics.Tokens.convexHull)
    return prim


def _solid(stage: Any, path: str, part: Part) -> Any:
    from pxr import UsdGeom

    radius, height = float(part.size[0] / 2.0), float(part.size[2])
    if part.primitive == "box":
        return _unit_cube(stage, path)
    if part.primitive == "sphere":
        solid = UsdGeom.Sphere.Define(stage, path)
    elif part.primitive == "cylinder":
        solid = UsdGeom.Cylinder.Define(stage, path)
    else:
        solid = UsdGeom.Capsule.Define(stage, path)
        height -= 2.0 * radius
    # Unrounded: at some diameters tessellation changes the number of sides.
    solid.CreateRadiusAttr(radius)
    if part.primitive != "sphere":
        solid.CreateHeightAttr(max(float(rounded(height)), 10.0**-DECIMALS))
        solid.CreateAxisAttr(UsdGeom.Tokens.z)
    solid.CreateExtentAttr(UsdGeom.Boundable.ComputeExtentFromPlugins(solid, 0.0))
    return solid


def _unit_cube(stage: Any, path: str) -> Any:
    from pxr import Gf, UsdGeom

    cube = UsdGeom.Cube.Define(stage, path)
    cube.CreateSizeAttr(1.0)
    cube.CreateExtentAttr([Gf.Vec3f(-0.5), Gf.Vec3f(0.5)])
    return cube


def _place(xformable: Any, position: Any, quaternion: Any, scale: Any) -> None:
    from pxr import Gf

    xformable.AddTranslateOp().Set(Gf.Vec3d(*map(float, rounded(position))))
    if tuple(quaternion) != (1.0, 0.0, 0.0, 0.0):
        w, x, y, z = (float(value) for value in np.round(quaternion, 7) + 0.0)
        xformable.AddOrientOp().Set(Gf.Quatf(w, x, y, z))
    if scale is not None:
        xformable.AddScaleOp().Set(Gf.Vec3f(*map(float, rounded(scale))))
