"""The shape of an asset imported from a mesh file: its pieces, unchanged."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from labgym.assets.archive import SHAPE, geometry
from labgym.assets.model import Asset
from labgym.assets.shapes.parts import UPRIGHT, Part
from labgym.assets.shapes.registry import shape


@shape(SHAPE)
def imported(asset: Asset) -> Iterator[Part]:
    """One part for each material of the mesh file."""
    for piece in geometry(asset).pieces:
        low, high = piece.vertices.min(axis=0), piece.vertices.max(axis=0)
        width, depth, height = (high - low).tolist()
        x, y, z = ((low + high) / 2.0).tolist()
        centred = np.ascontiguousarray(piece.vertices - (low + high) / 2.0)
        centred.setflags(write=False)
        yield Part("mesh", (width, depth, height), (x, y, z), UPRIGHT, piece.material, triangles=(centred, piece.faces))
