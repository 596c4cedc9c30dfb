"""Remarks: what a file format has no field for, in a text field of the format, so that an import reads it back.

A remark is a word, a JSON object and perhaps a note: `Wash {"keep": "organic"}: until neutral`. The word is the verb of
an action, or `PORTION` for a material.
"""

from __future__ import annotations

import json
from collections.abc import Collection
from typing import Any, get_args

from labgym.protocols.experiments.model import Action, Portion, Verb

PORTION = "Portion"
BEFORE = "before"
"""Entry for actions before the first that takes a material."""
_HEADS = frozenset((*get_args(Verb), PORTION))
_OF_THE_TEXT = {"verb", "takes", "gives", "then", "span", "assumed", "note"}
"""Fields that are exported in other ways, or that refer to the text that an action was read from."""
MAX_LENGTH = 20_000


def write_remark(action: Action, expressed: Collection[str], implied: Verb | None, **more: Any) -> str:
    """Return the remark on an action; its note alone if the format expresses everything else.

    Args:
        action: the action.
        expressed: names of its fields that the format has fields for.
        implied: verb that the format expresses.
        more: further entries of the JSON object.
    """
    rest = action.model_dump(mode="json", exclude_defaults=True, exclude={*_OF_THE_TEXT, *expressed}) | more
    if action.verb == implied and not rest:
        return action.note
    return _written(action.verb, rest) + (f": {action.note}" if action.note else "")


def write_portion(portion: Portion, amount: str) -> str:
    """Return the remark on a material whose amount a format expresses as a text; "" if nothing is missing there."""
    rest = portion.model_dump(exclude_defaults=True, include={"solvent"})
    rest |= {"amount": portion.amount} if portion.amount != amount else {}
    return _written(PORTION, rest) if rest else ""


def read_remark(text: str) -> tuple[str, dict[str, Any], str]:
    """Return the word, the entries and the note of a remark; a text that is none is all note, with the word ""."""
    head, _, rest = text.partition(" ")
    if head not in _HEADS or not rest.startswith("{") or len(text) > MAX_LENGTH:
        return "", {}, text
    try:
        fields, end = json.JSONDecoder().raw_decode(rest)
    except (ValueError, RecursionError):
        return "", {}, text
    return head, fields, rest[end:].removeprefix(": ")


def _written(head: str, fields: dict[str, Any]) -> str:
    return f"{head} {json.dumps(fields, ensure_ascii=False)}"
