"""Folders of LabNav evaluations that somebody submits: rows, routes, actions, times, summary, identity, manifest."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from random import Random

from signed_folders import SignedFolder

from fuzz.target import Case, Target
from fuzz.targets.runs import changed
from labgym.eval.evaluator import evaluate
from labgym.eval.labnav.evaluation import LabNavEvaluation
from labgym.eval.labnav.replay import driver_name
from labgym.eval.labnav.suites import LabNavSuite, load_labnav
from labgym.eval.submission.check import check_submission

SIGNED = ("episodes.jsonl", "routes.jsonl", "actions.jsonl", "summary.json")
SECONDS = 0.5
"""Time limit of the drives, which are simulated again for each case."""


def targets() -> Iterator[Target]:
    """Yield the target of submissions."""
    yield Target("record of a LabNav episode", _prepare, _check, ("labgym.eval.submission.check",), share=0.5)


def _suite() -> LabNavSuite:
    return LabNavSuite("labnav-val", (load_labnav("labnav-val-people").parts[0].first(1, 1),), seconds=SECONDS)


def _prepare() -> Callable[[Random | None], Case]:
    """Return a maker of evaluations of an episode, of which a file is changed and, half of the time, signed again."""
    place = Path("seed-labnav").absolute()
    evaluate("straight", _suite(), out=place, progress=False, kernels="pinned")
    sound = {path.name: path.read_bytes() for path in place.iterdir() if path.suffix in (".json", ".jsonl")}

    def make(rng: Random | None) -> Case:
        if rng is None:
            return sound
        name = rng.choice(sorted(sound))
        files = {**sound, name: changed(rng, name, sound[name])}
        if name in SIGNED and rng.random() < 0.5:
            for other, content in files.items():
                (place / other).write_bytes(content)
            SignedFolder(place).sign()
            files["manifest.json"] = (place / "manifest.json").read_bytes()
        return files

    return make


def _check(folder: Path) -> None:
    """Read an episode as `labgym record` does, and check the folder as `labgym submit check --no-drive` does."""
    verdict = check_submission(folder, suite=_suite(), drive=False, progress=False)
    for line in (*verdict.problems, *verdict.facts):
        assert len(line.splitlines()) <= 1, f"a line that is several: {line!r}"
        assert len(line) < 2000, f"a line of {len(line)} characters"
    evaluation = LabNavEvaluation.read(folder)
    driver_name(evaluation)
    for row in evaluation.rows:
        assert evaluation.row(row.key).key == row.key
