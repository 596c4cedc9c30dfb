"""Opens untrusted maps of ROS: `map.yaml` and its image, within limits of size."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path, PureWindowsPath
from typing import Any

import numpy as np
from numpy.typing import NDArray

from labgym.documents import read_yaml
from labgym.errors import DocumentError, optional_package

MAX_YAML = 64 * 1024
MAX_IMAGE = 32 * 1024 * 1024
MAX_CELLS = 16_000_000
FORMATS = ("PNG", "PPM", "BMP", "TIFF")
"""Formats of Pillow that are read; PPM includes PGM."""
MAX_PAGE, PAGE_PIXEL = 15_000, 0.02
"""Longest side of a page of a PDF file, points, and the side of a pixel in which it is drawn, meters."""
UNKNOWN, DARK = 205, 160
"""Gray values of unknown cells in maps of map_saver, and below which cells are occupied in maps of probabilities."""
RESOLUTIONS = (0.005, 0.5)
"""Sides of a cell that are read, meters."""


@dataclass(frozen=True)
class RosMap:
    """A map of ROS.

    Attributes:
        occupied, free: (ny, nx) bool, row 0 at the least y; cells that are neither are unknown.
        resolution: side of a cell, meters.
        origin: pose (x, y, yaw) of the outer corner of cell [0, 0], meters and radians.
    """

    occupied: NDArray[np.bool_]
    free: NDArray[np.bool_]
    resolution: float
    origin: tuple[float, float, float]

    def sampled(self, cells: NDArray[np.bool_], points: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Return the values of the cells that contain points (n, 2) of the map's frame; False outside, shape (n,)."""
        x, y, yaw = self.origin
        dx, dy = points[:, 0] - x, points[:, 1] - y
        columns = np.floor((dx * math.cos(yaw) + dy * math.sin(yaw)) / self.resolution).astype(int)
        rows = np.floor((dy * math.cos(yaw) - dx * math.sin(yaw)) / self.resolution).astype(int)
        inside = (rows >= 0) & (rows < cells.shape[0]) & (columns >= 0) & (columns < cells.shape[1])
        values = np.zeros(len(points), dtype=np.bool_)
        values[inside] = cells[rows[inside], columns[inside]]
        return values


def open_ros_map(path: str | Path, lenient: bool = False) -> RosMap:
    """Return the map that a map.yaml describes, interpreted as map_server does in its modes trinary and scale.

    The image must lie in the folder of the file or below it. An absolute path, as map_saver writes it, stands for the
    image of that name next to the file.

    Args:
        lenient: whether the gray values decide where the thresholds contradict them: cells of the 205 that map_saver
            writes are unknown, and darker ones than 160 occupied.

    Raises:
        DocumentError: a file is missing, too large or damaged, or a field is invalid.
        MissingDependencyError: PyYAML is not installed.
    """
    path = Path(path)
    fields = _fields(path)
    resolution, origin = _resolution(fields, path), _origin(fields, path)
    occupied_above = _number(fields, "occupied_thresh", path, 0.65)
    free_below = _number(fields, "free_thresh", path, 0.196)
    if not 0.0 <= free_below < occupied_above <= 1.0:
        raise DocumentError(path, "free_thresh", f"{free_below:g} must be less than occupied_thresh {occupied_above:g}")
    mode = fields.get("mode", "trinary")
    if mode not in ("trinary", "scale"):
        raise DocumentError(path, "mode", f"expected 'trinary' or 'scale', got {str(mode)[:40]!r}")
    gray, opaque = _pixels(fields, path)
    negate = bool(_number(fields, "negate", path, 0.0))
    occupancy = (gray if negate else 255.0 - gray) / 255.0
    if lenient:
        opaque &= gray != UNKNOWN
        occupied_above = min(occupied_above, 1.0 - DARK / 255.0)
    occupied, free = (occupancy > occupied_above) & opaque, (occupancy < free_below) & opaque
    return RosMap(occupied[::-1], free[::-1], resolution, origin)


def open_image(path: str | Path, scale: float) -> RosMap:
    """Return the picture of a floor plan as a map: dark pixels are occupied, light and transparent ones free.

    Args:
        scale: side of a pixel, or length of a point (1/72 inch) of the first page of a PDF file, meters.

    Raises:
        DocumentError: the file is missing, too large or damaged.
        MissingDependencyError: pypdfium2, which PDF files need, is not installed.
    """
    path = Path(path)
    if path.suffix.lower() == ".pdf":
        gray, scale = _page(path, scale)
        opaque = np.ones(gray.shape, dtype=np.bool_)
    else:
        gray, opaque = _pixels({"image": path.name}, path)
    dark = (gray < DARK) & opaque
    return RosMap(dark[::-1], ~dark[::-1], scale, (0.0, 0.0, 0.0))


def _page(path: Path, scale: float) -> tuple[NDArray[np.float64], float]:
    """Return the gray values (ny, nx) of the first page of a PDF file, and the side of a pixel, meters."""
    with optional_package("pypdfium2", "reading PDF files", "cad"):
        import pypdfium2
    try:
        if path.stat().st_size > MAX_IMAGE:
            raise DocumentError(path, "", f"the file is larger than {MAX_IMAGE} bytes")
        with pypdfium2.PdfDocument(path) as document:
            page = document[0]
            width, height = page.get_size()
            if not 1.0 <= min(width, height) <= max(width, height) <= MAX_PAGE:
                raise DocumentError(path, "", f"a page of {width:.0f} x {height:.0f} points; at most {MAX_PAGE}")
            density = min(scale / PAGE_PIXEL, math.sqrt(MAX_CELLS / 4.0 / (width * height)))
            exact = {"no_smoothtext": True, "no_smoothimage": True, "no_smoothpath": True}  # thin lines stay dark
            pixels = page.render(scale=density, grayscale=True, **exact).to_numpy()
    except OSError as error:
        raise DocumentError(path, "", f"cannot be read ({error.strerror or str(error)[:80]})") from None
    except (pypdfium2.PdfiumError, ValueError, IndexError) as error:
        raise DocumentError(path, "", f"a damaged or encrypted PDF file ({str(error)[:80]})") from None
    return pixels.reshape(pixels.shape[:2]).astype(np.float64), scale / density


def _fields(path: Path) -> Mapping[str, Any]:
    data = read_yaml(path, MAX_YAML, "a map of ROS")
    if not isinstance(data, dict):
        raise DocumentError(path, "", f"expected fields such as image and resolution, got {type(data).__name__}")
    return data


def _pixels(fields: Mapping[str, Any], path: Path) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Return the gray values of the image, the mean of its colors, and where it is opaque; each (ny, nx)."""
    from PIL import Image, UnidentifiedImageError

    name = fields.get("image")
    if not isinstance(name, str) or not name or "\0" in name:
        raise DocumentError(path, "image", f"expected the name of the image, got {str(name)[:40]!r}")
    place = path.parent / name
    beside = path.parent / PureWindowsPath(name).name
    if PureWindowsPath(name).root and beside.is_file():  # map_saver writes absolute paths
        place = beside
    try:
        inside = place.resolve().is_relative_to(path.parent.resolve())
    except (OSError, RuntimeError):
        inside = False
    if not inside:
        raise DocumentError(path, "image", f"{name[:80]!r} is outside the folder of the file: put the image next to it")
    try:
        if place.stat().st_size > MAX_IMAGE:
            raise DocumentError(place, "", f"the file is larger than {MAX_IMAGE} bytes")
        with Image.open(place, formats=FORMATS) as image:
            if image.width * image.height > MAX_CELLS:
                raise DocumentError(place, "", f"{image.width} x {image.height} cells; at most {MAX_CELLS} are read")
            colors = np.asarray(image.convert("RGBA"))
    except UnidentifiedImageError:
        raise DocumentError(place, "", "not a PNG, PGM, BMP or TIFF image") from None
    except OSError as error:
        raise DocumentError(place, "", f"cannot be read ({error.strerror or str(error)[:80]})") from None
    except (ValueError, SyntaxError, LookupError, TypeError, ArithmeticError, Image.DecompressionBombError) as error:
        raise DocumentError(place, "", f"a damaged image ({type(error).__name__})") from None
    return colors[..., :3].mean(axis=-1), colors[..., 3] == 255


def _resolution(fields: Mapping[str, Any], path: Path) -> float:
    resolution = _number(fields, "resolution", path, None)
    low, high = RESOLUTIONS
    if not low <= resolution <= high:
        raise DocumentError(path, "resolution", f"{resolution:g} m must be {low:g} to {high:g} m")
    return resolution


def _origin(fields: Mapping[str, Any], path: Path) -> tuple[float, float, float]:
    origin = fields.get("origin")
    if not isinstance(origin, list) or len(origin) != 3:
        raise DocumentError(path, "origin", f"expected [x, y, yaw], got {str(origin)[:60]!r}")
    x, y, yaw = (_finite(value, "origin", path) for value in origin)
    if max(abs(x), abs(y)) > 10_000.0 or abs(yaw) > 7.0:
        raise DocumentError(path, "origin", f"({x:g}, {y:g}, {yaw:g}) is out of range")
    return x, y, yaw


def _number(fields: Mapping[str, Any], name: str, path: Path, default: float | None) -> float:
    value = fields.get(name, default)
    return _finite(value, name, path)


def _finite(value: Any, name: str, path: Path) -> float:
    if not isinstance(value, int | float) or not abs(value) < 1e9 or not math.isfinite(value):
        raise DocumentError(path, name, f"expected a number, got {str(value)[:40]!r}")
    return float(value)
