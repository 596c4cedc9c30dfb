"""Texture coordinates of meshes for exported scenes; floors of one plain rectangular room have no textures."""

from __future__ import annotations

import numpy as np

from labgym.assets.meshes.normals import face_normals
from labgym.assets.textures import Texture, surface_coordinates, texture
from labgym.layouts.floor import Floor
from labgym.scenes.patches import Array, Faces


def texture_on(floor: Floor, material: str) -> Texture | None:
    """Return the texture of a material in the exported scene of a floor, or None.

    Scenes of one plain rectangular room keep the bytes of earlier versions.
    """
    return None if floor.is_rectangle else texture(material)


def corner_coordinates(vertices: Array, faces: Faces, image: Texture) -> Array:
    """Return the places of face corners in a texture, shape (m, 3, 2), in periods, v upwards."""
    normals = np.repeat(face_normals(vertices, faces), 3, axis=0)
    places = surface_coordinates(vertices[faces].reshape(-1, 3), normals, image.upright)
    return np.asarray(places / image.period).reshape(-1, 3, 2)
