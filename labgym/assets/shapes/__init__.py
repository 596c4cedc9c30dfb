"""Parametric shapes: the visible geometry of each asset, from primitives and revolved profiles."""

from labgym.assets.shapes import (  # noqa: F401 - their import registers the shapes
    bench_instruments,
    bench_ware,
    bottles,
    building,
    columns,
    furniture,
    heating,
    hoods,
    instruments,
    machines,
    safety,
    storage,
    transport,
    vessels,
)
from labgym.assets.shapes.materials import MATERIALS
from labgym.assets.shapes.parts import Part, tessellate
from labgym.assets.shapes.registry import SHAPES, build

__all__ = ["MATERIALS", "SHAPES", "Part", "build", "tessellate"]
