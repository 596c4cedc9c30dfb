"""Traces: every accepted state follows from the first one, and the figures are those of the states."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from fallible_proposer import Shaken
from laboratories import island_laboratory

from labgym.errors import DocumentError, OptionError
from labgym.layouts import Layout, generate
from labgym.layouts.method import Method
from labgym.layouts.moves import Move, apply
from labgym.layouts.optimise import optimise_assessed
from labgym.layouts.repairs import repair_layout
from labgym.layouts.rules.objective import evaluate_layout
from labgym.layouts.trace import Recorder, StateChange, Trace
from labgym.protocols import protocols

PROTOCOL = "sub_01"


@pytest.fixture(scope="module")
def recorded() -> tuple[Layout, Trace]:
    recorder = Recorder()
    layout = generate(PROTOCOL, 3, method=Method(proposer=Shaken(), dress="always"), clutter=1, trace=recorder)
    return layout, recorder.trace()


def test_the_phases_repair_a_fallible_proposal(recorded: tuple[Layout, Trace]) -> None:
    layout, trace = recorded
    assessment = evaluate_layout(layout, protocols()[PROTOCOL], navigation=True, rules="paper")
    assert (assessment.v, assessment.errors, assessment.missing) == (0, (), ())
    assert "failures" not in layout.provenance.options
    assert {item.id for item in trace.start.placements} < {item.id for item in layout.placements}


def test_the_changes_lead_from_the_first_state_to_the_placements_of_the_result(
    recorded: tuple[Layout, Trace], tmp_path: Path
) -> None:
    layout, trace = recorded
    loaded = Trace.load(trace.save(tmp_path / "trace.json"))
    assert loaded == trace
    assert loaded.final().placements == layout.placements
    assert [each.hash for each, _ in loaded.states()] == [each.hash for each in trace.iterations]
    phases = [iteration.phase for iteration in trace.iterations]
    assert phases[0] == "propose"
    assert phases[-2:] == ["dress", "clutter"]
    assert "optimise" in phases


def test_the_figures_are_those_of_the_states(recorded: tuple[Layout, Trace]) -> None:
    _, trace = recorded
    for iteration, layout in trace.states():
        assessment = evaluate_layout(layout, protocols()[PROTOCOL], navigation=True)
        figures = iteration.figures
        unreachable = sum(not move.feasible for move in assessment.transitions or ())
        assert (figures.v, figures.errors) == (assessment.v, len(assessment.errors))
        assert figures.fitness == assessment.fitness
        assert (figures.unreachable, figures.transitions) == (unreachable, len(assessment.transitions or ()))
        assert sum(figures.faults.values()) == figures.v + figures.errors
    assert trace.iterations[0].figures.v > 0 == trace.iterations[-1].figures.v


def test_a_state_changes_exactly_if_a_trial_was_accepted(recorded: tuple[Layout, Trace]) -> None:
    _, trace = recorded
    for iteration in trace.iterations:
        if iteration.phase in ("optimise", "refine"):
            accepted = [trial for trial in iteration.trials if trial.verdict == "accepted"]
            assert bool(accepted) == iteration.accepted
            for trial in iteration.trials:
                if trial.verdict == "cost_rose":
                    assert trial.worse


def test_a_repair_is_recorded_stage_by_stage() -> None:
    spoilt = apply(island_laboratory(), Move("IslandBench1800_1", 1.4, 2.6))
    recorder = Recorder()
    repaired = repair_layout(spoilt, trace=recorder, rules="paper").layout
    trace = recorder.trace()
    assert trace.start == spoilt
    assert trace.final().placements == repaired.placements != spoilt.placements
    assert "repair" in {iteration.phase for iteration in trace.iterations}
    assert repair_layout(spoilt, rules="paper").layout == repaired


def test_recording_changes_nothing(recorded: tuple[Layout, Trace]) -> None:
    layout, _ = recorded
    again = generate(PROTOCOL, 3, method=Method(proposer=Shaken(), dress="always"), clutter=1)
    assert again.to_json() == layout.to_json()


def test_a_phase_alone_begins_its_own_trace(recorded: tuple[Layout, Trace]) -> None:
    layout, _ = recorded
    recorder = Recorder()
    same, _ = optimise_assessed(layout, protocols()[PROTOCOL], trace=recorder, rules="paper")
    trace = recorder.trace()
    assert trace.start is layout is same
    assert len(trace.iterations) == 1
    with pytest.raises(OptionError, match="begin"):
        Recorder().trace()


@pytest.mark.parametrize("seed", range(5))
def test_a_change_between_any_two_states_leads_to_the_second(recorded: tuple[Layout, Trace], seed: int) -> None:
    generator = np.random.default_rng(seed)
    layout, _ = recorded
    carried = {item.support for item in layout.placements}
    loose = [item for item in layout.placements if item.id not in carried]
    states = []
    for _ in range(2):
        removed = {str(name) for name in generator.choice([item.id for item in loose], 5, replace=False)}
        items = [item for item in layout.placements if item.id not in removed]
        moved = generator.integers(len(items))
        x, y, z = items[moved].position
        items[moved] = items[moved].model_copy(update={"position": (x + 0.01, y, z)})
        if generator.random() < 0.5:
            items = [items[index] for index in generator.permutation(len(items))]
        states.append(layout.replace(placements=tuple(items)))
    first, second = states
    change = StateChange.between(first, second)
    assert change.apply(first).placements == second.placements
    assert StateChange.between(first, first).empty


def edited(trace: Trace, **changes: object) -> bytes:
    data = json.loads(json.dumps(trace.to_json()))
    number = next(index for index, each in enumerate(trace.iterations) if each.accepted)
    data["iterations"][number] |= changes
    return json.dumps(data).encode()


@pytest.mark.parametrize(
    ("changes", "field"),
    [
        ({"change": {"removed": ["nothing"]}}, "iterations.1.change"),
        ({"change": {"order": ["FumeHood_1", "FumeHood_1"]}}, "iterations.1.change"),
        ({"hash": "0" * 64}, "iterations.1.hash"),
        ({"hash": "x"}, "hash"),
        ({"phase": "magic"}, "phase"),
        ({"trials": [{"operator": "x", "verdict": "accepted"}] * 401}, "trials"),
    ],
)
def test_a_trace_that_does_not_fit_is_refused_in_one_line(
    recorded: tuple[Layout, Trace], changes: dict[str, object], field: str, tmp_path: Path
) -> None:
    path = tmp_path / "bad.json"
    path.write_bytes(edited(recorded[1], **changes))
    with pytest.raises(DocumentError) as caught:
        Trace.load(path).final()
    assert field in str(caught.value)
    assert "\n" not in str(caught.value)
