"""Shapes by name, the parameters that an asset gives them, and the shape of imported assets."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator
from dataclasses import replace

import numpy as np

from labgym.assets.archive import SHAPE, geometry
from labgym.assets.model import Asset
from labgym.assets.shapes.parts import UPRIGHT, Part
from labgym.counts import check_switch, is_real
from labgym.errors import OptionError, check_name

Builder = Callable[[Asset], Iterable[Part]]
Extents = tuple[float, float, float, float, float]

SHAPES: dict[str, Builder] = {}
"""Builder of each shape name."""
EMPTY = "empty"
"""Shape parameter of a vessel without its content."""
INVERTED = "inverted"
"""Shape parameter of an object that stands upside down, as a stored funnel does on its rim."""
LIQUIDS = frozenset({"blue_liquid", "yellow_liquid", "clear_liquid"})
"""Materials of the content of vessels."""


def shape(name: str) -> Callable[[Builder], Builder]:
    """Register a builder under a shape name."""

    def register(builder: Builder) -> Builder:
        SHAPES[name] = builder
        return builder

    return register


def build(asset: Asset, hidden: bool = False) -> tuple[Part, ...]:
    """Return the visible parts of an asset in its own frame, inside its bounding box.

    Args:
        hidden: whether to include the parts that only an open asset shows, such as the boxes of drawers.

    Raises:
        UnknownNameError: the asset names an unknown shape or color.
        OptionError: a shape parameter of the wrong type.
    """
    check_name("shape", asset.shape.name, SHAPES)
    parts = tuple(part for part in SHAPES[asset.shape.name](asset) if hidden or not part.hidden)
    if flag(asset, EMPTY):
        parts = tuple(part for part in parts if part.material not in LIQUIDS)
    return tuple(_inverted(part, asset.size.height) for part in parts) if flag(asset, INVERTED) else parts


def _inverted(part: Part, height: float) -> Part:
    """Return a part of an object that is turned upside down about its own x axis at half its height."""
    (x, y, z), (a, b, c, d) = part.position, part.quaternion
    return replace(part, position=(x, -y, height - z), quaternion=(-b, a, -d, c))


def extents(asset: Asset) -> Extents:
    """Return width, depth and height of an asset's bounding box, half its width and half its depth, meters."""
    width, depth = asset.size.width, asset.size.depth
    return width, depth, asset.size.height, width / 2.0, depth / 2.0


def number(asset: Asset, name: str, default: float) -> float:
    """Return a numeric shape parameter.

    Raises:
        OptionError: it is not a number.
    """
    value = asset.shape.parameters.get(name, default)
    if not is_real(value):
        raise OptionError(f"shape parameter {name!r} of asset {asset.name!r} is {value!r}, expected a number")
    return float(value)


def count(asset: Asset, name: str, default: int) -> int:
    """Return an integer shape parameter."""
    return round(number(asset, name, default))


def flag(asset: Asset, name: str) -> bool:
    """Return a boolean shape parameter, by default False.

    Raises:
        OptionError: it is neither true nor false.
    """
    value = asset.shape.parameters.get(name, False)
    check_switch(f"shape parameter {name!r} of asset {asset.name!r}", value)
    return bool(value)


def choice(asset: Asset, name: str, default: str, words: Collection[str], kind: str) -> str:
    """Return a shape parameter that is one of some words.

    Args:
        kind: what the parameter names, for the error.

    Raises:
        UnknownNameError: it is another word.
        OptionError: it is not text.
    """
    word = text(asset, name, default)
    check_name(kind, word, words)
    return word


def text(asset: Asset, name: str, default: str) -> str:
    """Return a shape parameter that is a word.

    Raises:
        OptionError: it is not text.
    """
    value = asset.shape.parameters.get(name, default)
    if not isinstance(value, str):
        raise OptionError(f"shape parameter {name!r} of asset {asset.name!r} is {value!r}, expected text")
    return value


@shape(SHAPE)
def imported(asset: Asset) -> Iterator[Part]:
    """One part for each material of the mesh file."""
    for piece in geometry(asset).pieces:
        low, high = piece.vertices.min(axis=0), piece.vertices.max(axis=0)
        width, depth, height = (high - low).tolist()
        x, y, z = ((low + high) / 2.0).tolist()
        centered = np.ascontiguousarray(piece.vertices - (low + high) / 2.0)
        centered.setflags(write=False)
        yield Part(
            "mesh", (width, depth, height), (x, y, z), UPRIGHT, piece.material, triangles=(centered, piece.faces)
        )
