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


def test_an_unknown_name_says_what_was_given_what_is_near_and_what_there_is():
    message = str(UnknownNameError("policy", "astra", ["astar", "random"]))
    assert "'astra'" in message
    assert "nearest: astar" in message
    assert "available: astar, random" in message


def test_a_long_list_of_names_is_cut_and_counted():
    message = str(UnknownNameError("asset", "x", [f"A{i:03}" for i in range(400)]))
    assert "400 in all" in message
    assert len(message) < 1000
