"""The contents of requests, checked: JSON objects, and the frames in a form."""

from __future__ import annotations

from typing import Any

import numpy as np

from labgym.documents import parse_json
from labgym.geometry import Array
from labgym.policies.http.served import Frame
from labgym.policies.http.wire import WireError, decode_color, decode_depth
from labgym.policies.policy import GoalKind

MAX_JSON = 1024 * 1024
"""Largest JSON text of a request, bytes."""
LARGEST_NUMBER = 1e5
"""Largest number in a request: goals, positions and focal lengths beyond it are refused."""

Motion = tuple[tuple[float, float, float] | None, tuple[float, float]]
"""Pose of a robot, None if the client does not send it, and its velocity."""


def json_object(body: bytes, source: str) -> dict[str, Any]:
    """Return the JSON object of a body.

    Args:
        body: the bytes.
        source: name of the body in messages.

    Raises:
        WireError: it is too large or not an object.
        DocumentError: it is not JSON.
    """
    if len(body) > MAX_JSON:
        raise WireError(f"{source}: {len(body)} bytes of JSON; at most {MAX_JSON} are read")
    content = parse_json(body, source)
    if not isinstance(content, dict):
        raise WireError(f"{source}: expected a JSON object")
    return content


def frames_of(parts: dict[str, bytes], kind: GoalKind, batch: int, intrinsic: Array) -> list[Frame]:
    """Return the frame of each robot of a batch.

    Args:
        parts: parts of the form by name.
        kind: kind of the goals: `goal_data` for points, the picture `goal` for images.
        batch: number of robots.
        intrinsic: camera matrix (3, 3), pixels.

    Raises:
        WireError: a part is missing or invalid.
        DocumentError: a part is not JSON.
    """
    needed = {"point": ["goal_data"], "image": ["goal"], "none": []}[kind]
    for name in ("image", "depth", *needed):
        if name not in parts:
            raise WireError(f"the form has no {name}; expected {' and '.join(['image', 'depth', *needed])}")
    color, depth = decode_color(parts["image"], batch), decode_depth(parts["depth"], batch)
    if color.shape[:3] != depth.shape:
        raise WireError(f"image has shape {color.shape[:3]} and depth {depth.shape}; expected equal shapes")
    goals = _point_goals(parts["goal_data"], batch) if kind == "point" else [None] * batch
    pictures = decode_color(parts["goal"], batch) if kind == "image" else [None] * batch
    motions = _motions(parts.get("state_data"), batch)
    return [Frame(color[k], depth[k], goals[k], intrinsic, *motions[k], pictures[k]) for k in range(batch)]


def finite_numbers(content: object, name: str) -> Array:
    """Return nested lists of numbers as an array.

    Raises:
        WireError: they are not finite numbers of at most 100,000.
    """
    try:
        numbers = np.asarray(content, dtype=np.float64)
    except (TypeError, ValueError):
        numbers = np.array(np.nan)
    if not np.isfinite(numbers).all() or np.abs(numbers).max(initial=0.0) > LARGEST_NUMBER:
        raise WireError(f"{name} is not finite numbers of at most {LARGEST_NUMBER:g}")
    return numbers


def _point_goals(raw: bytes, batch: int) -> list[tuple[float, float]]:
    data = json_object(raw, "goal_data")
    x, y = (_column(data.get(key), key, batch) for key in ("goal_x", "goal_y"))
    return [(float(x[k]), float(y[k])) for k in range(batch)]


def _motions(raw: bytes | None, batch: int) -> list[Motion]:
    """Return pose and velocity of each robot; without `state_data` the poses are None."""
    data = json_object(raw, "state_data") if raw else {}
    if "robot_pos" not in data or "robot_quat" not in data:
        return [(None, (0.0, 0.0))] * batch
    places = finite_numbers(data["robot_pos"], "robot_pos")
    turns = finite_numbers(data["robot_quat"], "robot_quat")
    speeds = finite_numbers(data["velocity"], "velocity") if "velocity" in data else np.zeros((batch, 2))
    if places.shape not in ((batch, 2), (batch, 3)) or turns.shape != (batch, 4) or speeds.shape != (batch, 2):
        raise WireError("state_data has wrong shapes; expected robot_pos (B, 3), robot_quat (B, 4) and velocity (B, 2)")
    yaws = np.arctan2(
        2.0 * (turns[:, 3] * turns[:, 2] + turns[:, 0] * turns[:, 1]),
        1.0 - 2.0 * (turns[:, 1] ** 2 + turns[:, 2] ** 2),
    )
    return [
        ((float(places[k, 0]), float(places[k, 1]), float(yaws[k])), (float(speeds[k, 0]), float(speeds[k, 1])))
        for k in range(batch)
    ]


def _column(content: object, name: str, batch: int) -> Array:
    column = finite_numbers(content, name)
    if column.shape != (batch,):
        raise WireError(f"{name} has shape {column.shape}, expected a list of {batch}")
    return column
