from __future__ import annotations

import hashlib
import importlib.util
from pathlib import Path

import cv2
import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest
from lerobot_reader import LeRobotFolder

from labgym.datasets import drive_options, make_drives
from labgym.runs import ExecutorOptions

LUMA = np.array([0.299, 0.587, 0.114])
STATISTICS = ("min", "max", "mean", "std")


@pytest.fixture(scope="module")
def chosen(camera):
    return drive_options(format="lerobot", shard=1, **camera)


@pytest.fixture(scope="module")
def root(tmp_path_factory, chosen) -> Path:
    return make_drives(tmp_path_factory.mktemp("lerobot"), chosen, progress=False)


@pytest.fixture(scope="module")
def folder(root) -> LeRobotFolder:
    return LeRobotFolder(root)


def vectors(table, name) -> np.ndarray:
    return np.array(table[name].to_pylist())


def test_steps_are_numbered_through_and_timed_by_the_rate(folder, chosen):
    steps, rows, info = folder.steps, folder.episodes, folder.info
    assert info["total_frames"] == len(steps) == rows.length.sum()
    assert info["total_episodes"] == len(rows) == 2
    assert info["splits"] == {"val": "0:2"}
    assert list(steps["index"].to_pylist()) == list(range(len(steps)))
    for row in rows.itertuples():
        own = steps.slice(row.dataset_from_index, row.dataset_to_index - row.dataset_from_index)
        assert set(own["episode_index"].to_pylist()) == {row.episode_index}
        assert own["frame_index"].to_pylist() == list(range(row.length))
        assert np.allclose(vectors(own, "timestamp"), np.arange(row.length) / info["fps"], atol=1e-4)
        assert list(row.tasks) == [chosen.task_id]
    assert folder.tasks.index.tolist() == [chosen.task_id]
    assert folder.tasks.loc[chosen.task_id].task_index == 0


def test_values_equal_those_of_the_tables(folder, camera_tables):
    expected, steps = pq.read_table(camera_tables / "steps"), folder.steps
    state = [vectors(expected, f"observation.{name}") for name in ("goal", "velocity")]
    assert np.array_equal(vectors(steps, "observation.state"), np.concatenate(state, axis=1))
    assert folder.features["observation.state"]["names"][:3] == ["goal.distance", "goal.cosine", "goal.sine"]
    assert np.array_equal(vectors(steps, "action"), vectors(expected, "action"))
    assert np.array_equal(vectors(steps, "depth"), vectors(expected, "observation.depth"))
    assert np.allclose(vectors(steps, "next.reward"), vectors(expected, "reward"))
    done = vectors(expected, "terminated") | vectors(expected, "truncated")
    assert np.array_equal(vectors(steps, "next.done"), done)
    rows = pd.read_parquet(camera_tables / "episodes.parquet")
    assert vectors(steps, "next.success").sum() == rows.success.sum()
    for name in ("floor", "seed", "score", "ending"):
        assert list(folder.episodes[f"labgym/{name}"]) == list(rows[name])


def test_videos_show_the_images_of_their_steps(folder, camera_tables):
    expected = pq.read_table(camera_tables / "steps")
    assert folder.videos == ["observation.images.rgb", "observation.images.depth"]
    for row in folder.episodes.itertuples():
        own = expected.slice(row.dataset_from_index, row.length)
        pictures = [
            cv2.imdecode(np.frombuffer(each["bytes"], np.uint8), 1)[..., ::-1]
            for each in own["observation.rgb"].to_pylist()
        ]
        shown = folder.frames("observation.images.rgb", row.episode_index)
        # Brightness: chroma has half the resolution.
        errors = ((shown @ LUMA - np.stack(pictures) @ LUMA) ** 2).mean(axis=(1, 2))
        assert (10.0 * np.log10(255.0**2 / errors) > 36.0).all()
        depth = vectors(own, "observation.depth").reshape(-1, 72, 128)
        gray = folder.frames("observation.images.depth", row.episode_index).mean(axis=-1) / 25.5
        assert np.abs(gray - depth).max() < 0.08


def test_statistics_are_those_of_the_steps(folder):
    for name in ("observation.state", "action", "next.reward"):
        values = vectors(folder.steps, name).reshape(len(folder.steps), -1)
        for key in STATISTICS:
            assert np.allclose(folder.stats[name][key], getattr(values, key)(axis=0), rtol=1e-6, atol=1e-9), (name, key)
        assert folder.stats[name]["count"] == [len(values)]
        assert (np.array(folder.stats[name]["q10"]) <= np.array(folder.stats[name]["q90"])).all()
    for feature in folder.videos:
        assert np.array(folder.stats[feature]["mean"]).shape == (3, 1, 1)
        assert 0.0 <= np.min(folder.stats[feature]["min"]) <= np.max(folder.stats[feature]["max"]) <= 1.0


def test_no_feature_that_policies_read_is_privileged(folder):
    read = {name for name in folder.features if name.startswith(("observation", "action"))}
    assert read == {"observation.state", *folder.videos, "action"}


@pytest.mark.slow
def test_two_workers_give_the_same_bytes(root, chosen, tmp_path):
    make_drives(tmp_path, chosen, ExecutorOptions(workers=2), progress=False)
    for path in sorted(root.rglob("*")):
        if path.is_file() and path.name not in ("provenance.jsonl", ".lock"):
            other = tmp_path / path.relative_to(root)
            assert hashlib.sha256(other.read_bytes()).digest() == hashlib.sha256(path.read_bytes()).digest(), path.name


@pytest.mark.skipif(importlib.util.find_spec("lerobot") is None, reason="LeRobot is not installed")
def test_lerobot_itself_reads_the_dataset(root, folder):
    from lerobot.datasets.lerobot_dataset import LeRobotDataset

    dataset = LeRobotDataset("labgym/drives", root=root, video_backend="pyav")
    assert (len(dataset), dataset.meta.total_episodes) == (len(folder.steps), 2)
    item = dataset[len(dataset) - 1]
    assert np.array_equal(item["action"].numpy(), vectors(folder.steps, "action")[-1].astype(np.float32))
    assert item["observation.images.rgb"].shape == (3, 72, 128)
