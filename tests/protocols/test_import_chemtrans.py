"""ChemTrans and ChemActor files: operations and their fields, lost brackets, and broken files."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

import pytest

from labgym.errors import DocumentError
from labgym.protocols.experiments import Experiment, Rejection
from labgym.protocols.importers import chemtrans, read

LINE = (
    "[ add ] reagent:  ( name: indene & type: pure & mole: 0.25 mol & mass: 29.0 g & equivalent: 1 equiv &  ) "
    "& reagent:  ( name: dichloromethane & type: pure & volume: 30 mL &  )  & [ settemp ] temperature: −5°C & "
    "time: 1 hr & [ add ] reagent:  ( name: bleach & type: mixture & volume: 191 mL & concentration: 1.7 M & s"
    "peed: dropwise, 10 min &  )  & [ filter ] N/A: filtered & [ wash ] reagent:  ( name: brine & type: mixtur"
    "e & volume: 50 mL & batch:each: 2 &  )  & phase: organic layer & [ evaporate ] pressure: 300 mmHg & [ col"
    "umn ] reagent(adsorbent): silica & reagent(eluent): hexane & [ distill ] temperature: a steam bath & [ yi"
    "eld ] appearance: colorless & yield: 71% & mass(yield): 24.0 g & reagent:  ( name: the epoxide & type: pu"
    "re &  )  &"
)


def one(tmp_path: Path, line: str) -> Experiment | Rejection:
    (tmp_path / "dev_out.txt").write_text(line + "\n", encoding="utf-8")
    (found,) = read(tmp_path / "dev_out.txt", "chemtrans")
    return found


def test_a_line_becomes_an_experiment(tmp_path: Path) -> None:
    (tmp_path / "dev_inp.txt").write_text("Dissolve indene.\n", encoding="utf-8")
    found = one(tmp_path, LINE)
    assert isinstance(found, Experiment)
    assert (found.id, found.product, found.description) == ("chemtrans_dev_1", "the epoxide", "Dissolve indene.")
    assert [(m.name, m.role) for m in found.materials] == [
        ("indene", "reagent"),
        ("dichloromethane", "reagent"),
        ("bleach", "reagent"),
        ("brine", "workup"),
        ("silica", "workup"),
        ("hexane", "workup"),
    ]
    added, cooled, dropped, filtered, washed, evaporated, column, distilled, yielded = found.actions
    assert [p.amount for p in added.takes] == ["29.0 g, 0.25 mol", "30 mL"]
    assert (cooled.temperature, cooled.duration, cooled.note) == (-5.0, 60.0, "")
    assert (dropped.manner, dropped.duration, dropped.takes[0].amount) == ("dropwise", 10.0, "191 mL, 1.7 M")
    assert filtered.takes == ()
    assert (washed.takes[0].amount, washed.keep) == ("2 x 50 mL", "organic")
    assert evaporated.pressure == pytest.approx(0.39997, rel=1e-4)
    assert [p.name for p in column.takes] == ["silica", "hexane"]
    assert (distilled.temperature, distilled.note) == (None, "a steam bath")
    assert yielded.note == "colorless; 71%; 24.0 g"


@pytest.mark.parametrize("operation", sorted(chemtrans.VERBS))
def test_every_operation_gives_an_action(tmp_path: Path, operation: str) -> None:
    found = one(tmp_path, f"[ add ] reagent:  ( name: water &  ) & [ {operation} ] N/A: done &")
    assert isinstance(found, Experiment)
    assert found.actions[1].verb == chemtrans.VERBS[operation]


@pytest.mark.parametrize(
    "reagent",
    [
        "reagent:  ( name: glass wool & type: pure &  )",
        "reagent:  name: glass wool &  )",
        "reagent: ( name: glass  wool. & )",
        "reagent:  ( name: glass wool",
    ],
)
def test_lost_brackets_are_seen_through(tmp_path: Path, reagent: str) -> None:
    found = one(tmp_path, f"[ filter ] {reagent} & [ settemp ] temperature: 30 °C &")
    assert isinstance(found, Experiment)
    assert [material.name for material in found.materials] == ["glass wool"]
    assert found.actions[1].temperature == 30.0


@pytest.mark.parametrize(
    "line, reason",
    [
        ("", "begin with an operation"),
        ("add water", "begin with an operation"),
        ("water [ add ] N/A: x", "begin with an operation"),
        ("[ explode ] N/A: x &", "'explode' is not known"),
        ("[ add ] reagent:  ( type: pure &  ) &", "no name"),
        ("[ settemp ] temperature: 5 °C &", "materials"),
        ("[ add ] reagent:  ( name: x &  ) & " * 3000, "longer than"),
        ("[ add ] reagent:  ( name: x &  ) & " + "[ wash ] N/A: y & " * 400, "300"),
    ],
)
def test_a_line_that_cannot_be_told_is_turned_down_with_the_reason(tmp_path: Path, line: str, reason: str) -> None:
    found = one(tmp_path, line)
    assert isinstance(found, Rejection)
    assert found.place == "dev_out.txt:1"
    assert reason in found.reason


def test_tables_of_chemactor_are_read(tmp_path: Path) -> None:
    rows: list[dict[str, Any]] = [
        {"reaction_name": "Epoxidation", "action_labels": LINE, "action_preds_1": "-"},
        {"reaction_name": "", "action_labels": "none", "action_preds_1": "-"},
    ]
    with (tmp_path / "Results.csv").open("w", newline="", encoding="utf-8") as stream:
        writer = csv.DictWriter(stream, list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)
    first, second = read(tmp_path, "chemtrans")
    assert isinstance(first, Experiment)
    assert (first.id, first.name) == ("chemtrans_results_1", "Epoxidation")
    assert isinstance(second, Rejection)


@pytest.mark.parametrize(
    "name, content, problem",
    [
        ("a.csv", b"x,y\n1,2\n", "no column 'action_labels'"),
        ("a.csv", b'reaction_name,action_labels\n"a,b', "comma-separated"),
        ("a_out.txt", b"\xff\xfe\x00", "UTF-8"),
    ],
)
def test_broken_files_are_refused(tmp_path: Path, name: str, content: bytes, problem: str) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises(DocumentError, match=problem):
        list(read(tmp_path / name, "chemtrans"))


def test_files_that_do_not_belong_together_are_told(tmp_path: Path) -> None:
    (tmp_path / "dev_inp.txt").write_text("one\ntwo\n")
    with pytest.raises(DocumentError, match="line by line"):
        one(tmp_path, LINE)


def test_an_endless_file_is_not_read_to_its_end(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(chemtrans, "MAX_BYTES", 50)
    with pytest.raises(DocumentError, match="larger than"):
        one(tmp_path, LINE)


def test_an_empty_folder_is_told(tmp_path: Path) -> None:
    with pytest.raises(DocumentError, match=r"_out\.txt"):
        list(read(tmp_path, "chemtrans"))


@pytest.mark.parametrize("end", ["& )", "&  )", "&)", "& "])
def test_a_lost_or_narrow_bracket_does_not_swallow_the_next_reagent(tmp_path: Path, end: str) -> None:
    line = (
        f"[ add ] reagent: ( name: benzaldehyde & mass: 5.3 g {end} & reagent: ( name: ethanol & volume: 30 mL &  ) &"
    )
    found = one(tmp_path, line)
    assert isinstance(found, Experiment)
    assert [(p.name, p.amount) for p in found.actions[0].takes] == [("benzaldehyde", "5.3 g"), ("ethanol", "30 mL")]


@pytest.mark.parametrize("operation", sorted(chemtrans.VERBS))
def test_an_operation_without_fields_is_an_action(tmp_path: Path, operation: str) -> None:
    found = one(tmp_path, f"[ add ] reagent:  ( name: water &  ) & [ {operation} ]")
    assert isinstance(found, Experiment)
    assert found.actions[1].verb == chemtrans.VERBS[operation]


def test_in_a_folder_a_broken_file_does_not_stop_the_others(tmp_path: Path) -> None:
    (tmp_path / "a_out.txt").write_text(LINE + "\n", encoding="utf-8")
    (tmp_path / "b_out.txt").write_bytes(b"\xff\xfe")
    (tmp_path / "c_out.txt").write_text(LINE + "\n", encoding="utf-8")
    assert [type(item) for item in read(tmp_path, "chemtrans")] == [Experiment, Rejection, Experiment]


def test_only_line_feeds_end_lines(tmp_path: Path) -> None:
    (tmp_path / "dev_inp.txt").write_text("one\u2028still one\n", encoding="utf-8")
    found = one(tmp_path, LINE)
    assert isinstance(found, Experiment)
    assert found.description == "one\u2028still one"
