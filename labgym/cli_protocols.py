"""The commands about protocols: listing, showing, validating, searching."""

from __future__ import annotations

from pathlib import Path

from tyro.conf import Positional

from labgym import protocols as library
from labgym.cli_group import CommandGroup
from labgym.cli_outcome import DONE, findings
from labgym.protocols import Protocol

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
