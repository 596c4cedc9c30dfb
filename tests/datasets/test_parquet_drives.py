from __future__ import annotations

import hashlib
import json
import math
from pathlib import Path

import gymnasium as gym
import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest

from labgym.cli import main
from labgym.datasets import DriveOptions, drive_options, make, make_drives
from labgym.datasets.tables import column_array, episodes_schema, observations_of, steps_schema
from labgym.envs.labnav.task import STOP_HOLD
from labgym.envs.labnav.tasks import TASKS
from labgym.errors import LabgymError, OptionError, UnknownNameError
from labgym.runs import ExecutorOptions

RECORD = ("provenance.jsonl", ".lock")
"""Files that tell when and where a dataset was made."""


def options(**values) -> DriveOptions:
    arguments = {"task": "people", "policy": "astar", "split": "floors-val", "level": 1, "format": "parquet"}
    return drive_options(**{**arguments, "episodes": 2, "shard": 1, "seed": 3, **values})


def digests(folder: Path) -> dict[str, str]:
    files = (path for path in folder.rglob("*") if path.is_file() and path.name not in RECORD)
    return {str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest() for path in files}


def steps_of(folder: Path, episode: int):
    table = pq.read_table(folder / "steps")
    return table.filter(np.array(table["episode_index"]) == episode)


@pytest.fixture(scope="module")
def people(tmp_path_factory) -> Path:
    return make_drives(tmp_path_factory.mktemp("people"), options(), progress=False)


@pytest.fixture(scope="module")
def episodes(people) -> pd.DataFrame:
    return pd.read_parquet(people / "episodes.parquet")


def assert_replays(folder: Path, chosen: DriveOptions, episode: int) -> None:
    """The environment returns what the dataset holds, to the bit, when its actions are carried out again."""
    rows, table = pd.read_parquet(folder / "episodes.parquet"), steps_of(folder, episode)
    env = gym.make(chosen.spec)
    assert isinstance(env.observation_space, gym.spaces.Dict)
    expected = observations_of(table, env.observation_space)
    final = pq.read_table(folder / "episodes.parquet").slice(episode, 1)
    last = observations_of(final, env.observation_space, "final.observation.")
    actions, flags = column_array(table, "action", env.action_space), []
    observation, info = env.reset(seed=int(rows.seed[episode]))
    for k, action in enumerate(actions):
        assert set(observation) == set(expected)
        for name, value in observation.items():
            assert np.array_equal(value, expected[name][k]), (name, k)
        assert np.array_equal(info["pose"], table["privileged.pose"][k].as_py())
        observation, reward, terminated, truncated, info = env.step(action)
        assert reward == table["reward"][k].as_py()
        flags.append((terminated, truncated))
    assert flags == list(zip(table["terminated"].to_pylist(), table["truncated"].to_pylist(), strict=True))
    assert [any(flag) for flag in flags] == [False] * (len(flags) - 1) + [True]
    for name, value in observation.items():
        assert np.array_equal(value, last[name][0])
    env.close()


def test_an_episode_replays_bit_for_bit_in_the_gym_environment(people):
    assert_replays(people, options(), 0)


def test_camera_drives_replay_bit_for_bit_although_the_expert_had_other_sensors(camera, camera_tables):
    assert_replays(camera_tables, options(**camera), 0)


def test_tables_have_the_documented_columns(people):
    env = gym.make(options().spec)
    steps, episodes = pq.read_table(people / "steps"), pq.read_table(people / "episodes.parquet")
    assert steps.schema.equals(steps_schema(env.observation_space, env.action_space), check_metadata=True)
    assert episodes.schema.equals(episodes_schema(env.observation_space), check_metadata=True)
    page = (Path(__file__).parents[2] / "docs" / "training-data.md").read_text(encoding="utf-8")
    for name in (*steps.column_names, *episodes.column_names):
        family = name if "observation." not in name else name[: name.index("observation.")] + "observation.*"
        assert f"`{family}`" in page, name


def test_steps_of_an_episode_are_consecutive_and_sum_to_its_row(people, episodes):
    steps = pd.read_parquet(people / "steps")
    for row in episodes.itertuples():
        own = steps[steps.episode_index == row.episode_index]
        assert list(own.frame_index) == list(range(row.length))
        assert np.allclose(own.timestamp, 0.1 * own.frame_index)
        assert math.isclose(own.reward.sum(), episodes["return"][row.Index], abs_tol=1e-9)
        places = np.stack(own["privileged.pose"])[:, :2]
        # The base moves on arcs between the steps, so that chords are a little shorter than the way driven.
        chords = np.linalg.norm(np.diff(places, axis=0), axis=1).sum()
        assert 0.0 <= row.path_length - chords < 0.25


def test_the_score_follows_from_the_columns(episodes):
    for row in episodes.itertuples():
        ideal, close = row.shortest_path_length, json.loads(episodes["privileged.outcomes"][row.Index])["people"]
        good = 0.4 + 0.3 * min(1.0, ideal / row.time) + 0.3 * max(0.0, 1.0 - close["close_seconds"] / ideal)
        assert math.isclose(row.score, good if row.success else 0.0, abs_tol=1e-5)


def test_stop_is_held_at_the_end_of_a_successful_drive(people, episodes):
    for row in episodes.itertuples():
        actions = np.stack(steps_of(people, row.episode_index)["action"].to_pylist())
        stops = actions[:, 2] > 0.0
        assert not stops[:-STOP_HOLD].any()
        assert stops[-STOP_HOLD:].tolist() == [row.ending not in ("contact", "stuck", "time")] * STOP_HOLD


def test_observations_hold_nothing_but_what_the_environment_shows(people, camera_tables):
    cases = (people, {"goal", "velocity", "odometry", "lidar"}), (camera_tables, {"goal", "velocity", "rgb", "depth"})
    for folder, shown in cases:
        names = pq.read_table(folder / "steps").column_names
        assert {name.removeprefix("observation.") for name in names if name.startswith("observation.")} == shown


@pytest.mark.slow
def test_two_workers_give_the_same_bytes(people, tmp_path):
    make_drives(tmp_path, options(), ExecutorOptions(workers=2), progress=False)
    assert digests(tmp_path) == digests(people)


def test_an_interruption_gives_the_same_bytes(people, tmp_path, monkeypatch):
    whole = make.make_shard

    def interrupted(chosen, index, *others):
        if index == 1:
            raise KeyboardInterrupt
        return whole(chosen, index, *others)

    monkeypatch.setattr(make, "make_shard", interrupted)
    with pytest.raises(KeyboardInterrupt):
        make_drives(tmp_path / "resumed", options(), progress=False)
    driven = []

    def counted(chosen, index, *others):
        driven.append(index)
        return whole(chosen, index, *others)

    monkeypatch.setattr(make, "make_shard", counted)
    make_drives(tmp_path / "resumed", options(), progress=False)
    assert driven == [1]
    assert digests(tmp_path / "resumed") == digests(people)


def test_a_finished_dataset_is_not_made_again_and_another_one_is_refused(people, monkeypatch):
    monkeypatch.setattr(make, "make_shard", None)
    assert make_drives(people, options(), progress=False) == people
    with pytest.raises(OptionError, match="another run"):
        make_drives(people, options(seed=4), progress=False)


def test_the_card_makes_the_environment_in_which_the_drives_replay(people):
    card, names = (people / "README.md").read_text(encoding="utf-8"), {}
    exec(card[card.index("import gymnasium as gym") :].split("```")[0], names)
    assert names["env"].spec.id == options().spec.id
    assert names["env"].spec.kwargs == options().spec.kwargs
    assert names["env"].spec.kwargs["exact"] is True


def test_the_card_counts_all_drives(people, episodes):
    card = (people / "README.md").read_text(encoding="utf-8")
    assert f"| episodes | {len(episodes)} |" in card
    assert f"| success rate of the expert | {episodes.success.mean():.3f} of {len(episodes)} drives |" in card
    assert f"| mean score of the expert | {episodes.score.mean():.3f} |" in card
    assert "labgym data --format parquet --task people --level 1 --split floors-val --policy astar" in card


def test_only_successful_drives_on_request_and_an_expert_that_never_succeeds_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr("labgym.datasets.driving.MOST_FAILURES", 2)
    chosen = options(task="point", split="val", level=None, policy="random", episodes=1, successful=True)
    monkeypatch.setattr(DriveOptions, "max_steps", 20)
    with pytest.raises(LabgymError, match="expert 'random' failed in 2 drives in a row"):
        make_drives(tmp_path / "random", chosen, progress=False)


@pytest.mark.parametrize("split", ["floors-test", "floors-seen", "test"])
@pytest.mark.parametrize("task", ["people", "point"])
def test_test_splits_are_refused_in_one_line(task, split, tmp_path, capsys):
    arguments = ["data", "--format", "parquet", "--task", task, "--split", split, "--out", str(tmp_path / "out")]
    assert main(arguments) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert f"split '{split}' is held out for tests and must not be trained on" in error
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--task", "people"], "--task has no effect with --format planner"),
        (["--successful"], "--successful has no effect with --format planner"),
        (["--format", "parquet", "--samples", "5"], "--samples has no effect on drives"),
        (["--format", "parquet", "--split", "val"], "split 'val' has single rooms"),
        (["--format", "parquet", "--level", "4"], "level is 4, expected 1, 2 or 3"),
        (["--format", "parquet", "--task", "point", "--level", "1"], "only tasks of LabNav have levels"),
        (["--format", "parquet", "--task", "points"], "task 'points' not found; nearest: point"),
        (["--format", "parquet", "--policy", "mine:Policy"], "expert (a built-in policy) 'mine:Policy' not found"),
        (["--format", "parquet", "--sensors", "sonar"], "sensors 'sonar' not found; available: depth, lidar, rgbd"),
        (["--format", "parquet", "--episodes", "0"], "episodes is 0, expected 1 to"),
        (["--format", "parquet", "--task", "point", "--policy", "clairvoyant"], "foresees the world"),
    ],
)
def test_bad_options_are_one_line(arguments, message, tmp_path, capsys):
    assert main(["data", *arguments, "--out", str(tmp_path / "out")]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1


@pytest.mark.parametrize("task", TASKS)
@pytest.mark.parametrize("sensors", ["lidar", "depth", "rgbd"])
def test_the_environment_of_every_task_follows_from_plain_data(task, sensors):
    spec = options(task=task, level=3, sensors=sensors).spec
    assert json.loads(spec.to_json())["kwargs"] == {
        "config": f"labnav-{task}-3-{sensors}",
        "split": "floors-val",
        "exact": True,
        "stop": "action",
    }
    env = gym.make(gym.envs.registration.EnvSpec.from_json(spec.to_json()))
    assert env.unwrapped.config.drives == f"labnav-{task}-3"
    assert set(env.observation_space) - {"goal", "velocity", "odometry"} == (
        {"rgb", "depth"} if sensors == "rgbd" else {sensors}
    )
    env.close()


def test_configurations_by_name_are_checked():
    for name in ("labnav-people", "labnav-people-4", "labnav-nothing-2", "labnav-people-2-sonar"):
        with pytest.raises(UnknownNameError):
            gym.make("LabNavPeople-v0", config=name)
