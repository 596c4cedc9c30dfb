"""Unknown tasks, levels, endings, conditions, nuisances and observations raise everywhere, and list the names."""

from __future__ import annotations

import json

import pytest
from pydantic import ValidationError

from labgym.envs.drive_source import LabNavTasks
from labgym.envs.labnav.drawing import draw_floor, drawer_of
from labgym.envs.labnav.episodes import LabNavEpisodes, published_episodes
from labgym.envs.labnav.nuisances import drawn_episode, episode_without, nuisances_of, prepared, properties_without
from labgym.envs.labnav.tasks import condition_names, config_of, task_of
from labgym.errors import DocumentError, UnknownNameError
from labgym.eval.driving.episode_row import LabNavRow, TransitionRow
from labgym.eval.labnav.drive import drive_floor
from labgym.eval.labnav.publication import Publication
from labgym.eval.labnav.results import DriveTerms
from labgym.eval.labnav.rules import RULES, Finish, ending_of
from labgym.eval.labnav.suites import load_labnav
from labgym.policies import make_policy

EPISODES = published_episodes("people", 2, development=True)
EPISODE = EPISODES.episodes[0]
LAYOUT = EPISODES.layout(EPISODE.floor)
WRONG = ("Dock", "ninth", "", "docks", "shift ")


BY_TASK = {
    "task_of": task_of,
    "config_of": config_of,
    "condition_names": lambda task: condition_names(task, 2),
    "nuisances_of": lambda task: nuisances_of(task, 2),
    "properties_without": lambda task: properties_without(task, 2, ()),
    "episode_without": lambda task: episode_without(EPISODE, LAYOUT, task, 2, ()),
    "prepared": lambda task: prepared(task, 2, EPISODE, LAYOUT),
    "drawn_episode": lambda task: drawn_episode(task, 2, 0),
    "draw_floor": lambda task: draw_floor(LAYOUT, task, 2, 1, 0, 1),
    "drawer_of": lambda task: drawer_of(LAYOUT, task, 2),
    "published_episodes": lambda task: published_episodes(task, 2),
    "load_labnav": lambda task: load_labnav(f"labnav-{task}"),
    "LabNavTasks": lambda task: LabNavTasks(None, f"labnav-{task}-2"),
    "Publication": lambda task: Publication("floors-val", tasks=(task,)),
    "drive_floor": lambda task: drive_floor(make_policy("still"), LAYOUT, [EPISODE], DriveTerms(task, 2, "x", "x", 0)),
}


@pytest.mark.parametrize("name", BY_TASK)
@pytest.mark.parametrize("task", WRONG)
def test_an_unknown_task_raises_with_the_names(name, task):
    with pytest.raises(UnknownNameError, match=r"not found.*(aisle|labnav-)") as error:
        BY_TASK[name](task)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("level", [4, -1, True, 2.0, "2", None])
def test_an_unknown_level_raises(level):
    for call in (
        lambda: task_of("dock").level(level),
        lambda: config_of("dock", level),
        lambda: nuisances_of("dock", level),
        lambda: drawer_of(LAYOUT, "dock", level),
        lambda: drive_floor(make_policy("still"), LAYOUT, [EPISODE], DriveTerms("dock", level, "x", "x", 0)),
    ):
        with pytest.raises(UnknownNameError, match=r"level of task 'dock'.*available: 0, 1, 2, 3"):
            call()


def test_an_unknown_ending_of_a_drive_raises():
    for rule in RULES:
        ending_of(Finish(rule, parked=True, inside=True, believed=True))
    for rule in ("touch", "Contact", "spilled"):
        with pytest.raises(UnknownNameError, match="ending of a drive"):
            ending_of(Finish(rule, parked=True, inside=True, believed=True))


def test_an_unknown_condition_or_one_of_another_task_raises():
    for name in ("crowd", "People", "glass"):
        strange = EPISODE.model_copy(update={"conditions": {**EPISODE.conditions, name: []}})
        with pytest.raises(UnknownNameError, match=f"condition of people-2 '{name}' not found; .*available: people"):
            prepared("people", 2, strange, LAYOUT)
        data = EPISODES.model_copy(update={"episodes": (strange,)}).to_json()
        with pytest.raises(DocumentError, match=f"condition of people-2 '{name}' not found"):
            LabNavEpisodes.parse(data, "people-2.json")


def test_an_unknown_nuisance_raises():
    for names in (("drift",), ("people", "glass")):
        for call in (
            lambda names=names: properties_without("people", 2, names),
            lambda names=names: episode_without(EPISODE, LAYOUT, "people", 2, names),
        ):
            with pytest.raises(UnknownNameError, match="nuisance of people-2"):
                call()


def test_an_unknown_observation_raises():
    for call in (lambda: task_of("dock").level(2).sensors("sonar"), lambda: config_of("dock", 2, "sonar")):
        with pytest.raises(UnknownNameError, match=r"observation 'sonar' not found; .*available: depth, lidar, rgbd"):
            call()


ROW = {
    "suite": "labnav-dock-2/1", "task": "dock", "level": 2, "floor": "a", "floor_hash": "b", "number": 0, "policy": "p",
    "track": "mapless", "seed": 0, "score": 0.5, "success": True, "ending": "success", "shortest": 9.0, "straight": 8.0,
    "path_length": 9.5, "time": 12.0, "final_distance": 0.1, "final_heading": 0.0, "odometry_error": 0.0, "steps": 120,
    "contacts": 0,
}  # fmt: skip


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("task", "Dock"), ("task", "ninth"), ("level", 4), ("level", 0), ("track", "open"), ("ending", "Success"),
        ("stopped", "nobody"), ("success", 1), ("success", "true"), ("time", -1.0), ("time", float("nan")),
        ("score", 1.1), ("score", float("nan")), ("steps", -1), ("steps", 1.5), ("path_length", -0.1),
        ("shortest", float("inf")), ("final_heading", float("nan")), ("surprise", 1),
    ],
)  # fmt: skip
def test_a_row_with_an_unknown_name_or_an_impossible_value_is_refused(field, value):
    assert LabNavRow.model_validate(ROW).task == "dock"
    with pytest.raises(ValidationError):
        LabNavRow.model_validate({**ROW, field: value})
    with pytest.raises(ValidationError):
        LabNavRow.model_validate_json(json.dumps({**ROW, field: value}))


@pytest.mark.parametrize("field", ROW)
def test_a_row_without_a_field_is_refused(field):
    with pytest.raises(ValidationError):
        LabNavRow.model_validate({name: value for name, value in ROW.items() if name != field})


def test_success_of_a_lab30_row_is_a_truth_value():
    assert TransitionRow.model_fields["success"].annotation is bool
    with pytest.raises(ValidationError, match="success"):
        TransitionRow.model_validate({"success": 1})
