"""The commands about protocols: listing, showing, validating, searching, writing."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated

from tyro.conf import Positional, arg

from labgym import protocols as library
from labgym.assets import Catalog
from labgym.cli.group import CommandGroup
from labgym.cli.outcome import DONE, findings, written
from labgym.errors import MissingDependencyError, OptionError, UnknownNameError
from labgym.protocols import Protocol, ReactionType
from labgym.protocols.experiments import Experiment, Rejection
from labgym.protocols.importers import Format
from labgym.protocols.synthesis import Writer

protocols_app = CommandGroup("show")


@protocols_app.command
def show(name: Positional[str | None] = None, validate: Path | None = None) -> int:
    """List the protocols, show one, or validate a protocol in a file.

    Args:
        name: Id of a protocol; nothing lists all.
        validate: A protocol's .json file, put through the validation suite; exit 1 where something is wrong.
    """
    from labgym.cli.describe import protocol_details, protocol_table

    if validate:
        return findings([f"{f.message}; {f.suggestion}" for f in library.validate(Protocol.load(validate))])
    print(protocol_details(library.get(name)) if name else protocol_table(library.protocols().values()))
    return DONE


@protocols_app.command
def search(text: Positional[str], count: int = 5, keyword_only: bool = False) -> int:
    """Find the fragments of the library that are nearest to a text in English or Chinese.

    Args:
        text: What to look for.
        count: How many fragments, at most one a source.
        keyword_only: Leave the sentence embeddings out.
    """
    from labgym.cli.describe import search_results
    from labgym.protocols.retrieval import search as retrieve

    print(search_results(retrieve(text, count, keyword_only)))
    return DONE


@protocols_app.command
def new(
    text: Positional[str], out: Path = Path(), keyword_only: bool = False, model: bool = False, repairs: int = 3
) -> int:
    """Write a protocol for a description in English or Chinese; what it assumes is told on standard error.

    A description that names unknown substances, no reaction, or something dangerous is refused and nothing is written.

    Args:
        text: What is to be done, such as "Reduce benzophenone with NaBH4 in methanol at 0 C for 30 min".
        out: A .json file, or a folder for a file named after the protocol.
        keyword_only: Search the library without sentence embeddings.
        model: Have the language model that the environment names write it, in place of templates.
        repairs: How often what the model wrote goes back to it with its faults.
    """
    from labgym.protocols.synthesis import synthesize

    made = synthesize(text, _model_writer(repairs) if model else None, keyword_only)
    for remark in (*made.notes, *(f"advice: {line}" for line in made.advice)):
        print(f"labgym: {remark}", file=sys.stderr)
    return written(made.protocol.save(out if out.suffix == ".json" else out / f"{made.protocol.id}.json"))


@protocols_app.command
def check(protocol: Positional[Annotated[str, arg(metavar="PROTOCOL")]]) -> int:
    """Examine whether a protocol is complete, safe, and within what its equipment can do; exit 1 where it is not.

    Faults cannot or must not be done so; advice can be done better and leaves the exit code at 0.

    Args:
        protocol: Id of a protocol, or a protocol's .json file.
    """
    examined = library.examine(Protocol.load(protocol) if protocol.endswith(".json") else library.get(protocol))
    lines: dict[str, list[str]] = {"fault": [], "advice": []}
    for finding in examined:
        lines[finding.severity].append(f"{finding.severity}: {finding.message}; {finding.suggestion} [{finding.rule}]")
    return findings(lines["fault"], lines["advice"])


@protocols_app.command
def experiments(name: Positional[str | None] = None, type: ReactionType | None = None, check: bool = False) -> int:  # noqa: A002
    """List the experiments of the library, show one, or check that all are complete and consistent.

    Args:
        name: Id of an experiment; nothing lists all.
        type: List those of a reaction type alone.
        check: Check completeness, and amounts against molar mass and density; exit 1 where something is wrong.
    """
    from labgym.cli.describe import experiment_details, experiment_table
    from labgym.protocols.experiments import experiments as every
    from labgym.protocols.experiments import get
    from labgym.protocols.experiments.checks import check as faults

    chosen = [get(name)] if name else [item for item in every().values() if type in (None, item.reaction_type)]
    if check:
        return findings([f"{item.id}: {fault}" for item in chosen for fault in faults(item)])
    print(experiment_details(chosen[0], Catalog.load()) if name else experiment_table(chosen))
    return DONE


@protocols_app.command
def stage(
    experiment: Positional[str],
    path: Path | None = None,
    type: ReactionType | None = None,  # noqa: A002
    out: Path = Path(),
) -> int:
    """Make an experiment a protocol: its actions get places and apparatus, and the whole passes every check.

    Args:
        experiment: Id of an experiment.
        path: A file or folder of experiments that it is in; by default the published library.
        type: Type of reaction, for an imported experiment that does not say; else its equation tells (extra chem).
        out: A .json file, or a folder for a file named after the protocol.
    """
    from labgym.protocols.experiments import get, read_experiments
    from labgym.protocols.synthesis.staging import stage as staged

    if path is None:
        chosen = get(experiment)
    else:
        known = {item.id: item for item in read_experiments(path)}
        if experiment not in known:
            raise UnknownNameError("experiment", experiment, known)
        chosen = known[experiment]
    made = staged(chosen.model_copy(update={"reaction_type": type or _type_of(chosen)}))
    return written(made.save(out if out.suffix == ".json" else out / f"{made.id}.json"))


def _type_of(experiment: Experiment) -> ReactionType | None:
    """Return the type of an experiment; one that is proposed from its equation is told, without RDKit there is none."""
    from labgym.protocols.experiments.reaction_types import typed

    if experiment.reaction_type is not None:
        return experiment.reaction_type
    try:
        proposed = typed(experiment.reaction)
    except MissingDependencyError:
        return None
    if proposed is None:
        return None
    print(f"labgym: {experiment.id} is taken for {proposed.reaction_type}: {proposed.why}", file=sys.stderr)
    return proposed.reaction_type


@protocols_app.command(name="import")
def import_(
    path: Positional[Path],
    format: Format,  # noqa: A002
    out: Path,
    limit: int | None = None,
    feasible: bool = False,
    replace: bool = False,
) -> int:
    """Import experiments from the file formats of others; what cannot be used is listed with the reason.

    Args:
        path: A file, or a folder of files.
        format: openexp (ReactXT), chemtrans (also ChemActor), ord (Open Reaction Database, extra ord) or xdl.
        out: Folder for files of a thousand experiments and rejected.csv.
        limit: How many records to read, at most.
        feasible: Keep only what the catalogue's reagents and equipment can do, under the catalogue's names.
        replace: Write over an earlier import in that folder.
    """
    from itertools import islice

    from labgym.protocols.importers import read

    if limit is not None and limit < 1:
        raise OptionError(f"--limit is {limit}; read at least 1 record, or leave it out to read all")

    return _collected(islice(read(path, format), limit), out, feasible, replace)


@protocols_app.command(name="filter")
def filter_(path: Positional[Path | None] = None, out: Path | None = None, replace: bool = False) -> int:
    """Say which experiments the catalogue's reagents and equipment can do, and what stands against the others.

    Args:
        path: A file or folder of experiments; by default the published library.
        out: Folder for those that can be done and rejected.csv with the reason for each of the others.
        replace: Write over what is in that folder.
    """
    from labgym.cli.describe import verdict_table
    from labgym.protocols.experiments import experiments as every
    from labgym.protocols.experiments import read_experiments
    from labgym.protocols.experiments.feasibility import FeasibilityFilter

    chosen = read_experiments(path) if path else tuple(every().values())
    if out is not None:
        return _collected(iter(chosen), out, True, replace)
    feasibility = FeasibilityFilter()
    print(verdict_table([feasibility.judge(experiment) for experiment in chosen]))
    return DONE


def _collected(records: Iterator[Experiment | Rejection], out: Path, feasible: bool, replace: bool) -> int:
    """Write records to a folder, tell what became of them, and return the exit code."""
    from tqdm import tqdm

    from labgym.protocols.experiments.collection import REJECTED, collect, filtered
    from labgym.protocols.experiments.feasibility import FeasibilityFilter

    shown = tqdm(records, "read", unit="record")
    tally = collect(filtered(shown, FeasibilityFilter()) if feasible else shown, out, replace)
    why = ", ".join(f"{count} {kind}" for kind, count in tally.reasons.most_common())
    print(f"{tally.kept} experiments kept, {tally.rejected} turned down" + (f": {why}; see {REJECTED}" if why else ""))
    return written(out)


def _model_writer(repairs: int) -> Writer:
    from labgym.llm import LanguageModel
    from labgym.protocols.synthesis.llm_writer import LanguageWriter

    return LanguageWriter(LanguageModel.from_environment(), repairs)
