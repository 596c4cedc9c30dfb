"""The format "lerobot": a LeRobotDataset of version 3.0, with videos of the camera."""

from __future__ import annotations

import io
import json
from collections.abc import Iterator, Sequence
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from labgym.datasets.options import TRAINING_SPLITS, DriveOptions
from labgym.datasets.shard import FinishedShard, FinishedShards
from labgym.datasets.tables import OBSERVATION, PRIVILEGED, column_array
from labgym.datasets.video import (
    CODEC,
    FILES_PER_CHUNK,
    PIXELS,
    STEPS_PER_SECOND,
    VIDEO_PATH,
    VIDEOS,
    camera_pictures,
    file_place,
)
from labgym.envs.sensors import IMAGE_SHAPE
from labgym.policies.data.columns import arrow
from labgym.runs.folder import Content

QUANTILES = {"q01": 0.01, "q10": 0.10, "q50": 0.50, "q90": 0.90, "q99": 0.99}

Statistics = dict[str, NDArray[Any]]
"""min, max, mean, std and quantiles, each of the shape of the feature, and count (1,)."""

VERSION = "v3.0"
"""`codebase_version` of the layout."""

DATA_PATH = "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"

EPISODES_PATH = "meta/episodes/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"

STATE = {
    "goal": ("goal.distance", "goal.cosine", "goal.sine"),
    "velocity": ("velocity.forward", "velocity.turn"),
    "odometry": ("odometry.x", "odometry.y", "odometry.cosine", "odometry.sine"),
}
"""Entries of the observation that make `observation.state`, in this order, and the names of their components."""

SURROUNDINGS = {"lidar": "observation.environment_state"}
"""Feature of the entry that LeRobot's policies read as the state of the surroundings."""

EXACT_DEPTH = "depth"
"""Feature with the depth in meters; its name keeps LeRobot's policies from reading it besides the video."""

ACTIONS = ("forward", "turn", "stop")

DESCRIBED = (
    *("task_id", "task", "level", "split", "policy", "floor", "floor_hash", "protocol", "seed", "goals", "radius"),
    *("success", "score", "ending", "shortest_path_length", "path_length", "time", "attempt"),
)
"""Columns of the episodes that the metadata of LeRobot's episodes have, with "labgym/" before their names."""


def statistics(values: NDArray[Any]) -> Statistics:
    """Return the statistics of vectors (n, k) over their rows."""
    values = np.asarray(values, np.float64)
    return {
        "min": values.min(axis=0),
        "max": values.max(axis=0),
        "mean": values.mean(axis=0),
        "std": values.std(axis=0),
        "count": np.array([len(values)]),
        **{name: np.quantile(values, share, axis=0) for name, share in QUANTILES.items()},
    }


def picture_statistics(pictures: NDArray[np.uint8]) -> Statistics:
    """Return the statistics of images (n, rows, columns, 3) by channel, (3, 1, 1), in shares of 255; count is n."""
    channels = {name: each for name, each in statistics(pictures.reshape(-1, 3)).items() if name != "count"}
    return {
        **{name: each.reshape(3, 1, 1) / 255.0 for name, each in channels.items()},
        "count": np.array([len(pictures)]),
    }


def aggregated(parts: Sequence[Statistics]) -> Statistics:
    """Return the statistics of all episodes from those of each; quantiles are means weighted by count, as LeRobot's."""
    counts = np.array([part["count"][0] for part in parts], np.float64)
    weights = counts / counts.sum()

    def weighted(name: str, values: Sequence[NDArray[Any]] | None = None) -> NDArray[Any]:
        return np.tensordot(weights, np.stack([part[name] for part in parts] if values is None else values), axes=1)

    mean = weighted("mean")
    variance = weighted("", [part["std"] ** 2 + (part["mean"] - mean) ** 2 for part in parts])
    return {
        "min": np.min([part["min"] for part in parts], axis=0),
        "max": np.max([part["max"] for part in parts], axis=0),
        "mean": mean,
        "std": np.sqrt(variance),
        "count": np.array([int(counts.sum())]),
        **{name: weighted(name) for name in QUANTILES},
    }


def lerobot_files(options: DriveOptions, shards: FinishedShards) -> Iterator[tuple[str, Content]]:
    """Yield the merged files: the steps with their numbers in the dataset, and the metadata."""
    env = gym.make(options.spec)
    observation, action = env.observation_space, env.action_space
    env.close()
    assert isinstance(observation, spaces.Dict)
    assert isinstance(action, spaces.Box)
    features = features_of(observation, action)
    rows: list[dict[str, Any]] = []
    parts: list[dict[str, Statistics]] = []
    total = 0
    for shard in shards:
        table = _steps(shard, observation, action, total)
        yield DATA_PATH.format(**file_place(shard.index)), _parquet(table)
        pictures = {VIDEOS[name]: _observed(shard, observation, name) for name in VIDEOS if name in observation.spaces}
        begin = 0
        for episode in shard.episodes.select(["episode_index", "length", *DESCRIBED]).to_pylist():
            end = begin + episode["length"]
            parts.append(_statistics(table, features, pictures, begin, end))
            rows.append(_episode(options, shard.index, episode, begin, total + begin, list(pictures)))
            begin = end
        total += begin
    yield "meta/info.json", _json(_info(options, features, len(rows), total))
    yield "meta/stats.json", _json({name: _plain(aggregated([each[name] for each in parts])) for name in parts[0]})
    yield "meta/tasks.parquet", _tasks(options.task_id)
    for row, part in zip(rows, parts, strict=True):
        row |= {f"stats/{name}/{key}": value for name, each in part.items() for key, value in _plain(each).items()}
    yield EPISODES_PATH.format(**file_place(0)), _parquet(arrow().Table.from_pylist(rows))


def features_of(observation: spaces.Dict, action: spaces.Box) -> dict[str, dict[str, Any]]:
    """Return the features of `meta/info.json`: type, shape and names of each."""
    state = [name for entry, names in STATE.items() if entry in observation.spaces for name in names]
    features = {"observation.state": _feature("float32", len(state), state)}
    for entry, name in SURROUNDINGS.items():
        if entry in observation.spaces:
            count = int(np.prod(observation[entry].shape or ()))
            features[name] = _feature("float32", count, [f"{entry}.{ray}" for ray in range(count)])
    for entry, name in VIDEOS.items():
        if entry in observation.spaces:
            features[name] = _video_feature()
    if "depth" in observation.spaces:
        features[EXACT_DEPTH] = _feature("float32", int(np.prod(IMAGE_SHAPE)), None)
    return {
        **features,
        "action": _feature("float32", action.shape[0], list(ACTIONS[: action.shape[0]])),
        "next.reward": _feature("float32", 1, None),
        "next.done": _feature("bool", 1, None),
        "next.terminated": _feature("bool", 1, None),
        "next.truncated": _feature("bool", 1, None),
        "next.success": _feature("bool", 1, None),
        "leg": _feature("int64", 1, None),
        "privileged.pose": _feature("float32", 3, ["x", "y", "yaw"]),
        "privileged.goal": _feature("float32", 3, ["x", "y", "yaw"]),
        "privileged.contact": _feature("bool", 1, None),
        "timestamp": _feature("float32", 1, None),
        **{name: _feature("int64", 1, None) for name in ("frame_index", "episode_index", "index", "task_index")},
    }


def _feature(dtype: str, count: int, names: list[str] | None) -> dict[str, Any]:
    return {"dtype": dtype, "shape": [count], "names": names}


def _video_feature() -> dict[str, Any]:
    rows, columns = IMAGE_SHAPE
    info = {
        "video.height": rows,
        "video.width": columns,
        "video.codec": CODEC,
        "video.pix_fmt": PIXELS,
        "video.is_depth_map": False,
        "video.fps": STEPS_PER_SECOND,
        "video.channels": 3,
        "has_audio": False,
    }
    return {"dtype": "video", "shape": [rows, columns, 3], "names": ["height", "width", "channels"], "info": info}


def _info(options: DriveOptions, features: dict[str, Any], episodes: int, steps: int) -> dict[str, Any]:
    """Return `meta/info.json`."""
    videos = any(each["dtype"] == "video" for each in features.values())
    split = "train" if options.split in TRAINING_SPLITS else "val"
    return {
        "codebase_version": VERSION,
        "robot_type": "labgym_differential",
        "total_episodes": episodes,
        "total_frames": steps,
        "total_tasks": 1,
        "chunks_size": FILES_PER_CHUNK,
        "data_files_size_in_mb": 100,
        "video_files_size_in_mb": 200,
        "fps": STEPS_PER_SECOND,
        "splits": {split: f"0:{episodes}"},
        "data_path": DATA_PATH,
        "video_path": VIDEO_PATH if videos else None,
        "features": features,
    }


def _episode(
    options: DriveOptions, shard: int, episode: dict[str, Any], in_file: int, first: int, videos: Sequence[str]
) -> dict[str, Any]:
    """Return the metadata of an episode, but for its statistics.

    Args:
        shard: index of its file. episode: its row. in_file, first: number of its first step in the file, and in all.
        videos: features.
    """
    length, place = episode["length"], file_place(shard)
    row: dict[str, Any] = {
        "episode_index": episode["episode_index"],
        "tasks": [options.task_id],
        "length": length,
        "data/chunk_index": place["chunk_index"],
        "data/file_index": place["file_index"],
        "dataset_from_index": first,
        "dataset_to_index": first + length,
    }
    for feature in videos:
        row |= {
            f"videos/{feature}/chunk_index": place["chunk_index"],
            f"videos/{feature}/file_index": place["file_index"],
            f"videos/{feature}/from_timestamp": in_file / STEPS_PER_SECOND,
            f"videos/{feature}/to_timestamp": (in_file + length) / STEPS_PER_SECOND,
        }
    described = {f"labgym/{name}": episode[name] for name in DESCRIBED}
    return {**row, "meta/episodes/chunk_index": 0, "meta/episodes/file_index": 0, **described}


def _steps(shard: FinishedShard, observation: spaces.Dict, action: spaces.Box, first: int) -> Any:
    """Return the steps of a shard in LeRobot's columns; `first` is the number of the first step in the dataset."""
    pa, steps = arrow(), shard.steps
    count = len(steps)
    ended = np.array(steps["terminated"].to_pylist(), bool), np.array(steps["truncated"].to_pylist(), bool)
    good = {
        row["episode_index"]: row["success"] for row in shard.episodes.select(["episode_index", "success"]).to_pylist()
    }
    success = np.array([good[number] for number in steps["episode_index"].to_pylist()], bool)
    state = [_observed(shard, observation, entry) for entry in STATE if entry in observation.spaces]
    pose = spaces.Box(-np.inf, np.inf, (3,), np.float64)
    columns: dict[str, Any] = {"observation.state": _vectors(np.concatenate(state, axis=1))}
    for entry, name in (*SURROUNDINGS.items(), ("depth", EXACT_DEPTH)):
        if entry in observation.spaces:
            columns[name] = _vectors(_observed(shard, observation, entry))
    columns |= {
        "action": _vectors(column_array(steps, "action", action)),
        "next.reward": steps["reward"].cast(pa.float32()),
        "next.done": ended[0] | ended[1],
        "next.terminated": ended[0],
        "next.truncated": ended[1],
        "next.success": success & (ended[0] | ended[1]),
        "leg": steps["leg"],
        "privileged.pose": _vectors(column_array(steps, f"{PRIVILEGED}pose", pose)),
        "privileged.goal": _vectors(column_array(steps, f"{PRIVILEGED}goal", pose)),
        "privileged.contact": steps[f"{PRIVILEGED}contact"],
        "timestamp": steps["timestamp"].cast(pa.float32()),
        "frame_index": steps["frame_index"],
        "episode_index": steps["episode_index"],
        "index": np.arange(first, first + count, dtype=np.int64),
        "task_index": np.zeros(count, np.int64),
    }
    return pa.table(columns)


def _observed(shard: FinishedShard, observation: spaces.Dict, entry: str) -> NDArray[Any]:
    box = observation[entry]
    assert isinstance(box, spaces.Box)
    return column_array(shard.steps, OBSERVATION + entry, box)


def _statistics(
    table: Any, features: dict[str, Any], pictures: dict[str, NDArray[Any]], begin: int, end: int
) -> dict[str, Statistics]:
    """Return the statistics of an episode by feature, from the rows of its file."""
    parts: dict[str, Statistics] = {}
    for name, feature in features.items():
        if name == EXACT_DEPTH:
            continue  # Statistics of each pixel take more space than the episode.
        if name in pictures:
            parts[name] = picture_statistics(camera_pictures(name.rpartition(".")[2], pictures[name][begin:end]))
        else:
            column = table[name].slice(begin, end - begin).combine_chunks()
            flat = column.flatten() if feature["shape"] != [1] else column
            parts[name] = statistics(np.array(flat.to_numpy(zero_copy_only=False)).reshape(end - begin, -1))
    return parts


def _vectors(values: NDArray[Any]) -> Any:
    """Return rows as an array of float32 lists of fixed size."""
    pa = arrow()
    flat = pa.array(np.ascontiguousarray(values, np.float32).reshape(-1))
    return pa.FixedSizeListArray.from_arrays(flat, int(np.prod(values.shape[1:])))


def _plain(part: Statistics) -> dict[str, Any]:
    return {name: values.tolist() for name, values in part.items()}


def _tasks(task: str) -> bytes:
    """Return `meta/tasks.parquet`: a data frame whose index is the task, as pandas writes it."""
    pa = arrow()
    index = "__index_level_0__"
    column = {"field_name": None, "metadata": None, "name": None, "numpy_type": "object", "pandas_type": "unicode"}
    pandas = {
        "index_columns": [index],
        "column_indexes": [],
        "columns": [
            {**column, "field_name": "task_index", "name": "task_index", "numpy_type": "int64", "pandas_type": "int64"},
            {**column, "field_name": index},
        ],
        "creator": {"library": "labgym", "version": "1"},
        "pandas_version": "2.0.0",
    }
    schema = pa.schema([("task_index", pa.int64()), (index, pa.string())], {"pandas": json.dumps(pandas)})
    return _parquet(pa.table({"task_index": [0], index: [task]}, schema=schema))


def _json(data: Any) -> bytes:
    return (json.dumps(data, indent=4, allow_nan=False) + "\n").encode()


def _parquet(table: Any) -> bytes:
    stream = io.BytesIO()
    arrow().parquet.write_table(table, stream, compression="zstd")
    return stream.getvalue()
