"""Write generated documentation: the environment's page, tables, and the heads of model cards.

`python docs/generate.py` writes pages. With `--check` it writes nothing and exits 1 if a file is out of date. With
`--rooms` it also scores the published rooms for the tables of layouts (a minute); with `--floors` it draws the plans of
the families of floors; with `--pictures` the rendered laboratories of the README and of docs/floors.md; with `--labnav`
the pictures of LabNav's tasks, or of the tasks named after it; with `--film` the film of the README. The site has the
JSON Schemas of `DOCUMENTS`.
"""

from __future__ import annotations

import argparse
import inspect
import json
import re
import sys
import typing
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import Literal

import numpy as np
from environment_ids import id_page, reward_table
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Polygon
from PIL import Image
from pydantic import BaseModel

from labgym.artefacts import artefacts
from labgym.assets import AssetFile
from labgym.assets.articulation import FOOTINGS
from labgym.assets.forge import Annotation
from labgym.assets.inference import Substructures
from labgym.assets.reactivity import Reactivity
from labgym.assets.search import Lookalikes
from labgym.assets.shapes.joints import MECHANISMS
from labgym.assets.specs import Specifications, quantity
from labgym.assets.substances import NameTable
from labgym.assets.usd.attributes import ATTRIBUTES
from labgym.cards.labnav import board, headed
from labgym.datasets.tables import episodes_schema, steps_schema
from labgym.documents import Document, tagged, write_text
from labgym.envs import LabPointNavEnv
from labgym.envs.goal_env import LabFloorNavGoalEnv
from labgym.envs.labnav.nuisances import drawn_episode
from labgym.envs.labnav.pack import FloorPack
from labgym.envs.labnav.tasks import FIGURE_TASKS, HEADLINE
from labgym.envs.presets import labnav_id, presets
from labgym.errors import LabgymError
from labgym.eval import LayoutReport, LayoutSummary, aggregate, score
from labgym.eval.drawing.episode_film import episode_film
from labgym.eval.drawing.episode_picture import EpisodeWorld, episode_picture, save_episode_picture
from labgym.eval.drawing.film import Picture, save_film
from labgym.eval.driving.record import NavigationSummary
from labgym.eval.labnav.replay import drive_again
from labgym.eval.labnav.suites import MINI, VAL, published_episode
from labgym.eval.leaderboard.lab30 import Lab30Result, published_lab30
from labgym.eval.leaderboard.labnav import LabNavResult, published_results
from labgym.eval.leaderboard.receipts import FreshReceipt, published_rounds
from labgym.eval.leaderboard.tables import correlation_tables, published_table
from labgym.eval.reports.comparison import Comparison
from labgym.eval.reports.tables import layout_table, leaderboard
from labgym.exchange.inventory import Inventory
from labgym.exchange.recognition.proposal import Answers
from labgym.layouts import Layout, Placement, generate, load_published, published
from labgym.layouts.clutter import add_clutter
from labgym.layouts.floor import Floor, Opening, Space, Wall
from labgym.layouts.floor.spaces import Column, KeepOut, Service
from labgym.layouts.floors import FAMILIES, FloorDraw, draw_floor
from labgym.layouts.floors.ranges import BuildingRanges, described
from labgym.layouts.rooms import RoomFile
from labgym.layouts.rules import TOUCHSTONE
from labgym.layouts.sealed import Commitment
from labgym.layouts.sites import FloorFile
from labgym.layouts.splits import Manifest
from labgym.layouts.trace import Trace
from labgym.llm.config import PREFIX, LanguageModelConfig
from labgym.llm.replay import RecordedReply
from labgym.paper.reproduction.figures import FigureCell, PublishedFigures
from labgym.paper.reproduction.nuisances import NOTES
from labgym.protocols import Protocol
from labgym.protocols.experiments import ExperimentFile
from labgym.protocols.language.concepts import Words
from labgym.protocols.language.vocabulary import Vocabulary
from labgym.protocols.reading.lexicon import ProcedureWords
from labgym.protocols.refusals import Refusals
from labgym.protocols.synthesis.general_procedures import GeneralProcedures
from labgym.protocols.synthesis.operations import Operations
from labgym.protocols.synthesis.transformations import Transformations
from labgym.scenes.tracing import trace
from labgym.suites import Suite
from labgym.table import Table

DOCS = Path(__file__).resolve().parent
README = DOCS.parent / "README.md"
RESULTS = DOCS / "results.md"
POLICIES = DOCS.parent / "policies"
FRONT_ROWS = 5
"""Number of policies in the README's table of LabNav."""

FRONT_COLUMNS = ("Policy", "Knows", "LabNav ↑", "Touched ↓")
"""Columns of the README's table of LabNav."""

FLOOR_FIELDS = (Floor, Wall, Opening, Space, Column, Service, KeepOut)
"""Classes whose fields docs/layouts.md lists."""

SHOWN_SETS = ("touchstone", "paper")
"""Rule sets in the table of the published rooms."""

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

FILM = {
    "people": (VAL, "floors-val-0009/0", 33),
    "glass": (VAL, "floors-val-0008/2", 30),
    "aisle": (VAL, "floors-val-0002/0", 75),
    "moved": (VAL, "floors-val-0000/0", 12),
    "carry": (VAL, "floors-val-0001/1", 0),
    "dock": (VAL, "floors-val-0004/0", 34),
    "odometry": (VAL, "floors-val-0000/1", 45),
    "shift": (MINI, "floors-val-0005/0", 20),
}
"""The README's film by task: suite, episode, and the control step at which its shot begins."""
FILM_SIZE, FILM_STEPS, FILM_STRIDE, FILM_RATE = (640, 360), 90, 6, 20 / 3
"""Size in pixels, control steps of a shot, steps between two pictures, and pictures per second."""
FILM_POLICY = "stack"

USES = {
    "laboratory": "#fff4d8",
    "instrument": "#dcecff",
    "store": "#e4e4e4",
    "write-up": "#e2f6e2",
    "corridor": "#f2ecfa",
}
PARTS = {"wall": "#484848", "pane": "#40a0e0", "sill": "#90b8d0", "leaf": "#c06030", "column": "#202020"}
"""Colors of spaces by use, and of solid parts, in the plans of floors."""

SECTION = re.compile(r"^Attributes:\n((?:(?: {4}.*)?\n)+)", re.MULTILINE)
FIELD = re.compile(r"^ {4}([A-Za-z_][\w, ]*): (.*(?:\n {5,}.*)*)", re.MULTILINE)
INLINE = re.compile(r"(?<=\.) ([a-z_]\w*(?:, [a-z_]\w*)*): ")
"""The section of a class's docstring that describes its fields, a description in it, and a further one in its line."""

MARKS = "<!-- {name}: begin -->", "<!-- {name}: end -->"
DOCUMENTS: tuple[type[Document], ...] = (
    AssetFile,
    Annotation,
    Lookalikes,
    NameTable,
    Reactivity,
    Substructures,
    Protocol,
    ExperimentFile,
    Layout,
    RoomFile,
    FloorFile,
    Inventory,
    Answers,
    FloorPack,
    Commitment,
    FreshReceipt,
    Manifest,
    Trace,
    Suite,
    LayoutReport,
    LayoutSummary,
    NavigationSummary,
    Comparison,
    LabNavResult,
    Lab30Result,
    PublishedFigures,
    RecordedReply,
    Words,
    ProcedureWords,
    Vocabulary,
    Operations,
    GeneralProcedures,
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
    return f"# LabPointNav\n\n{text}\n\n## LabFloorNavGoal-v0\n\n{more}\n"


def pages() -> dict[Path, str]:
    """Return the contents of all generated files by path."""
    tables = {
        README: {"results of LabNav": front_table()},
        RESULTS: {
            "results of LabNav": results_tables(),
            "results of lab30": lab30_table(),
            "correlation of tasks": correlations(),
            "nuisances": nuisance_table(),
        },
        DOCS / "metrics.md": {"rules": rule_table(safety=False)},
        DOCS / "safety-rules.md": {"rules": rule_table(safety=True)},
        DOCS / "layouts.md": {"floor": field_table(FLOOR_FIELDS), "placements": field_table([Placement])},
        DOCS / "language-models.md": {"settings": setting_table()},
        DOCS / "training-data.md": {"steps": column_list(steps_schema), "episodes": column_list(episodes_schema)},
        DOCS / "schemas.md": {"schemas": schema_table()},
        DOCS / "specifications.md": {"specifications": specification_table(), "attributes": attribute_table()},
        DOCS / "floors.md": {"tables": parameter_tables()},
        DOCS / "moving-parts.md": {"tables": moving_tables()},
        DOCS / "classical-policies.md": {"LabNav": classical_table()},
        DOCS / "labnav-tasks.md": {
            f"reward of {labnav_id(task)}": reward_table(labnav_id(task)) for task in FIGURE_TASKS
        },
    }
    files = {DOCS / "environment.md": environment_page(LabPointNavEnv, LabFloorNavGoalEnv)}
    files |= {DOCS / "environments" / f"{name}.md": id_page(name) for name in presets()}
    for page, blocks in tables.items():
        text = page.read_text(encoding="utf-8")
        for name, block in blocks.items():
            text = with_tables(text, block, name)
        files[page] = text
    return files | {card: headed(card.read_text(encoding="utf-8")) for card in sorted(POLICIES.glob("*/CARD.md"))}


def markdown(columns: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table of Markdown whose cells may hold Markdown."""
    lines = [columns, ["---"] * len(columns), *rows]
    return "\n".join(f"| {' | '.join(cells)} |" for cells in lines)


def fields(docstring: str) -> dict[str, str]:
    """Return the descriptions in the section "Attributes" of a class's docstring, by name of the field."""
    section = SECTION.search(inspect.cleandoc(docstring) + "\n")
    described = {}
    for first, text in FIELD.findall(section[1] if section else ""):
        parts = [first, *INLINE.split(" ".join(text.split()))]
        for names, description in zip(parts[::2], parts[1::2], strict=True):
            described |= dict.fromkeys(names.split(", "), description)
    return described


def field_table(classes: Sequence[type[BaseModel]]) -> str:
    """Return the table of the fields of classes, with their choices or defaults and their descriptions."""
    rows = []
    for model in classes:
        summary = " ".join(inspect.cleandoc(model.__doc__ or "").partition("\n\n")[0].split())
        rows.append((f"**{model.__name__}**", "", summary))
        described = fields(model.__doc__ or "")
        for name, field in model.model_fields.items():
            choices = typing.get_args(field.annotation) if typing.get_origin(field.annotation) is Literal else ()
            plain = isinstance(field.default, bool | int | float | str) and field.default != ""
            default = f"{field.default:g}" if isinstance(field.default, float) else str(field.default)
            rows.append(
                (f"`{name}`", ", ".join(map(str, choices)) or (default if plain else ""), described.get(name, ""))
            )
    return markdown(("field", "values or default", "meaning"), rows)


def setting_table() -> str:
    """Return the table of the environment variables of language models."""
    described = fields(LanguageModelConfig.__doc__ or "")
    rows = []
    for name, field in LanguageModelConfig.model_fields.items():
        default = (
            "required"
            if field.is_required()
            else ""
            if field.default is None or name == "api_key"
            else str(field.default)
        )
        rows.append((f"`{PREFIX}{name.upper()}`", described[name], default))
    return markdown(("variable", "meaning", "default"), rows)


def column_list(schema: Callable[..., object]) -> str:
    """Return the list of columns in the docstring of the function that makes a schema."""
    return inspect.cleandoc(schema.__doc__ or "").partition("\n\n")[2]


def rule_table(safety: bool) -> str:
    """Return the table of the safety rules, or of the other facility rules."""
    rules = [rule for rule in TOUCHSTONE.facility if (rule.group == "safety") == safety]
    rows = [(f"`{rule.name}`", rule.severity, rule.requires, rule.limit, rule.source) for rule in rules]
    return markdown(("rule", "severity", "requirement", "limit", "source"), rows)


def schema_name(document: type[Document]) -> str:
    """Return the name of the file that holds a document's schema on the site, without its suffix."""
    return document.SCHEMA.partition(".")[2].replace("/", "-")


def schema_table() -> str:
    """Return the table of the JSON documents."""
    rows = []
    for document in sorted(DOCUMENTS, key=lambda document: document.SCHEMA):
        summary = inspect.cleandoc(document.__doc__ or "").partition("\n\n")[0]
        rows.append((f"`{document.SCHEMA}`", " ".join(summary.split()), f"`{document.__module__}.{document.__name__}`"))
    return markdown(("schema", "document", "class"), rows)


def specification_table() -> str:
    """Return the table of the specifications of assets."""
    fields = Specifications.model_fields.items()
    rows = [(f"`{name}`", quantity(name)[1] or "-", str(field.description)) for name, field in fields]
    return markdown(("specification", "unit", "meaning"), rows)


def attribute_table() -> str:
    """Return the table of the custom attributes of USD files, apart from specifications."""
    shown = [each for each in ATTRIBUTES if not each.name.startswith("specs:")]
    rows = [(f"`{each.full_name}`", each.type_name, each.meaning) for each in shown]
    return markdown(("attribute", "type", "meaning"), rows)


def front_table() -> str:
    """Return the README's table of LabNav: the best policies, with few columns."""
    results = published_results()
    if not results:
        return "No results are published yet."
    table = published_table(results, published_rounds())
    chosen = [table.columns.index(name) for name in FRONT_COLUMNS]
    rows = tuple(tuple(row[index] for index in chosen) for row in table.rows[:FRONT_ROWS])
    return Table("", FRONT_COLUMNS, rows).markdown()


def rooms_table() -> str:
    """Return the table of the published rooms under every rule set, with the paper's row."""
    layouts = [load_published(split, name) for split in ("val", "test") for name in published(split)]
    columns = ("Obj", "OB", "CN", "Asset", "Step nav", "Prot nav", "Flam", "Store", "Incomp", "Glass")
    rows = []
    for name in SHOWN_SETS:
        reports = [score(layout, rules=name) for layout in layouts]
        table = layout_table(aggregate(reports), name)
        headings = [heading.split(" ↑")[0].split(" ↓")[0] for heading in table.columns]
        shown = [headings.index(column) for column in columns]
        valid = sum(report.v == 0 for report in reports)
        mean = sum(report.v for report in reports) / len(reports)
        rows.append((f"`{name}`", f"{valid} of {len(reports)}", f"{mean:.2f}", *(table.rows[0][i] for i in shown)))
    paper = (table.rows[1][0], "-", "-", *(table.rows[1][i] for i in shown))
    return markdown(("rule set", "v = 0", "mean v", *columns), [*rows, paper])


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
    return published_table(results, published_rounds()).markdown() if results else "No results are published yet."


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
        for table in PublishedFigures.load(path).tables
    }
    if not policies:
        return "No figures are published yet."
    keys = [("with", "{}"), ("without", "{} without"), ("difference", "{} difference")]
    names = dict.fromkeys(name for lines in policies.values() for name in lines)
    missing = FigureCell(value=None)
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


def film_pictures(tasks: Iterable[str] = FILM) -> Iterator[Picture]:
    """Yield the pictures of the README's film, a shot of each task after the other."""
    for task in tasks:
        suite, key, first = FILM[task]
        part, episode, seconds = published_episode(suite, f"{task}-{HEADLINE}/{key}")
        shown = drive_again(FILM_POLICY, part, episode, seconds=seconds)
        yield from episode_film(shown, *FILM_SIZE, steps=range(first, first + FILM_STEPS, FILM_STRIDE))


def main() -> int:
    """Write or check the generated files and return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true")
    parser.add_argument("--rooms", action="store_true")
    parser.add_argument("--floors", action="store_true")
    parser.add_argument("--pictures", action="store_true")
    parser.add_argument("--labnav", nargs="*", choices=list(EPISODES))
    parser.add_argument("--film", action="store_true")
    arguments = parser.parse_args()
    if arguments.floors:
        draw_families(DOCS / "pictures" / "floors.png")
    if arguments.pictures:
        draw_laboratories(DOCS / "pictures")
    if arguments.labnav is not None:
        draw_episodes(DOCS / "pictures", arguments.labnav)
    if arguments.film:
        save_film(film_pictures(), DOCS / "pictures" / "labnav.webp", FILM_RATE)
    files = pages()
    if arguments.rooms:
        table = rooms_table()
        files |= {page: with_tables(files[page], table, "results of layouts") for page in (README, RESULTS)}
    stale = [path for path, text in files.items() if not path.is_file() or path.read_text(encoding="utf-8") != text]
    for path in stale:
        print(f"{'stale' if arguments.check else 'written'}: {path.relative_to(DOCS.parent)}")
        if not arguments.check:
            write_text(path, files[path])
    return int(arguments.check and bool(stale))


if __name__ == "__main__":
    sys.exit(main())
