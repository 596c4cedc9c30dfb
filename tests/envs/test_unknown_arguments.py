"""Unknown and ineffective arguments: one line that names the argument and those that exist."""

from __future__ import annotations

import inspect
import pickle
from contextlib import suppress

import gymnasium as gym
import pytest

import labgym  # noqa: F401 -- registers the ids
from labgym.envs import LabPointNavEnv
from labgym.envs.parts.protocols import INTERFACES, Sensor
from labgym.envs.parts.registry import kinds_of, part_of
from labgym.errors import LabgymError, OptionError, UnknownArgumentError, UnknownNameError

KINDS = [(role, kind, made) for role in INTERFACES for kind, made in kinds_of(role).items()]
NAMES = [f"{role} {kind}" for role, kind, _ in KINDS]
SPOILT = [None, "x", [], {}, float("nan"), -1, True, 1e300, 10**9, object(), {"kind": "nope"}, [1, "a"], b"1"]


@pytest.mark.parametrize(("role", "kind", "made"), KINDS, ids=NAMES)
def test_a_part_names_the_unknown_argument_and_its_own(role, kind, made):
    with pytest.raises(UnknownArgumentError) as problem:
        part_of({"kind": kind, "seconds_": 20}, role)
    message = str(problem.value)
    assert "\n" not in message
    assert f"{role} {kind!r} got an unexpected keyword argument 'seconds_'" in message
    for name in inspect.signature(made).parameters:
        assert name in message or "in all" in message


@pytest.mark.parametrize(("role", "kind", "made"), KINDS, ids=NAMES)
def test_an_argument_of_a_wrong_type_or_size_is_one_line_or_accepted(role, kind, made):
    for name in inspect.signature(made).parameters:
        for value in SPOILT:
            with suppress(LabgymError):
                part_of({"kind": kind, name: value}, role)


@pytest.mark.parametrize("kind", [None, 3, [], {}])
def test_a_kind_that_is_no_name_is_unknown(kind):
    with pytest.raises(UnknownNameError, match="ending"):
        part_of({"kind": kind}, "ending")


def test_a_missing_argument_is_named():
    class Needs:
        def __init__(self, wheels):
            self.wheels = wheels

    globals()["Needs"] = Needs
    with pytest.raises(OptionError, match="needs the argument 'wheels'"):
        part_of({"kind": f"{__name__}:Needs"}, "ending")


@pytest.mark.parametrize(
    "make",
    [
        lambda **options: LabPointNavEnv(**options),
        lambda **options: gym.make("LabFloorNav-v0", **options),
        lambda **options: gym.make("LabNavPeople-v0", **options),
        lambda **options: gym.make_vec("LabFloorNav-v0", 2, vectorization_mode="vector_entry_point", **options),
        lambda **options: LabPointNavEnv(config=options),
    ],
)
def test_libraries_that_probe_for_an_argument_get_the_type_error_of_python(make):
    """TorchRL and others look for these words in a `TypeError`."""
    with pytest.raises(TypeError, match="unexpected keyword argument 'frameskip'") as problem:
        make(frameskip=4)
    assert isinstance(problem.value, UnknownNameError)
    assert str(pickle.loads(pickle.dumps(problem.value))) == str(problem.value)


def test_a_part_of_one_s_own_without_its_method_is_refused_when_it_is_made():
    class Compass(Sensor):
        name = "compass"
        space = None

        def read(self, state, rng):
            return None

    with pytest.raises(TypeError, match=r"abstract method '?reading"):
        Compass()
