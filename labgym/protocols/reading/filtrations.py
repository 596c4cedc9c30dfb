"""Filtrations: which part goes on, by what is done to which part in the sentences that follow.

A filtration is read when its clause is; which part it keeps often stands behind it ("and filtered. The filtrate was
evaporated"). Where both parts go on, or nothing says which one does, the filtration is reported as unread.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from itertools import takewhile
from typing import Literal

from labgym.protocols.experiments.model import Action, Verb
from labgym.protocols.reading.draft import ActionDraft

KeptPart = Literal["filtrate", "precipitate"]
_FILTRATE = re.compile(r"\b(?:filtrates?|mother liquors?|supernatant)\b")
_SOLID = re.compile(r"\b(?:solids?|precipitates?|crystals|cake|filtercake|filter-cake|powder|product)\b")
_LIQUID = re.compile(r"\b(?:solutions?|mixture|solvents?|liquors?|volatiles|\w{5,30} (?:layers?|phases?))\b")
_THROWN = re.compile(
    r"\b(?:(filtrates?|mother liquors?|supernatant)|(?:solids?|precipitates?|cake|filter-cake))"
    r"(?: (?:was|were|is|are))?(?: then)? (?:discarded|rejected|thrown away|disposed of)\b"
)
_CROP = re.compile(
    r"\b(?:(?:second|third) (?:crop|quantity|batch|portion|amount)|(?:further|additional|another|more)"
    r"(?: (?:crop|quantity|batch|portion|amount)| (?:of )?(?:the )?(?:solid|product|material|crystals)| \d))"
)
"""Words for more of a product, from the mother liquor."""
_OF_LIQUIDS: frozenset[Verb] = frozenset((
    "Concentrate", "Extract", "Partition", "PhaseSeparation", "CollectLayer", "DrySolution", "AdjustPH", "Distill",
    "Cool",
))  # fmt: skip
"""Operations that are done to a liquid."""
_OF_SOLIDS: frozenset[Verb] = frozenset((
    "DrySolid", "Recrystallize", "Triturate", "Dissolve", "MakeSolution", "Sublime", "Yield",
))  # fmt: skip
"""Operations that are done to a solid."""
_OF_EITHER: frozenset[Verb] = frozenset(("Wash", "Monitor", "Analyze", "Transfer"))
_UNCLEAR = "which part of the filtration goes on is not clear"


def settle_filtrations(draft: ActionDraft) -> None:
    """Set which part each filtration keeps by what is done after it, and report those where that is not clear."""
    for place, action in enumerate(draft.actions):
        if action.verb != "Filter" or action.keep is None or action.span is None:
            continue
        keep, is_clear = _kept(draft, place)
        if keep != action.keep:
            assumed = tuple(dict.fromkeys((*action.assumed, "keep")))
            draft.actions[place] = action.model_copy(update={"keep": keep, "assumed": assumed})
        if keep == "filtrate":
            _dry_filtrate(draft, place)
        if not is_clear:
            draft.doubt(action.span, _UNCLEAR)


def _dry_filtrate(draft: ActionDraft, place: int) -> None:
    """Let what is washed and dried behind a filtration that keeps the filtrate be dried as a solution."""
    for k in range(place + 1, len(draft.actions)):
        action = draft.actions[k]
        bare = (action.temperature, action.duration, action.pressure, action.atmosphere) == (None,) * 4
        if action.verb == "DrySolid" and bare:
            draft.actions[k] = action.model_copy(update={"verb": "DrySolution"})
        if action.verb not in ("Wash", "Extract", "PhaseSeparation", "CollectLayer"):
            return


def _kept(draft: ActionDraft, place: int) -> tuple[KeptPart, bool]:
    """Return the part that a filtration keeps, and whether that is clear."""
    action = draft.actions[place]
    is_solid_used = washed = False
    if place and draft.actions[place - 1].verb == "Dissolve" and "keep" in action.assumed:
        return "filtrate", True
    for following, words, inside in _after(draft, place):
        thrown = _THROWN.search(words)
        if thrown is not None and not is_solid_used:
            return ("precipitate" if thrown[1] else "filtrate"), True
        if _FILTRATE.search(f"{words} {inside}"):
            crop = _gives_crop(draft, following) or _is_weighed(draft, place, following)
            return ("precipitate", crop) if is_solid_used else ("filtrate", True)
        if following.verb == "Filter":
            break
        if is_solid_used:
            continue
        if following.verb in _OF_EITHER:
            washed = washed or following.verb == "Wash"
            continue
        wording = draft.plain[slice(*(action.span or (0, 0)))]
        off = " off" in wording or not (washed or "collect" in wording)
        if off and following.verb == "Concentrate" and _LIQUID.search(f"{words} {inside}"):
            return "filtrate", True
        part = _used(action, following, words)
        if part == "filtrate":
            return "filtrate", True
        if part is None and "keep" in action.assumed and _is_worked_up(draft, following, words):
            return "filtrate", True
        if part is None:
            return _guessed(action, following, words, washed)
        is_solid_used = True
    return ("filtrate" if action.keep == "filtrate" and not is_solid_used else "precipitate"), True


def _gives_crop(draft: ActionDraft, following: Action) -> bool:
    """Return whether a filtrate gives more of a product whose first part was filtered off."""
    start = 0 if following.span is None else following.span[0]
    return _CROP.search(draft.plain, max(0, start - 120), start + 300) is not None


def _is_weighed(draft: ActionDraft, place: int, following: Action) -> bool:
    """Return whether the solid of a filtration is weighed before its filtrate goes on and gives a product, too."""
    later = draft.actions[place + 1 :]
    between = list(takewhile(lambda item: item is not following, later))
    parts = (between, later[len(between) :])
    return all(any(" g" in item.amount for action in part for item in action.gives) for part in parts)


def _is_worked_up(draft: ActionDraft, following: Action, words: str) -> bool:
    """Return whether a sentence goes on with the liquid: "filtered, diluted with water and extracted"."""
    place = next(k for k, item in enumerate(draft.actions) if item is following)
    later = draft.actions[place + 1].verb if place + 1 < len(draft.actions) else ""
    if any(portion.name.lower().startswith("silica") for portion in following.takes):
        return following.verb == "Add"
    separated = later in ("Extract", "Partition", "PhaseSeparation", "CollectLayer")
    return separated and following.verb in ("Add", "AdjustPH") and not _SOLID.search(words)


def _used(action: Action, following: Action, words: str) -> KeptPart | None:
    """Return the part of a filtration that an action behind it is clearly done to, or None."""
    named = "keep" not in action.assumed
    if _SOLID.search(words) and following.verb != "Crystallize":
        return "precipitate"
    if action.keep == "filtrate":
        return "precipitate" if following.verb == "DrySolid" else "filtrate"
    if following.verb in _OF_SOLIDS or (named and following.verb in ("DrySolution", "Partition")):
        return "precipitate"
    if following.verb == "Crystallize":
        return "precipitate" if following.takes or named else "filtrate"
    if following.verb == "Chromatograph" and not named and words.strip(" ,") in ("", "and", "then"):
        return "filtrate"
    if following.verb in _OF_LIQUIDS and (not named or _LIQUID.search(words)):
        return "filtrate"
    return None


def _guessed(action: Action, following: Action, words: str, washed: bool) -> tuple[KeptPart, bool]:
    """Return the more likely part where an action may be done to either, and whether it is nearly certain."""
    named = "keep" not in action.assumed
    if _LIQUID.search(words):
        return "filtrate", not named
    if named:
        return "precipitate", following.verb not in _OF_LIQUIDS
    return ("precipitate" if washed else "filtrate"), False


def _after(draft: ActionDraft, place: int) -> Iterator[tuple[Action, str, str]]:
    """Yield the actions behind a filtration, each with the words before it, and its own if it is done to a liquid."""
    actions: Sequence[Action] = draft.actions
    own = actions[place].span
    end = 0 if own is None else own[1]
    for following in actions[place + 1 :]:
        start, stop = following.span or (end, end)
        inside = draft.plain[start:stop].lower() if following.verb in _OF_LIQUIDS or following.verb == "Add" else ""
        yield following, draft.plain[min(end, start) : start].lower(), inside
        end = max(end, stop)
