"""Whether a judge of pictures can rank: 20 published layouts, each also damaged lightly and heavily.

A model whose scores do not tell these layouts apart says nothing about others: its columns do not appear.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress

import numpy as np

from labgym.errors import LabgymError
from labgym.eval.scoring.judgement import JudgeOptions
from labgym.eval.scoring.score import score
from labgym.layouts import Layout, load_published, published
from labgym.layouts.rules.rule_sets import PAPER
from labgym.paper.damage import KINDS, damaged
from labgym.paper.reproduction.cases import LayoutRow, judged
from labgym.paper.reproduction.measures import report_metrics
from labgym.paper.reproduction.study import rows_output
from labgym.runs import Shard, ShardOutput

PAIRS, LEAST_RANKED = 20, 16
"""Number of layouts, and of them that must score more than when they are damaged: by chance with p = 0.006."""
GRADES = {"sound": 0, "damaged": 2, "spoilt": 5}
"""Number of damaged pieces by grade."""
POINTS = ("real", "lay", "comp")
SPLIT = "test"


def ranking_shards(judge: JudgeOptions | None) -> tuple[Shard, ...]:
    """Return a shard for each layout and grade: 60 layouts, the same in every study; none without a judge."""
    if judge is None:
        return ()
    return tuple(
        Shard(f"ranking/{grade}-{index}", judge_grade, (grade, index, judge))
        for grade in GRADES
        for index in range(PAIRS)
    )


def judge_grade(grade: str, index: int, judge: JudgeOptions) -> ShardOutput:
    """Return the row of a graded layout with the points of the judge.

    Raises:
        LanguageModelError: the model is not configured or cannot be reached.
    """
    layout = graded(grade, index)
    protocol = layout.protocols[0]
    report = judged(score(layout, protocol, PAPER, contacts=False), layout, protocol, judge)
    row = LayoutRow(variant=f"ranking-{grade}", protocol=protocol.id, seed=index, metrics=report_metrics(report))
    return rows_output(f"ranking/{grade}-{index}", [row])


def graded(grade: str, index: int) -> Layout:
    """Return one of the 20 layouts with the damage of a grade; kinds of damage take turns."""
    layout = load_published(SPLIT, published(SPLIT)[index])
    names, turn = sorted(KINDS), index % len(KINDS)
    for step, kind in enumerate((*names[turn:], *names[:turn]) if GRADES[grade] else ()):
        with suppress(LabgymError):  # Too few pieces of this kind: the next one.
            return damaged(layout, kind, GRADES[grade], np.random.default_rng([index, step])).layout
    return layout


def ranked(rows: Sequence[LayoutRow]) -> dict[str, int]:
    """Return how many of the layouts score more points than with the damage of each grade."""
    points = {
        (row.variant, row.seed): sum(row.metrics.get(name) or 0.0 for name in POINTS)
        for row in rows
        if row.variant.startswith("ranking-")
    }
    return {
        grade: sum(
            points.get(("ranking-sound", index), 0.0) > points.get((f"ranking-{grade}", index), 0.0)
            for index in range(PAIRS)
        )
        for grade, pieces in GRADES.items()
        if pieces
    }


def can_rank(rows: Sequence[LayoutRow]) -> bool:
    """Return whether a judge has ranked enough layouts above their damaged selves, in both grades."""
    return all(count >= LEAST_RANKED for count in ranked(rows).values())


def ranking_lines(rows: Sequence[LayoutRow]) -> tuple[str, ...]:
    """Return in words how a judge has ranked; empty without one."""
    if not any(row.variant.startswith("ranking-") for row in rows):
        return ()
    counts = " and ".join(f"{count} {grade}" for grade, count in ranked(rows).items())
    verdict = "its columns are shown" if can_rank(rows) else f"below {LEAST_RANKED}, so that its columns are left out"
    return (f"The judge ranks {PAIRS} published layouts above {counts} versions of them: {verdict}.",)
