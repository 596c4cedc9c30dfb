"""Facts about an imported mesh before it is annotated."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from labgym.assets.catalog import Catalog
from labgym.assets.forge.looks import substance
from labgym.assets.forge.matching import NOISE, Resemblance, telling
from labgym.assets.meshes import MeshFile, PhysicalMesh
from labgym.assets.model import Asset, Kind, Placing, Size, Surface
from labgym.assets.search import normalize, surface_forms

TALL_M, LONG_M = 0.6, 1.6
"""Height and longest side, meters, beyond which an unknown object stands on the floor."""
FLAT_TOP_DEPTH_M = 0.005
"""Depth below the top within which faces belong to it, meters."""
MIN_COVERED_SHARE = 0.8
"""Least share of the outline that faces at the top must cover to be a surface that carries objects."""


@dataclass(frozen=True)
class Facts:
    """A mesh with the evidence of its texts and its resemblance.

    Attributes:
        stem: name of the file without its suffix. digest: SHA-256 of the file.
        catalog: the catalog that it is compared with. resemblance: the entry that it resembles, if any.
        chosen_name: canonical name that the user chose.
    """

    stem: str
    digest: str
    catalog: Catalog
    file: MeshFile
    mesh: PhysicalMesh
    resemblance: Resemblance | None
    chosen_name: str | None = None

    @property
    def like(self) -> Asset | None:
        """The entry that the mesh resembles with enough confidence."""
        return self.resemblance.asset if self.resemblance and self.resemblance.is_accepted else None

    @property
    def size(self) -> Size:
        """Bounding box in the asset's frame."""
        return self.mesh.size

    @property
    def substances(self) -> tuple[str, ...]:
        """Substances of the object by the names of its materials, sorted."""
        return tuple(sorted({name for part in self.mesh.parts if (name := substance(part.material))}))

    @cached_property
    def taken(self) -> frozenset[str]:
        """Names and synonyms of the catalog's entries, normalized."""
        return frozenset(normalize(form) for asset in self.catalog for form in surface_forms(asset))

    @property
    def label(self) -> str:
        """The text that most likely names the object: the file's stem, or the object's name if the stem is mute."""
        return next((text for text in (self.stem, self.file.name) if not is_mute(text)), self.stem)


def is_mute(text: str) -> bool:
    """Return whether a name does not describe the object."""
    return all(word.casefold() in NOISE or not any(char.isalpha() for char in word) for word in telling(text))


def texts(file: MeshFile, stem: str) -> list[tuple[str, str]]:
    """Return the texts of a mesh file that may name it, most trusted first: (where, text)."""
    pairs = [("attribute labgym:name", file.metadata.get("labgym:name", "")), ("file name", stem)]
    pairs += [("object name", file.name), ("title", file.metadata.get("title", ""))]
    pairs += [("part name", part.name) for part in file.parts[:20]]
    return [(where, text) for where, text in pairs if text and not is_mute(text)]


def standing(like: Asset | None, extents: tuple[float, float, float]) -> tuple[Kind, str, Placing]:
    """Return kind, category and placing: those of the entry that a mesh resembles, else by its size alone."""
    if like is not None:
        return like.kind, like.category, like.placing
    if extents[2] > TALL_M or max(extents) > LONG_M:
        return "facility", "furniture", "floor"
    return "instrument", "tool", "desktop"


def top_surface(mesh: PhysicalMesh) -> Surface | None:
    """Return the top as a surface that carries objects, or None if faces that look up do not cover the outline."""
    size, covered = mesh.size, 0.0
    for part in mesh.parts:
        corners = part.vertices[part.faces]
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        at_top = (corners[:, :, 2].min(axis=1) > size.height - FLAT_TOP_DEPTH_M) & (normal[:, 2] > 0.0)
        covered += float(normal[at_top, 2].sum()) / 2
    if covered < MIN_COVERED_SHARE * size.width * size.depth:
        return None
    return Surface(z=math.floor(1e4 * size.height + 0.5) / 1e4, width=size.width, depth=size.depth)
