from __future__ import annotations

import pickle

import pytest

from labgym.errors import (
    DocumentError,
    InfeasibleError,
    LabgymError,
    MissingDependencyError,
    OptionError,
    UnknownNameError,
)

ERRORS = (
    UnknownNameError("asset", "rotovap", ["RotaryEvaporator", "Rotor"]),
    OptionError("seed must not be negative"),
    DocumentError("layout.json", "room.width", "too small"),
    MissingDependencyError("torch", "training", "train"),
    InfeasibleError("room", ["a clashes with b"], "roomy"),
)


@pytest.mark.parametrize("error", ERRORS, ids=lambda error: type(error).__name__)
def test_an_error_crosses_processes_unchanged(error):
    back = pickle.loads(pickle.dumps(error))
    assert type(back) is type(error)
    assert str(back) == str(error)
    assert vars(back) == vars(error)


@pytest.mark.parametrize("error", ERRORS, ids=lambda error: type(error).__name__)
def test_an_error_is_one_line_and_a_labgym_error(error):
    assert isinstance(error, LabgymError)
    assert len(str(error).splitlines()) == 1


@pytest.mark.parametrize("breaks", ["\n", "\r\n", "\n\n  ", "\v", "\u2028", "\x85", "\x1d"])
def test_line_breaks_of_values_do_not_reach_the_message(breaks):
    name = f"a{breaks}b"
    for error in (
        LabgymError(f"policy {name}: unknown"),
        OptionError(f"option {name} is unknown"),
        DocumentError(f"{name}.json", name, f"bad {name}"),
        UnknownNameError("policy", "x", [name]),
        InfeasibleError("room", [f"{name} clashes"], None),
        MissingDependencyError("torch", name, "train"),
    ):
        assert len(str(error).splitlines()) == 1
        assert "a b" in str(error)


def test_an_unknown_name_says_what_was_given_what_is_near_and_what_there_is():
    message = str(UnknownNameError("policy", "astra", ["astar", "random"]))
    assert "'astra'" in message
    assert "nearest: astar" in message
    assert "available: astar, random" in message


def test_of_a_long_list_the_nearest_five_and_the_number_are_given():
    message = str(UnknownNameError("asset", "fumehod", ["FumeHood", *(f"A{i:03}" for i in range(399))]))
    assert message.endswith("; 400 in all")
    near = message.split("nearest: ")[1].split(";")[0].split(", ")
    assert len(near) == 5
    assert near[0] == "FumeHood"


def test_an_unknown_name_can_carry_a_remedy():
    message = str(UnknownNameError("asset", "Mug", ["Cup"], near=[], remedy="drink from your hands"))
    assert message == "asset 'Mug' not found; no name is near; 1 in all; drink from your hands"
