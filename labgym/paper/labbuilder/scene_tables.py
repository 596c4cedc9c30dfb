"""The rows of the study of LabBuilder's scenes, and their tables."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

from pydantic import Field

from labgym.documents import Record
from labgym.eval.reports.paper import paper
from labgym.paper.reproduction.figures import (
    FigureCell,
    FigureColumn,
    FigureLine,
    FigureTable,
    Scale,
    mean_cell,
    paper_line,
)

POLICY = "astar"
"""The policy that drives in the repaired scenes."""
State = Literal["before", "after"]
Origin = Literal["scenes", "published layouts", "generated layouts"]
SCENES: Origin = "scenes"
PUBLISHED: Origin = "published layouts"
GENERATED: Origin = "generated layouts"
BEFORE: State = "before"
AFTER: State = "after"
STATES: dict[State, str] = {BEFORE: "scenes as they are", AFTER: "scenes repaired"}
MEANS = (
    ("obj", "Obj", 1),
    ("ob", "OB ↓", 2),
    ("cn", "CN ↓", 2),
    ("asset", "Asset ↑", 3),
    ("step_nav", "Step nav ↑", 3),
    ("prot_nav", "Prot nav ↑", 3),
    ("flam", "Flam ↑", 3),
    ("store", "Store ↑", 3),
    ("incomp", "Incomp ↑", 3),
    ("glass", "Glass ↑", 3),
    ("v", "v ↓", 2),
)


class SceneRow(Record):
    """A scene, as its authors wrote it and repaired; or a layout of labgym.

    Attributes:
        scene: name of its file. query: the request that it was generated for.
        objects: number of objects that were read. unknown: what was left out, with reasons; assumptions too.
        route: assets that the goal pairs lead to.
        before, after: metrics under the rule set `paper` of the scene as it is, and repaired.
        transitions: number of transitions. feasible_before, feasible_after: those with a path.
        driven, reached, touching: drives of the policy in the repaired scene, those that reach the goal, and those
            with contacts.
        moved: number of objects that the repair moved.
        error: why the scene could not be read or processed.
        origin: what it is. Layouts have only `before` and `readings`; generated ones also `v` and `missed`.
        v: violations and facility errors under the rule set `touchstone`.
        missed: scores under the rule set `labbuilder` that are lower than they should be.
        readings: figures under the rule set `labbuilder` by reading: both modes, and each quirk corrected alone; with a
            library.
    """

    scene: str
    query: str = ""
    objects: int = 0
    notes: tuple[str, ...] = ()
    route: tuple[str, ...] = ()
    before: dict[str, float | None] = Field(default_factory=dict)
    after: dict[str, float | None] = Field(default_factory=dict)
    transitions: int = 0
    feasible_before: int = 0
    feasible_after: int = 0
    driven: int = 0
    reached: int = 0
    touching: int = 0
    moved: int = 0
    error: str | None = None
    origin: Origin = SCENES
    v: int | None = None
    missed: tuple[str, ...] = ()
    readings: dict[str, dict[str, float | None]] = Field(default_factory=dict)


def mean_table(rows: Sequence[SceneRow]) -> FigureTable:
    """Return the means over scenes, as they are and repaired, with the paper's line."""
    columns = tuple(FigureColumn(key=key, heading=heading, digits=digits) for key, heading, digits in MEANS)
    lines = [
        FigureLine(name=title, cells={column.key: _mean(rows, state, column.key) for column in columns})
        for state, title in STATES.items()
    ]
    printed = paper_line(paper().layouts.row("LabBuilder"), columns)
    return FigureTable(
        key="means",
        title=f"Means over {len(rows)} scenes",
        first="Scenes",
        columns=columns,
        lines=(*lines, printed),
        notes=(
            "Rule set paper, not weighted by asset availability: the files do not say what their protocols require. "
            "Brackets: 95% intervals over scenes.",
            "The paper's line is of 30 scenes, of which these are some, by its own program.",
        ),
    )


def _mean(rows: Sequence[SceneRow], state: State, metric: str) -> FigureCell:
    values = [getattr(row, state).get(metric) for row in rows]
    scale: Scale = "amount" if metric in ("obj", "ob", "cn", "v") else "share"
    return mean_cell(values, [row.scene for row in rows], scale)


def scene_table(rows: Sequence[SceneRow]) -> FigureTable:
    """Return a line for each scene."""
    keys = (
        ("objects", "Objects"),
        ("ob", "OB"),
        ("cn", "CN"),
        ("v", "v"),
        ("v_after", "v after"),
        ("transitions", "Transitions"),
        ("feasible_before", "feasible"),
        ("feasible_after", "feasible after"),
        ("reached", "Drives that reach the goal"),
        ("touching", "Drives with contact"),
        ("moved", "Objects moved"),
    )
    columns = tuple(FigureColumn(key=key, heading=heading, digits=0) for key, heading in keys)
    lines = []
    for row in rows:
        values: dict[str, float | None] = {key: getattr(row, key, None) for key, _ in keys}
        values |= {key: row.before.get(key) for key in ("ob", "cn", "v")} | {"v_after": row.after.get("v")}
        lines.append(
            FigureLine(
                name=row.scene,
                detail=" → ".join(row.route),
                cells={key: FigureCell(value=None if value is None else float(value)) for key, value in values.items()},
            )
        )
    return FigureTable(
        key="scenes",
        title="Scenes before and after the repair",
        first="Scene",
        second="Route",
        columns=columns,
        lines=tuple(lines),
        notes=(
            "Route: the furniture that the goal pairs of the file lead to; without goal pairs, cabinets, hoods, other "
            f"furniture that carries something, and instruments on the floor. Drives: {POLICY} in the repaired scene.",
        ),
    )
