from __future__ import annotations

import sys
import types
from importlib.metadata import EntryPoint

import numpy as np
import pytest

from labgym.errors import LabgymError, OptionError, UnknownNameError
from labgym.policies import EpisodeStart, Policy, make_policy, policy_names, registry


class Forward(Policy):
    def __init__(self, speed: float = 1.0) -> None:
        self.speed = speed

    def reset(self, episode: EpisodeStart) -> None:
        pass

    def act(self, observation):
        return np.array([self.speed, 0.0])


@pytest.fixture
def module(monkeypatch):
    """A module on the Python path with a policy in it."""
    made = types.ModuleType("a_users_module")
    made.Forward, made.NotAPolicy, made.number = Forward, dict, 3
    monkeypatch.setitem(sys.modules, "a_users_module", made)
    return made


@pytest.mark.parametrize("name", ["astar", "dwa", "online_map", "random", "straight"])
def test_each_built_in_is_made_by_its_name(name):
    policy = make_policy(name)
    assert isinstance(policy, Policy)
    assert policy.name == name
    assert name in policy_names()


@pytest.mark.parametrize("name", ["astar", "dwa", "online_map", "random", "straight"])
def test_only_astar_is_given_the_map(name):
    assert make_policy(name).privileged is (name == "astar")


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
        UnknownNameError, match=r"'astr' not found; nearest: astar.*available: astar, .*random, straight"
    ):
        make_policy("astr")


@pytest.mark.parametrize("place", ["no_such_module_at_all:Policy", "a_users_module:Missing", ":Forward"])
def test_what_cannot_be_imported_is_named(module, place):
    with pytest.raises(LabgymError, match="cannot import"):
        make_policy(place)


def test_a_module_that_fails_on_import_is_named_with_its_reason(tmp_path, monkeypatch):
    (tmp_path / "a_broken_module.py").write_text("raise RuntimeError('half installed')\n")
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(LabgymError, match="half installed"):
        make_policy("a_broken_module:Policy")


@pytest.mark.parametrize("place", ["a_users_module:NotAPolicy", "a_users_module:number"])
def test_what_is_no_policy_is_refused(module, place):
    with pytest.raises(LabgymError, match="a_users_module"):
        make_policy(place)


def test_an_option_that_the_class_does_not_take_is_named(module):
    with pytest.raises(OptionError, match="colour"):
        make_policy("a_users_module:Forward", colour="red")
