from __future__ import annotations

import signal
from pathlib import Path
from typing import Any

import pytest

from labgym.cli import main
from labgym.errors import DocumentError, OptionError
from labgym.protocols.experiments import read_experiments
from labgym.protocols.importers import ImportSource, read
from labgym.protocols.importers.run import import_experiments, import_file
from labgym.runs import ExecutorOptions, ShardOutput
from runs import killing

XDL = """<Synthesis><Metadata product="{product}"/><Hardware><Component id="reactor" type="reactor"/></Hardware>
<Reagents><Reagent name="ethanol"/></Reagents><Procedure><Add vessel="reactor" reagent="ethanol" volume="{volume} mL"/>
<Stir vessel="reactor" time="{volume} min"/></Procedure></Synthesis>"""
COUNT = 12


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Files of one experiment each, one that is cut off, and one whose action nobody knows."""
    home = tmp_path_factory.mktemp("xdl")
    for number in range(COUNT):
        (home / f"x{number:02d}.xdl").write_text(XDL.format(product=f"Product {number}", volume=number + 1))
    (home / "x03.xdl").write_text("<Synthesis><Proc")
    (home / "x07.xdl").write_text("<Synthesis><Procedure><Teleport/></Procedure></Synthesis>")
    return home


@pytest.fixture(scope="module")
def whole(folder: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("whole") / "imported"
    tally = import_experiments(ImportSource(folder, "xdl"), out, progress=False)
    assert (tally.accepted, tally.rejected) == (COUNT - 2, 2)
    return out


def test_an_import_has_the_experiments_of_its_files_in_their_order(folder: Path, whole: Path) -> None:
    expected = [record.id for record in read(folder, "xdl") if hasattr(record, "id")]
    assert [experiment.id for experiment in read_experiments(whole)] == expected
    rejected = (whole / "rejected.csv").read_text().splitlines()
    assert [line.split(",")[0] for line in rejected] == ["record", "x03.xdl", "x07.xdl"]


def test_workers_do_not_change_an_import_and_a_finished_one_is_not_read_again(
    folder: Path, whole: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    tally = import_experiments(
        ImportSource(folder, "xdl"), tmp_path, executor=ExecutorOptions(workers=2), progress=False
    )
    assert killing.tree(tmp_path) == killing.tree(whole)
    monkeypatch.setattr("labgym.protocols.importers.run.import_file", None)
    assert import_experiments(ImportSource(folder, "xdl"), tmp_path, progress=False) == tally


def test_an_interrupted_import_resumes_to_the_same_files(
    folder: Path, whole: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    numbers: list[int] = []

    def interrupted(number: int, *others: Any) -> ShardOutput:
        numbers.append(number)
        if len(numbers) == 4:
            raise KeyboardInterrupt
        return import_file(number, *others)

    monkeypatch.setattr("labgym.protocols.importers.run.import_file", interrupted)
    with pytest.raises(KeyboardInterrupt):
        import_experiments(ImportSource(folder, "xdl"), tmp_path, progress=False)
    import_experiments(ImportSource(folder, "xdl"), tmp_path, progress=False)
    assert numbers == [0, 1, 2, 3, *range(3, COUNT)]
    assert killing.tree(tmp_path) == killing.tree(whole)


def test_a_limit_counts_the_records_of_all_files(folder: Path, tmp_path: Path) -> None:
    tally = import_experiments(ImportSource(folder, "xdl"), tmp_path, limit=5, progress=False)
    assert (tally.accepted, tally.rejected) == (4, 1)


def test_a_folder_keeps_to_one_import(folder: Path, whole: Path, tmp_path: Path) -> None:
    with pytest.raises(OptionError, match=r"limit .*--fresh"):
        import_experiments(ImportSource(folder, "xdl"), whole, limit=5, progress=False)
    (tmp_path / "mine.json").write_text("{}")
    with pytest.raises(OptionError, match=r"mine\.json"):
        import_experiments(ImportSource(folder, "xdl"), tmp_path, progress=False)


def test_a_single_file_that_cannot_be_read_is_an_error(folder: Path, tmp_path: Path) -> None:
    with pytest.raises(DocumentError, match=r"x03\.xdl"):
        import_experiments(ImportSource(folder / "x03.xdl", "xdl"), tmp_path, progress=False)
    words = ["protocols", "import", str(folder / "x03.xdl"), "--format", "xdl", "--out", str(tmp_path)]
    assert main(words) == 2


@pytest.mark.slow
def test_a_killed_import_ends_with_the_same_files(folder: Path, whole: Path, tmp_path: Path) -> None:
    out = tmp_path / "killed"
    words = ("protocols", "import", str(folder), "--format", "xdl", "--out", str(out), "--workers", "2")
    killing.check(words, out, killing.tree(whole), (signal.SIGKILL, killing.lines(out / "ledger.jsonl", 4)))
