"""The damage benchmark: its cases, its verdict, and the shares that it reports."""

import pytest

from labgym.errors import OptionError
from labgym.layouts.moves import Move, apply
from labgym.paper.damage import KINDS
from labgym.paper.repairs.cases import RepairCase, cases, patient
from labgym.paper.repairs.rows import RepairRow, repair_row, verdict
from labgym.paper.reproduction.repair import RepairStudy

CASE = RepairCase("items_shoved", 2, 0)


def row(kind: str, pieces: int = 1, **wrong: object) -> RepairRow:
    return RepairRow.model_validate(
        {
            "kind": kind, "pieces": pieces, "draw": 0, "place": "bay", "protocol": f"p{pieces}", "seed": 1,
            "objects": 100, "damaged": ("a",), "v_damaged": 2, "v": 0, "moved": 3, "added": 0, "missing": (),
            "free_standing": (), "errors": (), "warnings": (), "outside": (), "repaired": not wrong, **wrong,
        }
    )  # fmt: skip


def test_the_benchmark_has_300_cases():
    every = list(cases())
    assert len(every) == len(set(every)) == 300
    assert {case.kind for case in every} == set(KINDS)


def test_a_damaged_laboratory_is_repaired_and_the_verdict_sees_the_damage():
    ill = patient(CASE, 3)
    result, seconds = repair_row(CASE, 3)
    assert seconds > 0.0
    assert (result.seed, result.damaged) == (ill.seed, ill.damage.ids)
    assert result.repaired
    assert result.v_damaged >= 2
    assert result.moved == 2
    assert not verdict(ill.sound, ill.damage.layout, ill.sound.protocol).repaired
    hung = next(p.id for p in ill.sound.placements if p.support == "floor" and ill.sound.asset(p.id).cavity)
    away = apply(ill.sound, Move(hung, 0.02, 0.0))
    moved = verdict(ill.sound, apply(away, Move(hung, 0.0, 50.0)), ill.sound.protocol)
    assert moved.v > 0
    assert "outside" in moved.outside


def test_shares_are_those_of_the_rows():
    rows = [row("moved", 1), row("moved", 2, v=1), row("turned", 1), row("removed", 3, warnings=("hood_door",))]
    figures = RepairStudy(1).figures(rows)
    by_kind = {line.name.partition(":")[0]: line.cells for line in figures.tables[0].lines}
    assert by_kind["moved"]["repaired"].value == 0.5
    assert by_kind["removed"]["clear"].value == 1.0
    assert by_kind["removed"]["repaired"].value == 0.0
    assert by_kind["all"]["repaired"].value == 0.5
    assert by_kind["all"]["moved"].value == pytest.approx(0.03)
    counts = {line.name: line.cells["layouts"].value for line in figures.tables[-1].lines}
    assert {fault: count for fault, count in counts.items() if count} == {"violations": 1.0, "warning: hood_door": 1.0}


@pytest.mark.parametrize("arguments", [{"draws": 0}, {"seed": -1}, {"pieces": (6,)}])
def test_arguments_out_of_range_are_refused(arguments):
    with pytest.raises(OptionError):
        RepairStudy(**arguments)
