"""Write generated documentation: JSON Schemas, the environment's page, tables, and the heads of model cards.

`python docs/generate.py` writes schemas and pages. With `--check` it writes nothing and exits 1 if a file is out of
date. With `--run runs/default` it also writes layout metrics and pictures of that run into the README; with `--floors`
the plans of the families of floors; with `--pictures` the rendered laboratories of the README and of docs/floors.md;
with `--labnav` the pictures of LabNav's tasks, or of the tasks named after it.
"""

from __future__ import annotations

import argparse
import inspect
import json
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Polygon
from PIL import Image

from labgym.artefacts import artefacts
from labgym.assets import AssetFile
from labgym.assets.articulation import FOOTINGS
from labgym.assets.forge import Annotation
from labgym.assets.inference import Substructures
from labgym.assets.reactivity import Reactivity
from labgym.assets.search import Lookalikes
from labgym.assets.shapes.joints import MECHANISMS
from labgym.cards.labnav import board, headed
from labgym.documents import Document, tagged, write_bytes, write_text
from labgym.envs import LabPointNavEnv
from labgym.envs.goal_env import LabPointNavGoalEnv
from labgym.envs.labnav.tasks import HEADLINE
from labgym.envs.labnav.worlds import drawn_episode
from labgym.errors import LabgymError
from labgym.eval import LayoutReport, LayoutSummary
from labgym.eval.drawing.episode_picture import EpisodeWorld, episode_picture, save_episode_picture
from labgym.eval.driving.record import NavigationSummary
from labgym.eval.leaderboard.correlation import correlation_tables
from labgym.eval.leaderboard.lab30 import Lab30Result, published_lab30
from labgym.eval.leaderboard.labnav import LabNavResult, published_results
from labgym.eval.leaderboard.tables import published_table
from labgym.eval.reports.comparison import Comparison
from labgym.eval.reports.labnav_comparison import LabNavComparison
from labgym.eval.reports.results import ResultsFolder
from labgym.eval.reports.run_report import result_tables
from labgym.eval.reports.tables import leaderboard
from labgym.exchange.inventory import Inventory
from labgym.layouts import Layout, generate
from labgym.layouts.clutter import add_clutter
from labgym.layouts.floors import FAMILIES, FloorDraw, draw_floor
from labgym.layouts.floors.ranges import BuildingRanges, described
from labgym.layouts.rooms import RoomFile
from labgym.layouts.sealed import Commitment
from labgym.layouts.sites import FloorFile
from labgym.layouts.splits import Manifest
from labgym.layouts.trace import Trace
from labgym.llm.replay import RecordedReply
from labgym.paper.reproduction.figures import Cell, Figures
from labgym.paper.reproduction.nuisances import NOTES
from labgym.protocols import Protocol
from labgym.protocols.experiments import ExperimentFile
from labgym.protocols.language.vocabulary import Vocabulary
from labgym.protocols.language.words import Words
from labgym.protocols.refusals import Refusals
from labgym.protocols.synthesis.operations import Operations
from labgym.protocols.synthesis.transformations import Transformations
from labgym.scenes.tracing import trace
from labgym.suites import Suite
from labgym.table import Table

DOCS = Path(__file__).resolve().parent
README = DOCS.parent / "README.md"
POLICIES = DOCS.parent / "policies"
SHOWN = "test-alk_01"
"""The published layout shown in the README's pictures."""

NUISANCES = "leaderboard/nuisances"
"""Folder of the published figures of `labgym reproduce nuisances`, in eval/."""

PICTURES = {
    "laboratory": ("double", 9, ("sub_01",), 3, "space/laboratory"),
    "gallery_bay": ("bay", 33, ("red_02",), 3, "overview"),
    "gallery_ell": ("ell", 8, ("fgt_02",), 2, "overview"),
    "gallery_suite": ("suite", 11, ("sub_01", "red_02"), 2, "overview"),
    "gallery_double": ("double", 6, ("red_02",), 1, "overview"),
    "gallery_refit": ("refit", 12, ("alk_01",), 2, "overview"),
    "gallery_inside": ("refit", 5, ("sub_01",), 1, "door"),
}
"""Rendered pictures by name: family, seed, protocols, level of clutter, camera."""
LARGE, SMALL = (1280, 640), (800, 450)
"""Sizes of the README's picture and of those in the gallery, pixels."""

EPISODES = {
    "aisle": 4, "moved": 5, "people": 8, "odometry": 10, "dock": 5, "glass": 7, "carry": 15, "shift": 11,
}  # fmt: skip
"""Random seeds of the LabNav episodes in docs/labnav.md, on floors of floors-val."""

USES = {
    "laboratory": "#fff4d8",
    "instrument": "#dcecff",
    "store": "#e4e4e4",
    "write-up": "#e2f6e2",
    "corridor": "#f2ecfa",
}
PARTS = {"wall": "#484848", "pane": "#40a0e0", "sill": "#90b8d0", "leaf": "#c06030", "column": "#202020"}
"""Colors of spaces by use, and of solid parts, in the plans of floors."""

MARKS = "<!-- {name}: begin -->", "<!-- {name}: end -->"
DOCUMENTS: tuple[type[Document], ...] = (
    AssetFile,
    Annotation,
    Lookalikes,
    Reactivity,
    Substructures,
    Protocol,
    ExperimentFile,
    Layout,
    RoomFile,
    FloorFile,
    Inventory,
    Commitment,
    Manifest,
    Trace,
    Suite,
    LayoutReport,
    LayoutSummary,
    NavigationSummary,
    Comparison,
    LabNavComparison,
    LabNavResult,
    Lab30Result,
    Figures,
    RecordedReply,
    Words,
    Vocabulary,
    Operations,
    Transformations,
    Refusals,
)


def schema(document: type[Document]) -> str:
    """Return the JSON Schema of a document, including its `schema` field."""
    body = tagged(document.model_json_schema(mode="validation"), document)
    return (
        json.dumps({"$schema": "https://json-schema.org/draft/2020-12/schema", **body}, indent=1, ensure_ascii=False)
        + "\n"
    )


def environment_page(environment: type, goals: type) -> str:
    """Return the page of the environments: the docstrings of the class and of that for relabeled goals."""
    text, more = (inspect.cleandoc(each.__doc__ or "") for each in (environment, goals))
    more = more.replace("\n## ", "\n### ")
    return f"# LabPointNav\n\n{text}\n\n## LabPointNavGoal-v1\n\n{more}\n"


def pages() -> dict[Path, str]:
    """Return the contents of all generated files in docs/ by path."""
    schemas = {DOCS / "schemas" / f"{d.SCHEMA.partition('.')[2].replace('/', '-')}.json": schema(d) for d in DOCUMENTS}
    floors, moving, labnav = DOCS / "floors.md", DOCS / "moving-parts.md", DOCS / "labnav.md"
    classical = DOCS / "classical-policies.md"
    text = with_tables(labnav.read_text(encoding="utf-8"), correlations(), "correlation of tasks")
    readme = with_tables(README.read_text(encoding="utf-8"), results_tables(), "results of LabNav")
    return {
        **schemas,
        README: with_tables(readme, lab30_table(), "results of lab30"),
        DOCS / "environment.md": environment_page(LabPointNavEnv, LabPointNavGoalEnv),
        labnav: with_tables(text, nuisance_table(), "nuisances"),
        floors: with_tables(floors.read_text(encoding="utf-8"), parameter_tables()),
        moving: with_tables(moving.read_text(encoding="utf-8"), moving_tables()),
        classical: with_tables(classical.read_text(encoding="utf-8"), classical_table(), "LabNav"),
        **{card: headed(card.read_text(encoding="utf-8")) for card in sorted(POLICIES.glob("*/CARD.md"))},
    }


def moving_tables() -> str:
    """Return the tables of the kinds of moving parts and of the ways in which assets stand on the floor."""
    lines = [
        "| part | force, N | damping, N s/m | mass, kg/m² | contents, kg | source |",
        "|---|---:|---:|---:|---:|---|",
    ]
    for name, part in MECHANISMS.items():
        lines.append(
            f"| {name} | {part.force:g} | {part.damping:g} | {part.areal_mass:g} | {part.content:g} | {part.source} |"
        )
    lines += ["", "| shape | friction / weight | castors | source |", "|---|---:|---|---|"]
    for name, foot in FOOTINGS.items():
        lines.append(f"| `{name}` | {foot.friction:g} | {'yes' if foot.castors else 'no'} | {foot.source} |")
    return "\n".join(lines)


def parameter_tables() -> str:
    """Return the tables of the parameters of all families of floors, those that all share first."""
    shared = {name: limits for name, limits, _, _ in described(BuildingRanges())}
    blocks = [("All families", list(described(BuildingRanges())))]
    for family in FAMILIES.values():
        own = [row for row in described(family.ranges) if shared.get(row[0]) != row[1]]
        blocks.append((f"`{family.name}`: {family.summary}", own))
    lines = []
    for title, rows in blocks:
        lines += [f"### {title}", "", "| parameter | values | meaning | source |", "|---|---|---|---|"]
        lines += [f"| `{name}` | {_values(limits)} | {meaning} | {source} |" for name, limits, meaning, source in rows]
        lines.append("")
    return "\n".join(lines)


def _values(limits: object) -> str:
    if not isinstance(limits, tuple):
        return str(limits)
    if isinstance(limits[0], str):
        return ", ".join(limits)
    return f"{limits[0]:g}" if limits[0] == limits[1] else f"{limits[0]:g} to {limits[1]:g}"


def draw_families(path: Path, seeds: Sequence[int] = (2, 3, 7)) -> None:
    """Write a picture with the plans of some floors of each family, a family per row."""
    figure = Figure(figsize=(10.0, 3.0 * len(FAMILIES)), dpi=80)
    for row, family in enumerate(FAMILIES):
        for column, seed in enumerate(seeds):
            axes = figure.add_subplot(len(FAMILIES), len(seeds), row * len(seeds) + column + 1)
            draw_plan(axes, draw_floor(family, seed))
    figure.tight_layout()
    figure.savefig(path, metadata={"Software": None})


def draw_plan(axes: Axes, draw: FloorDraw) -> None:
    """Draw spaces, solids, exits and the first hood wall of each laboratory."""
    floor, preferred = draw.floor, {hood.space: hood.wall for hood in reversed(draw.style.hood_walls)}
    for space in floor.spaces:
        for box in space.boxes:
            axes.add_patch(Polygon(box.corners(), color=USES[space.use], linewidth=0))
    for part in floor.parts:
        if part.kind in PARTS:
            axes.add_patch(Polygon(part.box.corners(), color=PARTS[part.kind], linewidth=0))
    for index in preferred.values():
        axes.plot(*zip(floor.walls[index].start, floor.walls[index].end, strict=True), color="#9050b0", linewidth=2)
    for way in floor.doorways:
        if way.exit:
            axes.plot([way.x], [way.y], "^", color="#c02020", markersize=6)
    x0, y0, x1, y1 = floor.bounds
    axes.set(xlim=(x0, x1), ylim=(y0, y1), aspect="equal")
    axes.set_title(f"{floor.name}, {draw.parameters['area']:.0f} m²", fontsize=9)
    axes.axis("off")


def results_tables() -> str:
    """Return the table of the published results of LabNav."""
    results = published_results()
    return published_table(results).markdown() if results else "No results are published yet."


def classical_table() -> str:
    """Return the LabNav rows of the policies without learning, and how they fail."""
    learned = {
        card.read_text(encoding="utf-8").partition(":")[0].removeprefix("# ") for card in POLICIES.glob("*/CARD.md")
    }
    results = published_results()
    names = [result.summary.policy for result in results if result.summary.policy not in learned]
    return board(results, names) if names else "No results are published yet."


def lab30_table() -> str:
    """Return the table of the published results of lab30, with the paper's."""
    results = published_lab30()
    return leaderboard(results).titled_markdown() if results else "No results are published yet."


def correlations() -> str:
    """Return the tables of the correlation between the tasks of LabNav, of the published results."""
    results = published_results()
    tables = correlation_tables(results) if results else ()
    return "\n\n".join(table.markdown() for table in tables) or "No results are published yet."


def nuisance_table() -> str:
    """Return the table of the published figures of `labgym reproduce nuisances`, with columns for each policy."""
    policies = {
        table.key: {(line.name, line.detail): line for line in table.lines}
        for path in sorted((artefacts("eval") / NUISANCES).glob("*.json"))
        for table in Figures.load(path).tables
    }
    if not policies:
        return "No figures are published yet."
    keys = [("with", "{}"), ("without", "{} without"), ("difference", "{} difference")]
    names = dict.fromkeys(name for lines in policies.values() for name in lines)
    missing = Cell(value=None)
    rows = [
        (task, detail, *(
            (lines[task, detail].cells[key] if (task, detail) in lines else missing).text(2)
            for lines in policies.values()
            for key, _ in keys
        ))
        for task, detail in names
    ]  # fmt: skip
    heads = (head.format(policy) for policy in policies for _, head in keys)
    return Table("", ("Task", "Nuisance", *heads), tuple(rows), tuple(NOTES)).markdown()


def with_tables(page: str, tables: str, name: str = "tables") -> str:
    """Return a page with the block between its markers of that name replaced.

    Raises:
        LabgymError: the markers are missing.
    """
    begin, end = (mark.format(name=name) for mark in MARKS)
    before, first, rest = page.partition(begin)
    _, last, after = rest.partition(end)
    if not first or not last:
        raise LabgymError(f"the page has no block between {begin} and {end}")
    return f"{before}{begin}\n\n{tables.strip()}\n\n{end}{after}"


def draw_laboratories(folder: Path) -> None:
    """Write the rendered pictures of `PICTURES` as JPEG files."""
    for name, (family, seed, protocols, level, camera) in PICTURES.items():
        layout = add_clutter(generate(protocols, seed, family=family), level, np.random.default_rng(seed))
        width, height = LARGE if name == "laboratory" else SMALL
        picture = trace(layout, width, height, camera, samples=16)
        Image.fromarray(picture).save(folder / f"{name}.jpg", quality=90, optimize=True)


def draw_episodes(folder: Path, tasks: Sequence[str] = ()) -> None:
    """Write the pictures of LabNav's tasks at their headline level as JPEG files.

    Args:
        tasks: names of tasks; empty for all.
    """
    for task in tasks or EPISODES:
        layout, episode = drawn_episode(task, HEADLINE, EPISODES[task])
        picture = episode_picture(EpisodeWorld.of(task, HEADLINE, episode, layout), samples=10)
        save_episode_picture(picture, folder / f"labnav_{task}.jpg")


def main() -> int:
    """Write or check the generated files and return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true")
    parser.add_argument("--run", type=Path)
    parser.add_argument("--floors", action="store_true")
    parser.add_argument("--pictures", action="store_true")
    parser.add_argument("--labnav", nargs="*", choices=list(EPISODES))
    arguments = parser.parse_args()
    if arguments.floors:
        draw_families(DOCS / "pictures" / "floors.png")
    if arguments.pictures:
        draw_laboratories(DOCS / "pictures")
    if arguments.labnav is not None:
        draw_episodes(DOCS / "pictures", arguments.labnav)
    files = pages()
    if arguments.run:
        layouts, *_ = result_tables(ResultsFolder.read(arguments.run))
        files[README] = with_tables(files[README], layouts.titled_markdown())
        for name, folder in (("overview", "views"), ("topdown", "pictures")):
            write_bytes(DOCS / "pictures" / f"{name}.png", (arguments.run / folder / f"{SHOWN}.png").read_bytes())
    stale = [path for path, text in files.items() if not path.is_file() or path.read_text(encoding="utf-8") != text]
    for path in stale:
        print(f"{'stale' if arguments.check else 'written'}: {path.relative_to(DOCS.parent)}")
        if not arguments.check:
            write_text(path, files[path])
    return int(arguments.check and bool(stale))


if __name__ == "__main__":
    sys.exit(main())
