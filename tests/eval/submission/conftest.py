"""A finished evaluation over two published layouts, and copies of it that can be changed and signed again."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from signed_folders import SignedFolder

from labgym.eval.driving.episode_row import TransitionRow
from labgym.eval.driving.record import NavigationSummary
from labgym.eval.evaluator import evaluate
from labgym.suites import Jitter, Suite

Rows = list[dict[str, Any]]


class Submission(SignedFolder):
    """A copy of an evaluation, with the means of somebody who cheats: everything can be changed and signed again."""

    def rows(self) -> Rows:
        return self.lines("episodes.jsonl")

    def routes(self) -> Rows:
        return self.lines("routes.jsonl")

    def change(self, change: Callable[[Rows, Rows], None]) -> None:
        """Change rows and routes, recompute the summary from them and sign everything."""
        rows, routes = self.rows(), self.routes()
        change(rows, routes)
        self.write("episodes.jsonl", rows)
        self.write("routes.jsonl", routes)
        summary = NavigationSummary.load(self.folder / "summary.json")
        summary.recomputed([TransitionRow.model_validate(row) for row in rows]).save(self.folder / "summary.json")
        self.sign()

    def change_document(self, name: str, **fields: Any) -> None:
        """Change fields of a document and sign everything."""
        self.write(name, {**self.document(name), **fields})
        self.sign()


@pytest.fixture(scope="session")
def suite_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    suite = Suite(
        name="mini",
        split="test",
        layouts=("test-con_01", "test-sub_01"),
        max_steps=200,
        repeats=2,
        jitter=Jitter(),
    )
    return suite.save(tmp_path_factory.mktemp("suite") / "mini.json")


@pytest.fixture(scope="session")
def honest(suite_file: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An evaluation of a policy that fails in some episodes, with contacts."""
    folder = tmp_path_factory.mktemp("honest") / "straight"
    report = evaluate("straight", suite_file, out=folder, progress=False)
    assert 0 < sum(row.success for row in report.rows) < len(report.rows)
    assert sum(row.contacts for row in report.rows) > 100
    return folder


@pytest.fixture
def submission(honest: Path, tmp_path: Path) -> Submission:
    shutil.copytree(honest, tmp_path / "submission")
    return Submission(tmp_path / "submission")
