"""Materials of a mesh file as materials of labgym: by the words of their names, else by the nearest color."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from labgym.assets.archive import Geometry, MeshPiece
from labgym.assets.forge.matching import name_words
from labgym.assets.meshes import MeshPart, PhysicalMesh
from labgym.assets.shapes import MATERIALS
from labgym.assets.shapes.materials import FINISHES, SUPPLIES

SUBSTANCES: dict[str, tuple[str, ...]] = {
    "glass": ("glass", "borosilicate", "pyrex", "duran", "quartz", "glas", "verre", "vidrio", "玻璃", "石英"),
    "ceramic": ("ceramic", "porcelain", "alumina", "陶瓷"),
    "metal": (
        "steel",
        "stainless",
        "inox",
        "chrome",
        "metal",
        "aluminium",
        "aluminum",
        "iron",
        "brass",
        "不锈钢",
        "金属",
    ),
    "plastic": ("plastic", "polypropylene", "polyethylene", "pp", "pe", "hdpe", "ptfe", "teflon", "pvc", "abs", "塑料"),
    "rubber": ("rubber", "silicone", "橡胶", "硅胶"),
    "wood": ("wood", "oak", "plywood", "timber", "木"),
}
"""Substances, and the words in material names that indicate them."""
_LOOKS = {
    "glass": "borosilicate",
    "ceramic": "porcelain",
    "metal": "stainless",
    "plastic": "plastic_white",
    "rubber": "rubber",
    "wood": "oak",
}
_GLASSES = ("borosilicate", "thick_glass", "amber_glass")
MAX_CLEAR_OPACITY = 0.85
"""Opacity below which a surface counts as transparent."""
PLAIN_MATERIAL = "plastic_light"
"""Material of parts without a color or an informative name."""
MIN_VERTICES = 4


def substance(name: str | None) -> str | None:
    """Return the substance that a material's name indicates, such as glass or metal, or None."""
    words = {word.casefold() for word in name_words(name or "")} | ({name.casefold()} if name else set())
    return next((kind for kind, known in SUBSTANCES.items() if words & set(known)), None)


def look(part: MeshPart, plain: str = PLAIN_MATERIAL) -> str:
    """Return the name in `MATERIALS` that matches the look of a part of a mesh file; `plain` if it is unknown."""
    if part.material in MATERIALS:
        return part.material
    made_of = substance(part.material)
    color = tuple(round(channel, 3) for channel in part.color) if part.color else None
    if made_of == "glass" and color:
        return min(_GLASSES, key=lambda name: math.dist(MATERIALS[name].rgba[:3], color[:3]))
    if made_of == "wood" or (made_of and color is None):
        return _LOOKS[made_of]
    return _nearest(color) if color else plain


def geometry_of(mesh: PhysicalMesh, category: str) -> Geometry:
    """Return a mesh with labgym's materials, a piece for each; glassware without materials in the file is clear."""
    plain = _LOOKS["glass"] if category == "glassware" else PLAIN_MATERIAL
    by_look: dict[str, list[MeshPart]] = {}
    for part in mesh.parts:
        by_look.setdefault(look(part, plain), []).append(part)
    # MuJoCo takes no mesh of three vertices: a lone triangle goes with the largest piece.
    largest = max(by_look, key=lambda name: sum(len(part.faces) for part in by_look[name]))
    for name in [name for name in by_look if sum(len(part.vertices) for part in by_look[name]) < MIN_VERTICES]:
        if name != largest:
            by_look[largest] += by_look.pop(name)
    return Geometry(tuple(_joined(name, parts) for name, parts in sorted(by_look.items())), mesh.convex)


def _joined(name: str, parts: list[MeshPart]) -> MeshPiece:
    offsets = np.cumsum([0, *[len(part.vertices) for part in parts[:-1]]])
    faces = np.concatenate([part.faces + offset for part, offset in zip(parts, offsets, strict=True)])
    return MeshPiece(np.concatenate([part.vertices for part in parts]), faces, name)


@lru_cache(maxsize=4096)
def _nearest(color: tuple[float, ...]) -> str:
    """Return the material of the nearest color among those that are as clear or as opaque, without lights."""
    clear = color[3] < MAX_CLEAR_OPACITY
    alike = [
        name
        for name, known in MATERIALS.items()
        if (known.rgba[3] < MAX_CLEAR_OPACITY) == clear
        and known.emission == 0.0
        and name not in FINISHES
        and name not in SUPPLIES
    ]
    return min(alike, key=lambda name: (math.dist(MATERIALS[name].rgba[:3], color[:3]), name))
