"""Parametric shapes: the visible geometry of each asset, from primitives and revolved profiles."""

from labgym.assets.shapes import (
    apparatus,
    bench_instruments,
    bench_ranges,
    bench_ware,
    bottles,
    building,
    chromatographs,
    columns,
    flasks,
    furniture,
    heating,
    hood_ranges,
    hoods,
    imported,
    instruments,
    machines,
    racks,
    safety,
    seat_ranges,
    storage,
    transport,
    vessels,
)
from labgym.assets.shapes.materials import MATERIALS, SurfaceMaterial
from labgym.assets.shapes.parts import Part
from labgym.assets.shapes.registry import SHAPES, build
from labgym.assets.shapes.tessellate import tessellate

FAMILIES = (
    apparatus,
    bench_instruments,
    bench_ranges,
    bench_ware,
    bottles,
    building,
    chromatographs,
    columns,
    flasks,
    furniture,
    heating,
    hood_ranges,
    hoods,
    imported,
    instruments,
    machines,
    racks,
    safety,
    seat_ranges,
    storage,
    transport,
    vessels,
)
"""Modules whose import registers their shapes."""

__all__ = ["FAMILIES", "MATERIALS", "SHAPES", "Part", "SurfaceMaterial", "build", "tessellate"]
