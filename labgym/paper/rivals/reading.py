"""Assets that a description names, as retrieval by text finds them."""

from __future__ import annotations

import re
from functools import lru_cache

from labgym.assets import Asset, Catalog
from labgym.protocols import Protocol

LEAST = 4
"""Shortest name in letters that is looked for: shorter ones are abbreviations and parts of words."""
_WORDS = re.compile(r"[A-Z][a-z]+|[A-Z]+(?![a-z])|[a-z]+|\d+")


def description(protocol: Protocol) -> str:
    """Return the natural-language description that Holodeck and SceneWeaver get: name and description, no lists.

    LabBuilder's comparison gives both methods the natural-language descriptions of the experiments (section 4).
    """
    return f"a chemistry laboratory for {protocol.name}. {protocol.description}"


@lru_cache(maxsize=256)
def assets_in(text: str, catalog: Catalog) -> tuple[Asset, ...]:
    """Return the instruments, furniture and reagents that a text names, in the order of the text.

    Names and English synonyms are compared as whole words; of names that share words the longest counts. Plurals count.
    """
    words = _plain(text)
    found: list[tuple[int, int, Asset]] = []
    for form, asset in _forms(catalog):
        start = words.find(form)
        if start >= 0:
            found.append((start, start + len(form), asset))
    chosen: list[tuple[int, int, Asset]] = []
    for start, end, asset in sorted(found, key=lambda hit: (hit[0] - hit[1], hit[0], hit[2].name)):
        if all(end <= other[0] + 1 or start >= other[1] - 1 for other in chosen) and asset not in (
            c[2] for c in chosen
        ):
            chosen.append((start, end, asset))
    return tuple(asset for _, _, asset in sorted(chosen, key=lambda hit: hit[0]))


@lru_cache(maxsize=8)
def _forms(catalog: Catalog) -> tuple[tuple[str, Asset], ...]:
    """Names as they occur in plain text, with their assets; a name of several assets belongs to the first."""
    forms: dict[str, Asset] = {}
    for asset in catalog:
        if asset.variant_of is not None or asset.category in ("opening", "robot"):
            continue
        for name in (asset.name, *asset.synonyms_en):
            form = _plain(name).strip()
            if len(form) >= LEAST:
                forms.setdefault(f" {form} ", asset)
                forms.setdefault(f" {form}s ", asset)
    return tuple(forms.items())


def _plain(text: str) -> str:
    """Lower-case words with single spaces between and around them; CamelCase is split."""
    return f" {' '.join(word.lower() for word in _WORDS.findall(text))} "
