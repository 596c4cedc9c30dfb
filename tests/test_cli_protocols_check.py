from __future__ import annotations

import pytest

from labgym.cli import main
from labgym.protocols import get


def test_a_sound_protocol_is_told_to_be_so_with_its_advice(capsys):
    assert main(["protocols", "check", "red_02"]) == 0
    told = capsys.readouterr().out
    assert told.startswith("advice: step 3 ")
    assert told.endswith("nothing wrong\n")


def test_a_fault_is_told_with_its_step_and_a_way_out_and_ends_in_1(capsys, tmp_path):
    protocol = get("sub_01")
    reagents = tuple(
        use.model_copy(update={"amount": "900 mL"}) if use.name == "Acetone" else use for use in protocol.reagents
    )
    file = protocol.model_copy(update={"reagents": reagents}).save(tmp_path / "large.json")
    assert main(["protocols", "check", str(file)]) == 1
    told = capsys.readouterr().out
    assert (
        "fault: step 2 (Add) has about 456 mL in RoundBottomFlask of 250 mL; use ThreeNeckFlask [vessel-volume]" in told
    )


@pytest.mark.parametrize("given", ["nothing", "missing.json"])
def test_what_is_not_there_is_an_error(capsys, given):
    assert main(["protocols", "check", given]) == 2
    assert "labgym: error:" in capsys.readouterr().err
