"""The format "minari": a dataset of the Minari library, written by its own storage as HDF5."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium import spaces

import labgym
from labgym.datasets.options import DriveOptions
from labgym.datasets.shard import FinishedShard, FinishedShards
from labgym.datasets.tables import FINAL, OBSERVATION, PRIVILEGED, column_array, observations_of
from labgym.runs.folder import Content
from labgym.temporary import temporary_folder

DATA = "data"
"""Folder of the files that Minari reads."""
PIECE_BYTES = 2**24
"""Bytes that are copied at one time."""
DESCRIBED = (
    *("task_id", "task", "level", "split", "policy", "floor", "floor_hash", "protocol", "goals", "radius"),
    *("success", "score", "ending", "shortest_path_length", "path_length", "time", "attempt"),
)
"""Columns of the episodes that are metadata of Minari's episodes."""


def minari_files(options: DriveOptions, shards: FinishedShards) -> Iterator[tuple[str, Content]]:
    """Yield the files of the folder `data`, which `minari.MinariDataset` reads.

    Images are not encoded as JPEG, so that observations equal those of the environment.
    """
    import minari
    from minari.dataset.minari_storage import MinariStorage

    spec = options.spec
    env = gym.make(spec)
    observation, action = env.observation_space, env.action_space
    env.close()
    assert isinstance(observation, spaces.Dict)
    assert isinstance(action, spaces.Box)
    # Minari's storage joins its folder to paths that already begin with it, which only absolute paths survive.
    with temporary_folder(shards.path.resolve()) as temporary:
        storage = MinariStorage.new(
            temporary / DATA, observation, action, spec, data_format="hdf5", jpeg_encoding=False
        )
        storage.update_metadata(
            {
                "dataset_id": options.name,
                "minari_version": minari.__version__,
                "algorithm_name": options.policy,
                "author": {"labgym"},
                "description": f"Drives of the expert {options.policy} in {options.task_id}; README.md is the card.",
                "requirements": [f"labgym-nav=={labgym.__version__}"],
            }
        )
        described: list[dict[str, Any]] = []
        for shard in shards:
            storage.update_episodes(_buffers(shard, observation, action))
            described += shard.episodes.select(DESCRIBED).to_pylist()
        storage.update_episode_metadata(described)
        for path in sorted((temporary / DATA).iterdir()):
            yield f"{DATA}/{path.name}", _pieces(path)


def _buffers(shard: FinishedShard, observation: spaces.Dict, action: spaces.Box) -> Iterator[Any]:
    """Yield the episodes of a shard: observations and infos have one entry more than actions."""
    from minari.data_collector import EpisodeBuffer

    first = 0
    for row in range(len(shard.episodes)):
        episode = shard.episodes.slice(row, 1)
        count = episode["length"][0].as_py()
        steps = shard.steps.slice(first, count)
        first += count
        before, after = observations_of(steps, observation), observations_of(episode, observation, FINAL + OBSERVATION)
        yield EpisodeBuffer(
            id=episode["episode_index"][0].as_py(),
            seed=episode["seed"][0].as_py(),
            observations={name: np.concatenate([before[name], after[name]]) for name in before},
            actions=column_array(steps, "action", action),
            rewards=steps["reward"].to_numpy(),
            terminations=_flags(steps, "terminated"),
            truncations=_flags(steps, "truncated"),
            infos={"privileged": _infos(steps, episode)},
        )


def _infos(steps: Any, episode: Any) -> dict[str, Any]:
    """Return what no policy may see: the poses of robot and goal, and contacts during the action before."""
    pose = spaces.Box(-np.inf, np.inf, (3,), np.float64)
    names = ("pose", "goal")
    infos = {
        name: np.concatenate(
            [column_array(steps, PRIVILEGED + name, pose), column_array(episode, FINAL + PRIVILEGED + name, pose)]
        )
        for name in names
    }
    return {**infos, "contact": np.concatenate([[False], _flags(steps, f"{PRIVILEGED}contact")])}


def _flags(table: Any, name: str) -> Any:
    return np.array(table[name].to_pylist(), dtype=bool)


def _pieces(path: Path) -> Iterator[bytes]:
    """Yield the content of a file."""
    with path.open("rb") as stream:
        while piece := stream.read(PIECE_BYTES):
            yield piece
