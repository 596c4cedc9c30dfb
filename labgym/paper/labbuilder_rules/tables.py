"""Tables of figures under the rule set `labbuilder`: both modes, and what each quirk is worth."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from labgym.paper.labbuilder_rules.quirks import QUIRKS
from labgym.paper.labbuilder_rules.verdict import Verdict
from labgym.paper.reproduction.figures import FigureColumn, FigureLine, FigureTable, plain_cells

Values = Mapping[str, float | None]
COLUMNS = tuple(
    FigureColumn(key=key, heading=heading, digits=digits)
    for key, heading, digits in (
        ("obj", "Obj", 1),
        ("ob", "OB ↓", 2),
        ("cn", "CN ↓", 2),
        ("heights", "Heights ↓", 2),
        ("flam", "Flam ↑", 3),
        ("store", "Store ↑", 3),
        ("incomp", "Incomp ↑", 3),
        ("glass", "Glass ↑", 3),
        ("glass_ceiling", "Glass ceiling", 3),
        ("glassware", "Glassware ↑", 3),
        ("overall", "Overall ↑", 3),
        ("nav_released", "Nav, released goals ↑", 3),
        ("nav_published", "Nav, published goals ↑", 3),
    )
)
"""The figures."""
NOTES = (
    "Glass ceiling: the greatest Glass that the surfaces admit. Glassware: Glass without reagents.",
    "Nav: share of the paths that a disc of 0.30 m can drive, by the goals of the program and of the published files.",
)


def verdict_values(verdicts: Mapping[str, Verdict]) -> dict[str, dict[str, float | None]]:
    """Return the figures of each reading by name."""
    return {name: verdict.values() for name, verdict in verdicts.items()}


def rules_table(title: str, lines: Mapping[str, Sequence[Values]], key: str = "labbuilder") -> FigureTable:
    """Return a line of means for each group of scenes.

    Args:
        title: of the table. lines: figures of each scene by the name of the line. key: of the table.
    """
    return FigureTable(
        key=key,
        title=title,
        first="Reading",
        columns=COLUMNS,
        lines=tuple(FigureLine(name=name, cells=plain_cells(_means(group))) for name, group in lines.items()),
        notes=NOTES,
    )


def quirk_table(title: str, scenes: Sequence[Mapping[str, Values]], key: str) -> FigureTable:
    """Return how the means of the literal mode change if one quirk is corrected.

    Args:
        title: of the table. scenes: figures of each scene by reading: `literal`, and names of quirks. key: of the
            table.
    """
    literal = _means([scene["literal"] for scene in scenes])
    lines = []
    for number, quirk in enumerate(QUIRKS, 1):
        changed = _means([scene[quirk.name] for scene in scenes])
        cells = plain_cells({name: _difference(changed[name], value) for name, value in literal.items()})
        detail = f"{quirk.literal}; corrected: {quirk.corrected}"
        lines.append(FigureLine(name=f"{number} {quirk.name}", detail=detail, cells=cells))
    return FigureTable(
        key=key,
        title=title,
        first="Quirk",
        second="Literal and corrected",
        columns=COLUMNS,
        lines=tuple(lines),
        notes=("Change of the mean of the literal mode if this quirk alone is corrected.",),
    )


def _means(group: Sequence[Values]) -> dict[str, float | None]:
    """Return the means of the figures; scenes to which one does not apply are left out."""
    means = {}
    for column in COLUMNS:
        values = [value for figures in group if (value := figures.get(column.key)) is not None]
        means[column.key] = sum(values) / len(values) if values else None
    return means


def _difference(one: float | None, other: float | None) -> float | None:
    return None if one is None or other is None else one - other
