"""Surveys: how many experiments a laboratory can carry out, and which purchases would add most."""

from __future__ import annotations

import io
import json
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, ClassVar

from pydantic import Field

from labgym.assets import Catalog
from labgym.documents import Document, Record, json_bytes
from labgym.protocols.experiments.library import experiment_files
from labgym.protocols.experiments.model import ExperimentFile
from labgym.protocols.experiments.needs import Alternatives, NeedsFinder, Shortfall
from labgym.runs import ExecutorOptions, RunFolder, RunIdentity, Shard, ShardOutput, run_shards
from labgym.runs.manifest import file_digest
from labgym.table import Table

SURVEY, PICTURE, NEEDS = "survey.json", "survey.png", "needs.jsonl"
PURCHASES = 12
"""Number of purchases that a survey proposes."""
Count = Annotated[int, Field(ge=0)]


class Purchase(Record):
    """Something to buy, after everything before it in the list.

    Attributes:
        name: asset of the catalog, or the name of a substance that the catalog lacks.
        kind: "instrument", "reagent" or "substance" (not in the catalog).
        adds: experiments that become possible with it and everything before it.
        possible: experiments that are possible then.
        lacking: experiments that lack it now, perhaps among other things.
    """

    name: str
    kind: str
    adds: Count
    possible: Count
    lacking: Count


class Survey(Document):
    """The share of a collection of experiments that a laboratory can carry out, and the best purchases.

    Attributes:
        laboratory: file of the laboratory.
        experiments: number of experiments.
        possible: how many of them the laboratory can carry out.
        lacking: how many lack something that can be bought, and nothing else.
        flawed: how many no purchase makes possible, by kind of obstacle; an experiment may have several.
        purchases: the best purchases, each after those before it.
    """

    SCHEMA: ClassVar[str] = "labgym.survey/1"

    laboratory: str
    experiments: Count
    possible: Count
    lacking: Count
    flawed: dict[str, Count]
    purchases: tuple[Purchase, ...]

    def table(self) -> Table:
        """Return the purchases as a table."""
        rows = [("as it is", "-", "-", "-", str(self.possible))]
        rows += [
            (f"+ {item.name[:60]}", item.kind, str(item.lacking), str(item.adds), str(item.possible))
            for item in self.purchases
        ]
        share = 100.0 * self.possible / max(self.experiments, 1)
        flawed = ", ".join(f"{count} {code}" for code, count in sorted(self.flawed.items()))
        return Table(
            f"{self.laboratory} can carry out {self.possible} of {self.experiments} experiments ({share:.1f}%)",
            ("purchase", "kind", "lack it", "adds", "possible"),
            tuple(rows),
            (
                "Each purchase comes after those above it; it adds the experiments that then lack nothing.",
                *((f"No purchase helps (an experiment may have several reasons): {flawed}.",) if flawed else ()),
            ),
        )


def survey(
    path: str | Path,
    laboratory: str,
    names: Sequence[str],
    out: str | Path,
    *,
    catalog: Catalog | None = None,
    executor: ExecutorOptions | None = None,
    fresh: bool = False,
    progress: bool = True,
) -> Survey:
    """Survey the experiments of a file or folder; an interrupted survey resumes after its finished files.

    The folder receives `survey.json`, `survey.png` and `needs.jsonl`, with what each experiment lacks.

    Args:
        path: file or folder of experiments, such as an import.
        laboratory: its name in the result.
        names: assets that the laboratory has.
        out: folder of the survey.
        catalog: everything that could be bought; by default the loaded catalog.
        executor: where the files are surveyed.
        fresh: move the files of the folder aside and start anew.
        progress: whether to show a progress bar.

    Raises:
        OptionError: the folder is in use, or holds another survey or other files.
        DocumentError: the path holds no experiments.
    """
    catalog = Catalog.load() if catalog is None else catalog
    files = experiment_files(path)
    owned = tuple(sorted(set(names)))
    identity = RunIdentity.of(
        "survey",
        laboratory=laboratory,
        names=list(owned),
        files={file.name: file_digest(file) for file in files},
        catalog=catalog.digest,
    )
    shards = [Shard(f"{number:05d}", survey_file, (number, file, owned, catalog)) for number, file in enumerate(files)]
    with RunFolder.open(out, identity, fresh) as run:
        if not run.finished:
            for _ in run_shards(shards, run, executor, "survey", "file", progress=progress):
                pass
            run.finish(_outputs(run, len(files), laboratory, catalog))
        return Survey.load(run.path / SURVEY)


def survey_file(number: int, file: Path, names: tuple[str, ...], catalog: Catalog) -> ShardOutput:
    """Return what each experiment of a file lacks, one per line."""
    finder = NeedsFinder(catalog, names)
    lines = []
    for experiment in ExperimentFile.load(file).experiments:
        needs = finder.find(experiment)
        lines.append(json.dumps({"id": experiment.id, **asdict(needs)}, ensure_ascii=False))
    return ShardOutput({_part(number): "".join(f"{line}\n" for line in lines).encode()})


def _part(number: int) -> str:
    return f"shards/{number:05d}.jsonl"


def _outputs(run: RunFolder, files: int, laboratory: str, catalog: Catalog) -> Iterator[tuple[str, bytes]]:
    """Yield the files of a survey, the survey last."""
    content = b"".join((run.path / _part(number)).read_bytes() for number in range(files))
    yield NEEDS, content
    lines = [json.loads(line) for line in content.splitlines()]
    needs = [Shortfall(tuple(tuple(need) for need in line["lacking"]), tuple(line["flaws"])) for line in lines]
    survey = summarized(laboratory, needs, catalog)
    yield PICTURE, _picture(survey)
    yield SURVEY, json_bytes(survey.to_json())


def summarized(laboratory: str, needs: Sequence[Shortfall], catalog: Catalog) -> Survey:
    """Return the survey of experiments with these needs."""
    sound = [set(item.lacking) for item in needs if not item.flaws]
    lacked = Counter(name for item in needs for name in {name for need in item.lacking for name in need})
    possible = sum(not lacking for lacking in sound)
    total, purchases = possible, list[Purchase]()
    remaining = [lacking for lacking in sound if lacking]
    while len(purchases) < PURCHASES and remaining:
        name = _best(remaining)
        remaining = [{need for need in lacking if name not in need} for lacking in remaining]
        adds = sum(not lacking for lacking in remaining)
        remaining = [lacking for lacking in remaining if lacking]
        total += adds
        kind = catalog.get(name).kind if name in catalog else "substance"
        purchases.append(Purchase(name=name, kind=kind, adds=adds, possible=total, lacking=lacked[name]))
    return Survey(
        laboratory=laboratory,
        experiments=len(needs),
        possible=possible,
        lacking=len(sound) - possible,
        flawed=dict(sorted(Counter(code for item in needs for code in item.flaws).items())),
        purchases=tuple(purchases),
    )


def _best(remaining: Iterable[set[Alternatives]]) -> str:
    """Return the purchase that brings the experiments nearest to being possible.

    An experiment that it makes possible counts 1; one with n needs, of which it meets m, counts m / n^2.
    """
    nearer = defaultdict[str, float](float)
    for lacking in remaining:
        for name in {name for need in lacking for name in need}:
            met = sum(name in need for need in lacking)
            nearer[name] += 1.0 if met == len(lacking) else met / len(lacking) ** 2
    return min(nearer, key=lambda name: (-nearer[name], name))


def _picture(survey: Survey) -> bytes:
    """Return the growth of the possible experiments with the purchases as a bar chart, PNG."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    bars = [("as it is", 0, survey.possible)]
    bars += [(f"+ {item.name[:40]}", item.possible - item.adds, item.adds) for item in survey.purchases]
    figure = Figure(figsize=(8.0, 1.2 + 0.32 * len(bars)), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    names, starts, widths = zip(*bars, strict=True)
    places = range(len(bars))
    axes.barh(places, starts, color="#dcdfe3")
    axes.barh(places, widths, left=starts, color="#5f8fae")
    for place, start, width in zip(places, starts, widths, strict=True):
        axes.text(start + width, place, f" {start + width}", va="center", fontsize=8)
    axes.set_yticks(places, names, fontsize=8)
    axes.invert_yaxis()
    axes.set_xlabel(f"experiments that can be carried out, of {survey.experiments}")
    axes.set_title(survey.laboratory, fontsize=10)
    stream = io.BytesIO()
    figure.savefig(stream, format="png", dpi=110, metadata={"Software": None})
    return stream.getvalue()
