"""Names of substances without an amount are recognized; ordinary words in the same positions are not taken."""

from __future__ import annotations

import json
from pathlib import Path

from every_case import for_each

from labgym.assets import Catalog
from labgym.protocols.synthesis import read

SENTENCES = json.loads((Path(__file__).parent / "names_without_amounts.json").read_text(encoding="utf-8"))
"""By hand: names of substances that the catalog lacks with a sentence each, sentences without such names, and
procedures with all their substances."""
CATALOG = Catalog.load()
LEAST_SHARE = 0.95


def test_nearly_all_names_are_recognized() -> None:
    missed = [
        name for name, text in SENTENCES["names"] if name.lower() not in " ".join(read(text, CATALOG).unlisted).lower()
    ]
    assert len(missed) <= (1.0 - LEAST_SHARE) * len(SENTENCES["names"]), missed


@for_each("text", SENTENCES["ordinary"])
def test_no_ordinary_word_is_taken_for_a_substance(text: str) -> None:
    assert read(text, CATALOG).unlisted == ()


def test_nearly_all_names_in_procedures_are_recognized() -> None:
    missed, total = [], 0
    for text, names in SENTENCES["texts"]:
        description = read(text, CATALOG)
        recognized = [mention.text for clause in description.clauses for mention in clause.mentions]
        recognized += [*description.unlisted, *(description.text[start:end] for start, end in description.products)]
        lowered = " | ".join(recognized).lower()
        missed += [name for name in names if name.lower() not in lowered]
        total += len(names)
    assert len(missed) <= (1.0 - LEAST_SHARE) * total, missed
