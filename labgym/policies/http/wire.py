"""Pictures as the NavDP benchmark's clients and servers exchange them, to the byte.

Colour is a JPEG that is made by handing RGB to an encoder which takes it for BGR: a picture viewer shows red as blue,
and every server of that benchmark undoes it. Depth is a 16-bit PNG of 0.1 mm, so that it ends at 6.5535 m. A batch is
its pictures one below the other.
"""

from __future__ import annotations

import io
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from PIL import Image

from labgym.errors import LabgymError

DEPTH_SCALE = 10_000.0
"""Depth steps a metre."""
FULL_SCALE = 65_535
"""Largest depth step: 6.5535 m or anything beyond."""
MAX_PIXELS = 16 * 1280 * 960
"""Largest picture that is decoded, a whole batch."""

Colour = NDArray[np.uint8]
Depth = NDArray[np.float32]


class WireError(LabgymError):
    """Bytes that are not what the protocol asks for."""


def encode_colour(pictures: Colour) -> bytes:
    """Return pictures (B, H, W, 3), RGB, as one JPEG."""
    return _encoded(".jpg", np.concatenate(list(pictures), axis=0))


def encode_depth(depth: NDArray[np.floating[Any]]) -> bytes:
    """Return planar depth (B, H, W), metres, as one 16-bit PNG; what is no number becomes 0, cut off, not rounded."""
    stacked = np.concatenate(list(depth), axis=0).astype(np.float32)
    steps = np.clip(np.nan_to_num(stacked * DEPTH_SCALE, nan=0.0, posinf=FULL_SCALE, neginf=0.0), 0.0, FULL_SCALE)
    return _encoded(".png", steps.astype(np.uint16))


def decode_colour(data: bytes, batch: int) -> Colour:
    """Return the pictures (batch, H, W, 3), RGB, of a JPEG.

    Raises:
        WireError: it is no JPEG, is too large, or its height is no multiple of the batch.
    """
    return _stacked(_decoded(data, "JPEG", cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION, np.uint8, 3), batch)


def decode_depth(data: bytes, batch: int) -> Depth:
    """Return planar depth (batch, H, W), metres, of a 16-bit PNG; saturated pixels say 6.5535.

    Raises:
        WireError: it is no 16-bit grey PNG, is too large, or its height is no multiple of the batch.
    """
    steps = _stacked(_decoded(data, "PNG", cv2.IMREAD_UNCHANGED, np.uint16, 2), batch)
    return np.asarray(steps.astype(np.float32) / np.float32(DEPTH_SCALE), dtype=np.float32)


def intrinsic_matrix(width: int, height: int, hfov: float) -> NDArray[np.float64]:
    """Return the camera matrix (3, 3) in pixels of a pinhole with square pixels and its axis in the middle.

    Pixel coordinates run from 0 at the left edge of the first pixel, so that the middle is at width / 2.
    """
    focal = width / 2.0 / np.tan(hfov / 2.0)
    return np.array([[focal, 0.0, width / 2.0], [0.0, focal, height / 2.0], [0.0, 0.0, 1.0]])


def _encoded(kind: str, picture: NDArray[Any]) -> bytes:
    done, data = cv2.imencode(kind, picture)
    if not done:
        raise WireError(f"a picture of shape {picture.shape} cannot be encoded as {kind}")
    return data.tobytes()


def _decoded(data: bytes, kind: str, flags: int, dtype: type[np.generic], dimensions: int) -> NDArray[Any]:
    """Decode after a look at the header: a small file may claim to be a huge picture."""
    try:
        with Image.open(io.BytesIO(data), formats=[kind]) as header:
            width, height = header.size
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError) as error:
        raise WireError(f"expected a {kind} picture, got {len(data)} bytes that are none ({error})") from None
    if not 0 < width * height <= MAX_PIXELS:
        raise WireError(f"a {kind} picture of {width} x {height} pixels; at most {MAX_PIXELS} pixels are read")
    picture = cv2.imdecode(np.frombuffer(data, dtype=np.uint8), flags)
    if picture is None or picture.dtype != dtype or picture.ndim != dimensions:
        found = "nothing that can be read" if picture is None else f"{picture.dtype} of shape {picture.shape}"
        raise WireError(f"a {kind} picture holds {found}, expected {np.dtype(dtype)} in {dimensions} dimensions")
    return picture


def _stacked(picture: NDArray[Any], batch: int) -> NDArray[Any]:
    height, width = picture.shape[:2]
    if height % batch:
        raise WireError(f"a picture {height} rows high is no stack of {batch}; send as many as /navigator_reset said")
    return picture.reshape(batch, height // batch, width, *picture.shape[2:])
