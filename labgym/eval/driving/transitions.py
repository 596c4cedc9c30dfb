"""The run of an evaluation on transitions: a shard is a layout."""

from __future__ import annotations

from typing import Any

from labgym.documents import json_bytes
from labgym.eval.driving.assignments import episode_keys
from labgym.eval.driving.drive import drive_layout
from labgym.eval.driving.episode_row import TransitionRow
from labgym.eval.driving.evaluation import TransitionEvaluation
from labgym.eval.driving.files import drive_files
from labgym.eval.driving.record import NavigationSummary
from labgym.eval.driving.runner import Content, EvaluationRun, RunningPolicy, ShardPolicy, shard_file
from labgym.layouts import Layout
from labgym.runs import Shard, ShardOutput
from labgym.suites import Suite


class TransitionRun(EvaluationRun[TransitionEvaluation]):
    """An evaluation on transitions.

    Args:
        running: the policy. suite: the rules. layouts: in their order. seed: of the policy.
    """

    evaluation = TransitionEvaluation

    def __init__(self, running: RunningPolicy, suite: Suite, layouts: tuple[Layout, ...], seed: int) -> None:
        self._suite = suite
        shards = [
            Shard(
                layout.id,
                drive_shard,
                (running.shard_policy, layout, suite, seed),
                size=len(episode_keys(layout, suite)),
            )
            for layout in layouts
        ]
        super().__init__(running, shards, layouts, seed)

    def inputs(self) -> dict[str, Any]:
        """Return suite, layouts, and whether the policy is in a separate process."""
        return {
            "suite": self._suite.model_dump(mode="json"),
            "layouts": {layout.id: layout.hash for layout in self.layouts},
            "isolated": self.running.isolated,
        }

    def documents(self) -> Content:
        """Return the layouts, if they are not published."""
        if self._suite.split is not None:
            return {}
        return {f"layouts/{layout.id}.json": json_bytes(layout.to_json()) for layout in self.layouts}

    def summary(self, rows: tuple[TransitionRow, ...]) -> NavigationSummary:
        """Return the summary of rows."""
        expected, running = sum(shard.size for shard in self.shards), self.running
        summary = NavigationSummary(
            suite=self._suite,
            policy=running.label,
            options=running.source.options,
            privileged=running.driver.privileged,
            sensors=running.driver.observation,
            seed=self.seed,
            layouts={layout.id: layout.hash for layout in self.layouts},
            episodes=expected,
            expected=expected,
            errors=0,
            unreachable=0,
            complete=True,
            metrics={},
        )
        return summary.recomputed(rows)


def drive_shard(policy: ShardPolicy, layout: Layout, suite: Suite, seed: int) -> ShardOutput:
    """Drive all episodes of a layout and return rows, routes and times, below `shards/LAYOUT/`.

    Args:
        policy: the policy. layout: the layout; its protocol gives the goal pairs. suite: the rules.
        seed: random seed of the evaluation.

    Raises:
        LabgymError: the policy's files are others here, or were changed; or this processor cannot run the kernels.
    """
    drives = drive_layout(policy.driver(), layout, suite, policy.label, seed)
    return ShardOutput({shard_file(layout.id, name): content for name, content in drive_files(drives).items()})
