"""The library of the rule set labbuilder, which commands take by an option."""

from __future__ import annotations

from typing import TYPE_CHECKING

from labgym.errors import OptionError

if TYPE_CHECKING:
    from labgym.paper.labbuilder_rules.library import Library

LABBUILDER = "labbuilder"
"""Rule set of the evaluator that LabBuilder's authors released."""


def flag_library(name: str | None) -> Library:
    """Return the library of the option --library, which the rule set labbuilder requires.

    Raises:
        OptionError: it is not given.
        DocumentError: the file is broken.
    """
    from labgym.paper.labbuilder_rules.library import open_library

    if name is None:
        raise OptionError(
            "--rules labbuilder takes sizes and flags from a library: add --library FILE, LabBuilder's "
            "assets_annotated.json, or --library catalog for labgym's own"
        )
    return open_library(name)
