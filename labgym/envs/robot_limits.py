"""Limits on the sums of a robot's MJCF file: elements, attributes, pixels, vertices; checked before MuJoCo reads it."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
import zlib
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

from labgym.errors import DocumentError

MAX_ELEMENTS = 10_000
"""Largest number of all elements."""
MAX_COUNTS = {
    "body": 200, "geom": 1000, "joint": 200, "freejoint": 1, "site": 500, "camera": 50, "light": 50, "frame": 500,
    "mesh": 200, "texture": 100, "material": 200, "default": 200, "pair": 500, "exclude": 1000,
    "actuator": 100, "equality": 100, "tendon": 100,
}  # fmt: skip
"""Largest number of elements of a kind, or in a section."""
SECTIONS = ("actuator", "equality", "tendon")
"""Sections whose elements count together."""
MAX_ATTRIBUTES = 50
"""Largest number of attributes of an element; MuJoCo takes quadratic time to read them."""
MAX_PIXELS_PER_SIDE, MAX_PIXELS = 8192, 16_000_000
"""Largest width or height of a texture, and largest sum over all textures, pixels."""
MAX_VERTICES = 400_000
"""Largest sum over all meshes of vertices or faces, whichever are more."""
MAX_LINE_BYTES = 2_000
"""Longest line of an OBJ file; a face with many corners takes quadratic time."""
MAX_NUMBERS = {
    "params": 180.0, "maxhullvert": 1_000.0, "octree_maxdepth": 6.0, "nsample": 100.0, "actdim": 10.0,
    "resolution": 4_096.0, "nrow": 100.0, "ncol": 100.0, "gridsize": 12.0,
}  # fmt: skip
"""Largest magnitude of the numbers in attributes that decide how much memory or time MuJoCo takes."""
INLINE = ("vertex", "normal", "texcoord", "face", "facenormal", "facetexcoord")
"""Attributes of <mesh> that hold its geometry."""
PNG = b"\x89PNG\r\n\x1a\n"
CHANNELS = {0: 1, 2: 3, 3: 1, 4: 2, 6: 4}
"""Values per pixel by color type."""
KEPT = (b"IHDR", b"PLTE", b"tRNS", b"IDAT", b"IEND")
"""Chunks of a picture that say what it shows; the others may be compressed without end."""


def check_counts(path: Path, root: ET.Element) -> None:
    """Check the number of elements and attributes, and the numbers that size what MuJoCo makes of them.

    Raises:
        DocumentError: a limit is exceeded.
    """
    counts: Counter[str] = Counter(element.tag for element in root.iter())
    if counts.total() > MAX_ELEMENTS:
        raise DocumentError(path, "", f"has {counts.total()} elements, at most {MAX_ELEMENTS} are allowed")
    for name in SECTIONS:
        counts[name] = sum(len(section) for section in root.findall(name))
    for name, limit in MAX_COUNTS.items():
        if counts[name] > limit:
            raise DocumentError(path, name, f"there are {counts[name]}, at most {limit} are allowed")
    for element in root.iter():
        if len(element.attrib) > MAX_ATTRIBUTES:
            raise DocumentError(path, element.tag, f"has {len(element.attrib)} attributes, at most {MAX_ATTRIBUTES}")
        for name in element.attrib.keys() & MAX_NUMBERS.keys():
            _check_numbers(path, element, name, MAX_NUMBERS[name])


def pixels(path: Path, element: ET.Element, size: tuple[int, int] | None = None) -> int:
    """Return the number of pixels that MuJoCo makes of a texture.

    Args:
        path: the document. element: <texture>. size: width and height of its picture; None for a built-in pattern.

    Raises:
        DocumentError: it is too wide or too high.
    """
    if size is None:
        sides = [_numbers(element, name) or [0.0] for name in ("width", "height")]
        for name, numbers in zip(("width", "height"), sides, strict=True):
            if len(numbers) > 1:
                raise DocumentError(path, f"texture/{name}", f"has {len(numbers)} numbers, expected one")
            _check_numbers(path, element, name, MAX_PIXELS_PER_SIDE)
        width, height = (int(abs(numbers[0])) for numbers in sides)
    else:
        width, height = size
        if max(size) > MAX_PIXELS_PER_SIDE:
            raise DocumentError(path, "texture/file", f"has {width} x {height} pixels, at most {MAX_PIXELS_PER_SIDE}")
    if element.get("type", "cube") != "2d":  # six sides, which may all be made of one picture
        height = max(height, 6 * width)
    return width * height


def vertices(path: Path, element: ET.Element, suffix: str = "", data: bytes = b"") -> int:
    """Return an upper bound of the number of vertices or faces of a mesh.

    Args:
        path: the document. element: <mesh>. suffix, data: of its file, if it has one.

    Raises:
        DocumentError: the file cannot be bounded.
    """
    inline = max(len(element.get(name, "").split()) for name in INLINE) // 3
    if element.get("builtin") is not None:
        inline += math.ceil(max(map(abs, _numbers(element, "params")), default=0.0) + 1) ** 2
    if suffix == ".stl":
        return inline + len(data) // 50 * 3
    if suffix == ".obj":
        if any(len(line) > MAX_LINE_BYTES for line in data.split(b"\n")):
            raise DocumentError(path, "mesh/file", f"has a line of more than {MAX_LINE_BYTES} bytes")
        return inline + data.count(b"\n") + 1
    return inline + len(data) // 12


def plain_png(path: Path, data: bytes) -> tuple[bytes, tuple[int, int]]:
    """Return a picture without its optional chunks, and its width and height.

    Raises:
        DocumentError: it is no PNG picture, or unpacks to more than its pixels.
    """
    chunks = list(_chunks(path, data))
    if not chunks or chunks[0][0] != b"IHDR" or len(chunks[0][1]) != 13:
        raise DocumentError(path, "texture/file", "is no PNG picture")
    header = chunks[0][1]
    width, height = int.from_bytes(header[:4], "big"), int.from_bytes(header[4:8], "big")
    bits = header[8] * CHANNELS.get(header[9], 0)
    limit = 2 * (width * bits // 8 + 2) * (height + 8)  # twice, for the rows of interlaced pictures
    if not 0 < width * height <= MAX_PIXELS or not 0 < bits <= 64:
        raise DocumentError(path, "texture/file", f"has {width} x {height} pixels, at most {MAX_PIXELS} are allowed")
    unpacker = zlib.decompressobj()
    try:
        rest = b"".join(content for name, content in chunks if name == b"IDAT")
        while rest and not unpacker.eof and limit >= 0:
            limit -= len(unpacker.decompress(rest, 2**20))
            rest = unpacker.unconsumed_tail
    except zlib.error:
        raise DocumentError(path, "texture/file", "is a damaged PNG picture") from None
    if limit < 0:
        raise DocumentError(path, "texture/file", "unpacks to more than its pixels")
    kept = (_chunk(name, content) for name, content in chunks if name in KEPT)
    return PNG + b"".join(kept), (width, height)


def _chunks(path: Path, data: bytes) -> Iterator[tuple[bytes, bytes]]:
    """Yield name and content of the chunks of a PNG file, up to the last."""
    if not data.startswith(PNG):
        raise DocumentError(path, "texture/file", "is no PNG picture")
    at = len(PNG)
    while at + 12 <= len(data):
        size, name = int.from_bytes(data[at : at + 4], "big"), data[at + 4 : at + 8]
        if at + 12 + size > len(data):
            break
        yield name, data[at + 8 : at + 8 + size]
        if name == b"IEND":
            return
        at += 12 + size
    raise DocumentError(path, "texture/file", "is a PNG picture that is cut off")


def _chunk(name: bytes, content: bytes) -> bytes:
    return len(content).to_bytes(4, "big") + name + content + zlib.crc32(name + content).to_bytes(4, "big")


def _numbers(element: ET.Element, name: str) -> list[float]:
    """Return the numbers in an attribute; NaN for what is none."""
    numbers = []
    for text in element.get(name, "").split():
        try:
            numbers.append(float(text))
        except ValueError:
            numbers.append(math.nan)
    return numbers


def _check_numbers(path: Path, element: ET.Element, name: str, limit: float) -> None:
    for number in _numbers(element, name):
        if not abs(number) <= limit:
            shown = element.get(name, "")[:40]
            raise DocumentError(path, f"{element.tag}/{name}", f"is {shown!r}, expected numbers up to {limit:g}")
