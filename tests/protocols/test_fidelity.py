"""Descriptions graded by fidelity: the protocol holds what the text states, or the refusal names what it cannot keep.

`fidelity.json` was written before the code that it grades. The entries marked `held_out` were run once, after the code
was finished: 30 of 41 were faithful at that first try; what the rest showed was then fixed. Expectations
that changed since: purifications alone (4 entries) are refused, because a protocol has one of seven types of reaction.

`fidelity_foreign.json` holds 60 more, written later by someone who had not read `fidelity.json`; 40 name something that
the catalog lacks. At the first try 49 of the 60 were faithful, 8 were written wrongly, 2 refused for another reason
than what they lack, and 1 refused although it can be written. The protocols were also read by hand: 4 of the 8 had
passed the expectations of that time, which were then tightened (`azide_dmso`, `half_hour_quench`, `mcpba_wt`,
`tosyl_py`); two expectations had a wrong name (`dibal_m78`, `xphos_pd_g3`). Of 15 entries drawn at random before the
first try, 3 failed and were used to change the code; the other 12, marked `unseen`, were not.

The entries marked `second` were written after those changes. At the first try 15 of 15 met their expectations, but 2 of
them, read by hand, had a mistake (`lah_solution` added the solvent last, `dehydr` evaporated its product); both are
graded now. The last 3 are mistakes that were found afterwards.
"""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest

from labgym.assets import Catalog
from labgym.errors import LabgymError
from labgym.protocols import Protocol, examine
from labgym.protocols.amounts import read_amount
from labgym.protocols.synthesis import synthesize

CASES: list[dict[str, Any]] = [
    case
    for name in ("fidelity.json", "fidelity_foreign.json")
    for case in json.loads((Path(__file__).parent / name).read_text(encoding="utf-8"))
]
CATALOG = Catalog.load()
PREPARING = ("Weigh", "Measure", "Clean", "Analyze")
ENDING = ("Quench", "Acidify", "Basify", "Extract", "Wash", "Filter", "DrySolution", "Concentrate")
CATALYTIC = 0.2
"""Equivalents of the limiting substrate up to which a reagent is catalytic."""


def shortcomings(case: dict[str, Any]) -> list[str]:
    """Return what a protocol or refusal lacks; empty where it is faithful."""
    try:
        synthesis = synthesize(case["text"], keyword_only=True)
    except LabgymError as refusal:
        if "refused_for" not in case:
            return [f"refused: {refusal}"]
        return [
            f"refused, but not for {word!r}: {refusal}" for word in case["refused_for"] if not _names(refusal, word)
        ]
    protocol = synthesis.protocol
    if "refused_for" in case and "reagents" not in case:
        return [f"written as {protocol.name!r}, but should have been refused for {case['refused_for']}"]
    faults = [finding.message for finding in examine(protocol) if finding.severity == "fault"]
    return [
        *faults,
        *_reagents(case, protocol),
        *_conditions(case, protocol),
        *_order(case, protocol),
        *(f"no note on {word!r}" for word in case.get("notes", ()) if word not in " ".join(synthesis.notes)),
    ]


def _names(refusal: LabgymError, word: str) -> bool:
    """Say whether a refusal names something, as the text or as the catalog calls it."""
    message = str(refusal).casefold()
    try:
        return word.casefold() in message or CATALOG.find(word).name.casefold() in message
    except LabgymError:
        return False


def _reagents(case: dict[str, Any], protocol: Protocol) -> list[str]:
    amounts = {use.name: use.amount for use in protocol.reagents}
    lacking = []
    for name, stated in case.get("reagents", {}).items():
        options = [stated] if isinstance(stated, str) else stated
        if name not in amounts:
            lacking.append(f"{name} is missing")
        elif not any(_holds_amount(amounts[name], option) for option in options):
            lacking.append(f"{name} is {amounts[name]!r}, not {stated!r}")
    text = " ".join(step.text for step in protocol.steps).lower()
    present = {*amounts, *protocol.instruments}
    unwelcome = (n for n in case.get("must_not", ()) if n in present or (n.islower() and n in text))
    lacking += [f"{name} appears" for name in unwelcome]
    substrate = next(iter(case.get("reagents", {})), None)
    for name in case.get("catalytic", ()):
        moles = _moles(name, amounts.get(name, ""))
        limit = _moles(substrate, amounts.get(substrate, "")) if substrate else None
        if moles is None or limit is None or moles > CATALYTIC * limit:
            lacking.append(f"{name} is {amounts.get(name)!r}, not catalytic")
    return lacking


def _holds_amount(amount: str, stated: str) -> bool:
    pattern = rf"(?<![\d.]){re.escape(stated)}(?![a-z])"
    if not stated:
        return bool(amount)
    number, _, unit = stated.rpartition(" ")
    trimmed = f"{float(number):g} {unit}" if re.fullmatch(r"[\d.]+", number) else stated
    return any(re.search(pattern, amount) for pattern in (pattern, rf"(?<![\d.]){re.escape(trimmed)}(?![a-z])"))


def _moles(name: str, amount: str) -> float | None:
    stated, chemistry = read_amount(amount), CATALOG.get(name).chemistry
    if stated.moles is not None or chemistry is None or chemistry.molar_mass is None:
        return stated.moles
    mass = stated.mass if stated.mass is not None else (stated.volume or 0.0) * (chemistry.density or 0.0)
    return mass / chemistry.molar_mass if mass else None


def _conditions(case: dict[str, Any], protocol: Protocol) -> list[str]:
    steps = [
        (s.temperature, s.duration) for s in protocol.steps if s.temperature is not None and s.duration is not None
    ]
    return [
        f"no step at {low} to {high} C for {least} to {most} min"
        for low, high, least, most in case.get("holds", ())
        if not any(low - 0.6 <= t <= high + 0.6 and least - 1.0 <= d <= most + 1.0 for t, d in steps)
    ]


def _order(case: dict[str, Any], protocol: Protocol) -> list[str]:
    lacking = []
    rest = iter(step.action for step in protocol.steps)
    missing = next((action for action in case.get("order", ()) if action not in rest), None)
    if missing:
        lacking.append(f"{missing} is out of order in {[step.action for step in protocol.steps]}")
    charged = [name for step in protocol.steps if step.action not in (*PREPARING, *ENDING) for name in step.uses]
    places = [charged.index(name) if name in charged else -1 for name in case.get("add_order", ())]
    if places != sorted(places) or -1 in places:
        lacking.append(f"not added in the order {case['add_order']}")
    for name in case.get("quench_only", ()):
        first = next((s.action for s in protocol.steps if name in s.uses and s.action not in PREPARING), "")
        if first not in (*ENDING, "Add"):
            lacking.append(f"{name} is used in {first or 'no step'} first, not to end the reaction")
        quench = next((i for i, s in enumerate(protocol.steps) if s.action in ENDING), len(protocol.steps))
        if any(name in s.uses for s in protocol.steps[:quench] if s.action not in PREPARING):
            lacking.append(f"{name} is used before the reaction has ended")
    for pattern in case.get("must_not_step", ()):
        lacking += [f"step {s.index} matches {pattern!r}" for s in protocol.steps if re.search(pattern, s.text)]
    return lacking


@pytest.mark.cases(50)
@pytest.mark.parametrize("case", CASES, ids=[case["id"] for case in CASES])
def test_what_a_description_states_is_in_the_protocol_or_named_in_the_refusal(case: dict[str, Any]) -> None:
    assert shortcomings(case) == []


def test_the_descriptions_are_many_foreign_and_of_both_languages() -> None:
    assert len(CASES) >= 80
    assert sum("refused_for" in case for case in CASES) >= len(CASES) / 2
    assert sum(any("\u4e00" <= char <= "\u9fff" for char in case["text"]) for case in CASES) >= 20
