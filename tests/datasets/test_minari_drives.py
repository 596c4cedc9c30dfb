from __future__ import annotations

import math
import shutil
from pathlib import Path

import gymnasium as gym
import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest

from labgym.datasets import DriveOptions, drive_options, make_drives
from labgym.datasets.tables import OBSERVATION, column_array, observations_of

minari = pytest.importorskip("minari")


@pytest.fixture(scope="module")
def chosen(camera) -> DriveOptions:
    return drive_options(format="minari", shard=1, **camera)


@pytest.fixture(scope="module")
def root(tmp_path_factory, chosen) -> Path:
    """The folder of $MINARI_DATASETS_PATH."""
    root = tmp_path_factory.mktemp("minari")
    make_drives(root / chosen.name, chosen, progress=False)
    return root


@pytest.fixture
def dataset(root, chosen, monkeypatch):
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(root))
    return minari.load_dataset(chosen.name)


def test_minari_loads_the_dataset_with_the_spaces_of_the_environment(dataset, chosen):
    env = gym.make(chosen.spec)
    assert dataset.observation_space == env.observation_space
    assert dataset.action_space == env.action_space
    assert (dataset.total_episodes, dataset.id) == (2, chosen.name)
    assert minari.list_local_datasets().keys() == {chosen.name}


def test_episodes_equal_those_of_the_other_format(dataset, camera_tables):
    steps, rows = pq.read_table(camera_tables / "steps"), pd.read_parquet(camera_tables / "episodes.parquet")
    for episode in dataset.iterate_episodes():
        own = steps.filter(np.array(steps["episode_index"]) == episode.id)
        expected = observations_of(own, dataset.observation_space)
        for name, values in expected.items():
            assert episode.observations[name].dtype == dataset.observation_space[name].dtype
            assert np.array_equal(episode.observations[name][:-1], values), OBSERVATION + name
            assert len(episode.observations[name]) == len(values) + 1
        assert np.array_equal(episode.actions, column_array(own, "action", dataset.action_space))
        assert np.array_equal(episode.rewards, own["reward"].to_numpy())
        assert list(episode.terminations) == own["terminated"].to_pylist()
        assert np.array_equal(episode.infos["privileged"]["pose"][:-1], np.stack(own["privileged.pose"].to_pylist()))
        assert dataset.observation_space.contains({name: each[-1] for name, each in episode.observations.items()})
        (metadata,) = dataset.storage.get_episode_metadata([episode.id])
        row = rows.iloc[episode.id]
        assert (metadata["seed"], metadata["floor"], metadata["ending"]) == (row.seed, row.floor, row.ending)
        assert bool(metadata["success"]) == row.success
        assert math.isclose(metadata["score"], row.score)


def test_the_recovered_environment_begins_each_episode_as_it_was(dataset):
    env = dataset.recover_environment()
    episode = dataset[1]
    (metadata,) = dataset.storage.get_episode_metadata([1])
    observation, _ = env.reset(seed=metadata["seed"])
    for name, value in observation.items():
        assert np.array_equal(value, episode.observations[name][0])
    observation, reward, *_ = env.step(episode.actions[0])
    assert reward == episode.rewards[0]
    assert all(np.array_equal(value, episode.observations[name][1]) for name, value in observation.items())


def test_a_relative_folder_gives_the_same_bytes(root, chosen, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path.parent)
    make_drives(tmp_path.name, chosen, progress=False)
    for name in ("main_data.hdf5", "metadata.json"):
        assert (tmp_path / "data" / name).read_bytes() == (root / chosen.name / "data" / name).read_bytes()
    shutil.rmtree(tmp_path / "data")
