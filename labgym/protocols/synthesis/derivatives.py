"""Names that a prefix or suffix makes another substance: N-Boc-piperidine, toluene-d8, Et3N·HCl, deuterated ethanol."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence

from labgym.protocols.language import Mention
from labgym.protocols.language.vocabulary import is_ordinary

_GROUPS = r"Boc|Cbz|Fmoc|Alloc|Troc|TBS|TBDMS|TBDPS|TIPS|TMS|PMB|Trt|MOM|MEM|THP|SEM|Teoc|Dmb|Pbf|Mtr|Bn"
_PREFIX_RUN = re.compile(r"[A-Za-z0-9\[\]()'′,.%·•–-]{0,40}(?:[-–·•]|\])$")
_SUFFIX_RUN = re.compile(r"[-–·•][A-Za-z0-9\[\]()'′,·•–-]*[A-Za-z0-9\])]")
_MARKER = re.compile(
    rf"\d[\d,'′]*|[A-Za-z]|(?:[A-Za-z],?\d*')+|[dDtT]\d+|\d+[A-Z][a-z]?\d*|{_GROUPS}|Ac|Bz|Ts|Ms|Tf|Me|Et|Pr|Bu|Ph|"
    r"iso|tert|sec|neo|cis|trans|rac|endo|exo|syn|anti|meso|alpha|beta|gamma|ortho|meta|para|bis|tris|"
    r"(?:per)?deuter\w*|[a-z]*(?:yl|oxy|ylidene)|(?:chloro|bromo|iodo|fluoro|nitro|amino|hydroxy|cyano|oxo|thio|aza)"
)
"""A part of a name: a locant, an isotope, a protecting group, a radical, a stereodescriptor."""
_CONCENTRATION = re.compile(r"\d+(?:\.\d+)?(?:%|M|N|mL|g|mmol|equiv|eq)|conc|dil|sat|aq|anh", re.IGNORECASE)
_QUALIFIED = re.compile(
    rf"(?:(?<![A-Za-z0-9-])(?:[NOS]-)?(?:{_GROUPS})(?:[- ]protected)?|"
    r"\b(?:per|poly|mono)?(?:deuter|triti|isotop)\w*|"
    r"[\w-]{1,40}-(?:bound|supported|protected|substituted|label+ed|enriched|functionali[sz]ed|tethered))[ -]$"
)
"""Words before a name that make it another substance: "Boc piperidine", "deuterated toluene", "silica-supported"."""
_SALT = re.compile(r"(?:x|\d+(?:\.\d+)?)?\(?(?:HCl|HBr|HI|HF|TFA|TsOH|AcOH|HOAc|H2SO4|BH3|SO3)\)?\d?")
_WATER = re.compile(r"(?:[xn]|\d+(?:\.\d+)?)?(?:H2O|water|hydrate)")
_BASIC_NAME = re.compile(r"(?:ine|idine|DMAP|DBU|N)$")


def derivatives(text: str, mentioned: Sequence[Mention]) -> Iterator[tuple[int, int]]:
    """Yield the spans of names that contain a reagent's name and mean another substance.

    Mixtures ("THF-water"), hydrates and ordinary compounds ("phenol-based", "half-saturated brine") are left out.
    """
    reagents = [mention for mention in mentioned if mention.kind == "reagent"]
    for mention in reagents:
        start = _begin(text, mention, reagents)
        end = _end(text, mention, reagents)
        if start < mention.start or end > mention.end:
            yield start, end


def _begin(text: str, mention: Mention, reagents: Sequence[Mention]) -> int:
    """Return where the longer name begins, or where the mention does."""
    qualified = _QUALIFIED.search(text, max(0, mention.start - 40), mention.start)
    if qualified is not None:
        return qualified.start()
    run = _PREFIX_RUN.search(text, max(0, mention.start - 40), mention.start)
    if run is None or not run[0]:
        return mention.start
    start = run.start() + len(run[0]) - len(_opened(run[0]))
    neighbor = next((other for other in reagents if start < other.end <= mention.start), None)
    parts = [part for part in re.split(r"[-–·•]", text[start : mention.start]) if part]
    if not parts or neighbor is not None:
        return mention.start
    strange = any(_is_strange(part) for part in parts if not _CONCENTRATION.fullmatch(part))
    return start if strange else mention.start


def _opened(run: str) -> str:
    """Return a run of characters without an opening bracket that it does not close, and what is before it."""
    while any(run.count(left) > run.count(right) for left, right in ("()", "[]")):
        run = run[min(place for place in (run.find("("), run.find("[")) if place >= 0) + 1 :]
    return run


def _is_strange(part: str) -> bool:
    stripped = part.strip("()[],.'")
    return _MARKER.fullmatch(stripped) is not None or "[" in part or not is_ordinary(part)


def _end(text: str, mention: Mention, reagents: Sequence[Mention]) -> int:
    """Return where the longer name ends, or where the mention does."""
    run = _SUFFIX_RUN.match(text, mention.end)
    if run is None:
        return mention.end
    suffix = run[0][1:]
    if _WATER.fullmatch(suffix):
        return mention.end
    is_salt = _SALT.fullmatch(suffix) is not None and (run[0][0] in "·•" or _BASIC_NAME.search(mention.text))
    neighbor = any(mention.end < other.start <= mention.end + 2 for other in reagents)
    if is_salt:
        return run.end()
    if neighbor:
        return mention.end
    parts = [part for part in re.split(r"[-–·•]", suffix) if part]
    return run.end() if any(_is_strange(part) for part in parts) else mention.end
