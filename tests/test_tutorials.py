"""The blocks of every tutorial run in their order, as they stand apart from smaller numbers.

test_readme_commands.py checks the commands of those whose run is slow, too.
"""

from __future__ import annotations

import dataclasses
import json
import sys
from pathlib import Path

import pytest
from pages import blocks, free_port, run_python, shell, smaller

from labgym.eval.labnav import suites
from labgym.layouts import Layout
from labgym.runs import executors, slurm

FOLDER = Path(__file__).resolve().parents[1] / "docs" / "tutorials"
TEXTS = {path.stem: path.read_text(encoding="utf-8") for path in sorted(FOLDER.glob("*.md"))}
SMALLER = {
    "train": (
        ("total_timesteps=1_000_000", "total_timesteps=8"),
        ("count=64", "count=1"),
        ("layouts=128", "layouts=1"),
        ("n_steps=64, batch_size=1024", "n_steps=8, batch_size=8"),
        ("--suite val", "--layouts val-sub_01"),
    ),
    "evaluate": (),
    "navdp": (("8888", str(free_port())),),
    "design": (("--width 640 --height 360", "--width 64 --height 36"),),
    "assets": (),
    "cluster": (
        ("8786", str(free_port())),
        ("--nworkers 2", "--nworkers 1"),
        ("--count 100 --shard 20", "--count 1 --shard 1"),
    ),
}
EXTRAS = {"train": "stable_baselines3", "assets": "rdkit", "cluster": "distributed"}


@pytest.fixture
def small(monkeypatch):
    """Two episodes of a LabNav suite, of 10 s each, and submitit's jobs as processes of this machine."""
    load = suites.load_labnav

    def first(name):
        suite = load(name)
        parts = tuple(part.first(2, 1) for part in suite.parts)
        return dataclasses.replace(suite, parts=parts, seconds=10.0)

    monkeypatch.setattr(suites, "load_labnav", first)
    monkeypatch.setattr(slurm, "POLL_SECONDS", 0.05)
    local = lambda options, folder: slurm.slurm_workers(options.workers, options.slurm, folder, "local")  # noqa: E731
    monkeypatch.setitem(executors.EXECUTORS, "slurm", local)


def test_every_tutorial_is_run_and_every_large_number_is_still_there():
    assert TEXTS.keys() == SMALLER.keys()
    assert all(large in TEXTS[name] for name, changes in SMALLER.items() for large, _ in changes)
    assert all(blocks(text) for text in TEXTS.values())


@pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=pytest.mark.slow if name in ("cluster", "navdp", "train") else ()) for name in SMALLER],
)
def test_a_tutorial_runs_from_its_first_block_to_its_last(name, small, tmp_path, monkeypatch, capsys):
    if name in EXTRAS:
        pytest.importorskip(EXTRAS[name])
    if name == "cluster":
        pytest.importorskip("submitit")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", list(sys.path))
    names = {"__name__": "__main__"}
    with shell(monkeypatch, tmp_path) as terminal:
        for language, code in blocks(TEXTS[name]):
            code = smaller(code, SMALLER[name])
            if language == "python":
                run_python(code, tmp_path, names)
            else:
                terminal.run(code)
    sys.modules.pop("mine", None)
    RESULTS[name](tmp_path, names)


def trained(folder, names):
    assert names["model"].num_timesteps >= 8
    assert len((folder / "runs/ppo-lab/episodes.jsonl").read_text().splitlines()) > 1
    assert (folder / "runs/ppo-lab/report.html").is_file()


def evaluated(folder, names):
    rows = [json.loads(line) for line in (folder / "runs/careful-aisle/episodes.jsonl").open()]
    assert [row["policy"] for row in rows] == ["careful"] * 2
    assert {row["task"] for row in rows} == {"aisle"}
    assert not [row["error"] for row in rows if row.get("error")]


def served(folder, names):
    server, direct = (
        [json.loads(line) for line in (folder / f"runs/{name}/episodes.jsonl").open()] for name in ("server", "direct")
    )
    assert len(server) == len(direct) > 1
    assert not [row["error"] for row in server if row["error"]]
    assert sum(row["path_length"] for row in server) > 1.0


def designed(folder, names):
    layout = Layout.load(folder / "lab.json")
    assert names["info"]["layout"] == layout.id
    assert {"plan.pdf", "view.png", "moved.json", "repaired.json", "files"} <= {path.name for path in folder.iterdir()}
    assert layout.protocol_id.startswith("boc_removal")


def brought(folder, names):
    assets = {placement.asset for placement in Layout.load(folder / "lab.json").placements}
    assert {"RingStirrer", names["solvent"]} <= assets


def clustered(folder, names):
    for run in ("layouts", "slurm"):
        assert len((folder / f"runs/{run}/rows.jsonl").read_text().splitlines()) == 1


RESULTS = {
    "train": trained,
    "evaluate": evaluated,
    "navdp": served,
    "design": designed,
    "assets": brought,
    "cluster": clustered,
}
"""What each tutorial leaves behind."""
