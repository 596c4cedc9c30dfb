"""The scores of many layouts: in shards on any executor, with a row for each layout."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator
from itertools import islice
from pathlib import Path

from labgym.documents import canonical_hash
from labgym.errors import DocumentError, OptionError
from labgym.eval.scoring.judgement import JudgeOptions
from labgym.eval.scoring.layout_report import LayoutReport
from labgym.eval.scoring.score import score
from labgym.layouts.batch import catalog_digest
from labgym.layouts.model import Layout
from labgym.layouts.rules import TOUCHSTONE, RuleSet, rule_set
from labgym.llm import LanguageModel, LanguageModelConfig
from labgym.navigation import resolve_protocol
from labgym.protocols import Protocol
from labgym.runs import ExecutorOptions, RunFolder, RunIdentity, Shard, ShardOutput, run_shards

SCORES = "scores.jsonl"
PER_SHARD = 10
"""Layouts in a shard: a few seconds of work."""

Job = tuple[Layout, Protocol | None]
"""A layout, and the protocol to score it for; None for the layout's own."""
RuleSetName = tuple[str, str]
"""Names of a rule set and of its thresholds."""


def score_layouts(
    layouts: Callable[[], Iterable[Layout]],
    out: str | Path | None = None,
    protocol: Protocol | str | Path | None = None,
    profile: str | None = None,
    executor: ExecutorOptions | None = None,
    fresh: bool = False,
    *,
    progress: bool = True,
    rules: str = TOUCHSTONE.name,
    judge: JudgeOptions | None = None,
) -> Iterator[LayoutReport]:
    """Yield the scores of layouts in their order.

    Args:
        layouts: returns the layouts; called twice if there is a folder, so that not all layouts are in memory at once.
        out: folder for `scores.jsonl`, a report per line; an interrupted command resumes. None keeps the reports in
            memory.
        protocol: a protocol, its id or its .json file; by default the layout's first, if it has one.
        profile: name of the thresholds.
        executor: where layouts are scored; the scores do not depend on it.
        fresh: move the files of the folder aside and start anew.
        progress: whether to show a progress bar.
        rules: name of the rule set.
        judge: how the model that the environment of each worker configures judges the layouts; None for no judge.

    Raises:
        LanguageModelError: a judge, but no model is configured or reachable, or it gives no usable answer.
        UnknownNameError: there is no such rule set or profile.
        OptionError: the folder holds something else or is in use.
        DocumentError: a layout cannot be read, or names an asset or a support that does not exist.
        LabgymError: workers died, or have another version of labgym or another catalog.
    """
    chosen = rule_set(rules, profile)
    model = None if judge is None else LanguageModelConfig.from_environment().model
    jobs = ((layout, _target(layout, protocol)) for layout in layouts())
    guard = {"catalog": catalog_digest}
    if out is None:
        parts = {}
        shards = _shards(jobs, chosen, judge)
        for shard, output in run_shards(shards, None, executor, "score", "layout", guard, progress=progress):
            parts[shard.name] = output.files[_part(shard.name)]
        yield from (_report(line, "score") for name in sorted(parts) for line in parts[name].splitlines())
        return
    identity, count = _identity(layouts(), protocol, chosen, judge, model)
    with RunFolder.open(out, identity, fresh) as folder:
        if not folder.finished:
            names = []
            shards = _shards(jobs, chosen, judge)
            run = run_shards(shards, folder, executor, "score", "layout", guard, total=count, progress=progress)
            for shard, _ in run:
                names.append(shard.name)
            folder.finish({SCORES: ((folder.path / _part(name)).read_bytes() for name in sorted(names))})
    yield from read_scores(out)


def read_scores(folder: str | Path) -> Iterator[LayoutReport]:
    """Yield the reports in the `scores.jsonl` of a folder in their order.

    Raises:
        OptionError: the folder has no scores.
        DocumentError: a line is broken.
    """
    path = Path(folder) / SCORES
    if not path.is_file():
        raise OptionError(f"{folder} holds no scores: {SCORES} is missing; run labgym score --out again")
    with path.open("rb") as stream:
        for number, line in enumerate(stream, start=1):
            yield _report(line, f"{path}:{number}")


def score_shard(name: str, jobs: tuple[Job, ...], rules: RuleSetName, judge: JudgeOptions | None = None) -> ShardOutput:
    """Return the file of a shard: a report per line."""
    reports = (report.to_json() for report in _reports(jobs, rule_set(*rules), judge))
    lines = (json.dumps(report, ensure_ascii=False, allow_nan=False) for report in reports)
    return ShardOutput({_part(name): "".join(f"{line}\n" for line in lines).encode()})


def _reports(jobs: tuple[Job, ...], rules: RuleSet, judge: JudgeOptions | None) -> Iterator[LayoutReport]:
    if judge is None:
        yield from (score(layout, protocol, rules) for layout, protocol in jobs)
        return
    from labgym.eval.scoring.judge import Judge  # imported here because it loads the renderer

    with LanguageModel.from_environment() as model:
        for layout, protocol in jobs:
            yield Judge(model, judge).completed(score(layout, protocol, rules), layout, protocol)


def _shards(jobs: Iterator[Job], rules: RuleSet, judge: JudgeOptions | None) -> Iterator[Shard]:
    index = 0
    while batch := tuple(islice(jobs, PER_SHARD)):
        inputs = [[layout.id, layout.hash] for layout, _ in batch]
        arguments = (f"{index:07d}", batch, (rules.name, rules.profile.name), *(() if judge is None else (judge,)))
        yield Shard(f"{index:07d}", score_shard, arguments, len(batch), inputs)
        index += 1


def _identity(
    layouts: Iterable[Layout],
    protocol: Protocol | str | Path | None,
    rules: RuleSet,
    judge: JudgeOptions | None,
    model: str | None,
) -> tuple[RunIdentity, int]:
    """Return the identity of the scores and the number of layouts."""
    names, target = [], None
    for layout in layouts:
        names.append([layout.id, layout.hash])
        chosen = _target(layout, protocol)
        target = None if chosen is None else canonical_hash(chosen.to_json())
    identity = RunIdentity.of(
        "score",
        layouts=canonical_hash(names),
        count=len(names),
        protocol=target,
        rules=rules.name,
        profile=rules.profile.name,
        catalog=catalog_digest(),
        **({} if judge is None else {"judge": [model, judge.label, judge.samples]}),
    )
    return identity, len(names)


def _target(layout: Layout, protocol: Protocol | str | Path | None) -> Protocol | None:
    return None if protocol is None else resolve_protocol(layout, protocol)


def _part(name: str) -> str:
    return f"shards/{name}.jsonl"


def _report(line: bytes, source: str) -> LayoutReport:
    try:
        data = json.loads(line)
    except ValueError as error:
        raise DocumentError(source, "", f"not valid JSON ({error})") from None
    return LayoutReport.parse(data, source)
