"""Adjustments by a language model, over a real connection: verified like those of the rules, refusals counted."""

from __future__ import annotations

import json
import math

import pytest
from model_answers import answers_at_random

from labgym.cli import main
from labgym.layouts import Layout, generate
from labgym.layouts.language import LanguageAdjuster
from labgym.layouts.language.commands import surface_pose
from labgym.layouts.moves import Move, Place, Settle, apply
from labgym.layouts.optimise import optimise, optimise_assessed
from labgym.layouts.placement import FLOOR
from labgym.layouts.rules import PAPER
from labgym.layouts.rules.objective import evaluate_layout
from labgym.layouts.trace import Recorder
from labgym.llm import LanguageModelError
from labgym.protocols import get

PROTOCOL = get("sub_01")


@pytest.fixture(scope="module")
def layout():
    return generate("sub_01", 3)


@pytest.fixture(scope="module")
def unstored(layout):
    """The layout with a reagent on a bench, the command that stores it again, and its place in the cabinet."""
    reagent = layout.find("Acetone")
    spoilt = apply(
        layout, Settle(reagent.id, "MainWorkbench_1" if layout.find("MainWorkbench") else "FumeHood_1", 0, 0, 0)
    )
    x, y, yaw = surface_pose(layout, reagent.id)
    place = {"support": reagent.support, "surface": reagent.slot, "x": x, "y": y, "yaw": yaw}
    return spoilt, {"command": "settle", "id": reagent.id, **place}


def commands(*listed: dict[str, object]) -> str:
    return json.dumps({"commands": list(listed)})


def adjusted(adjuster, layout, level, trace=None):
    return adjuster.adjust(layout, PROTOCOL, evaluate_layout(layout, PROTOCOL, rules="paper"), level, trace)


def test_a_command_that_improves_the_layout_is_accepted(layout, unstored, loopback, model_at):
    spoilt, back = unstored
    loopback.says(commands(back))
    adjuster = LanguageAdjuster(model_at())
    result = adjusted(adjuster, spoilt, "desktop")
    assert evaluate_layout(result, PROTOCOL, rules="paper").v == evaluate_layout(layout, PROTOCOL, rules="paper").v == 0
    assert math.dist(result.placement(back["id"]).position, layout.placement(back["id"]).position) < 2e-3
    assert (adjuster.accepted, dict(adjuster.refused)) == (1, {})


def test_the_model_is_told_what_is_wrong_with_ids_and_amounts(unstored, loopback, model_at):
    spoilt, back = unstored
    loopback.says(commands(back))
    adjusted(LanguageAdjuster(model_at()), spoilt, "desktop")
    question = loopback.requests[0]["messages"][1]["content"]
    for violation in evaluate_layout(spoilt, PROTOCOL, rules="paper").violations.items:
        assert violation.message in question
    form = loopback.requests[0]["response_format"]["json_schema"]
    assert form["strict"] is True
    settle = form["schema"]["$defs"]["Settle"]["properties"]
    assert back["id"] in settle["id"]["enum"]
    assert set(settle["support"]["enum"]) <= set(spoilt.by_id)


def test_furniture_moves_rotates_and_swaps_at_room_level(layout, loopback, model_at):
    bench = next(p for p in layout.placements if p.support == FLOOR and p.asset == "SinkBench")
    turned = apply(layout, Place(bench.id, bench.position[0], bench.position[1], bench.yaw + 0.6))
    loopback.says(commands({"command": "rotate", "id": bench.id, "yaw": math.degrees(bench.yaw)}))
    assert evaluate_layout(adjusted(LanguageAdjuster(model_at()), turned, "room"), PROTOCOL, rules="paper").cost == 0
    moved = apply(layout, Move(bench.id, 0.4, 0.3))
    x, y, _ = bench.position
    loopback.says(commands({"command": "move", "id": bench.id, "x": x, "y": y}))
    assert evaluate_layout(adjusted(LanguageAdjuster(model_at()), moved, "room"), PROTOCOL, rules="paper").cost == 0


def test_two_items_swap_their_places(layout, loopback, model_at):
    first, second = [p for p in layout.placements if p.support == layout.find("Acetone").support][:2]
    spoilt = apply(layout, Settle(first.id, "FumeHood_1", 0, 0.0, 0.0))
    other = next(p for p in layout.children("FumeHood_1"))
    loopback.says(commands({"command": "swap", "first": first.id, "second": other.id}))
    recorder = Recorder()
    recorder.begin(spoilt, PROTOCOL, PAPER)
    adjusted(LanguageAdjuster(model_at()), spoilt, "desktop", recorder)
    recorder.update("optimise", "desktop", spoilt)
    trial = recorder.trace().iterations[-1].trials[0]
    assert [command.kind for command in trial.commands] == ["Settle", "Settle"]
    assert second.id in layout.by_id


def test_commands_that_only_help_together_are_accepted_together(layout, loopback, model_at):
    first, second = layout.find("EyewashStation"), layout.find("WasteStation")
    spoilt = apply(layout, Place(first.id, *second.position[:2], second.yaw))
    spoilt = apply(spoilt, Place(second.id, *first.position[:2], first.yaw))
    before = evaluate_layout(spoilt, PROTOCOL, rules="paper")
    loopback.says(
        commands(
            *(
                {"command": "move", "id": each.id, "x": each.position[0], "y": each.position[1]}
                for each in (first, second)
            ),
            *({"command": "rotate", "id": each.id, "yaw": math.degrees(each.yaw)} for each in (first, second)),
        )
    )
    result = adjusted(LanguageAdjuster(model_at()), spoilt, "room")
    after = evaluate_layout(result, PROTOCOL, rules="paper")
    assert before.cost > 0
    assert after.better_than(before)


def test_refusals_are_counted_and_traced_with_their_reasons(layout, unstored, loopback, model_at):
    spoilt, back = unstored
    hood = layout.find("FumeHood").id
    loopback.says(
        commands(
            {**back, "surface": 63},
            {**back, "support": hood, "surface": 0, "x": 0.6, "y": 0.3},
            {"command": "swap", "first": back["id"], "second": back["id"]},
        )
    )
    adjuster = LanguageAdjuster(model_at())
    recorder = Recorder()
    start = evaluate_layout(spoilt, PROTOCOL, rules="paper")
    recorder.begin(spoilt, PROTOCOL, start.rules)
    assert adjuster.adjust(spoilt, PROTOCOL, start, "desktop", recorder) is spoilt
    recorder.update("optimise", "desktop", spoilt)
    assert adjuster.accepted == 0
    assert adjuster.refused["invalid"] == 4, "two answers, each with two commands that cannot be applied"
    assert sum(adjuster.refused.values()) == 6
    trials = recorder.trace().iterations[-1].trials
    assert [trial.verdict for trial in trials].count("invalid") == 4
    assert any("no surface 63" in trial.note for trial in trials)
    second = loopback.requests[1]["messages"][-1]["content"]
    assert "no surface 63" in second
    assert "cannot be swapped with itself" in second


def test_fixed_objects_are_not_offered_and_stay(layout, loopback, model_at):
    fixed = tuple(p.model_copy(update={"fixed": p.asset == "SinkBench"}) for p in layout.placements)
    spoilt = apply(layout.replace(placements=fixed), Move(layout.find("EyewashStation").id, 0.4, 0.4))
    loopback.says(commands())
    adjusted(LanguageAdjuster(model_at()), spoilt, "room")
    names = loopback.requests[0]["response_format"]["json_schema"]["schema"]["$defs"]["Move"]["properties"]["id"][
        "enum"
    ]
    assert not {p.id for p in spoilt.placements if p.fixed} & set(names)


@pytest.mark.parametrize(
    "text",
    [
        "Move the hood to the left.",
        '{"commands": [{"command": "move"',
        '{"commands": [{"command": "delete", "id": "FumeHood_1"}]}',
        '{"commands": [{"command": "move", "id": "__import__(\'os\')", "x": 1, "y": 1}]}',
        '{"commands": [{"command": "move", "id": "FumeHood_1", "x": NaN, "y": 1}]}',
        '{"commands": [{"command": "move", "id": "FumeHood_1", "x": 1e308, "y": 1}]}',
        '{"commands": "none"}',
        "[" * 5000,
    ],
)
def test_an_unusable_answer_changes_nothing_and_is_counted(unstored, loopback, model_at, text):
    spoilt, _ = unstored
    loopback.says(text)
    adjuster = LanguageAdjuster(model_at(), repairs=1)
    assert adjusted(adjuster, spoilt, "room") is spoilt
    assert dict(adjuster.refused) == {"unusable answer: malformed": 1}
    assert len(loopback.requests) == 2


@pytest.mark.parametrize(
    ("reason", "fields"),
    [
        ("refused", {"message": {"refusal": "I cannot help with that."}}),
        ("truncated", {"finish_reason": "length"}),
        ("empty", {"message": {"content": None}}),
    ],
)
def test_a_model_that_declines_changes_nothing(unstored, loopback, model_at, reason, fields):
    spoilt, _ = unstored
    loopback.says("", **fields)
    adjuster = LanguageAdjuster(model_at())
    assert adjusted(adjuster, spoilt, "desktop") is spoilt
    assert dict(adjuster.refused) == {f"unusable answer: {reason}": 1}


def test_a_server_that_is_gone_is_an_error(unstored, loopback, model_at):
    spoilt, _ = unstored
    loopback.sends(500, {"error": {"message": "down"}})
    with pytest.raises(LanguageModelError) as caught:
        adjusted(LanguageAdjuster(model_at()), spoilt, "desktop")
    assert caught.value.reason == "server"


def test_a_model_that_never_improves_anything_is_asked_about_each_state_once(unstored, loopback, model_at):
    spoilt, back = unstored
    stored = next(p.id for p in spoilt.placements if p.support == "FlammableCabinet_1")
    loopback.says(commands({**back, "id": stored, "support": "FumeHood_1", "surface": 0, "x": 0.1, "y": 0.1}))
    adjuster = LanguageAdjuster(model_at())
    start = evaluate_layout(spoilt, PROTOCOL, rules="paper")
    for _ in range(3):
        assert adjuster.adjust(spoilt, PROTOCOL, start, "desktop") is spoilt
    assert len(loopback.requests) == 2


@pytest.mark.slow
def test_the_optimiser_takes_the_model_and_never_adds_a_violation(unstored, loopback, model_at):
    spoilt, back = unstored
    loopback.says(commands(back))
    recorder = Recorder()
    adjuster = LanguageAdjuster(model_at())
    _, assessment = optimise_assessed(spoilt, PROTOCOL, adjuster=adjuster, trace=recorder, rules="paper")
    assert assessment.v == 0
    assert adjuster.accepted >= 1
    accepted = [t for step in recorder.trace().iterations for t in step.trials if t.verdict == "accepted"]
    assert any(trial.operator == "adjust" for trial in accepted)


def test_a_sound_layout_asks_nothing(layout, loopback, model_at):
    assert optimise(layout, PROTOCOL, adjuster=LanguageAdjuster(model_at()), rules="paper") is layout
    assert loopback.requests == []


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("level", ["room", "desktop"])
def test_random_commands_never_make_a_layout_worse(layout, loopback, model_at, level, seed):
    spoilt = apply(layout, Move(layout.find("EyewashStation").id, 0.3, 0.3))
    before = evaluate_layout(spoilt, PROTOCOL, rules="paper")
    answers_at_random(loopback, seed)
    adjuster = LanguageAdjuster(model_at())
    result = adjuster.adjust(spoilt, PROTOCOL, before, level)
    after = evaluate_layout(result, PROTOCOL, rules="paper")
    assert result is spoilt or after.better_than(before)
    assert {p.id for p in result.placements} == {p.id for p in spoilt.placements}
    result.check_references()


def test_the_command_repair_takes_the_model(unstored, loopback, monkeypatch, tmp_path, capsys):
    spoilt, back = unstored
    for name, value in {"BASE_URL": loopback.url, "MODEL": "test-model"}.items():
        monkeypatch.setenv(f"LABGYM_LLM_{name}", value)
    loopback.says(commands(back))
    file = spoilt.save(tmp_path / "spoilt.json")
    code = main(["repair", str(file), "--adjuster", "llm", "--out", str(tmp_path / "repaired.json")])
    assert (code, capsys.readouterr().err) == (0, "")
    assert evaluate_layout(Layout.load(tmp_path / "repaired.json"), PROTOCOL, rules="paper").v == 0
    assert main(["repair", str(file), "--adjuster", "magic", "--out", str(tmp_path / "other.json")]) == 2
