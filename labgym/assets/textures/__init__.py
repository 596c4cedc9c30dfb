"""Textures of materials: procedural, seamless, the same on every machine."""

from labgym.assets.textures.mapping import corner_coordinates, surface_coordinates
from labgym.assets.textures.texture import Texture, decoded, encoded, texture

__all__ = ["Texture", "corner_coordinates", "decoded", "encoded", "surface_coordinates", "texture"]
