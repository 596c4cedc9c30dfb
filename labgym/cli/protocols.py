"""The commands about protocols and experiments."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, get_args

from tyro.conf import Positional, arg

from labgym import protocols
from labgym.assets import Catalog
from labgym.cli.arguments import THIS_PROCESS, Execution, OptionalPath, OptionalWholeNumber, ProtocolName
from labgym.cli.effects import refuses_idle_flags
from labgym.cli.outcome import DONE, FAILED, complaints, findings, written
from labgym.cli.problems import check_installed
from labgym.cli.saving import Overwrite, save, save_text
from labgym.documents import folder_path
from labgym.errors import OptionError
from labgym.protocols import Protocol, ReactionType
from labgym.protocols.exporters import ExportFormat
from labgym.protocols.importers import Format, ImportSource

if TYPE_CHECKING:
    from labgym.protocols.experiments.collection import Tally
    from labgym.protocols.synthesis import Writer
    from labgym.protocols.synthesis.wishes import Fulfillment


MAX_PATH = 250
"""Longest text that may be the path of a file, characters."""
Description = Positional[Annotated[str, arg(metavar="TEXT")]]
OutputPath = Annotated[Path, arg(help_behavior_hint="(default: the current folder)")]
OptionalType = Annotated[
    ReactionType | None, arg(metavar="{" + ",".join(get_args(ReactionType)) + "}", help_behavior_hint="")
]


@refuses_idle_flags("protocols show")
def show(
    name: Positional[Annotated[str | None, arg(metavar="[PROTOCOL]", help_behavior_hint="")]] = None,
    validate: OptionalPath = None,
) -> int:
    """List the published protocols, show one, or run the validation suite on a file.

    Args:
        name: Id of a published protocol, or the .json file of a protocol. If omitted, all are listed.
        validate: The .json file of a protocol to validate; the exit code is 1 if it violates a rule.
    """
    from labgym.cli.describe import protocol_details, protocol_table

    if validate:
        violations = protocols.validate(Protocol.load(validate))
        return findings([f"{violation.message}; {violation.suggestion}" for violation in violations])
    if name:
        print(protocol_details(protocols.resolve(name)))
    else:
        print(protocol_table(protocols.protocols().values()))
    return DONE


def search(text: Description, count: int = 5, keyword_only: bool = False) -> int:
    """Find the fragments of the library that are nearest to a text in English or Chinese.

    Args:
        text: Text to search for.
        count: Largest number of fragments; each source appears at most once.
        keyword_only: Search by keywords only, without sentence embeddings.
    """
    from labgym.cli.describe import search_results
    from labgym.protocols import retrieval

    print(search_results(retrieval.search(text, count, keyword_only)))
    return DONE


@refuses_idle_flags("protocols new")
def new(
    text: Description,
    *,
    out: OutputPath = Path(),
    keyword_only: bool = False,
    model: bool = False,
    repairs: int = 3,
    explain: bool = False,
    partial: bool = False,
    overwrite: Overwrite = False,
) -> int:
    """Write a protocol for a description in English or Chinese, or for a whole procedure in English.

    Assumptions are printed to stderr. A description that names unknown substances, no reaction, or something dangerous
    is refused. A procedure (sentences with amounts) is read action by action; unread words and gaps are listed
    and set the exit code to 1.

    Args:
        text: Description, such as "Reduce benzophenone with NaBH4 in methanol at 0 C for 30 min", a procedure, or a
            .txt file.
        out: A .json file, or a folder for a file named after the protocol.
        keyword_only: Search the library by keywords only, without sentence embeddings.
        model: Write the protocol with the configured language model instead of templates.
        repairs: How many times a protocol with faults is returned to the model.
        explain: Print the text with what each span became, its actions, stoichiometry and waste, and write no protocol;
            with --out FILE.html, write them as a page.
        partial: Write the protocol of a procedure although something of it is lacking; the protocol names what.
        overwrite: Replace a file that exists with other content.
    """
    text = _text_of(text)
    if explain:
        return _explain(text, out, overwrite)
    from labgym.protocols.synthesis import synthesize
    from labgym.protocols.synthesis.procedures import LONGEST_WISH, compile_procedure, is_procedure

    procedure = not model and is_procedure(text)
    wish = None if model or procedure else _wish(text, partial)
    if wish is not None:
        _remark(wish.notes, wish.advice)
        _name_substances(wish.protocol)
        return _save(wish.protocol, out, overwrite)
    if not procedure or len(text) <= LONGEST_WISH:
        try:
            result = synthesize(text, _model_writer(repairs) if model else None, keyword_only)
        except (protocols.RefusalError, protocols.ProtocolError) as error:
            # A template cannot do everything that a procedure tells; what is dangerous stays refused.
            if not procedure or getattr(error, "reason", "") == "unsafe":
                raise
        else:
            _remark(result.notes, result.advice)
            return _save(result.protocol, out, overwrite)
    compilation = compile_procedure(text, partial)
    _remark(compilation.notes, compilation.advice)
    if compilation.protocol is None:
        remedy = "write them out, or accept a partial protocol with --partial; --explain shows what was understood"
        return complaints([*compilation.lacks, f"no protocol was written: {remedy}"])
    _name_substances(compilation.protocol)
    return _save(compilation.protocol, out, overwrite)


def _wish(text: str, partial: bool) -> Fulfillment | None:
    """Return the protocol of a wish, or None if no general procedure carries it out.

    Raises:
        RefusalError: the wish asks for something dangerous.
    """
    from labgym.protocols.synthesis.wishes import fulfill

    try:
        return fulfill(text.encode(errors="replace").decode(), partial)  # bytes that are no text
    except protocols.RefusalError as error:
        if error.reason == "unsafe":
            raise
    except protocols.ProtocolError:
        pass
    return None


def _text_of(text: str) -> str:
    """Return a text, or the content of the .txt file that it names.

    Raises:
        OptionError: the file does not exist, or cannot be read as UTF-8 text.
    """
    if not text.endswith(".txt") or len(text) > MAX_PATH:
        return text
    if not Path(text).is_file():
        if len(text.split()) > 1:
            return text
        raise OptionError(f"{text} not found: pass the path of a .txt file, or the text itself in quotes")
    try:
        return Path(text).read_text(encoding="utf-8").strip()
    except (OSError, UnicodeDecodeError) as error:
        raise OptionError(f"{text} cannot be read as UTF-8 text ({type(error).__name__}): save it as UTF-8") from None


def _remark(notes: Sequence[str], advice: Sequence[str]) -> None:
    for remark in (*notes, *(f"advice: {line}" for line in advice)):
        print(f"labgym: {remark}", file=sys.stderr)


def _name_substances(protocol: Protocol) -> None:
    """Print what each embedded substance is and what a partial protocol lacks, to stderr."""
    for substance in protocol.substances:
        structure = substance.smiles or ("a listed mixture" if substance.is_classified else "unknown structure")
        doubt = f", {substance.confidence} confidence" if substance.confidence == "low" else ""
        source = f" ({substance.source}{doubt})" if substance.is_classified else ""
        print(
            f"labgym: {substance.names[0]}: {structure}{source}, stored as {substance.storage_class}", file=sys.stderr
        )
    for line in protocol.partial:
        print(f"labgym: partial: {line}", file=sys.stderr)


def _explain(text: str, out: Path, overwrite: bool) -> int:
    """Print what a procedure was understood as, or write it as a page, and return the exit code."""
    from labgym.cli.describe import batch_tables
    from labgym.protocols.reading.explain import explained, explained_html
    from labgym.protocols.reading.reader import read_procedure

    actions = read_procedure(text)
    if out.suffix == ".html":
        return save_text(explained_html(actions), out, overwrite)
    print(explained(actions, color=sys.stdout.isatty()))
    tables = batch_tables(actions.uses(Catalog.load()))
    if tables:
        print(f"\n{tables}")
    return DONE


def score_reading(gold: Positional[Path], texts: OptionalPath = None, differences: bool = False) -> int:
    """Read the texts of a gold file and print how well the actions agree with it.

    Args:
        gold: Gold file, one JSON object a line.
        texts: File of the texts, if the gold holds only their hashes.
        differences: List the tuples and conditions that differ: - of the gold, + read.
    """
    from labgym.protocols.reading.agreement import score
    from labgym.protocols.reading.gold import read_gold
    from labgym.protocols.reading.reader import read_procedure

    result = score((item, read_procedure(item.text)) for item in read_gold(gold, texts))
    print("\n".join([*result.lines(), *(result.differences if differences else ())]))
    return DONE


def check(protocol: ProtocolName) -> int:
    """Check that a protocol is complete, safe, and within the limits of its equipment.

    A fault means that a step cannot or must not be carried out as written, and sets the exit code to 1. Advice names a
    better way and does not change the exit code.

    Args:
        protocol: Id of a published protocol, or the .json file of a protocol.
    """
    lines: dict[str, list[str]] = {"fault": [], "advice": []}
    for finding in protocols.examine(protocols.resolve(protocol)):
        lines[finding.severity].append(f"{finding.severity}: {finding.message}; {finding.suggestion} [{finding.rule}]")
    return findings(lines["fault"], lines["advice"])


@refuses_idle_flags("protocols experiments")
def experiments(
    name: Positional[Annotated[str | None, arg(metavar="[EXPERIMENT]", help_behavior_hint="")]] = None,
    type: OptionalType = None,  # noqa: A002
    check: bool = False,
) -> int:
    """List the experiments of the library, show one, or check all for completeness and consistency.

    Args:
        name: Id of an experiment. If omitted, all are listed.
        type: List only experiments of this reaction type.
        check: Check completeness, and amounts against molar mass and density; the exit code is 1 if a check fails.
    """
    from labgym.cli.describe import experiment_details, experiment_table
    from labgym.protocols.experiments import checks, library

    catalog = Catalog.load()
    chosen = [library.get(name)] if name else library.of_type(type)
    if check:
        return findings([f"{item.id}: {fault}" for item in chosen for fault in checks.check(item, catalog)])
    print(experiment_details(chosen[0], catalog) if name else experiment_table(chosen))
    return DONE


def stage(
    experiment: Positional[Annotated[str, arg(metavar="EXPERIMENT")]],
    path: OptionalPath = None,
    type: OptionalType = None,  # noqa: A002
    out: OutputPath = Path(),
    overwrite: Overwrite = False,
) -> int:
    """Turn an experiment into a protocol: assign places and apparatus to its actions, and check the result.

    Materials that the catalog lacks are embedded in the protocol, with hazards by their structure. Names become
    structures by a published table, the packages chemicals (extra chem) and OPSIN (extra opsin), and the record; a
    substance of unknown structure is kept apart as toxic and flammable.

    Args:
        experiment: Id of an experiment.
        path: File or folder of experiments that contains it. If omitted, the published library.
        type: Reaction type of an experiment that has none. If omitted, it is proposed from the equation (extra chem).
        out: A .json file, or a folder for a file named after the protocol.
        overwrite: Replace a file that exists with other content.
    """
    from labgym.protocols.experiments import library, reaction_types
    from labgym.protocols.substances import Resolver
    from labgym.protocols.synthesis import staging

    chosen = library.get(experiment, path)
    if type is None and chosen.reaction_type is None:
        proposal = reaction_types.propose(chosen.reaction)
        if proposal is not None:
            type = proposal.reaction_type  # noqa: A001
            print(f"labgym: {chosen.id}: reaction type {type}, because {proposal.why}", file=sys.stderr)
    if type is not None:
        chosen = chosen.model_copy(update={"reaction_type": type})
    protocol = staging.stage(chosen, names=Resolver(Catalog.load()))
    _name_substances(protocol)
    return _save(protocol, out, overwrite)


def export(
    protocol: ProtocolName,
    *,
    format: ExportFormat,  # noqa: A002
    path: OptionalPath = None,
    out: OutputPath = Path(),
    overwrite: Overwrite = False,
) -> int:
    """Write a protocol or an experiment in the file format of another program.

    Places and instruments are not exported. What the format has no field for is written as a remark that an import
    reads back; a reaction of the Open Reaction Database has no provenance, which its depositor adds.

    Args:
        protocol: Id of a published protocol or experiment, or the .json file of a protocol.
        format: ord (Open Reaction Database, as JSON), xdl or autoprotocol.
        path: File or folder of experiments, such as an import, that contains the experiment PROTOCOL.
        out: A file, or a folder for a file named after the protocol.
        overwrite: Replace a file that exists with other content.
    """
    from labgym.protocols import exporters
    from labgym.protocols.experiments import library

    if path is not None or protocol in library.experiments():
        experiment = library.get(protocol, path)
    else:
        experiment = exporters.as_experiment(protocols.resolve(protocol))
    suffix = exporters.SUFFIXES[format]
    target = out if out.suffix and suffix.endswith(out.suffix) else folder_path(out) / f"{experiment.id}{suffix}"
    return save_text(exporters.export(experiment, format), target, overwrite)


@refuses_idle_flags("protocols import")
def import_(
    path: Positional[Path],
    *,
    format: Format,  # noqa: A002
    out: Path,
    limit: OptionalWholeNumber = None,
    feasible: bool = False,
    product: Annotated[str, arg(metavar="NAME", help_behavior_hint="")] = "",
    execution: Execution = THIS_PROCESS,
    fresh: bool = False,
) -> int:
    """Import experiments from another file format. Rejected records are listed with the reason.

    The exit code is 1 if no experiment is accepted. A file that cannot be read does not stop the others, and an
    interrupted import resumes after its finished files.

    Args:
        path: A file, or a folder of files.
        format: openexp (ReactXT), chemtrans (also ChemActor), ord (Open Reaction Database, extra ord) or xdl.
        out: Folder for the experiments, up to 1000 per file, and rejected.csv.
        limit: Largest number of records to read.
        feasible: Accept only experiments that the catalog's reagents and equipment can carry out.
        product: Product of XDL files that name none; "{stem}" stands for the name of the file without its suffix.
        fresh: Move the files of the folder aside and start anew.
    """
    from labgym.protocols.importers.run import import_experiments

    if limit is not None and limit < 1:
        raise OptionError(f"--limit is {limit}; read at least 1 record, or leave it out to read all")
    if format == "ord":
        check_installed("google.protobuf", "labgym protocols import --format ord")
    source = ImportSource(path, format, product)
    return _collected(import_experiments(source, out, limit, feasible, execution.options(), fresh), out)


@refuses_idle_flags("protocols filter")
def filter_(
    path: Positional[Annotated[Path | None, arg(metavar="[PATH]", help_behavior_hint="")]] = None,
    out: OptionalPath = None,
    overwrite: Overwrite = False,
) -> int:
    """List which experiments the catalog's reagents and equipment can carry out, and the obstacles to the others.

    Args:
        path: File or folder of experiments. If omitted, the published library.
        out: Folder for the feasible experiments and rejected.csv with the obstacles to the others.
        overwrite: Replace an earlier collection in the folder.
    """
    from labgym.cli.describe import verdict_table
    from labgym.protocols.experiments import feasibility, library

    chosen = library.read_experiments(path) if path else library.of_type(None)
    if out is not None:
        from labgym.protocols.experiments.collection import collect, filtered

        return _collected(collect(filtered(chosen, feasibility.FeasibilityFilter()), out, overwrite), out)
    judge = feasibility.FeasibilityFilter().judge
    print(verdict_table([judge(experiment) for experiment in chosen]))
    return DONE


def survey(
    path: Positional[Annotated[Path, arg(metavar="DATA")]],
    *,
    laboratory: Annotated[Path, arg(metavar="LAYOUT|INVENTORY.csv")],
    out: Path,
    execution: Execution = THIS_PROCESS,
    fresh: bool = False,
) -> int:
    """Count how many experiments a laboratory can carry out, and list the purchases that would add most.

    An interrupted survey resumes after its finished files.

    Args:
        path: File or folder of experiments, such as an import.
        laboratory: The .json file of a layout, or a .csv inventory.
        out: Folder for survey.json, survey.png and needs.jsonl, with what each experiment lacks.
        fresh: Move the files of the folder aside and start anew.
    """
    from labgym.protocols.experiments import survey as surveys

    result = surveys.survey(
        path, laboratory.name, _assets_of(laboratory), out, executor=execution.options(), fresh=fresh
    )
    print(result.table().text())
    return written(out)


def _assets_of(laboratory: Path) -> list[str]:
    """Return the names of the assets of a layout or an inventory.

    Raises:
        OptionError: the file is neither.
    """
    if laboratory.suffix.lower() == ".csv":
        from labgym.exchange.inventory import read_inventory

        counts = read_inventory(laboratory, remark=lambda text: _remark([text], [])).counts
        return [name for name, count in counts.items() if count]
    if laboratory.suffix.lower() != ".json":
        raise OptionError(f"{laboratory} is neither the .json file of a layout nor a .csv inventory")
    from labgym.layouts import Layout

    return [placement.asset for placement in Layout.load(laboratory).placements]


def _collected(tally: Tally, out: Path) -> int:
    """Print how many records were accepted, and return the exit code."""
    reasons = ", ".join(f"{count} {kind}" for kind, count in tally.reasons.most_common())
    print(f"{tally.accepted} experiments accepted, {tally.rejected} rejected" + (f": {reasons}" if reasons else ""))
    if not tally.accepted:
        rejected = out / "rejected.csv"
        print(f"labgym: failed: no experiment was accepted; the reasons are in {rejected}", file=sys.stderr)
        return FAILED
    return written(out)


def _save(protocol: Protocol, out: Path, overwrite: bool) -> int:
    """Save a protocol to a file, or to a folder under its id, print the path, and return the exit code."""
    return save(protocol, out if out.suffix == ".json" else folder_path(out) / f"{protocol.id}.json", overwrite)


def _model_writer(repairs: int) -> Writer:
    from labgym.llm import LanguageModel
    from labgym.protocols.synthesis.llm_writer import LanguageWriter

    return LanguageWriter(LanguageModel.from_environment(), repairs)
