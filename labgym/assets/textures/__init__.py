"""Textures of materials: procedural, seamless, the same on every machine."""

import numpy as np
from numpy.typing import NDArray

from labgym.assets.meshes.normals import face_normals
from labgym.assets.textures.texture import Texture, decoded, encoded, texture

__all__ = ["Texture", "corner_coordinates", "decoded", "encoded", "surface_coordinates", "texture"]
Array = NDArray[np.floating]
Faces = NDArray[np.int64]

LEVEL_NORMAL_SHARE = 0.7
"""Least share of z in the normal of a surface that counts as level."""


def surface_coordinates(points: Array, normals: Array, upright: bool = False) -> Array:
    """Return the place (n, 2) of points (n, 3) on surfaces with normals (n, 3), meters.

    On level surfaces it is (x, y); on upright ones the distance along the surface to the right, seen from in front,
    and the height.

    Args:
        upright: whether to exchange the two on upright surfaces.
    """
    reach = np.maximum(np.hypot(normals[:, 0], normals[:, 1]), 1e-9)
    along = (points[:, 1] * normals[:, 0] - points[:, 0] * normals[:, 1]) / reach
    level = np.abs(normals[:, 2]) > LEVEL_NORMAL_SHARE
    first, second = (points[:, 2], along) if upright else (along, points[:, 2])
    return np.stack([np.where(level, points[:, 0], first), np.where(level, points[:, 1], second)], axis=1)


def corner_coordinates(vertices: NDArray[np.float64], faces: Faces, image: Texture) -> Array:
    """Return the places of face corners in a texture, shape (m, 3, 2), in periods, v upwards."""
    normals = np.repeat(face_normals(vertices, faces), 3, axis=0)
    places = surface_coordinates(vertices[faces].reshape(-1, 3), normals, image.upright)
    return np.asarray(places / image.period).reshape(-1, 3, 2)
