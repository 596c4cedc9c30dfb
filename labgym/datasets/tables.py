"""The two tables of a dataset, steps and episodes: their Arrow schemas, and rows to and from parquet files."""

from __future__ import annotations

import io
import json
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import cv2
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from labgym.datasets.driving import RecordedEpisode
from labgym.datasets.options import DriveOptions
from labgym.envs.robot import ROBOT
from labgym.errors import LabgymError
from labgym.policies.data.columns import arrow

if TYPE_CHECKING:
    import pyarrow as pa

OBSERVATION, PRIVILEGED, FINAL = "observation.", "privileged.", "final."
STEPS_SCHEMA, EPISODES_SCHEMA = "labgym.drive-steps/1", "labgym.drive-episodes/1"
"""Names of the schemas, in the metadata of the tables."""
GROUP_BYTES = 64 * 2**20
"""Size of a row group before compression, bytes."""


def is_picture(space: spaces.Box) -> bool:
    """Whether an entry of the observation is a color image, which is stored as PNG."""
    return space.dtype == np.uint8 and len(space.shape) == 3


def observation_fields(space: spaces.Dict, prefix: str = OBSERVATION) -> list[pa.Field]:
    """Return the columns of an observation."""
    pa = arrow()
    picture = pa.struct([("bytes", pa.binary()), ("path", pa.string())])
    return [
        pa.field(prefix + name, picture if is_picture(_box(box)) else _list(_box(box))) for name, box in space.items()
    ]


def steps_schema(observation: spaces.Dict, action: spaces.Box) -> pa.Schema:
    """Return the columns of the steps, one row for each action.

    - `episode_index`, `frame_index`: of the episode in the dataset, and of the step in the episode.
    - `timestamp`: seconds since the start. `leg`: number of the drive in progress, 0 but in `shift`.
    - `observation.*`: what the policy may see before the action, as in the environment. `rgb` is a PNG.
    - `action`: as the environment receives it. `reward`, `terminated`, `truncated`: what it returns.
    - `privileged.pose`, `privileged.goal`: true pose and goal pose, (x, y, yaw) in the room frame, meters and radians,
      before the action. `privileged.contact`: whether the robot touched something during the action.
    """
    pa = arrow()
    columns = [
        ("episode_index", pa.int64()),
        ("frame_index", pa.int64()),
        ("timestamp", pa.float64()),
        ("leg", pa.int64()),
        *observation_fields(observation),
        ("action", _list(action)),
        ("reward", pa.float64()),
        ("terminated", pa.bool_()),
        ("truncated", pa.bool_()),
        (f"{PRIVILEGED}pose", _doubles(3)),
        (f"{PRIVILEGED}goal", _doubles(3)),
        (f"{PRIVILEGED}contact", pa.bool_()),
    ]
    return pa.schema(columns, {"labgym": STEPS_SCHEMA})


def episodes_schema(observation: spaces.Dict) -> pa.Schema:
    """Return the columns of the episodes.

    - `episode_index`, `length` (number of steps), `task_id`, `task`, `level`, `split`, `policy`.
    - `floor`, `floor_hash`, `protocol`: the layout. `seed`: `env.reset(seed=seed)` begins the episode.
    - `goal`: the first goal as it is announced, (x, y, yaw) in the frame of the start. `goals`: number of drives.
      `radius`: of the success disc, meters.
    - `success`, `score`, `ending`: by LabNav's rules; of "point" the score is SPL. `return`: sum of the rewards.
    - `shortest_path_length`, `path_length`, meters; `time`, seconds.
    - `attempt`: number of failed drives that were dropped before this one.
    - `privileged.outcomes`: outcomes of the conditions, JSON.
    - `final.observation.*`, `final.privileged.pose`, `final.privileged.goal`: after the last action.
    """
    pa = arrow()
    columns = [
        ("episode_index", pa.int64()),
        ("length", pa.int64()),
        ("task_id", pa.string()),
        ("task", pa.string()),
        ("level", pa.int64()),
        ("split", pa.string()),
        ("policy", pa.string()),
        ("floor", pa.string()),
        ("floor_hash", pa.string()),
        ("protocol", pa.string()),
        ("seed", pa.int64()),
        ("goal", _doubles(3)),
        ("goals", pa.int64()),
        ("radius", pa.float64()),
        ("success", pa.bool_()),
        ("score", pa.float64()),
        ("ending", pa.string()),
        ("return", pa.float64()),
        ("shortest_path_length", pa.float64()),
        ("path_length", pa.float64()),
        ("time", pa.float64()),
        ("attempt", pa.int64()),
        (f"{PRIVILEGED}outcomes", pa.string()),
        *observation_fields(observation, FINAL + OBSERVATION),
        (f"{FINAL}{PRIVILEGED}pose", _doubles(3)),
        (f"{FINAL}{PRIVILEGED}goal", _doubles(3)),
    ]
    return pa.schema(columns, {"labgym": EPISODES_SCHEMA})


def step_table(episode: RecordedEpisode, observation: spaces.Dict, action: spaces.Box) -> pa.Table:
    """Return the steps of an episode."""
    pa, steps, count = arrow(), episode.steps, len(episode.steps)
    schema = steps_schema(observation, action)
    columns: dict[str, Any] = {
        "episode_index": np.full(count, episode.facts.number, np.int64),
        "frame_index": np.arange(count, dtype=np.int64),
        "timestamp": np.round(np.arange(count) * ROBOT.control_dt, 9),
        "leg": np.array(steps.legs[:count], np.int64),
        "action": _rows(schema.field("action").type, steps.actions),
        "reward": np.array(steps.rewards, np.float64),
        "terminated": np.array(steps.terminated, bool),
        "truncated": np.array(steps.truncated, bool),
        f"{PRIVILEGED}pose": _rows(_doubles(3), steps.poses[:count]),
        f"{PRIVILEGED}goal": _rows(_doubles(3), steps.goals[:count]),
        f"{PRIVILEGED}contact": np.array(steps.contacts, bool),
    }
    columns |= _observed(schema, OBSERVATION, observation, steps.observations[:count])
    return pa.table({name: columns[name] for name in schema.names}, schema=schema)


def episode_table(episode: RecordedEpisode, observation: spaces.Dict, options: DriveOptions) -> pa.Table:
    """Return the row of an episode."""
    pa, facts = arrow(), episode.facts
    schema = episodes_schema(observation)
    values: dict[str, Any] = {
        **vars(options),
        **vars(facts),
        "episode_index": facts.number,
        "length": len(episode.steps),
        "task_id": options.task_id,
        "goal": list(facts.announced),
        "return": float(np.sum(np.array(episode.steps.rewards, np.float64))),
        "shortest_path_length": facts.shortest,
        f"{PRIVILEGED}outcomes": json.dumps(facts.outcomes, sort_keys=True, allow_nan=False),
    }
    columns: dict[str, Any] = {name: [value] for name, value in values.items()}
    for name, poses in (("pose", episode.steps.poses), ("goal", episode.steps.goals)):
        columns[FINAL + PRIVILEGED + name] = _rows(_doubles(3), poses[-1:])
    columns |= _observed(schema, FINAL + OBSERVATION, observation, episode.steps.observations[-1:])
    return pa.table({name: columns[name] for name in schema.names}, schema=schema)


def parquet_bytes(tables: Sequence[pa.Table]) -> bytes:
    """Return tables of one schema as a parquet file."""
    pa = arrow()
    table = pa.concat_tables(tables)
    stream = io.BytesIO()
    rows = max(1, GROUP_BYTES // max(1, table.nbytes // max(1, len(table))))
    pa.parquet.write_table(table, stream, row_group_size=rows, compression="zstd")
    return stream.getvalue()


def read_parquet(content: bytes) -> pa.Table:
    """Return the table of a parquet file that this run has written."""
    pa = arrow()
    return pa.parquet.read_table(pa.BufferReader(content))


def column_array(table: pa.Table, name: str, box: spaces.Box) -> NDArray[Any]:
    """Return an entry of the observation, or the action, for all rows: (n, *shape)."""
    column = table[name].combine_chunks()
    if is_picture(box):
        frames = [_decoded(each["bytes"]) for each in column.to_pylist()]
        return np.stack(frames) if frames else np.zeros((0, *box.shape), np.uint8)
    flat: NDArray[Any] = column.flatten().to_numpy(zero_copy_only=False)
    return flat.reshape(len(table), *box.shape)


def observations_of(table: pa.Table, space: spaces.Dict, prefix: str = OBSERVATION) -> dict[str, NDArray[Any]]:
    """Return the observations of all rows by entry."""
    return {name: column_array(table, prefix + name, _box(box)) for name, box in space.items()}


def _observed(
    schema: pa.Schema, prefix: str, space: spaces.Dict, observations: Sequence[Mapping[str, NDArray[Any]]]
) -> dict[str, Any]:
    """Return the columns of observations."""
    columns: dict[str, Any] = {}
    for name, box in space.items():
        entries = [each[name] for each in observations]
        if is_picture(_box(box)):
            columns[prefix + name] = [{"bytes": _png(each), "path": None} for each in entries]
        else:
            columns[prefix + name] = _rows(schema.field(prefix + name).type, entries)
    return columns


def _rows(kind: Any, rows: Sequence[Any]) -> Any:
    """Return rows of numbers as an array of fixed-size lists."""
    pa = arrow()
    flat = np.asarray(rows, kind.value_type.to_pandas_dtype()).reshape(-1)
    return pa.FixedSizeListArray.from_arrays(pa.array(flat, kind.value_type), type=kind)


def _box(space: spaces.Space[Any]) -> spaces.Box:
    """Return a space that must be a box."""
    if not isinstance(space, spaces.Box):
        raise LabgymError(f"datasets hold observations and actions that are boxes, not {type(space).__name__}")
    return space


def _list(box: spaces.Box) -> Any:
    pa = arrow()
    return pa.list_(pa.field("element", pa.from_numpy_dtype(box.dtype)), int(np.prod(box.shape)))


def _doubles(count: int) -> Any:
    pa = arrow()
    return pa.list_(pa.field("element", pa.float64()), count)


def _png(rgb: NDArray[np.uint8]) -> bytes:
    done, data = cv2.imencode(".png", rgb[..., ::-1], [cv2.IMWRITE_PNG_COMPRESSION, 3])
    if not done:
        raise LabgymError("OpenCV could not encode an image")
    return bytes(data.tobytes())


def _decoded(png: bytes) -> NDArray[np.uint8]:
    bgr: Any = cv2.imdecode(np.frombuffer(png, np.uint8), cv2.IMREAD_COLOR)
    return np.ascontiguousarray(bgr[..., ::-1], np.uint8)
