"""Memory that prepared data take."""

from __future__ import annotations

from typing import Any

import mujoco


def size_of(value: Any) -> int:
    """Return the bytes of the arrays and models that a value refers to, each counted once.

    An object with an attribute `nbytes` states its size itself; of any other object of this package the attributes
    are counted. Embree's copies of a mesh are in `RayScene.nbytes`.
    """
    return _size(value, set())


def _size(value: Any, counted: set[int]) -> int:
    if value is None or isinstance(value, int | float | str) or id(value) in counted:
        return 0
    counted.add(id(value))
    if isinstance(value, mujoco.MjModel):
        return int(value.nbuffer)
    if isinstance(value, bytes):
        return len(value)
    if hasattr(value, "nbytes"):
        return int(value.nbytes)
    if isinstance(value, dict):
        return sum(_size(item, counted) for item in value.values())
    if isinstance(value, tuple | list | set | frozenset):
        return sum(_size(item, counted) for item in value)
    if type(value).__module__.startswith("labgym."):
        return _size(getattr(value, "__dict__", None), counted)
    return 0
