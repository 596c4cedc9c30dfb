from __future__ import annotations

import json

import pytest

from labgym.errors import DocumentError, OptionError, UnknownNameError
from labgym.suites import Suite, load_suite, suite_names


@pytest.mark.parametrize("name", ["test", "val"])
def test_the_published_suites_have_the_designs_rules(name):
    suite = load_suite(name)
    assert (suite.name, suite.split) == (name, name)
    assert suite.success_distance == 0.5
    assert suite.max_steps == 600
    assert name in suite_names()
    assert suite.label == f"{name}/{suite.version}"


def test_a_suite_survives_being_saved_and_loaded(tmp_path):
    suite = Suite(name="mine", version=3, split="val", layouts=("a", "b"), max_steps=100, success_distance=1.0)
    assert load_suite(suite.save(tmp_path / "mine.json")) == suite


def test_an_unknown_suite_lists_those_that_exist():
    with pytest.raises(UnknownNameError, match="'tset' not found; nearest: test"):
        load_suite("tset")


@pytest.mark.parametrize(
    "change, field",
    [
        ({"max_steps": 0}, "max_steps"),
        ({"success_distance": -1.0}, "success_distance"),
        ({"split": "train"}, "split"),
        ({"name": "../../etc"}, "name"),
        ({"colour": "red"}, "colour"),
        ({"schema": "labgym.layout/1"}, "schema"),
    ],
)
def test_a_field_out_of_order_is_named(tmp_path, change, field):
    path = tmp_path / "suite.json"
    path.write_text(json.dumps({**Suite(name="mine", split="val").to_json(), **change}))
    with pytest.raises(DocumentError, match=field):
        load_suite(path)


def test_a_suite_without_a_split_has_no_layouts_of_its_own():
    with pytest.raises(OptionError, match="no published layouts"):
        Suite(name="mine").load_layouts()


def test_lab30_is_the_suite_of_the_published_test_layouts():
    assert load_suite("lab30") == load_suite("test")
    assert len(load_suite("lab30").load_layouts()) == 30
    assert load_suite("lab30").title == "lab30 (test/3)"
    assert load_suite("val").title == load_suite("val").label
    other = load_suite("test").model_copy(update={"split": None})
    assert other.title == other.label == "test/3"
    with pytest.raises(UnknownNameError, match="lab30"):
        load_suite("lab300")
