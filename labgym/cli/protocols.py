"""The commands about protocols: listing, showing, validating, searching, writing."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

from tyro.conf import Positional, arg

from labgym import protocols as library
from labgym.cli.group import CommandGroup
from labgym.cli.outcome import DONE, findings, written
from labgym.protocols import Protocol
from labgym.protocols.synthesis import Writer

protocols_app = CommandGroup("show")


@protocols_app.command
def show(name: Positional[str | None] = None, validate: Path | None = None) -> int:
    """List the protocols, show one, or validate a protocol in a file.

    Args:
        name: Id of a protocol; nothing lists all.
        validate: A protocol's .json file, put through the validation suite; exit 1 where something is wrong.
    """
    from labgym.describe import protocol_details, protocol_table

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
    from labgym.describe import search_results
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
    given = Protocol.load(protocol) if protocol.endswith(".json") else library.get(protocol)
    found = library.examine(given)
    faults = [f"fault: {f.message}; {f.suggestion} [{f.rule}]" for f in found if f.severity == "fault"]
    for finding in found:
        if finding.severity == "advice":
            print(f"advice: {finding.message}; {finding.suggestion} [{finding.rule}]")
    return findings(faults)


def _model_writer(repairs: int) -> Writer:
    from labgym.llm import LanguageModel
    from labgym.llm.writer import LanguageWriter

    return LanguageWriter(LanguageModel.from_environment(), repairs)
