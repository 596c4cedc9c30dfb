"""Mesh files: read safely, converted to meters and z up, then to the frame of an asset."""

from labgym.assets.meshes.model import LIMITS, MeshError, MeshFile, MeshPart, PhysicalMesh
from labgym.assets.meshes.physical import normalize
from labgym.assets.meshes.reading import FORMATS, UNITS, read_mesh

__all__ = [
    "FORMATS",
    "LIMITS",
    "UNITS",
    "MeshError",
    "MeshFile",
    "MeshPart",
    "PhysicalMesh",
    "normalize",
    "read_mesh",
]
