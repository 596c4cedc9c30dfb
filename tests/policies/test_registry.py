from __future__ import annotations

import json
import subprocess
import sys
import types
from importlib.metadata import EntryPoint

import numpy as np
import pytest

from labgym.errors import LabgymError, OptionError, UnknownNameError
from labgym.eval.driving.drive import drive_layout
from labgym.layouts import load_published, published
from labgym.policies import EpisodeStart, Policy, make_policy, policy_names, registry
from labgym.policies.registry import BUILT_IN
from labgym.suites import Suite


class Forward(Policy):
    def __init__(self, speed: float = 1.0) -> None:
        self.speed = speed

    def reset(self, episode: EpisodeStart) -> None:
        pass

    def act(self, observation):
        return np.array([self.speed, 0.0])


class Broken(Forward):
    """Fails in its constructor, in a way that has nothing to do with its arguments."""

    def __init__(self) -> None:
        super().__init__(speed=1.0 + None)


@pytest.fixture
def module(monkeypatch):
    """A module on the Python path with a policy in it."""
    module = types.ModuleType("a_users_module")
    module.Forward, module.Broken, module.NotAPolicy, module.number = Forward, Broken, dict, 3
    monkeypatch.setitem(sys.modules, "a_users_module", module)
    return module


CLASSICAL = [
    "astar",
    "blind",
    "bug2",
    "clairvoyant",
    "dwa",
    "mapless-local",
    "mapless-oracle",
    "mapless-stack",
    "online_map",
    "random",
    "stack",
    "still",
    "straight",
]


@pytest.mark.parametrize("name", CLASSICAL)
def test_each_built_in_is_made_by_its_name(name):
    policy = make_policy(name)
    assert isinstance(policy, Policy)
    assert policy.name == name
    assert name in policy_names()


@pytest.mark.parametrize("name", CLASSICAL)
def test_only_policies_that_plan_at_the_start_receive_the_map(name):
    assert make_policy(name).privileged is (name in ("astar", "blind", "stack"))


def test_a_class_is_found_by_its_place_and_takes_options(module):
    policy = make_policy("a_users_module:Forward", speed=0.5)
    assert policy.speed == 0.5
    assert policy.name == "Forward"
    assert not policy.privileged


def test_a_name_that_a_package_registers_works(module, monkeypatch):
    entry = EntryPoint("ahead", "a_users_module:Forward", registry.GROUP)
    monkeypatch.setattr(registry, "entry_points", lambda group: [entry] if group == registry.GROUP else [])
    assert isinstance(make_policy("ahead"), Forward)
    assert "ahead" in policy_names()


def test_an_unknown_name_lists_what_exists():
    with pytest.raises(
        UnknownNameError, match=r"'astr' not found; nearest: astar.*available: astar, .*random, stack, still, straight"
    ):
        make_policy("astr")


@pytest.mark.parametrize("place", ["no_such_module_at_all:Policy", "a_users_module:Missing", ":Forward"])
def test_a_place_that_cannot_be_imported_is_named(module, place):
    with pytest.raises(LabgymError, match="cannot import"):
        make_policy(place)


def test_a_module_that_fails_on_import_is_named_with_its_reason(tmp_path, monkeypatch):
    (tmp_path / "a_broken_module.py").write_text("raise RuntimeError('half installed')\n")
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(LabgymError, match="half installed"):
        make_policy("a_broken_module:Policy")


@pytest.mark.parametrize("place", ["a_users_module:NotAPolicy", "a_users_module:number"])
def test_an_object_that_is_not_a_policy_is_refused(module, place):
    with pytest.raises(LabgymError, match="a_users_module"):
        make_policy(place)


def test_an_option_that_the_class_does_not_take_is_named_with_those_that_it_takes(module):
    with pytest.raises(UnknownNameError, match="unexpected keyword argument 'colour'; available: speed"):
        make_policy("a_users_module:Forward", colour="red")


def test_an_error_inside_a_constructor_is_not_blamed_on_the_options(module):
    with pytest.raises(LabgymError, match="its constructor failed with TypeError: unsupported operand") as caught:
        make_policy("a_users_module:Broken")
    assert "option" not in str(caught.value)
    assert isinstance(caught.value.__cause__, TypeError)


def test_a_missing_argument_is_named():
    with pytest.raises(OptionError, match="missing a required argument"):
        make_policy("labgym.policies.http.client:HttpPolicy")


TUNABLE = {
    "dwa": ("radius", 0.28),
    "iplanner": ("commit", 0.4),
    "navdp": ("samples", 3),
    "online_map": ("replan", 5),
    "straight": ("turn_in_place", 0.4),
}


@pytest.mark.parametrize("name", TUNABLE)
def test_options_are_mappings_or_given_by_themselves(name):
    option, value = TUNABLE[name]
    for policy in (make_policy(name, options={option: value}), make_policy(name, **{option: value})):
        assert getattr(policy._options, option) == value
    defaults = make_policy(name)._options
    assert getattr(defaults, option) != value
    assert make_policy(name, options=defaults.model_copy(update={option: value}))._options != defaults


@pytest.mark.parametrize("name", TUNABLE)
def test_an_unknown_option_lists_those_that_exist(name):
    option, value = TUNABLE[name]
    for arguments in ({"options": {option + "x": value}}, {option + "x": value}):
        with pytest.raises(
            UnknownNameError, match=f"unexpected keyword argument '{option}x'; nearest: .*{option}.*available: "
        ):
            make_policy(name, **arguments)


@pytest.mark.parametrize("name", TUNABLE)
@pytest.mark.parametrize("value", ["wide", -1, float("nan")])
def test_a_value_outside_its_limits_is_refused_by_name(name, value):
    option, _ = TUNABLE[name]
    with pytest.raises(OptionError, match=option):
        make_policy(name, options={option: value})


def test_an_option_cannot_be_given_twice():
    with pytest.raises(OptionError, match="'radius' is given twice"):
        make_policy("dwa", radius=0.2, options={"radius": 0.3})


def test_policies_with_mapped_options_drive():
    layout = load_published("test", published("test")[0])
    suite = Suite(name="brief", max_steps=10)
    for name in ("dwa", "online_map"):
        option, value = TUNABLE[name]
        for drive in drive_layout(make_policy(name, options={option: value}), layout, suite, name, 0):
            assert drive.row.error is None


@pytest.mark.parametrize("entry", BUILT_IN.values(), ids=BUILT_IN)
def test_the_list_of_policies_agrees_with_the_classes(entry):
    policy = make_policy(entry.name)
    assert policy.name == entry.name
    assert policy.privileged is (entry.sees == "map")
    assert policy.foresees is (entry.sees == "world")
    assert entry.sees in ("map", "world", "goal", "none", policy.observation)


MAKE_EACH = """
import importlib, json, os, sys, traceback
packages, extras = json.loads(sys.argv[1])
sys.modules.update(dict.fromkeys(name for names in packages.values() for name in names))
from labgym.policies import make_policy
for extra in ("", *packages):
    for name in packages.get(extra, ()):
        del sys.modules[name]
    for name in packages.get(extra, ()):
        importlib.import_module(name)
    for policy in (name for name, needed in extras.items() if (needed or "") == extra):
        if os.fork() == 0:
            try:
                make_policy(policy)
            except BaseException:
                print(policy, traceback.format_exc())
            sys.stdout.flush()
            os._exit(0)
        os.wait()
    for name in packages.get(extra, ()):
        sys.modules[name] = None
"""


def test_a_policy_needs_the_packages_of_its_extra_and_no_others():
    plan = json.dumps([registry.PACKAGES, {entry.name: entry.extra for entry in BUILT_IN.values()}], default=list)
    run = subprocess.run([sys.executable, "-c", MAKE_EACH, plan], capture_output=True, text=True, check=False)
    assert (run.returncode, run.stdout) == (0, ""), run.stdout + run.stderr


def test_the_table_of_policies_has_a_line_for_each_and_imports_none(module, monkeypatch):
    def refuse(name):
        raise AssertionError(name)

    monkeypatch.setattr(registry.importlib, "import_module", refuse)
    entries = [EntryPoint("ahead", "a_users_module:Forward", registry.GROUP), EntryPoint("gone", "no_such:P", "g")]
    monkeypatch.setattr(registry, "entry_points", lambda group: entries)
    lines = {line.split()[0]: line for line in registry.policy_table().splitlines() if line}
    for name in ("astar", "dwa", "iplanner", "navdp", "online_map", "ppo", "ppo-depth", "random", "straight"):
        assert BUILT_IN[name].summary in lines[name]
    for name, place in (("ahead", "a_users_module:Forward"), ("gone", "no_such:P")):
        assert f"{place} of another package" in lines[name]
    assert "[train]" in lines["navdp"]
