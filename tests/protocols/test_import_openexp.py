"""OpenExp files: what becomes of each verb and slot, large files, and broken ones."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from openexp_record import RECORD

from labgym.errors import DocumentError
from labgym.protocols.experiments import Experiment, Rejection
from labgym.protocols.importers import openexp, read


def records(tmp_path: Path, *changes: dict[str, Any], name: str = "train.json") -> list[Experiment | Rejection]:
    file = tmp_path / name
    file.write_text(json.dumps([{**RECORD, **change} for change in changes]), encoding="utf-8")
    return list(read(file, "openexp"))


def actions(tmp_path: Path, text: str) -> Experiment:
    (found,) = records(tmp_path, {"actions": text})
    assert isinstance(found, Experiment), found
    return found


def test_a_record_becomes_an_experiment_with_its_placeholders_resolved(tmp_path: Path) -> None:
    (found,) = records(tmp_path, {})
    assert isinstance(found, Experiment)
    assert (found.id, found.origin, found.license) == ("openexp_17", "openexp", "CC-BY-SA-4.0")
    assert found.reaction == "O=Cc1ccccc1.Nc1ccccc1>CC(=O)O.CCO>C(=Nc1ccccc1)c1ccccc1"
    assert found.description == "An imine."
    assert [(m.name, m.role, m.smiles) for m in found.materials] == [
        ("benzaldehyde", "reactant", "O=Cc1ccccc1"),
        ("EtOH", "solvent", "CCO"),
        ("aniline", "reactant", "Nc1ccccc1"),
        ("cold ethanol", "workup", ""),
    ]
    made, added, dropped, stirred, filtered, washed, yielded = found.actions
    assert [p.amount for p in made.takes] == ["5.3 g, 50 mmol", "10 mL"]
    assert (added.takes, added.note) == ((), "the solution")
    assert (dropped.temperature, dropped.duration, dropped.atmosphere, dropped.manner) == (
        2.5,
        10.0,
        "nitrogen",
        "dropwise",
    )
    assert (stirred.verb, stirred.duration, stirred.temperature) == ("Stir", 960.0, 22.0)
    assert filtered.keep == "precipitate"
    assert washed.takes[0].amount == "2 x 5 mL"
    assert yielded.note == "8 g, 88%"


@pytest.mark.parametrize(
    "text, expected",
    [
        ("COLLECTLAYER organic", {"verb": "CollectLayer", "keep": "organic"}),
        ("CONCENTRATE", {"verb": "Concentrate"}),
        ("DEGAS with argon for 20 minutes", {"verb": "Purge", "atmosphere": "argon", "duration": 20.0}),
        (
            "DRYSOLID for 2 h at 60 °C under vacuum",
            {"verb": "DrySolid", "duration": 120.0, "temperature": 60.0, "atmosphere": "vacuum"},
        ),
        ("MICROWAVE for 5 min at 150 °C", {"verb": "Microwave", "duration": 5.0, "temperature": 150.0}),
        ("PHASESEPARATION", {"verb": "PhaseSeparation"}),
        ("PURIFY", {"verb": "Purify"}),
        (
            "REFLUX for 3 h under nitrogen with Dean-Stark apparatus",
            {"verb": "Reflux", "duration": 180.0, "atmosphere": "nitrogen", "note": "Dean-Stark trap"},
        ),
        ("SETTEMPERATURE -78 °C", {"verb": "SetTemperature", "temperature": -78.0}),
        ("SONICATE for 30 s", {"verb": "Sonicate", "duration": 0.5}),
        ("WAIT for 1 day at 4 °C", {"verb": "Wait", "duration": 1440.0, "temperature": 4.0}),
        ("STIR at reflux temperature", {"verb": "Stir", "note": "at reflux temperature"}),
    ],
)
def test_actions_without_materials(tmp_path: Path, text: str, expected: dict[str, Any]) -> None:
    found = actions(tmp_path, f"ADD $1$ ; {text} ; YIELD $-1$.")
    assert found.actions[1].model_dump(exclude_defaults=True) == expected


@pytest.mark.parametrize(
    "text, verb, names, extra",
    [
        ("DRYSOLUTION over magnesium sulfate", "DrySolution", ["magnesium sulfate"], {}),
        ("EXTRACT with ethyl acetate (30 mL) 3 x", "Extract", ["ethyl acetate"], {}),
        ("PARTITION with ether (50 mL) and water (50 mL)", "Partition", ["ether", "water"], {}),
        (
            "PH with 1N HCl to pH 2 dropwise at 0 °C",
            "AdjustPH",
            ["1N HCl"],
            {"ph": 2.0, "manner": "dropwise", "temperature": 0.0},
        ),
        ("PH with NaOH to pH basic", "AdjustPH", ["NaOH"], {"note": "to pH basic"}),
        ("QUENCH with water (10 mL) dropwise at 0 °C", "Quench", ["water"], {"manner": "dropwise", "temperature": 0.0}),
        ("RECRYSTALLIZE from hexane", "Recrystallize", ["hexane"], {}),
        ("TRITURATE with diethyl ether", "Triturate", ["diethyl ether"], {}),
        ("ADD iron(III) chloride \u200c(anhydrous) (3 g)", "Add", ["iron(III) chloride (anhydrous)"], {}),
        ("ADD oil for lamps", "Add", ["oil for lamps"], {}),
    ],
)
def test_actions_with_materials(tmp_path: Path, text: str, verb: str, names: list[str], extra: dict[str, Any]) -> None:
    action = actions(tmp_path, f"ADD $1$ ; {text} ; YIELD $-1$.").actions[1]
    assert action.verb == verb
    assert [portion.name for portion in action.takes] == names
    assert action.model_dump(exclude_defaults=True, exclude={"verb", "takes"}) == extra


@pytest.mark.parametrize(
    "change, reason",
    [
        ({"actions": "ADD $1$ ; NOACTION ; YIELD $-1$."}, "without an action"),
        ({"actions": "FOLLOWOTHERPROCEDURE."}, "another procedure"),
        ({"actions": "OTHERLANGUAGE."}, "not in English"),
        ({"actions": "INVALIDACTION oops."}, "could not be read"),
        ({"actions": "EXPLODE $1$."}, "'EXPLODE' is not known"),
        ({"actions": "ADD $9$."}, "$9$ is not among"),
        ({"actions": ""}, "no actions"),
        ({"actions": 3}, "no actions"),
        ({"actions": "YIELD $-1$."}, "materials"),
        ({"actions": " ; ".join(["STIR"] * 300)}, "more than 200"),
        ({"index": None}, "no index"),
        ({"extracted_molecules": [1]}, "not a JSON object"),
        ({"actions": "ADD " + "x" * 300 + "."}, "200 characters"),
    ],
)
def test_a_record_that_cannot_be_told_is_turned_down_with_place_and_reason(
    tmp_path: Path, change: dict[str, Any], reason: str
) -> None:
    first, second = records(tmp_path, {}, change)
    assert isinstance(first, Experiment)
    assert isinstance(second, Rejection)
    assert second.place == "train.json:1"
    assert reason in second.reason


def test_a_folder_gives_its_three_splits_in_order(tmp_path: Path) -> None:
    for number, name in enumerate(("test.json", "train.json", "valid.json")):
        records(tmp_path, {"index": number}, name=name)
    assert [item.id for item in read(tmp_path, "openexp") if isinstance(item, Experiment)] == [
        "openexp_1",
        "openexp_2",
        "openexp_0",
    ]


def test_a_long_file_is_read_across_the_ends_of_its_chunks(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(openexp, "CHUNK", 700)
    found = records(tmp_path, *({"index": number} for number in range(50)))
    assert [item.id for item in found if isinstance(item, Experiment)] == [f"openexp_{k}" for k in range(50)]


@pytest.mark.parametrize(
    "content, problem",
    [
        (b"", "cut off"),
        (b"{}", "not a JSON list"),
        (b'[{"index": 1}', "cut off"),
        (b"[nonsense]", "cut off"),
        (b"\xff\xfe[]", "UTF-8"),
        (b"[" * 300_000, "nested|cut off|longer"),
    ],
)
def test_a_file_that_is_no_list_of_records_is_refused(tmp_path: Path, content: bytes, problem: str) -> None:
    file = tmp_path / "train.json"
    file.write_bytes(content)
    with pytest.raises(DocumentError, match=problem):
        list(read(file, "openexp"))


def test_a_record_without_end_is_not_read_to_its_end(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(openexp, "CHUNK", 1000)
    monkeypatch.setattr(openexp, "MAX_RECORD", 1000)
    file = tmp_path / "train.json"
    file.write_text('[{"index": "' + "x" * 100_000)
    with pytest.raises(DocumentError, match="longer than"):
        list(read(file, "openexp"))


def test_an_empty_folder_is_told(tmp_path: Path) -> None:
    with pytest.raises(DocumentError, match=r"train\.json"):
        list(read(tmp_path, "openexp"))


NAMES = st.sampled_from(
    ["water", "sodium hydride", "1,4-dioxane", "HCl (conc.)", "4-nitro(phenyl) ether", "oil at rest"]
)


@given(
    name=NAMES,
    amount=st.sampled_from(["", "5 mL", "1.2 g, 10 mmol"]),
    drop=st.booleans(),
    minutes=st.none() | st.integers(1, 90),
    degrees=st.none() | st.integers(-78, 200),
    gas=st.none() | st.sampled_from(["nitrogen", "argon"]),
)
def test_whatever_the_grammar_writes_is_read_back(
    name: str, amount: str, drop: bool, minutes: int | None, degrees: int | None, gas: str | None
) -> None:
    known = openexp._context({})
    text = "ADD " + name.replace(" (", " \u200c(") + (f" ({amount})" if amount else "") + " dropwise" * drop
    text += f" at {degrees} °C" if degrees is not None else ""
    text += (f" under {gas}" if gas else "") + (f" over {minutes} minutes" if minutes else "")
    action = openexp._action(text, known, {})
    assert (action.takes[0].name, action.takes[0].amount) == (name, amount)
    assert (action.manner == "dropwise", action.duration, action.temperature, action.atmosphere) == (
        drop,
        minutes,
        degrees,
        gas,
    )
