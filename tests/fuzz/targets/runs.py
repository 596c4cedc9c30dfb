"""Folders of runs: identity, ledger, manifest, episodes, routes, summary."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from random import Random
from typing import Any

from laboratories import small_laboratory

from fuzz.mutation import mutated_bytes, mutated_data
from fuzz.target import Case, Target
from labgym.eval.drawing.film import film
from labgym.eval.reports.results import ResultsFolder, recorded_drive
from labgym.runs.folder import RunFolder
from labgym.runs.identity import RunIdentity, read_identity
from labgym.runs.ledger import Ledger
from labgym.runs.manifest import RunManifest

ROW: dict[str, Any] = {
    "suite": "layouts/1",
    "split": None,
    "layout": "a",
    "layout_hash": "0" * 64,
    "protocol": "sub_01",
    "pair": 0,
    "policy": "astar",
    "seed": 0,
    "start": [1.0, 1.0, 0.0],
    "goal": [2.0, 2.0, 0.0],
    "success": True,
    "spl": 0.9,
    "soft_spl": 0.9,
    "path_length": 2.0,
    "shortest_path_length": 1.8,
    "final_distance": 0.3,
    "contacts": 0,
    "min_clearance": 0.1,
    "steps": 40,
    "time": 4.0,
}
ROUTE = {"layout": "a", "pair": 0, "repeat": 0, "poses": [[1.0, 1.0, 0.0], [1.1, 1.0, 0.0]]}
TIME = {"layout": "a", "pair": 0, "repeat": 0, "planning_ms": 1.5}
SUMMARY: dict[str, Any] = {
    "schema": "labgym.navigation-summary/2",
    "suite": {"name": "layouts", "layouts": ["a"]},
    "policy": "astar",
    "options": {},
    "privileged": True,
    "seed": 0,
    "layouts": {"a": "0" * 64},
    "episodes": 2,
    "expected": 2,
    "errors": 0,
    "unreachable": 0,
    "complete": True,
    "metrics": {"success": {"value": 1.0, "low": 0.9, "high": 1.0, "count": 2, "nulls": 0}},
}


def targets() -> Iterator[Target]:
    """Yield the targets of run folders."""
    yield Target("run folder", _prepare, _open)
    yield Target("results", lambda: _results, _report)
    yield Target("record of a drive", _drive, _film, ("labgym.eval.drawing.film",), share=0.5)


def _identity() -> RunIdentity:
    return RunIdentity(kind="eval", inputs={"suite": "test", "seed": 0, "policy": {"name": "astar"}}, code="0" * 64)


def _prepare() -> Callable[[Random | None], Case]:
    """Return a maker of folders with one finished shard, of which one file is changed."""
    place = Path("seed-run").absolute()
    with RunFolder.open(place, _identity()) as folder:
        folder.put("a", {"x": 1}, {"shards/a.jsonl": b"row\n", "layouts/a.json": b"{}"}, {"episodes": 1})
        folder.put("b", {"x": 2}, {"shards/b.jsonl": b"row\n"})
    unfinished = _files(place)
    with RunFolder.open(place, _identity()) as folder:
        folder.finish({"episodes.jsonl": b"row\nrow\n"})
    finished = _files(place)

    def make(rng: Random | None) -> Case:
        if rng is None:
            return finished
        files = dict(rng.choice((finished, unfinished)))
        name = rng.choice(sorted(files))
        files[name] = changed(rng, name, files[name])
        return files

    return make


def _files(place: Path) -> dict[str, bytes]:
    found = {str(path.relative_to(place)): path.read_bytes() for path in place.rglob("*") if path.is_file()}
    return {name: content for name, content in found.items() if not name.startswith(".")}


def changed(rng: Random, name: str, content: bytes) -> bytes:
    """Return a JSON file, or a file with a document on every line, with one document changed."""
    if rng.random() < 0.2:
        return mutated_bytes(rng, content)
    lines = content.splitlines() if name.endswith(".jsonl") else [content]
    try:
        documents = [json.loads(line) for line in lines]
    except ValueError:
        return mutated_bytes(rng, content)
    at = rng.randrange(len(documents)) if documents else 0
    documents[at : at + 1] = [mutated_data(rng, each) for each in documents[at : at + 1]]
    return "\n".join(json.dumps(each) for each in documents).encode("utf-8", "surrogatepass")


def _open(folder: Path) -> None:
    """Read a run folder as `report` does, then resume it as the command does that wrote it."""
    read_identity(folder)
    manifest = RunManifest.read(folder)
    if manifest is not None:
        manifest.check(folder)
    list(Ledger(folder))
    with RunFolder.open(folder, _identity()) as run:
        if not run.finished:
            run.output("a", {"x": 1})
            run.put("c", {"x": 3}, {"shards/c.jsonl": b"row\n"})
            run.finish({"episodes.jsonl": b"row\n"})


def _results(rng: Random | None) -> Case:
    files = {
        "summary.json": json.dumps(SUMMARY).encode(),
        "episodes.jsonl": b"".join(json.dumps(ROW | {"pair": k}).encode() + b"\n" for k in range(2)),
        "routes.jsonl": b"".join(json.dumps(ROUTE | {"pair": k}).encode() + b"\n" for k in range(2)),
        "times.jsonl": b"".join(json.dumps(TIME | {"pair": k}).encode() + b"\n" for k in range(2)),
        "run.json": json.dumps(_identity().to_json()).encode(),
    }
    if rng is not None:
        name = rng.choice(sorted(files))
        files[name] = changed(rng, name, files[name])
    return files


def _drive() -> Callable[[Random | None], Case]:
    """Return a maker of results on a small room, of which a file, such as the layout or the routes, is changed."""
    room = small_laboratory("a")
    row = {**ROW, "layout_hash": room.hash, "pair": 0}
    sound = {
        **_results(None),
        "episodes.jsonl": json.dumps(row).encode() + b"\n",
        "routes.jsonl": json.dumps(ROUTE).encode() + b"\n",
        "times.jsonl": json.dumps(TIME).encode() + b"\n",
        "summary.json": json.dumps({**SUMMARY, "layouts": {"a": room.hash}, "episodes": 1, "expected": 1}).encode(),
        "layouts/a.json": json.dumps(room.to_json()).encode(),
    }
    return partial(_one_changed, sound)


def _one_changed(sound: Case, rng: Random | None) -> Case:
    files = dict(sound)
    if rng is not None:
        name = rng.choice(sorted(files))
        files[name] = changed(rng, name, files[name])
    return files


def _film(folder: Path) -> None:
    """Read a drive as `labgym record` does, and film its first two poses."""
    layout, _, route = recorded_drive(folder, "a/0")
    for picture in film(layout, route[:2], 96, 96):
        assert picture.shape == (96, 96, 3)


def _report(folder: Path) -> None:
    """Read results as `labgym report` does; what does not agree is named in lines."""
    results = ResultsFolder.read(folder)
    for problem in results.problems:
        assert len(problem.splitlines()) <= 1, f"a problem of several lines: {problem!r}"
    for evaluation in results.evaluations:
        assert evaluation.metrics
