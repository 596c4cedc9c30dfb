"""Columns of the parquet files, and encoding and decoding of their images.

Names follow LeRobot (`observation.*`, `action`, `episode_index`, `frame_index`); images are the `{bytes, path}` structs
that Hugging Face readers decode.
"""

from __future__ import annotations

import io
from typing import TYPE_CHECKING, Any

import cv2
import numpy as np
from numpy.typing import NDArray
from PIL import Image

from labgym.envs.sensors import IMAGE_SHAPE
from labgym.errors import LabgymError, optional_package
from labgym.policies.data.maps import Maps
from labgym.policies.data.situations import FRAME_PERIOD_S, PATH_POINTS, DriveFrame

if TYPE_CHECKING:
    import pyarrow as pa

JPEG_QUALITY = 92
MILLIMETERS = 1000.0
_SIZE = f"{IMAGE_SHAPE[1]} x {IMAGE_SHAPE[0]}"


def arrow() -> Any:
    """Return pyarrow.

    Raises:
        MissingDependencyError: it is not installed.
    """
    with optional_package("pyarrow", "making and reading datasets", "data"):
        import pyarrow as pa
        import pyarrow.parquet
    del pyarrow
    return pa


def sample_schema() -> pa.Schema:
    """Return the columns of a sample file.

    - `index`: of the sample. `episode_index`: of the first sample of its drive. `frame_index`: of the sample in its
      drive, whose samples are consecutive rows. `timestamp`: since the start of the drive, seconds.
    - `map_index`: row of its layout in the map file of the same number. `kind`: where its drive began.
    - `observation.images.rgb`: JPEG. `observation.images.depth`: 16-bit PNG, millimeters, planar, at most 10 m.
    - `observation.state`: x, y (m) and yaw (rad) in the room frame. `observation.goal`: x, y in the robot frame, m.
    - `action`: the expert path in the robot frame, x and y of 64 points in turn, meters.
    - `path_length`, `path_clearance`: of the expert path, meters.
    """
    pa = arrow()
    image = pa.struct([("bytes", pa.binary()), ("path", pa.string())])
    return pa.schema(
        [
            ("index", pa.int64()),
            ("episode_index", pa.int64()),
            ("frame_index", pa.int64()),
            ("timestamp", pa.float32()),
            ("map_index", pa.int64()),
            ("kind", pa.string()),
            ("observation.images.rgb", image),
            ("observation.images.depth", image),
            ("observation.state", _floats(3)),
            ("observation.goal", _floats(2)),
            ("action", _floats(2 * PATH_POINTS)),
            ("path_length", pa.float32()),
            ("path_clearance", pa.float32()),
        ]
    )


def map_schema() -> pa.Schema:
    """Return the columns of a map file, one layout per row; `cost` and `distance` are row by row from the origin."""
    pa = arrow()
    return pa.schema(
        [
            ("map_index", pa.int64()),
            ("layout", pa.string()),
            ("hash", pa.string()),
            ("rows", pa.int64()),
            ("columns", pa.int64()),
            ("resolution", pa.float64()),
            ("origin", pa.list_(pa.field("element", pa.float64()), 2)),
            ("cost", _floats(-1)),
            ("distance", _floats(-1)),
        ]
    )


def sample_row(situation: DriveFrame, rgb: NDArray[np.uint8], depth: NDArray[np.float32]) -> dict[str, Any]:
    """Return a row of the sample file, without its numbers in the dataset."""
    return {
        "frame_index": situation.frame,
        "timestamp": situation.frame * FRAME_PERIOD_S,
        "kind": situation.kind,
        "observation.images.rgb": {"bytes": jpeg(rgb), "path": None},
        "observation.images.depth": {"bytes": depth_png(depth), "path": None},
        "observation.state": list(situation.pose),
        "observation.goal": list(situation.goal),
        "action": situation.path.ravel().tolist(),
        "path_length": situation.length,
        "path_clearance": situation.clearance,
    }


def map_row(maps: Maps, index: int, layout: str, digest: str) -> dict[str, Any]:
    """Return a row of the map file."""
    rows, columns = maps.cost.shape
    return {
        "map_index": index,
        "layout": layout,
        "hash": digest,
        "rows": rows,
        "columns": columns,
        "resolution": maps.resolution,
        "origin": list(maps.origin),
        "cost": maps.cost.ravel(),
        "distance": maps.distance.ravel(),
    }


def _floats(count: int) -> Any:
    """Return the type of a list of `count` floats, -1 for any number; parquet calls the items `element`."""
    pa = arrow()
    return pa.list_(pa.field("element", pa.float32()), count)


def jpeg(rgb: NDArray[np.uint8]) -> bytes:
    """Return an image (h, w, 3) as JPEG."""
    done, data = cv2.imencode(".jpg", rgb[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])
    return _encoded(done, data)


def depth_png(depth: NDArray[np.float32]) -> bytes:
    """Return depth (h, w), meters, as a 16-bit PNG in millimeters, rounded."""
    millimeters = np.rint(np.clip(depth * MILLIMETERS, 0.0, 65535.0)).astype(np.uint16)
    done, data = cv2.imencode(".png", millimeters, [cv2.IMWRITE_PNG_COMPRESSION, 1])
    return _encoded(done, data)


def depth_of(png: bytes) -> NDArray[np.uint16]:
    """Return the depth (72, 128), millimeters, of a 16-bit PNG.

    Raises:
        LabgymError: the data are not a 16-bit PNG of that size.
    """
    depth = _decoded(png, "PNG", cv2.IMREAD_UNCHANGED)
    if depth is None or depth.dtype != np.uint16 or depth.shape != IMAGE_SHAPE:
        raise LabgymError(f"a depth image is not a 16-bit PNG of {_SIZE} pixels; make the dataset again: labgym data")
    return np.asarray(depth, dtype=np.uint16)


def rgb_of(jpeg_bytes: bytes) -> NDArray[np.uint8]:
    """Return the image (72, 128, 3), RGB, of a JPEG.

    Raises:
        LabgymError: the data are not a JPEG of that size.
    """
    bgr = _decoded(jpeg_bytes, "JPEG", cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION)
    if bgr is None or bgr.shape != (*IMAGE_SHAPE, 3):
        raise LabgymError(f"an RGB image is not a JPEG of {_SIZE} pixels; make the dataset again: labgym data")
    return np.ascontiguousarray(bgr[..., ::-1], dtype=np.uint8)


def _decoded(data: bytes, kind: str, flags: int) -> NDArray[Any] | None:
    """Decode an image if its header has the camera's size: a small file may declare a huge image."""
    try:
        with Image.open(io.BytesIO(data), formats=[kind]) as header:
            if header.size != IMAGE_SHAPE[::-1]:
                return None
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError):
        return None
    return cv2.imdecode(np.frombuffer(data, dtype=np.uint8), flags)


def _encoded(done: bool, data: NDArray[np.uint8]) -> bytes:
    if not done:
        raise LabgymError("OpenCV could not encode an image")
    return bytes(data.tobytes())
