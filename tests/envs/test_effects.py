"""Every argument of an environment has its effect, or is refused in one line that says what leaves it without."""

from __future__ import annotations

import pytest
from laboratories import island_laboratory

from labgym.envs import LabPointNavEnv
from labgym.envs.presets import configured, presets
from labgym.errors import LabgymError, OptionError, UnknownNameError
from labgym.layouts.splits import published

LAYOUT = island_laboratory()


class OneTask:
    def draw(self, rng, options, fresh):
        raise NotImplementedError

    def close(self):
        pass


@pytest.mark.parametrize(
    ("arguments", "name"),
    [
        ({"layout": LAYOUT, "split": "val"}, "split"),
        ({"layout": LAYOUT, "profile": "strict"}, "profile"),
        ({"layout": LAYOUT, "episodes_per_layout": 2}, "episodes_per_layout"),
        ({"layout": LAYOUT, "split": "train", "training": print}, "training"),
        ({"layout": LAYOUT, "resident_mb": 3.0}, "resident_mb"),
        ({"split": "val", "profile": "strict"}, "profile"),
        ({"split": "val", "episodes_per_layout": 2}, "episodes_per_layout"),
        ({"tasks": OneTask(), "split": "val"}, "split"),
        ({"tasks": OneTask(), "layout": LAYOUT}, "layout"),
        ({"tasks": OneTask(), "drives": "protocol"}, "drives"),
        ({"rewards": ["success"], "distance_to_go": "exact"}, "distance_to_go"),
        ({"observation": "depth", "sensors": ["goal"]}, "observation"),
        ({"onward": ["touch"]}, "onward"),
        ({"width": 320}, "width"),
        ({"quality": "fine"}, "quality"),
    ],
)
def test_an_argument_that_another_one_replaces_is_refused(arguments, name):
    for make in (lambda: LabPointNavEnv(**arguments), lambda: configured(arguments, {})):
        with pytest.raises(OptionError, match=f"^{name}=.* has no effect"):
            make()


def test_onward_names_endings_that_exist():
    with pytest.raises(UnknownNameError, match="ending in onward 'tuoch'"):
        configured(None, {"drives": "protocol", "onward": ["tuoch"]})
    assert configured(None, {"drives": "protocol", "onward": ["touch"]}).onward == ("touch",)


def test_a_fixed_layout_replaces_the_split_of_an_id_without_complaint():
    for name in presets():
        assert configured(name, {"layout": LAYOUT}).layout is LAYOUT


ARGUMENTS = {
    "layout": LAYOUT,
    "protocol": "alk_03",
    "observation": "depth",
    "render_mode": "rgb_array",
    "profile": "strict",
    "weights": {"time": -0.5},
    "episodes_per_layout": 3,
    "control_dt": 0.2,
    "width": 111,
    "height": 112,
    "quality": "fine",
    "exact": True,
    "distance_to_go": "exact",
    "training": print,
    "resident_mb": 7.0,
    "drives": "protocol",
    "tasks": OneTask(),
    "sensors": ["goal"],
    "rewards": ["success"],
    "endings": ["contact"],
    "onward": ["contact"],
    "actions": {"kind": "discrete", "turn": 0.6},
    "robot": "holonomic",
    "disc": 0.7,
    "measures": ["cost"],
    "interactive": True,
    "randomizations": ["mass"],
    "conditions": ["wet_floor"],
}


def observed(env: LabPointNavEnv, name: str) -> object:
    """Return what the user of an environment gets from an argument."""
    source = getattr(env.tasks, "_source", env.tasks)
    source = getattr(source, "_source", source)
    tasks = (type(env.tasks), vars(source).get("_layout"), vars(source).get("_protocol"))
    training = vars(source).get("_training")
    names = ("_lifetime", "_training", "_resident_mb", "_profile")
    generated = None if training is None else [vars(training)[key] for key in names]
    parts = [env._terms, env._endings, env._actions, env._robot, env._randomizations, env._conditions, env._entries]
    view = (env._view._size, env._view._quality, env.render_mode)
    used = {each: getattr(env.config, each) for each in ("control_dt", "exact", "disc", "interactive", "onward")}
    return repr((env.observation_space, env.action_space, tasks, generated, parts, view, used.get(name)))


@pytest.mark.cases(6)
@pytest.mark.parametrize("name", presets())
def test_each_argument_of_each_id_changes_the_environment_or_is_refused(name):
    """With the value of an argument alone, or with pictures, so that their size and quality can act."""
    for argument, value in ARGUMENTS.items():
        for others in ({}, {"render_mode": "rgb_array"}):
            if argument in others or getattr(presets()[name], argument) == value:
                continue
            try:
                changed = LabPointNavEnv(config=name, **others, **{argument: value})
            except LabgymError:
                continue
            assert observed(changed, argument) != observed(LabPointNavEnv(config=name, **others), argument), argument


@pytest.mark.parametrize(("split", "name"), [("val", "LabPointNav-v0"), ("floors-val", "LabNavAisle-v0")])
def test_a_split_that_is_passed_replaces_that_of_the_id(split, name):
    env = LabPointNavEnv(split, config=name)
    _, info = env.reset(seed=1)
    assert info["layout"] in published(split)
    env.close()
