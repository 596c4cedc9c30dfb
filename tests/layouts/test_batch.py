from __future__ import annotations

import json
import signal
from pathlib import Path
from typing import Any

import pytest

from labgym.cli import main
from labgym.envs.tasks import resolve_layouts
from labgym.errors import DocumentError, OptionError
from labgym.layouts import Layout, Room, generate
from labgym.layouts.batch import BatchRow, folder_layouts, generate_batch, make_shard, read_rows
from labgym.layouts.generate import resolve_request
from labgym.runs import ExecutorOptions, ShardOutput
from runs import killing

WORDS = (
    *("generate", "sub_01", "red_03", "--count", "4", "--shard", "2"),
    *("--room", "bay_small"),
)


@pytest.fixture(scope="module")
def batch(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("batch") / "layouts"
    generate_batch(["sub_01", "red_03"], 4, folder, room="bay_small", shard=2, progress=False)
    return folder


def test_each_row_names_the_layout_that_generate_makes_of_its_protocol_and_seed(batch: Path) -> None:
    rows = list(read_rows(batch))
    assert [(row.protocol, row.seed) for row in rows] == [(name, k) for name in ("sub_01", "red_03") for k in range(4)]
    layout = generate("red_03", 2, "bay_small")
    row = rows[6]
    assert (row.hash, row.objects, row.room) == (layout.hash, len(layout.placements), "bay_small")
    assert row.v == 0
    assert row.fitness is not None
    assert 0.5 < row.fitness <= 1.0
    assert Path(str(row.file)).name == f"{layout.id}.json"
    assert (batch / str(row.file)).read_bytes() == layout.save(batch.parent / "alone.json").read_bytes()


@pytest.mark.slow  # test_shards.py has workers
def test_workers_and_shards_do_not_change_the_files(batch: Path, tmp_path: Path) -> None:
    generate_batch(
        ["sub_01", "red_03"], 4, tmp_path / "two", room="bay_small", shard=3, executor=ExecutorOptions(workers=2),
        progress=False,
    )  # fmt: skip
    expected, files = killing.tree(batch), killing.tree(tmp_path / "two")
    for name in ("run.json", "manifest.json"):  # They name the size of the shards.
        del expected[name], files[name]
    assert files == expected


def test_a_room_that_cannot_hold_the_protocol_is_a_row_and_the_run_goes_on(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["generate", "sub_01", "--count", "2", "--shard", "1", "--room", "3x3", "--out", str(tmp_path / "small")]
    assert main(words) == 1
    assert "0 of 2 layouts generated, 2 infeasible" in capsys.readouterr().out.splitlines()[-1]
    rows = list(read_rows(tmp_path / "small"))
    assert [row.seed for row in rows] == [0, 1]
    assert all(row.file is None and row.proven and "'3x3' cannot hold" in str(row.infeasible) for row in rows)


def test_a_subfolder_has_at_most_a_thousand_layouts() -> None:
    request = resolve_request("sub_01", 0, Room(width=3.0, depth=3.0, name="r"), "default", None, ())
    requests = {1: resolve_request("sub_01", 0, "bay", "default", None, ())}
    output = make_shard(7, range(1999, 2001), 1999, {0: request, **requests})
    rows = [BatchRow.model_validate_json(line) for line in output.files["shards/000007.jsonl"].splitlines()]
    assert [row.file for row in rows] == ["layouts/0001/sub_01-bay-0.json", "layouts/0002/sub_01-bay-1.json"]


def test_a_folder_of_layouts_is_read_in_the_order_of_its_rows(batch: Path, tmp_path: Path) -> None:
    layouts = list(folder_layouts(batch))
    assert [layout.hash for layout in layouts] == [row.hash for row in read_rows(batch)]
    assert [layout.id for layout in resolve_layouts([batch, "test-sub_01"])][-2:] == [
        "red_03-bay_small-3",
        "test-sub_01",
    ]
    for name in ("b/two.json", "a/one.json"):
        layouts[0].replace(id=Path(name).stem).save(tmp_path / name)
    (tmp_path / "manifest.json").write_text(json.dumps({"schema": "labgym.manifest/1"}))
    assert [layout.id for layout in folder_layouts(tmp_path)] == ["one", "two"]


def test_a_changed_layout_of_a_batch_is_refused(batch: Path, tmp_path: Path) -> None:
    generate_batch("sub_01", 1, tmp_path, room="bay_small", progress=False)
    file = next(tmp_path.rglob("sub_01-*.json"))
    layout = Layout.load(file)
    layout.replace(placements=layout.placements[:-1]).save(file)
    with pytest.raises(DocumentError, match="hash"):
        list(folder_layouts(tmp_path))
    with pytest.raises(DocumentError, match="--fresh"):
        generate_batch("sub_01", 1, tmp_path, room="bay_small", progress=False)


def test_an_empty_folder_and_an_unfinished_batch_are_refused(tmp_path: Path) -> None:
    with pytest.raises(OptionError, match="no layout"):
        list(folder_layouts(tmp_path))
    generate_batch("sub_01", 1, tmp_path, room="bay_small", progress=False)
    (tmp_path / "rows.jsonl").unlink()
    with pytest.raises(OptionError, match="no finished batch"):
        list(folder_layouts(tmp_path))


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("sub_01", "--count", "2"), "--out"),
        (("sub_01", "sub_01", "--out", "x"), "named twice"),
        (("sub_01", "sub_01", "--count", "2", "--out", "x"), "named twice"),
        (("sub_01", "--count", "0", "--out", "x"), "count is 0"),
        (("sub_01", "--count", "2", "--shard", "0", "--out", "x"), "shard is 0"),
        (("sub_01", "--count", "2", "--explain", "--out", "x"), "--explain"),
        (("sub_01", "--count", "2", "--seed", str(2**53 - 1), "--out", "x"), "last seed"),
        (("sub_01", "--count", "2", "--workers", "0", "--out", "x"), "workers is 0"),
        (("sub_01", "--count", "2", "--clutter", "4", "--out", "x"), "0 to 3"),
    ],
)
def test_bad_arguments_are_one_line(words, message, capsys, tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["generate", *words]) == 2
    errors = capsys.readouterr().err
    assert message in errors
    assert len(errors.splitlines()) == 1
    assert not list(tmp_path.iterdir())


def test_the_level_of_clutter_is_in_the_rows_and_in_the_identity(batch: Path, tmp_path: Path) -> None:
    folder = tmp_path / "used"
    assert (
        main(["generate", "sub_01", "--count", "1", "--room", "bay_small", "--clutter", "2", "--out", str(folder)]) == 0
    )
    row = next(read_rows(folder))
    assert row.clutter == 2
    assert row.hash == generate("sub_01", 0, "bay_small", clutter=2).hash
    assert next(read_rows(batch)).clutter == 0
    with pytest.raises(OptionError, match=r"clutter.*--fresh"):
        generate_batch(["sub_01"], 1, folder, room="bay_small", clutter=1, progress=False)


def test_another_seed_needs_another_folder(batch: Path) -> None:
    with pytest.raises(OptionError, match=r"seed.*--fresh"):
        generate_batch(["sub_01", "red_03"], 4, batch, seed=1, room="bay_small", shard=2, progress=False)


def test_a_batch_that_is_interrupted_resumes_to_the_same_files(
    batch: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made: list[int] = []

    def interrupted(index: int, *others: Any) -> ShardOutput:
        made.append(index)
        if len(made) == 3:
            raise KeyboardInterrupt
        return make_shard(index, *others)

    monkeypatch.setattr("labgym.layouts.batch.make_shard", interrupted)
    arguments = {"room": "bay_small", "shard": 2, "progress": False}
    with pytest.raises(KeyboardInterrupt):
        generate_batch(["sub_01", "red_03"], 4, tmp_path, **arguments)
    generate_batch(["sub_01", "red_03"], 4, tmp_path, **arguments)
    assert made == [0, 1, 2, 2, 3]
    assert killing.tree(tmp_path) == killing.tree(batch)


@pytest.mark.slow
def test_a_batch_that_is_killed_again_and_again_resumes_to_the_same_files(batch: Path, tmp_path: Path) -> None:
    for attempt in range(20):  # A busy machine may let the command end before it is seen to have begun.
        folder = tmp_path / str(attempt)
        words = (*WORDS, "--workers", "2", "--out", str(folder))
        ledger = folder / "ledger.jsonl"
        if killing.kill(words, folder, signal.SIGKILL, killing.lines(ledger, 1)).finished < 4:
            break
    else:
        pytest.fail("no kill came before the last shard")
    kills = [(by, killing.lines(ledger, count)) for count, by in ((2, signal.SIGTERM), (3, signal.SIGINT))]
    killing.check(words, folder, killing.tree(batch), *kills)
