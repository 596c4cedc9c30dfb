"""Images as the clients and servers of the NavDP benchmark exchange them.

Color is a JPEG whose encoder reads RGB as BGR: viewers show red as blue, and the servers of that benchmark swap the
channels back. Depth is a 16-bit PNG in units of 0.1 mm, so that it ends at 6.5535 m. The images of a batch are stacked
vertically.
"""

from __future__ import annotations

import io
from typing import Any, Literal

import cv2
import numpy as np
from numpy.typing import NDArray
from PIL import Image

from labgym.errors import LabgymError
from labgym.policies.policy import GoalKind

DEPTH_SCALE = 10_000.0
"""Depth units per meter."""

FULL_SCALE = 65_535
"""Largest depth value: 6.5535 m and everything beyond."""

MAX_PIXELS = 16 * 1280 * 960
"""Largest number of pixels of a decoded image, for a whole batch."""

ColorImages = NDArray[np.uint8]

DepthImages = NDArray[np.float32]


class WireError(LabgymError):
    """Bytes that the protocol does not allow."""


def encode_color(pictures: ColorImages) -> bytes:
    """Return images (B, H, W, 3), RGB, as one JPEG."""
    return _encoded(".jpg", np.concatenate(list(pictures), axis=0))


def encode_depth(depth: NDArray[np.floating[Any]]) -> bytes:
    """Return planar depth (B, H, W), meters, as one 16-bit PNG; NaN becomes 0, and fractions of a unit are cut off."""
    stacked = np.concatenate(list(depth), axis=0).astype(np.float32)
    steps = np.clip(np.nan_to_num(stacked * DEPTH_SCALE, nan=0.0, posinf=FULL_SCALE, neginf=0.0), 0.0, FULL_SCALE)
    return _encoded(".png", steps.astype(np.uint16))


def decode_color(data: bytes, batch: int) -> ColorImages:
    """Return the images (batch, H, W, 3), RGB, of a JPEG.

    Raises:
        WireError: the data are not a JPEG or too large, or the height is not a multiple of the batch.
    """
    return _stacked(_decoded(data, "JPEG", cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION, np.uint8, 3), batch)


def decode_depth(data: bytes, batch: int) -> DepthImages:
    """Return planar depth (batch, H, W), meters, of a 16-bit PNG; saturated pixels become 6.5535.

    Raises:
        WireError: the data are not a 16-bit gray PNG or too large, or the height is not a multiple of the batch.
    """
    steps = _stacked(_decoded(data, "PNG", cv2.IMREAD_UNCHANGED, np.uint16, 2), batch)
    return np.asarray(steps.astype(np.float32) / np.float32(DEPTH_SCALE), dtype=np.float32)


def intrinsic_matrix(width: int, height: int, hfov: float) -> NDArray[np.float64]:
    """Return the camera matrix (3, 3), pixels, of a pinhole camera with square pixels and a centered axis.

    Pixel coordinates start with 0 at the left edge of the first pixel, so that the center is at width / 2.

    Args:
        width, height: size of the image, pixels.
        hfov: horizontal field of view, radians.
    """
    focal = width / 2.0 / np.tan(hfov / 2.0)
    return np.array([[focal, 0.0, width / 2.0], [0.0, focal, height / 2.0], [0.0, 0.0, 1.0]])


def _encoded(kind: str, picture: NDArray[Any]) -> bytes:
    done, data = cv2.imencode(kind, picture)
    if not done:
        raise WireError(f"an image of shape {picture.shape} cannot be encoded as {kind}")
    return data.tobytes()


def _decoded(data: bytes, kind: str, flags: int, dtype: type[np.generic], dimensions: int) -> NDArray[Any]:
    """Decode an image after checking its header: a small file may declare a huge image."""
    try:
        with Image.open(io.BytesIO(data), formats=[kind]) as header:
            width, height = header.size
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError) as error:
        raise WireError(f"expected a {kind} image, got {len(data)} bytes of something else ({error})") from None
    if not 0 < width * height <= MAX_PIXELS:
        raise WireError(f"the {kind} image has {width} x {height} pixels; at most {MAX_PIXELS} pixels are read")
    picture = cv2.imdecode(np.frombuffer(data, dtype=np.uint8), flags)
    if picture is None or picture.dtype != dtype or picture.ndim != dimensions:
        content = "no readable pixels" if picture is None else f"{picture.dtype} of shape {picture.shape}"
        raise WireError(f"the {kind} image has {content}, expected {np.dtype(dtype)} in {dimensions} dimensions")
    return picture


def _stacked(picture: NDArray[Any], batch: int) -> NDArray[Any]:
    height, width = picture.shape[:2]
    if height % batch:
        raise WireError(f"an image of {height} rows is not a stack of {batch}, the batch_size of /navigator_reset")
    return picture.reshape(batch, height // batch, width, *picture.shape[2:])


Step = Literal["pointgoal", "imagegoal", "nogoal"]
"""Name of a step in the options of the client; its path is `/NAME_step`."""

PATHS: dict[str, GoalKind] = {"/pointgoal_step": "point", "/imagegoal_step": "image", "/nogoal_step": "none"}
"""Kind of the goal by the path of the request."""


def path_of(step: Step) -> str:
    """Return the path of the request of a step."""
    return f"/{step}_step"


def paths_of(kinds: tuple[GoalKind, ...]) -> str:
    """Return the paths of the steps with these kinds of goals, for messages."""
    return ", ".join(path for path, kind in PATHS.items() if kind in kinds)
