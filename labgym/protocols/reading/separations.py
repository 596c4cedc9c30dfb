"""Separations: operations that take something out of the mixture: layers, solids, solvents, water, by-products."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any, Literal

from labgym.protocols.experiments.model import Portion
from labgym.protocols.reading.draft import (
    EXTRACTS,
    LAYERS,
    ActionDraft,
    PhrasedOperation,
    conditions,
    lows,
    with_substances,
)
from labgym.protocols.reading.lexicon import SOLID, SOLUTIONS
from labgym.protocols.reading.mentions import SubstanceMention, TextPhrase
from labgym.protocols.reading.phrases import read_phrases

_COLUMN = re.compile(
    r"\b(?:column|silica|chromatograph\w*|hplc|biotage|flash|tlc|spe|prep(?:lc)?|mplc|combiflash|isco|alumina|sio2)\b",
    re.IGNORECASE,
)
_SOLVENTS = frozenset((
    "solvent", "solvents", "volatiles", "solution", "liquor", "components", "excess", "thf", "ether", "ethanol",
    "methanol", "toluene", "dmf", "water", "acetone", "dichloromethane", "pyridine", "benzene", "chloroform",
    "dioxane", "acetonitrile", "reagent", "tfa", "chloride",
))  # fmt: skip
_NOT_SOLVENT = frozenset((
    "bath", "catalyst", "insolubles", "solid", "solids", "precipitate", "material", "salts", "salt", "crystals",
    "agent", "desiccant", "sulfate", "celite", "impurities", "carbon",
))  # fmt: skip
_UNWANTED = frozenset((
    "catalyst", "agent", "desiccant", "sieves", "impurities", "by-product", "by-products", "byproduct", "byproducts",
    "charcoal", "carbon", "urea", "inorganics", "salts",
))  # fmt: skip
"""Words for a solid that a filtration takes away."""
_WET = frozenset(("Extract", "Partition", "Wash"))
"""Operations behind which two layers are there."""
_UNDISSOLVED = frozenset(("insolubles", "insoluble", "undissolved"))
"""Words for a solid that may be the product or not."""
_REMOVING = re.compile(
    r",? (?:(?:in order |so as )?to (?:remove|eliminate|clarify)|removing)\b|,? (?:(?:was|were) )?(?:and )?discarded\b"
)
"""Words behind a filtration that takes a solid away."""
_SOLVENT_GONE = re.compile(r",? to (?:remove|eliminate) (?:the |most of the )?(?:excess )?\w{3,20}\b")
"""Words behind a distillation that leaves the batch."""
_LIQUIDS = LAYERS | {"fractions", "filtrates", "filtrate", "fraction", "extracts"}
_PLACES = ("lower", "upper", "bottom", "top")
_LIQUID_BATCHES = SOLUTIONS | {"oil", "liquid", "supernatant"}
_DISCARDED = re.compile(r",? ?(?:and )?(?:(?:was|were|is|are) )?(?:then )?(?:discarded|rejected|thrown away)")
_WATER_TRAPS = frozenset(("separator", "trap", "dean-stark"))
_DRYING = frozenset(("vacuum", "vacuo", "air", "oven", "desiccator", "pressure"))


def clear(draft: ActionDraft, operation: PhrasedOperation) -> None:
    """Append an operation that takes no substance: evaporation, distillation, separation, purification, transfer."""
    head, verb, after = operation.head, operation.verb, operation.after
    takes: list[Portion]
    if verb == "Repeat":
        takes = draft.portions(with_substances(after, "with", "using"))
        note = draft.text[slice(*operation.span)]
        if operation.clause.before:
            note = draft.text[operation.clause.before[0].start : operation.span[1]]
        draft.act("Repeat", operation, takes, note=note[:400])
        return
    if verb == "PhaseSeparation" and not _is_on_a_column(operation):
        collect(draft, operation)
        return
    if head.low.startswith(("remov", "elimin", "freed")):
        subject = lows(operation.clause.before) | (set() if head.passive else lows(operation.clause.after[:6]))
        if _is_filtered_off(draft, operation, subject):
            return
        if not _is_evaporated(draft, operation, subject):
            return
    note = ""
    gone = _SOLVENT_GONE.match(draft.plain, operation.span[1]) is not None
    if verb == "Distill" and (gone or _is_solvent_distilled(operation)):
        verb, note = "Concentrate", _taken_off(draft, operation.before)
    if verb in ("Chromatograph", "PhaseSeparation") or (verb == "Purify" and _is_on_a_column(operation)):
        _chromatograph(draft, operation)
        return
    if verb == "Purify" and any("recrystallization" in (*item.nouns, *item.words) for item in operation.phrases):
        verb = "Recrystallize"
    takes = []
    again = head.low.startswith(("azeotrop", "reconc", "coev", "co-ev"))
    if again or (verb == "Concentrate" and with_substances(after, "with")):
        takes = draft.portions(with_substances(after, "with", "from"))
    _charge_subject(draft, operation)
    draft.own_names(operation.phrases)
    if verb != "Wait":
        draft.last_solid = False
        draft.act(verb, operation, takes, note=note or _reached(draft, operation))
        _leave(draft, after)


def _is_filtered_off(draft: ActionDraft, operation: PhrasedOperation, subject: set[str]) -> bool:
    """Append the filtration that removes a solid, and return whether that is all: "after removal of the catalyst"."""
    method = operation.verb == "Filter" and operation.head.method != ""
    dried = draft.last_verb == "DrySolution" and bool(subject & {"sulfate", "sulphate", "agent", "desiccant"})
    alone = dried or ("catalyst" in subject and draft.last_verb != "Filter")
    if not alone and not (method and subject & _NOT_SOLVENT):
        return False
    _filter(draft, operation)
    return method or not subject & {"solvent", "solvents"}


def _leave(draft: ActionDraft, phrases: Sequence[TextPhrase]) -> None:
    """Append what an evaporation leaves, if its mass is stated: "concentrated to a foam (4 g)"."""
    for item in (item for phrase in phrases if phrase.prep in ("to", "as") for item in phrase.substances):
        if item.weak and item.is_measured and not draft.owned[item.start]:
            draft.emit("Yield", (item.start, item.end), gives=(draft.yielded(item),))


def _taken_off(draft: ActionDraft, phrases: Sequence[TextPhrase]) -> str:
    """Return the amounts that a text says are distilled or filtered off, own them, and charge nothing of them."""
    off = [item for phrase in phrases for item in phrase.substances if item.is_measured]
    for phrase in phrases:
        draft.own_names([phrase])
        phrase.substances = []
    for item in off:
        draft.own_all((item, *item.amounts))
    return ", ".join(f"{draft.text[item.start : item.end]}, {item.amounts[0].text}" for item in off)[:400]


def _is_solvent_distilled(operation: PhrasedOperation) -> bool:
    """Return whether something is distilled off and the batch stays: "the solvent was removed by distillation"."""
    head, subject = operation.head, lows(operation.clause.before)
    off = "off" in lows(operation.clause.after[:2]) or head.low.startswith(("remov", "eliminat", "evaporat"))
    return off and (head.passive or head.method != "") and not subject & {"product", "fraction", "residue"}


def _charge_subject(draft: ActionDraft, operation: PhrasedOperation) -> None:
    """Append what the flask holds before an operation, "A (2 g) was distilled", "distillation of the oil (2 g)"."""
    head = operation.head
    if head.word.noun:
        draft.charge([phrase for phrase in operation.after[:1] if phrase.prep in ("", "of") and phrase.is_measured])
    if (head.passive or head.marker in ("", "by")) and not head.low.startswith("remov"):
        draft.charge([phrase for phrase in operation.before if phrase.prep == "" and phrase.is_measured])


def _reached(draft: ActionDraft, operation: PhrasedOperation) -> str:
    """Return the volume to which an evaporation goes, "to 50 mL", or that it takes off, and own it; "" of others."""
    volumes = [item for phrase in operation.after for item in phrase.loose if item.kind == "volume"]
    off = [item for phrase in operation.before for item in phrase.loose if item.kind in ("volume", "parts")]
    if operation.verb not in ("Concentrate", "Distill") or not volumes + off:
        return ""
    draft.own_all(volumes + off)
    return ", ".join([f"to {item.text}" for item in volumes[:1]] + [item.text for item in off])


def _is_on_a_column(operation: PhrasedOperation) -> bool:
    words = " ".join(token.low for token in (*operation.clause.group, *operation.clause.after))
    return bool(_COLUMN.search(words)) or any("gel" in phrase.words for phrase in operation.after)


def _is_evaporated(draft: ActionDraft, operation: PhrasedOperation, subject: set[str]) -> bool:
    """Return whether "removed" means that a solvent is evaporated, not that a bath or a solid is taken away."""
    head = operation.head
    begins = not operation.clause.before and head.place == 0
    if head.marker == "to" and not head.passive and not begins:
        draft.own_names(operation.phrases)
        if draft.last_verb == "Filter":
            note = "; ".join(filter(None, (draft.actions[-1].note, _taken_off(draft, operation.after[:1]))))
            draft.actions[-1] = draft.actions[-1].model_copy(update={"note": note[:400]})
        return False
    if "bath" in subject:
        return False
    named = bool(subject & _SOLVENTS) or any(phrase.substances for phrase in operation.phrases)
    return (named and not subject & _NOT_SOLVENT) or bool(head.method) or head.low == "freed"


def collect(draft: ActionDraft, operation: PhrasedOperation) -> None:
    """Append what separates: layers, one layer, or a solid."""
    head, clause = operation.head, operation.clause
    near = lows(clause.before if head.passive or clause.before else clause.after[:6])
    if not head.passive and not near & (LAYERS | SOLID):
        near |= lows(clause.after[:6])
    draft.own_names(operation.phrases)
    if head.method == "filtration":
        _filter(draft, operation)
        return
    if _is_noted(draft, operation, near):
        return
    layer = _layer(near, operation)
    place = next((word for word in _PLACES if word in near), None)
    is_thrown = _DISCARDED.match(draft.plain, operation.span[1]) is not None
    if near & {"layers", "phases"} or (near & LAYERS and not layer and not place) or {"organic", "aqueous"} <= near:
        draft.act("PhaseSeparation", operation, part=None)
    elif near & LAYERS and is_thrown:
        other = {"organic": "aqueous", "aqueous": "organic"}.get(layer or "")
        draft.act("PhaseSeparation", operation, part=None, keep=other)
    elif near & (LAYERS | EXTRACTS | {"organics"}) or ("fraction" in near and draft.last_verb in _WET):
        note = f"{place} layer" if place else ""
        draft.act("CollectLayer", operation, keep=layer, note=note)
    elif head.low.startswith("decant"):
        kept, is_named = _decanted(draft, near)
        draft.last_solid = kept == "precipitate"
        draft.act("Filter", operation, keep=kept, note="decant", assumed=() if is_named else ("keep",))
    elif near & (SOLID | {"crystal", "product"}):
        _filter(draft, operation)
    elif near & _LIQUID_BATCHES or (head.low in ("separated", "separating") and draft.last_verb in _WET):
        draft.act("CollectLayer" if layer else "PhaseSeparation", operation, part=None, keep=layer)
    elif head.low in ("separated", "separating"):
        _filter(draft, operation)
        if not near & _UNWANTED:
            draft.doubt(operation.span, "whether a layer or a solid is separated is not clear")


def _is_noted(draft: ActionDraft, operation: PhrasedOperation, near: set[str]) -> bool:
    """Return whether what separates is a part of the action before, and note it there: water that boils, fractions."""
    ahead, last = lows(operation.clause.after), draft.last_verb
    if not (last == "Chromatograph" and "fractions" in ahead) and not (
        last in ("Reflux", "Heat", "Wait") and "water" in near and ahead & _WATER_TRAPS
    ):
        return False
    volumes = [item for phrase in operation.after for item in phrase.loose]
    draft.own_all(volumes)
    words = draft.text[operation.span[0] : operation.span[1]]
    note = ", ".join(filter(None, (draft.actions[-1].note, words, *(item.text for item in volumes))))
    draft.actions[-1] = draft.actions[-1].model_copy(update={"note": note[:400]})
    return True


def _decanted(draft: ActionDraft, near: set[str]) -> tuple[Literal["filtrate", "precipitate"], bool]:
    """Return which part of a decantation goes on, as far as its clause says, and whether it names it."""
    if draft.last_verb == "DrySolution":
        return "filtrate", True
    poured_off = bool(near & (_LIQUID_BATCHES | {"solvent", "solvents", "supernatant"})) and "mixture" not in near
    return ("precipitate" if poured_off else "filtrate"), False


def _layer(near: set[str], operation: PhrasedOperation) -> Literal["organic", "aqueous"] | None:
    """Return which layer words name: by "organic" or "aqueous", or by its solvent."""
    if near & {"organic", "organics"}:
        return "organic"
    if near & {"aqueous", "water"}:
        return "aqueous"
    named = [item for phrase in operation.before if phrase.prep == "" for item in phrase.substances]
    return "organic" if near & (LAYERS | SOLUTIONS) and any(not item.weak for item in named) else None


def over(draft: ActionDraft, operation: PhrasedOperation) -> None:
    """Append an operation over or through a solid: drying, filtration, chromatography."""
    steps = {"DrySolution": _dry, "Filter": _filter}
    steps.get(operation.verb, _chromatograph)(draft, operation)


def _dry(draft: ActionDraft, operation: PhrasedOperation) -> None:
    """Append the drying of a solution by an agent, or of a solid."""
    agents = [
        phrase
        for phrase in with_substances(operation.after, "over", "with", "on", "by", "using", "")
        if phrase.prep or not (set(phrase.nouns) & (LAYERS | EXTRACTS | {"solution"}) or phrase.substances[0].weak)
    ]
    if operation.head.marker == "after" and not agents and draft.last_verb in ("DrySolution", "DrySolid"):
        return
    before = lows(operation.clause.before)
    words = before | lows((*operation.clause.group, *operation.clause.after))
    heated = any(item.kind in ("temperature", "pressure") for item in operation.conditions)
    airy = bool(words & _DRYING) or "-" in operation.head.low
    solid = draft.last_solid or bool(before & (SOLID | {"residue", "foam", "powder"}))
    if airy and not agents and before & {"filtrate", "filtrates", "solution", "eluate"}:
        draft.act("Concentrate", operation)
    elif agents and not (solid and airy):
        draft.act("DrySolution", operation, draft.portions(agents))
        draft.last_solid = False
    elif airy or heated or solid:
        draft.own_names(operation.phrases)
        gas: dict[str, Any] = {"atmosphere": "air"} if "air" in words else {}
        draft.act("DrySolid", operation, **gas)
        _weigh(draft, operation)
    else:
        draft.act("DrySolution", operation)


def _filter(draft: ActionDraft, operation: PhrasedOperation) -> None:
    """Append a filtration; the phase that it keeps is assumed if the text does not name it."""
    head, clause = operation.head, operation.clause
    subject = lows(clause.before) | lows(clause.after[:5])
    if head.low.startswith("collect") and subject & _LIQUIDS and not head.method:
        if subject & LAYERS:
            collect(draft, operation)
        return
    aids = with_substances(operation.after, "over", "through", "on", "via", "with", "using")
    is_collected = head.low.startswith(("collect", "isolat", "recover"))
    is_unwanted = bool(subject & _UNWANTED) or head.low.startswith(("remov", "eliminat", "freed"))
    is_product = bool(subject & {"product", "crystals"}) and not subject & _LIQUIDS
    is_unwanted = (is_unwanted and not is_product) or _REMOVING.match(draft.plain, operation.span[1]) is not None
    solid = (is_product or bool(subject & (SOLID | {"crystals"}))) and not subject & _UNDISSOLVED and not is_unwanted
    cleared = (is_unwanted or bool(aids) or draft.last_verb == "DrySolution") and not is_collected and not solid
    draft.own_names([phrase for phrase in operation.phrases if phrase not in aids])
    behind = [token.low for token in clause.after[:2]]
    is_freed = "from" in behind and bool(subject & SOLID)
    is_unwanted, solid = is_unwanted or is_freed, solid and not is_freed
    is_solution = ("solution" in lows(clause.before) or is_freed) and not (solid or is_collected or is_unwanted)
    cleared = cleared or is_solution
    is_named = solid or is_solution or (is_collected and not cleared)
    draft.last_solid = not cleared
    keep = "filtrate" if cleared else "precipitate"
    draft.act("Filter", operation, draft.portions(aids), keep=keep, assumed=() if is_named else ("keep",))
    _weigh(draft, operation)


def _weigh(draft: ActionDraft, operation: PhrasedOperation) -> None:
    """Append the result of an operation that tells what it gives: "was collected by filtration (0.54 g, 90%)"."""
    for phrase in operation.before:
        for item in phrase.substances if set(phrase.nouns) & SOLID else ():
            if {value.kind for value in item.amounts} & {"mass"}:
                draft.emit("Yield", (item.start, item.end), gives=(draft.yielded(item),))
    loose = [item for phrase in operation.after for item in phrase.loose]
    weighed = [item for item in loose if item.kind in ("mass", "substance", "percent")]
    if any(item.kind == "mass" for item in weighed):
        named = [item for phrase in operation.before for item in phrase.substances if not item.is_measured]
        place = named[-1] if named else SubstanceMention(weighed[0].start, weighed[0].end)
        place.amounts = weighed
        draft.emit("Yield", (place.start, weighed[-1].end), gives=(draft.yielded(place),))


def _chromatograph(draft: ActionDraft, operation: PhrasedOperation) -> None:
    """Append a chromatography with its stationary phase and eluents, or add eluents to the one before."""
    head, before, after = operation.head, operation.before, operation.after
    draft.charge([phrase for phrase in before if phrase.prep == "" and phrase.is_measured])
    inner = read_phrases(operation.clause.group) if len(operation.clause.group) > 1 else []
    phrases = [*before, *inner, *after]
    used = [
        phrase
        for phrase in phrases
        if phrase.substances and (phrase.prep != "" or phrase in inner or phrase in after or not head.passive)
    ]
    ratios = [item for phrase in phrases for item in phrase.ratios]
    for phrase in used:
        for item in phrase.substances:
            ratios += [value for value in item.amounts if value.kind == "percent"]
            item.amounts = [value for value in item.amounts if value.kind != "percent"]
    takes = draft.portions(used)
    ratios += [item for phrase in phrases for item in phrase.loose]
    if draft.last_verb == "Chromatograph" and head.low.startswith("elut"):
        last = draft.actions[-1]
        known = {(old.name, old.amount) for old in last.takes} | {(old.name, "") for old in last.takes}
        takes = [*last.takes, *(portion for portion in takes if (portion.name, portion.amount) not in known)]
        draft.own_all(ratios)
        said = ", ".join(dict.fromkeys(draft.text[item.start : item.end] for item in ratios))
        note = "; ".join(filter(None, (last.note, said)))[:400]
        draft.actions[-1] = last.model_copy(update={"takes": tuple(takes)[:30], "note": note})
    else:
        draft.emit("Chromatograph", operation.span, takes, conditions(phrases), phrases, ratios)
