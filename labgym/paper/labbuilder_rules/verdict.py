"""All figures of a scene under the rule set `labbuilder`, by reading, and tables of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from labgym.documents import Record
from labgym.paper.labbuilder_rules.chemistry import CATEGORIES, chemistry
from labgym.paper.labbuilder_rules.geometry import collisions, height_errors, object_count, out_of_bounds
from labgym.paper.labbuilder_rules.library import Library
from labgym.paper.labbuilder_rules.navigation import GOAL_RULES, Navigation
from labgym.paper.labbuilder_rules.quirks import LITERAL, MODES, QUIRKS, QuirkName, Reading
from labgym.paper.labbuilder_rules.stage import RatedScene, Stage
from labgym.paper.reproduction.figures import FigureColumn, FigureLine, FigureTable, plain_cells

NAVIGATION: frozenset[QuirkName] = frozenset({"room", "walls", "exact", "keys", "flip", "sizes"})
"""Quirks that navigation depends on."""


class Verdict(Record):
    """The figures of a scene.

    Attributes:
        obj, ob, cn: numbers of objects, out of bounds, and of colliding pairs. heights: items at a wrong height.
        flam, store, incomp, glass: scores of the categories, 0 to 1; None if it does not apply.
        flam_count, store_count, incomp_count, glass_count: their numbers of constraints.
        glassware: glass without reagents. glass_ceiling: the greatest glass that the surfaces admit.
        overall: mean of all satisfactions, by weight.
        paths_released, reachable_released, paths_published, reachable_published: numbers of paths by the two rules of
            goals, and of those that the robot can drive.
    """

    obj: int
    ob: int
    cn: int
    heights: int
    flam: float | None
    store: float | None
    incomp: float | None
    glass: float | None
    flam_count: int
    store_count: int
    incomp_count: int
    glass_count: int
    glassware: float | None
    glass_ceiling: float | None
    overall: float | None
    paths_released: int
    reachable_released: int
    paths_published: int
    reachable_published: int

    def values(self) -> dict[str, float | None]:
        """Return the figures by name, with the shares of paths in place of their numbers."""
        figures: dict[str, float | None] = {
            name: value for name, value in self.model_dump().items() if not name.startswith(("paths", "reachable"))
        }
        for rule in GOAL_RULES:
            paths, reachable = getattr(self, f"paths_{rule}"), getattr(self, f"reachable_{rule}")
            figures[f"nav_{rule}"] = reachable / paths if paths else None
        return figures


def evaluate_scene(
    scene: RatedScene, library: Library, reading: Reading = LITERAL, paths: Mapping[str, int] | None = None
) -> Verdict:
    """Return the figures of a scene.

    Args:
        scene, library, reading: what is evaluated, and how.
        paths: numbers of paths by their fields, if they are known.
    """
    stage = Stage(scene, library, reading)
    chemical = chemistry(stage)
    return Verdict(
        obj=object_count(stage),
        ob=len(out_of_bounds(stage)),
        cn=len(collisions(stage)),
        heights=len(height_errors(stage)),
        **chemical.scores,
        **{f"{category}_count": chemical.count(category) for category in CATEGORIES},
        glassware=chemical.glassware,
        glass_ceiling=chemical.ceiling,
        overall=chemical.overall,
        **(_paths(stage) if paths is None else paths),
    )


def _paths(stage: Stage) -> dict[str, int]:
    navigation, numbers = Navigation(stage), {}
    for rule in GOAL_RULES:
        numbers[f"paths_{rule}"], numbers[f"reachable_{rule}"] = navigation.paths(rule)
    return numbers


def both_modes(scene: RatedScene, library: Library) -> Mapping[str, Verdict]:
    """Return the figures of a scene in both modes."""
    return {mode: evaluate_scene(scene, library, reading) for mode, reading in MODES.items()}


def quirk_effects(scene: RatedScene, library: Library, literal: Verdict) -> Mapping[str, Verdict]:
    """Return the figures with one quirk corrected and all others literal, by the name of the quirk.

    Args:
        scene, library: what is evaluated. literal: its figures with no quirk corrected.
    """
    known = {name: value for name, value in literal.model_dump().items() if name.startswith(("paths", "reachable"))}
    return {
        quirk.name: evaluate_scene(
            scene, library, LITERAL.correcting(quirk.name), None if quirk.name in NAVIGATION else known
        )
        for quirk in QUIRKS
    }


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
