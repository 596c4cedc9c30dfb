"""Sizes of LabBuilder's assets: asset_bboxes.json, by the name of the asset or of the object."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Self

from pydantic import Field, TypeAdapter, ValidationError, model_validator

from labgym.assets import Asset
from labgym.assets.model import Length, Size
from labgym.documents import read_json
from labgym.errors import DocumentError
from labgym.paper.labbuilder.scene import MAX_BYTES, Tolerant, scaled_error

SIZES_FILE = "asset_bboxes.json"
MAX_NAMES = 5000
EQUAL = 1e-9
"""Sizes that differ by less than this are equal, meters."""


class AssetSize(Tolerant):
    """Bounding box of an asset: the longer horizontal side lies along x at rotations of 0 and 180 degrees.

    Attributes:
        width, depth: sides along x and y at rotation 0, in place of `long` and `short`. Files that labgym wrote have
            them, since some of its assets are deeper than wide.
        asset: name in the catalog, in files that labgym wrote.
    """

    short: Length | None = None
    long: Length | None = None
    height: Length | None = None
    width: Length | None = None
    depth: Length | None = None
    asset: Annotated[str, Field(max_length=64)] | None = None

    @model_validator(mode="after")
    def _check_order(self) -> Self:
        if self.short is not None and self.long is not None and self.short > self.long:
            raise ValueError(f"short is {self.short:g} m and long {self.long:g} m; long must be the longer side")
        return self

    def size(self, asset: Asset) -> Size | None:
        """Return the size in place of an asset's own, which supplies the sides that are not stated; None if equal."""
        width = self.width if self.width is not None else self.long
        depth = self.depth if self.depth is not None else self.short
        own = asset.size
        size = Size(
            width=own.width if width is None else width,
            depth=own.depth if depth is None else depth,
            height=own.height if self.height is None else self.height,
        )
        same = max(abs(getattr(size, side) - getattr(own, side)) for side in Size.model_fields) < EQUAL
        return None if same else size


_SIZES: TypeAdapter[dict[str, AssetSize]] = TypeAdapter(dict[str, AssetSize])


def read_sizes(path: str | Path) -> Mapping[str, AssetSize]:
    """Read a file of sizes by name.

    Raises:
        DocumentError: the file is missing, larger than 4 MB, not JSON, or a size is out of range; names the asset.
    """
    data = read_json(path, MAX_BYTES)
    if not isinstance(data, dict) or len(data) > MAX_NAMES:
        raise DocumentError(path, "", f"sizes must be a JSON object with at most {MAX_NAMES} names")
    try:
        return _SIZES.validate_python(data)
    except ValidationError as error:
        raise scaled_error(path, error, data) from None
