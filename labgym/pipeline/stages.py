"""The stages of a run: layouts, the small suite of LabNav, plans with routes, rendered views, tables and the report."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from labgym.documents import json_bytes, write_bytes
from labgym.errors import OptionError
from labgym.eval import score
from labgym.eval.drawing.pictures import picture_bytes, topdown, view_bytes
from labgym.eval.drawing.plan_drawing import DrivenPath
from labgym.eval.driving.episode_row import LabNavRow
from labgym.eval.driving.files import EPISODES, SUMMARY, read_records
from labgym.eval.labnav.foresight import track_of
from labgym.eval.labnav.suites import CHECK, MINI_GOALS, MINI_SECONDS, LabNavSuite, load_labnav
from labgym.eval.labnav.summary import summarise
from labgym.eval.labnav.together import FOLDER, drive_together
from labgym.eval.leaderboard.lab30 import published_lab30
from labgym.eval.leaderboard.labnav import agreement, published_results
from labgym.eval.leaderboard.receipts import published_rounds
from labgym.eval.leaderboard.tables import published_table
from labgym.eval.reports.report import write_tables
from labgym.eval.reports.results import ResultsFolder
from labgym.eval.reports.run_report import result_tables, run_entries, run_site
from labgym.eval.reports.site.page import write_site
from labgym.eval.reports.tables import leaderboard
from labgym.layouts import Layout, generate, load_published
from labgym.layouts.batch import catalog_digest
from labgym.layouts.splits import manifest
from labgym.pipeline.config import LABNAV, SHOWN
from labgym.policies.process import PolicyProcess, PolicySource
from labgym.protocols import Protocol, protocols, resolve
from labgym.runs import ExecutorOptions, RunFolder, Shard, ShardOutput, run_shards
from labgym.scenes.files import mjcf_files
from labgym.table import Table, number

SPLIT = "test"
"""The published split that a run without a seed takes."""


@dataclass(frozen=True)
class LayoutJob:
    """A layout to load or to generate.

    Attributes:
        seed: seed to generate the layout with in the default room; None loads the published layout of that id.
        profile: thresholds that the layout is scored by, and generated with.
        published: hash of the published layout; None for a new one.
    """

    id: str
    protocol: Protocol
    seed: int | None
    profile: str
    published: str | None = None

    @property
    def inputs(self) -> dict[str, Any]:
        """The job as JSON data."""
        fields = {name: getattr(self, name) for name in ("id", "seed", "profile", "published")}
        return {**fields, "protocol": self.protocol.to_json()}

    @property
    def file(self) -> str:
        """Path of the layout relative to the run's folder."""
        return f"layouts/{self.id}.json"


def layout_jobs(seed: int | None, profile: str, only: Sequence[str] = ()) -> tuple[LayoutJob, ...]:
    """Return the jobs of a run: new layouts if there is a seed, else the published test layouts.

    Args:
        profile: thresholds that layouts are scored by, and new ones are generated with.
        only: ids or .json files of the protocols; empty for the whole library.

    Raises:
        OptionError: a protocol is not in the library and there is no seed, or two protocols have the same id.
        UnknownNameError: the library has no protocol of an id.
        DocumentError: a file is not a protocol.
    """
    chosen = [resolve(name) for name in only or protocols()]
    by_id = {protocol.id: protocol for protocol in chosen}
    if len(by_id) != len(chosen):
        raise OptionError(f"protocols {', '.join(only)} have the ids {', '.join(sorted(by_id))}: give each id once")
    if seed is not None:
        return tuple(LayoutJob(f"{name}-{seed}"[:80], by_id[name], seed, profile) for name in sorted(by_id))
    unpublished = [name for name, protocol in by_id.items() if protocols().get(name) != protocol]
    if unpublished:
        raise OptionError(f"protocol {unpublished[0]!r} has no published layout: give --seed to generate one")
    return tuple(
        LayoutJob(entry.id, by_id[entry.protocol], None, profile, entry.hash)
        for entry in manifest(SPLIT).layouts
        if entry.protocol in by_id
    )


def make_layouts(jobs: Sequence[LayoutJob], folder: RunFolder, executor: ExecutorOptions) -> tuple[Layout, ...]:
    """Load or generate the layouts of a run, score and compile them; return the layouts in the order of the jobs."""
    shards = [Shard(f"layout {job.id}", make_layout, (job,), inputs=job.inputs) for job in jobs]
    for _ in run_shards(shards, folder, executor, "layouts   ", guard={"catalog": catalog_digest}):
        pass
    return tuple(Layout.load(folder.path / job.file) for job in jobs)


def make_layout(job: LayoutJob) -> ShardOutput:
    """Return the files of a layout, its score and its scene.

    Raises:
        DocumentError: the published file does not have the manifest's hash.
        InfeasibleError: the room does not hold the protocol.
    """
    if job.seed is None:
        layout = load_published(SPLIT, job.id)
    else:
        layout = generate(job.protocol, job.seed, profile=job.profile).replace(id=job.id)
    files = {job.file: json_bytes(layout.to_json())}
    files[f"scores/{job.id}.json"] = json_bytes(score(layout, profile=job.profile).to_json())
    return ShardOutput(files | {f"scenes/{job.id}/{name}": content for name, content in mjcf_files(layout).items()})


def drive_mini(policies: Sequence[str], folder: RunFolder, executor: ExecutorOptions) -> None:
    """Drive the small suite by all policies, and write summary, rows and routes into the run's folder."""
    suite = load_labnav(CHECK)
    driven = drive_together(policies, suite, folder, executor)
    for policy, (label, files) in zip(policies, driven.items(), strict=True):
        for name, content in files.items():
            write_bytes(folder.path / FOLDER / label / name, content)
        write_mini_summary(policy, label, suite, folder.path / FOLDER / label)


def write_mini_summary(policy: str, label: str, suite: LabNavSuite, folder: Path) -> None:
    """Write the summary of a policy's rows into their folder.

    Args:
        policy: name for `make_policy`. label: in the rows. suite: of the rows.
    """
    driver = PolicyProcess(PolicySource.named(policy))
    try:
        facts = {"track": track_of(driver), "sensors": driver.observation, "latency": driver.latency}
    finally:
        driver.close()
    rows = tuple(read_records(folder / EPISODES, LabNavRow).values())
    summarise(suite, rows, policy=label, options={}, seed=0, **facts).save(folder / SUMMARY)


def published_tables(folder: Path) -> tuple[tuple[Table, ...], tuple[str, ...]]:
    """Return the published tables and the check of a run's LabNav drives, with a sentence for each row that differs.

    Args:
        folder: of the run; without drives of LabNav there are no tables.

    Raises:
        DocumentError: a file is broken.
    """
    paths = {path.parent.name: path for path in sorted((folder / FOLDER).glob(f"*/{EPISODES}"))}
    if not paths:
        return (), ()
    published = published_results()
    tables = [published_table(published, published_rounds())] if published else []
    lab30 = published_lab30(SHOWN)
    tables += [leaderboard(lab30)] if lab30 else []
    outcomes = {result.summary.policy: result.by_key for result in published}
    order = [policy for policy in dict.fromkeys((*LABNAV, *paths)) if policy in paths]
    rows = {policy: tuple(read_records(paths[policy], LabNavRow).values()) for policy in order}
    lines: list[tuple[str, ...]] = []
    problems: list[str] = []
    missing: dict[tuple[str, ...], list[str]] = {}
    tasks = list(dict.fromkeys(row.task for own in rows.values() for row in own))
    for policy, own in rows.items():
        result = agreement(own, outcomes.get(policy, {}), MINI_SECONDS)
        problems += result.differing
        if result.compared and result.missing:
            missing.setdefault(result.missing, []).append(policy)
        shares = [_mean([row for row in own if row.task == task]) for task in tasks]
        lines.append((policy, *shares, f"{result.equal} of {result.compared}" if result.compared else "-"))
    notes = (
        f"Mean scores of the first episodes of each task, cut off after {MINI_SECONDS:g} s: too few to compare "
        "policies, they check the installation.",
        "Equal: rows that are those of the published table; - where the policy has none there. Of a shift, its first "
        f"{MINI_GOALS} drives are compared, up to the first one that is cut off.",
        *(
            f"Not compared, for they are not published: {', '.join(each)} of {', '.join(missing[each])}."
            for each in missing
        ),
    )
    mini = Table(f"Check of LabNav, suite {CHECK}", ("Policy", *tasks, "Equal"), tuple(lines), notes)
    return (*tables, mini), tuple(problems)


def _mean(rows: Sequence[LabNavRow]) -> str:
    return number(sum(row.score for row in rows) / len(rows), 2) if rows else "-"


VIEW_SIZE = (1280, 720)
PICTURES, VIEWS = "pictures", "views"
"""Folders of the plans and of the rendered views."""


def draw_pictures(
    results: ResultsFolder, executor: ExecutorOptions, folder: RunFolder | None = None
) -> dict[str, Path]:
    """Draw a plan of every layout with the routes driven in it; return the pictures' paths by layout id.

    Args:
        results: the layouts and routes; the pictures are written into its folder.
        executor: where the plans are drawn.
        folder: the folder of the run, if it is one that is open; its unchanged pictures are not drawn again.
    """
    names = {layout.id: f"{PICTURES}/{layout.id}.png" for layout in results.layouts}
    shards = []
    for layout in results.layouts:
        traces = results.traces(layout)
        inputs = [layout.id, layout.hash, [[trace.policy, trace.success, trace.points.tolist()] for trace in traces]]
        shards.append(Shard(f"picture {layout.id}", _draw, (layout, traces, names[layout.id]), inputs=inputs))
    _write("pictures  ", shards, results.folder, executor, folder)
    return {layout: results.folder / name for layout, name in names.items()}


def render_views(results: ResultsFolder, executor: ExecutorOptions, folder: RunFolder, count: int) -> None:
    """Render `count` layouts, spread evenly over all."""
    count = min(count, len(results.layouts))
    sample = [results.layouts[index * len(results.layouts) // count] for index in range(count)]
    shards = [
        Shard(f"view {layout.id}", _render, (layout, f"{VIEWS}/{layout.id}.png"), inputs=[layout.hash, VIEW_SIZE])
        for layout in sample
    ]
    _write("views     ", shards, results.folder, executor, folder)


def write_results(
    results: ResultsFolder, pictures: dict[str, Path], views: dict[str, Path], first: tuple[Table, ...] = ()
) -> tuple[tuple[Table, ...], list[Path]]:
    """Write the tables as text and Markdown, and the report; return the tables and the paths.

    Args:
        results: the results. pictures, views: by layout id.
        first: tables that come before those of the results.
    """
    tables = (*first, *result_tables(results))
    site = run_site(results, pictures, views, first, run_entries(results.folder))
    page = write_site(site, results.folder / "report.html")
    paths = [*write_tables(tables, results.folder), page]
    return tables, paths


def _write(
    title: str, shards: Sequence[Shard], place: Path, executor: ExecutorOptions, folder: RunFolder | None
) -> None:
    for _, output in run_shards(shards, folder, executor, title):
        for name, content in output.files.items() if folder is None else ():
            write_bytes(place / name, content)


def _draw(layout: Layout, traces: tuple[DrivenPath, ...], name: str) -> ShardOutput:
    return ShardOutput({name: picture_bytes(topdown(layout, layout.protocol, traces))})


def _render(layout: Layout, name: str) -> ShardOutput:
    return ShardOutput({name: view_bytes(layout, "overview", *VIEW_SIZE)})
