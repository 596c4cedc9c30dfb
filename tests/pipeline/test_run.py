from __future__ import annotations

import json
import shutil
import signal
from dataclasses import replace
from pathlib import Path

import mujoco
import pytest

from labgym.artefacts import artefacts
from labgym.cli import main
from labgym.errors import DocumentError, MissingDependencyError, OptionError, UnknownNameError
from labgym.eval import evaluate
from labgym.layouts import Layout, load_published, splits
from labgym.pipeline import RunConfig
from labgym.pipeline.run import RunOutcome, report_folders, run_pipeline
from labgym.pipeline.stages import layout_jobs, make_layout
from labgym.policies import make_policy
from labgym.protocols import protocols
from labgym.runs.manifest import RunManifest
from labgym.suites import suite_of
from runs import killing

PROTOCOL = "sub_02"
LAYOUT = f"test-{PROTOCOL}"


@pytest.fixture(scope="module")
def config(tmp_path_factory) -> RunConfig:
    out = tmp_path_factory.mktemp("runs") / "small"
    return RunConfig(out=out, protocols=(PROTOCOL,), policies=("astar", "random"), workers=1, views=0)


@pytest.fixture(scope="module")
def outcome(config) -> RunOutcome:
    return run_pipeline(config)


def modified(folder: Path) -> dict[str, int]:
    return {path.as_posix(): path.stat().st_mtime_ns for path in folder.rglob("*") if path.suffix in (".png", ".xml")}


def test_a_run_leaves_everything_that_it_promises(config, outcome):
    assert outcome.problems == ()
    assert [path for path in outcome.paths if not path.exists()] == []
    rows = [json.loads(line) for line in (config.folder / "navigation/astar/episodes.jsonl").read_text().splitlines()]
    assert [row["pair"] for row in rows] == list(range(len(rows)))
    assert (config.folder / "pictures" / f"{LAYOUT}.png").read_bytes().startswith(b"\x89PNG")
    page = (config.folder / "report.html").read_text()
    assert protocols()[PROTOCOL].name in page
    assert f'src="pictures/{LAYOUT}.png"' in page


def test_the_layout_of_a_run_is_the_published_file(config, outcome):
    published = artefacts("layouts") / "test" / f"{LAYOUT}.json"
    assert (config.folder / "layouts" / f"{LAYOUT}.json").read_bytes() == published.read_bytes()
    (job,) = layout_jobs(None, "default", (PROTOCOL,))
    assert job.published == load_published("test", LAYOUT).hash


def test_the_scene_of_a_run_loads_in_mujoco(config, outcome):
    model = mujoco.MjModel.from_xml_path(str(config.folder / "scenes" / LAYOUT / "scene.xml"))
    names = {model.body(index).name for index in range(model.nbody)}
    assert {placement.id for placement in load_published("test", LAYOUT).placements} <= names


def test_the_tables_hold_the_policies_in_the_order_asked_for(outcome):
    layouts, navigation = outcome.tables
    assert [row[0] for row in layouts.rows] == ["labgym", "LabBuilder (paper)"]
    assert [row[:2] for row in navigation.rows[:2]] == [("astar", "map"), ("random", "lidar")]


def test_the_default_policies_are_those_whose_packages_are_installed(monkeypatch):
    everything, absent = RunConfig().runnable()
    assert {"astar", "online_map", "straight"} <= set(everything)

    def without_torch(name):
        if name == "ppo":
            raise MissingDependencyError("torch", "policy 'ppo'", "train")
        return make_policy(name)

    monkeypatch.setattr("labgym.policies.make_policy", without_torch)
    found, reasons = RunConfig().runnable()
    assert found == tuple(name for name in everything if name != "ppo")
    assert len(reasons) == len(absent) + ("ppo" in everything)
    assert all("pip install" in reason for reason in reasons)


def test_a_second_run_makes_nothing_again_and_says_the_same(config, outcome):
    before = modified(config.folder)
    again = run_pipeline(config)
    assert modified(config.folder) == before
    assert again.tables == outcome.tables


def test_a_picture_that_was_lost_is_drawn_again(config, outcome):
    picture = config.folder / "pictures" / f"{LAYOUT}.png"
    content = picture.read_bytes()
    picture.unlink()
    report = report_folders([config.folder])
    assert picture.read_bytes() == content
    assert report.tables == outcome.tables
    assert config.folder / "report.html" in report.paths
    assert not report.problems


def test_policies_of_two_folders_are_shown_in_one_report(tmp_path):
    layouts = [load_published("test", LAYOUT)]
    short = suite_of(layouts).model_copy(update={"max_steps": 20})
    for policy in ("random", "straight"):
        evaluate(policy, short, layouts=layouts, out=tmp_path / policy, progress=False)
    (table,) = report_folders([tmp_path / "random", tmp_path / "straight", tmp_path / "random"]).tables
    assert [row[0] for row in table.rows[:3]] == ["random", "straight", "iPlanner (w/o nav. opt.), paper"]
    page = (tmp_path / "random" / "report.html").read_text()
    assert all(f">{policy}<" in page for policy in ("random", "straight"))
    with pytest.raises(DocumentError, match="nowhere"):
        report_folders([tmp_path / "random", tmp_path / "nowhere"])


def test_a_folder_of_another_run_is_left_alone(config, outcome):
    with pytest.raises(OptionError, match=r"differs in seed \(null there, 1 requested\), layouts.*--fresh"):
        run_pipeline(RunConfig(out=config.out, seed=1, protocols=(PROTOCOL,)))


def test_the_manifest_lists_the_layouts_scores_and_scenes_and_none_of_what_a_report_draws_again(config, outcome):
    manifest = RunManifest.read(config.folder)
    assert manifest is not None
    manifest.check(config.folder)
    assert {name.partition("/")[0] for name in manifest.files} == {"layouts", "scores", "scenes"}


def test_a_published_file_that_was_changed_stops_the_run(tmp_path, monkeypatch):
    shutil.copytree(artefacts("layouts") / "test", tmp_path / "test")
    path = tmp_path / "test" / f"{LAYOUT}.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | {"placements": []}))
    monkeypatch.setattr(splits, "artefacts", lambda folder: tmp_path)
    (job,) = layout_jobs(None, "default", (PROTOCOL,))
    with pytest.raises(DocumentError, match="hash"):
        make_layout(job)


def test_new_layouts_take_the_seed_of_the_run():
    jobs = layout_jobs(7, "strict")
    assert {job.protocol.id for job in jobs} == set(protocols())
    assert {(job.seed, job.profile, job.published) for job in jobs} == {(7, "strict", None)}


def test_an_unknown_protocol_is_refused_before_anything_is_made(tmp_path):
    with pytest.raises(UnknownNameError, match="sub_99"):
        run_pipeline(RunConfig(out=tmp_path / "r", protocols=("sub_99",)))
    assert not (tmp_path / "r").exists()


APART = (*killing.APART, "tables.txt", "tables.md", "report.html")  # These hold times.


def test_a_run_that_stopped_in_a_stage_resumes_there_to_the_same_files(config, outcome, tmp_path):
    out = tmp_path / "run"
    shutil.copytree(config.folder, out)
    shutil.rmtree(out / "navigation" / "random")
    (out / "report.html").unlink()
    before = modified(out)
    assert run_pipeline(replace(config, out=out)).problems == ()
    assert modified(out) == before
    assert killing.tree(out, APART) == killing.tree(config.folder, APART)


@pytest.mark.slow
def test_a_run_that_is_killed_in_two_stages_resumes_to_the_same_files(config, outcome, tmp_path):
    out = tmp_path / "run"
    flags = ["--protocols", PROTOCOL, "--policies", "astar", "random", "--views", "0", "--workers", "2"]
    words = ["run", "--out", str(out), *flags]
    for ledger, by in (("ledger.jsonl", signal.SIGTERM), ("navigation/astar/ledger.jsonl", signal.SIGKILL)):
        seen = killing.kill(words, out, by, killing.lines(out / ledger, 1))
        assert seen.returncode in (-by, 128 + by, 0)
        assert seen.survivors == ()
    killing.run(words)
    assert killing.tree(out, APART) == killing.tree(config.folder, APART)
    assert killing.temporary_files(out) == []


def test_the_command_prints_both_tables_and_where_everything_is(config, outcome, capsys):
    flags = ["--out", str(config.out), "--protocols", PROTOCOL, "--policies", "astar", "random", "--views", "0"]
    assert main(["run", *flags, "--workers", "1"]) == 0
    printed = capsys.readouterr().out
    for table in outcome.tables:
        assert table.text() in printed
    assert printed.rstrip().endswith("report.html")


def test_a_run_takes_files_of_protocols_if_it_has_a_seed(tmp_path):
    mine = protocols()[PROTOCOL].model_copy(update={"id": "mine"})
    path = str(mine.save(tmp_path / "mine.json"))
    (job,) = layout_jobs(5, "default", (path,))
    content = make_layout(job).files[job.file]
    assert Layout.parse(json.loads(content)).protocols == (mine,)
    changed = mine.model_copy(update={"steps": mine.steps[:-1]}).save(tmp_path / "mine.json")
    assert layout_jobs(5, "default", (str(changed),))[0].inputs != job.inputs
    with pytest.raises(OptionError, match="'mine' has no published layout: give --seed"):
        layout_jobs(None, "default", (path,))
    with pytest.raises(OptionError, match="give each id once"):
        layout_jobs(5, "default", (path, path))
