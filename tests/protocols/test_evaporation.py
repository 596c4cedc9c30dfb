"""Batches larger than the flask of the rotary evaporator are evaporated in portions, up to what its receiver takes."""

from __future__ import annotations

import math

import pytest

from labgym.assets import Catalog
from labgym.protocols import examine
from labgym.protocols.contents import situations
from labgym.protocols.model import Protocol
from labgym.protocols.portions import portions
from labgym.protocols.synthesis import synthesize

TEXT = (
    "Reduce {} of benzophenone with NaBH4 in methanol at 0 C for 30 min, quench with water, extract with ethyl "
    "acetate, dry and evaporate"
)


def written(amount: str) -> Protocol:
    return synthesize(TEXT.format(amount), keyword_only=True).protocol


@pytest.mark.parametrize("amount", ["60 g", "80 g", "150 g"])
def test_a_large_batch_is_evaporated_in_portions_that_fill_the_flask_to_half(amount):
    protocol, catalog = written(amount), Catalog.load()
    assert not [finding for finding in examine(protocol, catalog) if finding.severity == "fault"]
    evaporations = [s for s in situations(protocol, catalog) if s.step.action == "Concentrate"]
    first = evaporations[0]
    assert first.volume > 500.0
    assert portions(first.step) == math.ceil(first.volume / 500.0)
    assert f"in {portions(first.step)} portions of at most 500 mL" in first.step.text
    assert ("empty the receiver" in first.step.text) == (first.volume > 1000.0)
    assert first.step.duration == 20.0 * portions(first.step)
    for situation in evaporations:
        assert situation.volume / portions(situation.step) <= 0.5 * situation.vessel.specs.capacity_mL


def test_a_small_batch_is_evaporated_at_once():
    steps = [step for step in written("3 g").steps if step.action == "Concentrate"]
    assert steps
    assert all("portions" not in step.text and step.duration == 20.0 for step in steps)


def test_a_batch_that_fills_the_receiver_four_times_goes_to_the_large_evaporator():
    steps = [step for step in written("400 g").steps if step.action == "Concentrate"]
    assert steps[0].uses[:2] == ("RotaryEvaporator20000", "RoundBottomFlask20000")
    assert "portions" not in steps[0].text


def test_a_protocol_that_overfills_the_flask_is_told_to_evaporate_in_portions():
    protocol = written("150 g")
    steps = [
        step.model_copy(update={"text": "Evaporate the solvent."}) if step.action == "Concentrate" else step
        for step in protocol.steps
    ]
    faults = [f for f in examine(protocol.model_copy(update={"steps": tuple(steps)})) if f.rule == "vessel-volume"]
    assert [fault.suggestion for fault in faults] == [
        "evaporate it in 4 portions of at most 500 mL, and say so in the step"
    ]
