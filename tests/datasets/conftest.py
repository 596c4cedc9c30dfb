from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from labgym.datasets import drive_options, make_drives

CAMERA: dict[str, Any] = {
    "task": "point", "policy": "astar", "split": "val", "level": None, "sensors": "rgbd", "episodes": 2, "seed": 9,
}  # fmt: skip
"""Drives with colors and depth that several formats hold: an expert with the map, in published rooms."""


@pytest.fixture(scope="session")
def camera() -> dict[str, Any]:
    """Arguments of `drive_options` for the drives with a camera, without format and shard."""
    return CAMERA


@pytest.fixture(scope="session")
def camera_tables(tmp_path_factory) -> Path:
    """The drives with a camera in the format parquet, in one shard."""
    chosen = drive_options(format="parquet", shard=2, **CAMERA)
    return make_drives(tmp_path_factory.mktemp("tables"), chosen, progress=False)
