"""A reader of LeRobotDataset v3.0 by its documentation: JSON, parquet and MP4, without LeRobot."""

from __future__ import annotations

import json
import subprocess
from functools import cached_property
from pathlib import Path
from typing import Any

import imageio_ffmpeg
import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

INFO = {
    "codebase_version": str, "robot_type": str, "total_episodes": int, "total_frames": int, "total_tasks": int,
    "chunks_size": int, "fps": int, "splits": dict, "data_path": str, "features": dict,
}  # fmt: skip
"""Entries of meta/info.json that readers rely on, with their types."""
DEFAULTS = {
    "timestamp": "float32",
    "frame_index": "int64",
    "episode_index": "int64",
    "index": "int64",
    "task_index": "int64",
}
"""Features that every dataset has, each of shape [1]."""
EPISODE = ("episode_index", "tasks", "length", "dataset_from_index", "dataset_to_index")
ARROW = {"float32": pa.float32(), "int64": pa.int64(), "bool": pa.bool_()}


class LeRobotFolder:
    """A dataset; reading checks what the documentation promises."""

    def __init__(self, root: Path) -> None:
        self.root = root
        self.info: dict[str, Any] = json.loads((root / "meta/info.json").read_text())
        for name, kind in INFO.items():
            assert isinstance(self.info[name], kind), name
        assert self.info["codebase_version"] == "v3.0"
        self.features: dict[str, dict[str, Any]] = self.info["features"]
        for name, dtype in DEFAULTS.items():
            assert self.features[name]["dtype"] == dtype
            assert self.features[name]["shape"] == [1]
        self.stats = json.loads((root / "meta/stats.json").read_text())
        self.tasks = pd.read_parquet(root / "meta/tasks.parquet")
        self.episodes = pd.concat(map(pd.read_parquet, sorted((root / "meta/episodes").glob("*/*.parquet"))))
        assert set(EPISODE) <= set(self.episodes.columns)

    @property
    def videos(self) -> list[str]:
        """Names of the features that are videos."""
        return [name for name, each in self.features.items() if each["dtype"] == "video"]

    @cached_property
    def steps(self) -> pa.Table:
        """All steps; their columns are the features but the videos, with the types of the features."""
        paths = [self.root / self.info["data_path"].format(**place) for place in self._places("data")]
        tables = [pq.read_table(path) for path in paths]
        table = pa.concat_tables(tables)
        assert set(table.column_names) == set(self.features) - set(self.videos)
        for name in table.column_names:
            kind, (count,) = ARROW[self.features[name]["dtype"]], self.features[name]["shape"]
            expected = kind if count == 1 else pa.list_(kind, count)
            assert table.schema.field(name).type.equals(expected), name
        return table

    def frames(self, feature: str, episode: int) -> np.ndarray:
        """Return the images of an episode, (n, rows, columns, 3), by its time span in the video."""
        row, rate = self.episodes.iloc[episode], self.info["fps"]
        place = {key: int(row[f"videos/{feature}/{key}"]) for key in ("chunk_index", "file_index")}
        path = self.root / self.info["video_path"].format(video_key=feature, **place)
        shape = self.features[feature]["shape"]
        command = [
            imageio_ffmpeg.get_ffmpeg_exe(),
            "-v",
            "error",
            "-i",
            str(path),
            "-f",
            "rawvideo",
            "-pix_fmt",
            "rgb24",
            "-",
        ]
        done = subprocess.run(command, capture_output=True, check=True)
        pictures = np.frombuffer(done.stdout, np.uint8).reshape(-1, *shape)
        first, last = (round(float(row[f"videos/{feature}/{key}_timestamp"]) * rate) for key in ("from", "to"))
        assert last - first == row.length
        assert last <= len(pictures)
        return pictures[first:last]

    def _places(self, kind: str) -> list[dict[str, int]]:
        """Return the files of the steps, in the order of the episodes."""
        pairs = zip(self.episodes[f"{kind}/chunk_index"], self.episodes[f"{kind}/file_index"], strict=True)
        return [{"chunk_index": int(chunk), "file_index": int(file)} for chunk, file in dict.fromkeys(pairs)]
