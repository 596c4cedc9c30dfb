"""Records as plain data for content hashes: rounded, and without fields that have their default value."""

from __future__ import annotations

import math
from typing import Any

from labgym.documents import Record
from labgym.geometry import wrap_angle


def canonical(value: Any) -> Any:
    """Return plain data with lengths in 0.1 mm and yaws in 0.1 mrad, without fields that have their default value."""
    if isinstance(value, Record):
        body: dict[str, Any] = {}
        for name, field in type(value).model_fields.items():
            item = _canonical_field(name, getattr(value, name))
            if field.is_required() or item != _canonical_field(name, field.get_default(call_default_factory=True)):
                body[name] = item
        return body
    if isinstance(value, tuple | list):
        return [canonical(item) for item in value]
    return round(value * 1e4) if isinstance(value, float) else value


def _canonical_field(name: str, value: Any) -> Any:
    if name == "yaw":
        return round(wrap_angle(value) * 1e4) % round(2e4 * math.pi)
    return canonical(value)
