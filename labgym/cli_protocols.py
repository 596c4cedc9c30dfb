"""The commands about protocols: listing, showing, validating."""

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
