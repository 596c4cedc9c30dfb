from __future__ import annotations

from pathlib import Path

import pytest

from labgym.cli import main
from labgym.protocols import get


def test_a_sound_protocol_is_reported_to_be_so_with_its_advice(capsys):
    assert main(["protocols", "check", "red_02"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) >= 2
    assert lines[0].startswith("advice: step 3 ")
    assert lines[-1] == f"no faults, {len(lines) - 1} pieces of advice"


def test_a_fault_is_reported_with_its_step_and_a_way_out_and_ends_in_1(capsys, tmp_path):
    protocol = get("sub_01")
    reagents = tuple(
        use.model_copy(update={"amount": "900 mL"}) if use.name == "Acetone" else use for use in protocol.reagents
    )
    file = protocol.model_copy(update={"reagents": reagents}).save(tmp_path / "large.json")
    assert main(["protocols", "check", str(file)]) == 1
    printed = capsys.readouterr().out
    assert (
        "fault: step 2 (Add) has about 456 mL in RoundBottomFlask of 250 mL; use RoundBottomFlask500 [vessel-volume]"
        in printed
    )


@pytest.mark.parametrize("given", ["nothing", "missing.json"])
def test_what_is_not_there_is_an_error(capsys, given):
    assert main(["protocols", "check", given]) == 2
    assert "labgym: error:" in capsys.readouterr().err


def test_a_limit_that_is_none_is_bad_input(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for limit in ("-1", "0"):
        (tmp_path / "train.json").write_text("[]")
        argv = [
            "protocols",
            "import",
            str(tmp_path),
            "--format",
            "openexp",
            "--out",
            str(tmp_path / "o"),
            "--limit",
            limit,
        ]
        assert main(argv) == 2
        assert "--limit" in capsys.readouterr().err


def test_bytes_that_are_no_text_are_searched_for_or_refused_in_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["protocols", "search", "\udcff Boc removal", "--count", "1"]) == 0
    assert main(["protocols", "new", "\udcff reduce benzophenone with NaBH4"]) == 2
    assert "UTF-8" in capsys.readouterr().err


def test_a_text_file_that_does_not_exist_is_named(tmp_path, capsys):
    missing = tmp_path / "procedure.txt"
    assert main(["protocols", "new", str(missing)]) == 2
    message = capsys.readouterr().err
    assert f"{missing} not found" in message
    assert message.count("\n") == 1


def test_an_existing_protocol_is_overwritten_only_when_asked(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = "Reduce benzophenone with NaBH4 in methanol at 0 C for 30 min, quench, extract"
    file = get("sub_01").save(tmp_path / "mine.json")
    before = file.read_bytes()
    arguments = ["protocols", "new", text, "--keyword-only", "--out", str(file)]
    assert main(arguments) == 2
    assert "--overwrite" in capsys.readouterr().err
    assert file.read_bytes() == before
    assert main([*arguments, "--replace"]) == 0
    assert file.read_bytes() != before
    assert main(arguments) == 0, "writing the same protocol again loses nothing"
    assert main(["protocols", "stage", "cyc_biginelli", "--out", str(file)]) == 2


def test_an_import_that_keeps_nothing_fails_and_says_where_the_reasons_are(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "x.xdl").write_text("<Synthesis><Procedure><Teleport/></Procedure></Synthesis>")
    arguments = ["protocols", "import", str(tmp_path / "x.xdl"), "--format", "xdl", "--out", str(tmp_path / "out")]
    assert main(arguments) == 1
    out, err = capsys.readouterr()
    assert "0 experiments accepted, 1 rejected: 1 unreadable" in out
    assert "rejected.csv" in err


def test_a_protocol_of_a_file_is_shown(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = get("sub_01").model_copy(update={"id": "mine"}).save(tmp_path / "mine.json")
    assert main(["protocols", str(file)]) == 0
    assert capsys.readouterr().out.startswith("mine ")


def test_help_says_what_the_group_does_without_a_command(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["protocols", "--help"])
    text = " ".join(capsys.readouterr().out.split())
    assert "Plain `labgym protocols` lists" in text
    assert "`labgym protocols sub_01` shows one" in text
