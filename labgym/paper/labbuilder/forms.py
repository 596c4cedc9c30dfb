"""Other forms of the same fields, as scenes of other versions may have them, brought into the form that is read."""

from __future__ import annotations

import re
from collections import Counter
from typing import Any

SIDES = {"width": "w", "depth": "d", "height": "h", "x": "w", "y": "d", "z": "h"}
"""Names of the room's sides, by other names."""
MAX_QUERY = 2000
LONGEST_ID = 74
_NOT_IN_IDS = re.compile(r"[^A-Za-z0-9_.-]+")


def identifier(name: str) -> str:
    """Return a name as an id of a placement: letters, digits, `_`, `.` and `-`."""
    return _NOT_IN_IDS.sub("_", name).strip("_.-")[:LONGEST_ID] or "object"


def regular(data: dict[str, Any]) -> tuple[dict[str, Any], tuple[str, ...]]:
    """Return a scene's data in the form that is read, and notes on what was taken for what.

    Null counts as missing, a list of three numbers as x, y, z (of the room: w, d, h), objects by name as a list of
    objects, and an empty location as the floor. Anything else is left to the check of the fields.
    """
    changes: Counter[str] = Counter()
    scene = _without_nulls(data, "", changes)
    query = scene.get("query", "")
    if not isinstance(query, str) or len(query) > MAX_QUERY:
        changes["query is not a text of at most 2000 characters; left out"] += 1
        del scene["query"]
    if "room_size" in scene:
        scene["room_size"] = _room_size(scene["room_size"], changes)
    objects = scene.get("objects")
    if isinstance(objects, dict):
        changes["objects are listed by name"] += 1
        objects = [{"id": name, **each} if isinstance(each, dict) else each for name, each in objects.items()]
    if isinstance(objects, list):
        scene["objects"] = [_object(each, changes) if isinstance(each, dict) else each for each in objects]
    return scene, tuple(text if count == 1 else f"{text} ({count} times)" for text, count in changes.items())


def _object(data: dict[str, Any], changes: Counter[str]) -> dict[str, Any]:
    each = _without_nulls(data, "objects.", changes)
    for name in ("position", "rotation"):
        if name in each:
            each[name] = _vector(each[name], ("x", "y", "z"), f"objects.{name}", changes)
    if each.get("initial_location") == "":
        changes["objects.initial_location is empty; taken as the floor"] += 1
        del each["initial_location"]
    return each


def _room_size(value: Any, changes: Counter[str]) -> Any:
    value = _vector(value, ("w", "d", "h"), "room_size", changes)
    if isinstance(value, dict):
        other = [name for name in value if name in SIDES and SIDES[name] not in value]
        if other:
            changes[f"room_size has {', '.join(other)}; taken as {', '.join(SIDES[name] for name in other)}"] += 1
            value = {SIDES[name] if name in other else name: side for name, side in value.items()}
    return value


def _vector(value: Any, names: tuple[str, str, str], field: str, changes: Counter[str]) -> Any:
    if isinstance(value, list) and len(value) == len(names):
        changes[f"{field} is a list; taken as {', '.join(names)}"] += 1
        return dict(zip(names, value, strict=True))
    return value


def _without_nulls(data: dict[str, Any], prefix: str, changes: Counter[str]) -> dict[str, Any]:
    for name, value in data.items():
        if value is None:
            changes[f"{prefix}{name[:80]} is null; taken as missing"] += 1
    return {name: value for name, value in data.items() if value is not None}
