"""The study of LabBuilder's own scenes: read, scored, repaired, compiled, driven in and written again."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

from labgym.documents import Record, json_bytes, read_json
from labgym.errors import DocumentError, LabgymError, OptionError
from labgym.eval.driving.drive import drive_layout
from labgym.eval.driving.episode_row import TransitionRow
from labgym.eval.scoring.score import score
from labgym.layouts import Layout, load_published, published
from labgym.layouts.repairs import repair_layout
from labgym.layouts.rules.objective import evaluate_layout
from labgym.layouts.rules.rule_sets import PAPER
from labgym.paper.labbuilder.reading import read_labbuilder
from labgym.paper.labbuilder.routes import PAIRS_FILE, read_goals, route_protocol, usual_places, visited
from labgym.paper.labbuilder.scene_tables import AFTER, BEFORE, POLICY, STATES, SceneRow, State, mean_table, scene_table
from labgym.paper.labbuilder.sizes import SIZES_FILE
from labgym.paper.labbuilder.writing import SCENE_FILE, pairs_data, scene_data, sizes_data
from labgym.paper.labbuilder_rules.inputs import scene_from_file
from labgym.paper.labbuilder_rules.library import CATALOG, Library, open_library
from labgym.paper.labbuilder_rules.quirks import MODES
from labgym.paper.labbuilder_rules.stage import RatedScene, layout_scene
from labgym.paper.labbuilder_rules.verdict import both_modes, quirk_effects, quirk_table, rules_table, verdict_values
from labgym.paper.reproduction.figures import FigureTable, PublishedFigures
from labgym.paper.reproduction.measures import report_metrics
from labgym.paper.reproduction.page import StudySection
from labgym.paper.reproduction.plates import layout_plate
from labgym.paper.reproduction.study import Study, code_facts, rows_output
from labgym.policies.kernels import kernel_mode
from labgym.policies.process import PolicySource, close_shared_process, shared_process
from labgym.protocols import Protocol
from labgym.runs import Shard, ShardOutput
from labgym.runs.manifest import file_digest
from labgym.suites import suite_of

MAX_SCENES = 200
SPLIT = "test"
"""Split of the published layouts that the table shows next to the scenes."""


@dataclass(frozen=True)
class LabBuilderStudy(Study[SceneRow]):
    """The scenes of a folder.

    Attributes:
        folder: with a .json file for each scene, and asset_bboxes.json and goal_pairs.json for all.
        library: file of LabBuilder's assets, or `catalog`; with it, the scenes and the layouts that labgym publishes
            are also evaluated by the rule set `labbuilder`.
    """

    folder: Path
    library: str | None = None
    name: ClassVar[str] = "labbuilder"
    unit: ClassVar[str] = "scene"
    row: ClassVar[type[Record]] = SceneRow

    def scenes(self) -> tuple[Path, ...]:
        """Return the scene files of the folder, sorted.

        Raises:
            OptionError: it has no scene, or too many.
        """
        names = (SIZES_FILE, PAIRS_FILE)
        files = [path for path in sorted(self.folder.glob("*.json")) if path.name not in names]
        scenes = tuple(path for path in files if _is_scene(path))
        if not scenes:
            raise OptionError(f"{self.folder} has no scene of LabBuilder: a .json file with a list of objects")
        if len(scenes) > MAX_SCENES:
            raise OptionError(f"{self.folder} has {len(scenes)} scenes, expected at most {MAX_SCENES}")
        return scenes

    def inputs(self) -> dict[str, Any]:
        """Return the hashes of the files."""
        shared = [path for name in (SIZES_FILE, PAIRS_FILE) if (path := self.folder / name).is_file()]
        library = self.library
        return {
            "scenes": {path.name: file_digest(path) for path in (*self.scenes(), *shared)},
            "policy": POLICY,
            "library": library if library in (None, CATALOG) else file_digest(Path(str(library))),
        }

    def shards(self) -> Sequence[Shard]:
        """Return a shard for each scene, and with a library for each published layout."""
        scenes = [Shard(path.stem, measure_scene, (path, self.library)) for path in self.scenes()]
        if self.library is None:
            return scenes
        return [*scenes, *(Shard(name, measure_published, (name, self.library)) for name in published(SPLIT))]

    def figures(self, rows: Sequence[SceneRow]) -> PublishedFigures:
        """Return the table of the scenes as they are and repaired, with the paper's means."""
        close_shared_process()  # Of the policy, if the scenes ran in this process.
        of_labgym = [row for row in rows if row.published]
        rows = [row for row in rows if not row.published]
        read = [row for row in rows if row.error is None]
        summary = [
            f"{len(read)} of {len(rows)} scenes were read; "
            f"hard violations {_sum(read, BEFORE, 'v')} before and {_sum(read, AFTER, 'v')} after the repair, feasible "
            f"transitions {sum(row.feasible_before for row in read)} and {sum(row.feasible_after for row in read)} of "
            f"{sum(row.transitions for row in read)}; {POLICY} reaches {sum(row.reached for row in read)} of "
            f"{sum(row.driven for row in read)} goals in the repaired scenes, "
            f"{sum(row.touching for row in read)} drives touch something."
        ]
        summary += [f"{row.scene} failed: {row.error}" for row in rows if row.error is not None]
        return PublishedFigures(
            study=self.name,
            title="Scenes of LabBuilder",
            source="Table 2",
            summary=tuple(summary),
            facts={
                "rules": "paper, profile default",
                "scenes": ", ".join(row.scene for row in rows),
                "repair": "as labgym repair, rule adjuster",
                "policy": POLICY,
                **code_facts(),
            },
            tables=(mean_table(read), scene_table(read), *self._rules_tables(read, of_labgym)),
        )

    def _rules_tables(self, scenes: Sequence[SceneRow], layouts: Sequence[SceneRow]) -> tuple[FigureTable, ...]:
        """Return scenes and published layouts under both rule sets and modes, and what each quirk is worth."""
        groups = {name: rows for name, rows in (("scenes", scenes), ("published layouts", layouts)) if rows}
        if self.library is None or not groups:
            return ()
        title = open_library(self.library).title
        lines = {}
        for name, rows in groups.items():
            lines[f"{name}, paper"] = [row.before for row in rows]
            lines |= {f"{name}, {title}, {mode}": [row.readings[mode] for row in rows] for mode in MODES}
        return (
            rules_table("Both rule sets", lines),
            *(
                quirk_table(f"Quirks of the released evaluator: {name}", [row.readings for row in rows], f"quirks-{n}")
                for n, (name, rows) in enumerate(groups.items(), 1)
            ),
        )

    def sections(self, rows: Sequence[SceneRow], folder: Path) -> Sequence[StudySection]:
        """Return the plans of each scene before and after the repair, and the notes of the import."""
        plates = []
        for row in rows:
            if row.error is not None or row.published:
                continue
            for state in STATES:
                layout = Layout.load(folder / _file(row.scene, state))
                plates.append(layout_plate(f"{row.scene}, {state} the repair", layout, layout.protocol))
        notes = tuple(f"{row.scene}: {'; '.join(row.notes)}." for row in rows if row.notes)
        return (
            StudySection(
                "Before and after the repair", ("Red: hard violations, with their numbers.",), plates=tuple(plates)
            ),
            StudySection("Assumptions of the import", notes),
        )


def measure_published(name: str, library: str) -> ShardOutput:
    """Return the row of a layout that labgym publishes, under the rule sets `paper` and `labbuilder`."""
    layout = load_published(SPLIT, name)
    assets = open_library(library)
    before = report_metrics(score(layout, rules=PAPER, contacts=False))
    readings = _readings(layout_scene(layout, assets), assets)
    return rows_output(name, [SceneRow(scene=name, published=True, before=before, readings=readings)])


def _readings(scene: RatedScene, library: Library) -> dict[str, dict[str, float | None]]:
    modes = both_modes(scene, library)
    return verdict_values({**modes, **quirk_effects(scene, library, modes["literal"])})


def measure_scene(path: Path, library: str | None = None) -> ShardOutput:
    """Return the row of a scene, both layouts, and the repaired scene in LabBuilder's form."""
    try:
        row, files = _measured(path)
        if library is not None:
            assets = open_library(library)
            row = row.model_copy(update={"readings": _readings(scene_from_file(path, assets), assets)})
    except LabgymError as error:
        row, files = SceneRow(scene=path.stem, error=str(error)[:500]), {}
    return rows_output(path.stem, [row], files)


def _measured(path: Path) -> tuple[SceneRow, dict[str, bytes]]:
    imported = read_labbuilder(path, skip_unknown=True)
    bare = imported.layout
    places = visited(bare, read_goals(path.with_name(PAIRS_FILE), path.stem)) or usual_places(bare)
    protocol = route_protocol(bare, places)
    before = bare if protocol is None else bare.replace(protocols=(protocol,))
    after = repair_layout(before, protocol, PAPER).layout
    drives = _driven(after) if protocol is not None and protocol.moves else []
    written = {SCENE_FILE: scene_data(after), SIZES_FILE: sizes_data(after), PAIRS_FILE: pairs_data(after)}
    poses = {placement.id: (placement.position, placement.yaw) for placement in before.placements}
    row = SceneRow(
        scene=path.stem,
        query=str(bare.provenance.options.get("query", ""))[:500],
        objects=len(bare.placements),
        notes=tuple(note for note in imported.notes if not note.startswith("no protocol")),
        route=places,
        before=report_metrics(score(before, protocol, rules=PAPER)),
        after=report_metrics(score(after, protocol, rules=PAPER)),
        transitions=_transitions(before, protocol)[0],
        feasible_before=_transitions(before, protocol)[1],
        feasible_after=_transitions(after, protocol)[1],
        driven=len(drives),
        reached=sum(drive.success for drive in drives),
        touching=sum(drive.contacts > 0 for drive in drives),
        moved=sum(poses.get(each.id) != (each.position, each.yaw) for each in after.placements),
    )
    files = {
        _file(path.stem, state): json_bytes(one.to_json()) for state, one in zip(STATES, (before, after), strict=True)
    }
    files |= {f"labbuilder/{path.stem}/{name}": json_bytes(data) for name, data in written.items()}
    return row, files


def _driven(layout: Layout) -> list[TransitionRow]:
    """Return the drives of the policy between the places of a scene; its process stays open for the next scene."""
    process = shared_process(PolicySource.named(POLICY, {}), None, kernel_mode(None).environment)
    return [drive.row for drive in drive_layout(process, layout, suite_of([layout]), POLICY, 0)]


def _transitions(layout: Layout, protocol: Protocol | None) -> tuple[int, int]:
    """Return the number of transitions, and of those with a path."""
    moves = evaluate_layout(layout, protocol, navigation=True, rules=PAPER).transitions or ()
    return len(moves), sum(move.feasible for move in moves)


def _file(scene: str, state: State) -> str:
    return f"layouts/{scene}-{state}.json"


def _is_scene(path: Path) -> bool:
    """Return whether a file is a scene, or cannot be read, which its row then says."""
    try:
        data = read_json(path)
    except DocumentError:
        return True
    return isinstance(data, dict) and isinstance(data.get("objects"), list)


def _sum(rows: Sequence[SceneRow], state: State, metric: str) -> int:
    return sum(int(getattr(row, state).get(metric) or 0) for row in rows)
