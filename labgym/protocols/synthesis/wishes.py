"""Wishes: one line that names a transformation, substances or their classes, reagents and perhaps a solvent.

A general procedure carries out a wish. The substances of the wish fill its slots; what the wish leaves open is assumed
and named in the notes. A class without a name becomes an unclassified placeholder, which the protocol lists in
`partial`. The product is what the reaction gives.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache

from labgym.assets import Catalog
from labgym.assets.flags import Flag, carried
from labgym.assets.inference.substructures import matches
from labgym.assets.search import normalize
from labgym.assets.structures import standard
from labgym.errors import MissingDependencyError
from labgym.protocols.errors import RefusalError
from labgym.protocols.experiments.grounding import SOLVENTS, WATER
from labgym.protocols.experiments.model import Experiment, Material, Portion
from labgym.protocols.language import language_of
from labgym.protocols.model import Protocol
from labgym.protocols.refusals import (
    refusals,
    refuse_product,
    refuse_structure,
    refuse_structures,
    refuse_to_make,
    refuse_wish,
)
from labgym.protocols.substances import Resolver
from labgym.protocols.substances.opening import PLACEHOLDER, Resolution
from labgym.protocols.substances.sources import physical_data
from labgym.protocols.synthesis.equations import backward, balanced, forward, may_be_product, molar_mass, same
from labgym.protocols.synthesis.general_procedures import ANY, GeneralProcedure, Slot, general_procedures
from labgym.protocols.synthesis.staging import stage
from labgym.protocols.synthesis.wish_amounts import MMOL, StatedWish, scaled_actions, stated_wish, with_amounts
from labgym.protocols.synthesis.wish_mentions import STRENGTH, Mention, is_qualifier, is_transformation, mentions_of
from labgym.protocols.validate import examine

_SEVERAL = re.compile(r"\b(?:followed by|and then|subsequent|(?:two|three|four|multi)-step)\b", re.IGNORECASE)
MAX_WISH = 500
"""Most characters of a wish."""
LEAST_HEATED_C, MOST_COOLED_C = 40.0, 10.0
"""Temperatures from which a mixture counts as heated, and up to which as cooled, degrees Celsius."""
VIOLENT: tuple[Flag, ...] = ("explosive", "oxidizer", "pyrophoric", "water_reactive", "active_metal")
"""Flags of substances that react only by a general procedure for them."""


@dataclass(frozen=True)
class Fit:
    """A general procedure with what fills its slots, by key; "S" is the solvent.

    Attributes:
        structures: SMILES by key. product: SMILES.
        counts: molecules of each substrate in a balanced equation, by key; 1 if it lacks.
        unread: words that have no effect. echoes: phrases that are taken to say again what something else says.
    """

    procedure: GeneralProcedure
    filled: dict[str, Mention]
    score: float
    structures: dict[str, str]
    product: str = ""
    named_product: Mention | None = None
    unread: tuple[str, ...] = ()
    echoes: tuple[str, ...] = ()
    counts: dict[str, int] = field(default_factory=dict)


@dataclass(frozen=True)
class Fulfillment:
    """The protocol of a wish, with assumptions and hazards, one sentence each, and the advice of the examination."""

    protocol: Protocol
    notes: tuple[str, ...]
    advice: tuple[str, ...]


def fulfill(text: str, partial: bool = False, names: Resolver | None = None) -> Fulfillment:
    """Write the protocol of a wish by the general procedure that fits best.

    Args:
        text: one English line; amounts and conditions in it replace those of the general procedure.
        partial: whether a protocol is written although words have no effect on it; its `partial` names them.
        names: says what the names mean; by default with all sources that are installed.

    Raises:
        RefusalError: no procedure takes everything that the wish names, or it asks for something dangerous.
        ProtocolError: the protocol breaks rules.
    """
    refuse_wish(text)
    refuse_structures(text)
    if len(text) > MAX_WISH or language_of(text) != "en":
        raise RefusalError("language", f"a wish is one English line of at most {MAX_WISH} characters")
    wish = stated_wish(text)
    resolver = names if names is not None else Resolver(Catalog.load())
    mentions = with_amounts(wish, mentions_of(wish.text, resolver))
    used = [(m.start, m.end) for m in mentions if m.part != "product" and m.meaning is not None and _is_sold(m.meaning)]
    refuse_product(text, used)
    for mention in mentions:
        if mention.smiles and mention.meaning is not None and not _is_sold(mention.meaning):
            refuse_structure(mention.smiles)
    fits = [fit for item in general_procedures().procedures for fit in _fits(item, wish.text, mentions, resolver)]
    if not fits:
        named = ", ".join(repr(mention.text[:60]) for mention in mentions) or "no substance"
        steps = "; write a wish for each step" if _SEVERAL.search(text) else ""
        raise RefusalError("no-reaction", f"no general procedure takes what the text names ({named}){steps}")
    best = max(fits, key=lambda fit: fit.score)
    experiment, notes = _experiment(text, best, wish, resolver)
    refuse_to_make(experiment.name, experiment.product, filter(None, [best.product]))
    unread = [f"unread: {word!r} has no effect on the general procedure" for word in best.unread]
    if unread and not partial:
        raise RefusalError(
            "unaccounted", f"{best.procedure.name}: {'; '.join(unread)}: leave it out, or accept it with --partial"
        )
    if best.procedure.losses is not None:
        unread.append("no general procedure covers this reaction: solvent, temperature and time are placeholders")
    protocol = stage(experiment, names=resolver, partial=unread)
    _refuse_hazards(best, protocol, resolver)
    advice = tuple(f"{finding.message}; {finding.suggestion}" for finding in examine(protocol))
    return Fulfillment(protocol, notes, advice)


def _refuse_hazards(fit: Fit, protocol: Protocol, resolver: Resolver) -> None:
    """Raise an error if a solvent that the wish names, or an operation without a reaction, meets what it must not meet.

    Raises:
        RefusalError: names both.
    """
    item, stated = fit.procedure, fit.filled.get("S")
    solvent = stated.meaning.asset if stated is not None and stated.meaning is not None else ""
    if item.dry and solvent in refusals().protic:
        raise RefusalError("unsafe", f"{item.name} tolerates no {solvent}: name an aprotic solvent")
    assets = protocol.assets(resolver.catalog)
    uses = [(use, assets.get(use.name).hazards) for use in protocol.reagents]
    handled = item.type is None
    oxidizers = [use.name for use, hazards in uses if hazards.oxidizer or (handled and hazards.explosive)]
    if (
        oxidizers
        and solvent
        and solvent != WATER
        and assets.get(solvent).hazards.flammable
        and not _is_usual(fit, solvent)
    ):
        raise RefusalError(
            "unsafe", f"{oxidizers[0]} must not meet {solvent}, which is flammable: leave the solvent out"
        )
    others = [use.name for use, hazards in uses if use.role == "reactant" and not hazards.oxidizer]
    if item.losses is not None:
        violent = [use.name for use, _ in uses if any(carried(assets.get(use.name)).get(f) for f in VIOLENT)]
        if violent:
            raise RefusalError("unsafe", f"no general procedure covers a reaction of {violent[0]}: write a procedure")
    if handled and oxidizers and (others or not item.id.startswith("solution")):
        raise RefusalError("unsafe", f"{item.name}: {oxidizers[0]} is an oxidizer or explosive; write a procedure")


def _is_usual(fit: Fit, solvent: str) -> bool:
    return solvent in _accepted((fit.procedure.solvent,), Catalog.load())


def _is_sold(meaning: Resolution) -> bool:
    return bool(meaning.asset) or (meaning.listed is not None and meaning.listed.sold)


def _fits(item: GeneralProcedure, text: str, mentions: Sequence[Mention], resolver: Resolver) -> Iterator[Fit]:
    """Yield the best way in which the substances of a wish fill the slots of a procedure, if there is one."""
    spans = [m.span() for m in re.finditer(rf"(?<![\w-])(?:[CNOS]-)?(?:{item.words})(?![\w-])", text, re.IGNORECASE)]
    if item.named and not spans:
        return
    owned = [m for m in mentions if any(start <= m.start and m.end <= end for start, end in spans)]
    handled = item.type is None
    products = [m for m in mentions if m.part == "product" and m not in owned and not (handled and m.meaning)]
    rest = [m for m in mentions if m not in products and m not in owned]
    for score, filled in sorted(_assignments(item, rest, resolver, bool(spans)), key=lambda pair: -pair[0])[:1]:
        fit = _with_product(Fit(item, filled, score, {}), products, resolver)
        if fit is None:
            continue
        empty = [slot for slot in item.slots if slot.key not in filled and slot.key not in fit.structures]
        if any(slot.role != "reactant" and not slot.default for slot in empty):
            continue
        open_ = sum(slot.role == "reactant" and not slot.default for slot in empty)
        accepted = any(_accepts(slot, filled[slot.key], resolver) for slot in item.slots if slot.key in filled)
        echoes = [m for m in rest if m not in filled.values() and m.classes != {"?"}]
        if not all(_is_echo(m, fit) for m in echoes):
            continue
        if "S" in filled and filled["S"].part != "solvent" and item.slots[0].key not in filled:
            continue
        if not accepted and any(not (m.meaning or m.classes or m.loose) for m in filled.values()):
            continue
        sure = [dict(_places(item, mention, resolver, False)).get(key, 0.0) >= 2.0 for key, mention in filled.items()]
        if not spans and not (all(sure) and (not open_ or (accepted and fit.score > score))):
            continue
        words = [m for m in re.finditer(r"[^\s.,;:]+", text) if is_transformation(m[0], first=m.start() == 0)]
        owners = [*spans, *((m.start, m.end) for m in mentions)]
        unread = [w[0] for w in words if not any(s <= w.start() and w.end() <= e for s, e in owners)]
        unread = [word for word in unread if word.lower() not in general_procedures().fillers]
        unread = [word for word in unread if not _is_done(word, fit)]
        if any(not is_qualifier(word) for word in unread):
            continue
        score = (
            fit.score
            + 3.0 * bool(spans)
            - 6.0 * (item.losses is not None)
            - 1.0 * open_
            - 1.5 * len(unread)
            - 0.1 * len(empty)
        )
        unread += [m.strength for key, m in filled.items() if m.strength and not _has_strength(item, key, m.strength)]
        unread += [m.text for m in products if m.classes == {"?"} or not (m.loose or m.meaning or m.classes)]
        unread += [m.text for m in rest if m not in filled.values() and m.classes == {"?"}]
        spoken = tuple(m.text for m in echoes)
        yield replace(fit, score=score, unread=tuple(dict.fromkeys(unread)), echoes=spoken)


def _is_done(word: str, fit: Fit) -> bool:
    """Return whether a general procedure does what a qualifier says: "refluxing", "catalytic", "chemoselective"."""
    lowered, actions = word.lower(), fit.procedure.actions
    if re.match(r"reflux", lowered):
        return any(action.verb == "Reflux" for action in actions)
    if re.match(r"heat|warm|thermal|hot$", lowered):
        return any(action.verb == "Reflux" or (action.temperature or 0.0) >= LEAST_HEATED_C for action in actions)
    if re.match(r"cool|cold$", lowered):
        return any((action.temperature or LEAST_HEATED_C) <= MOST_COOLED_C for action in actions)
    if lowered == "catalytic":
        return any(slot.role == "catalyst" for slot in fit.procedure.slots)
    if re.fullmatch(r"(?:chemo)?selective(?:ly)?", lowered):
        return bool(fit.product)
    return lowered == "stirring"


def _is_echo(mention: Mention, fit: Fit) -> bool:
    """Return whether a phrase that fills no slot may say again what the substrate is."""
    head = fit.procedure.slots[0]
    smiles = fit.structures.get(head.key, "")
    if not smiles and head.key not in fit.filled:
        return False
    if mention.loose or mention.in_title or not mention.classes:
        return True
    table = general_procedures().classes
    patterns = [smarts for name in mention.classes for smarts in table[name].smarts]
    return _has(smiles, patterns) if smiles else bool(mention.classes & set(head.classes))


def _has_strength(item: GeneralProcedure, key: str, strength: str) -> bool:
    stated = STRENGTH.match(strength)
    portions = [p for action in item.actions for p in action.takes if p.name == key]
    return stated is not None and any(p.amount.endswith(f"of {stated[1]} {stated[2]}") for p in portions)


def _assignments(
    item: GeneralProcedure, mentions: Sequence[Mention], resolver: Resolver, named: bool
) -> Iterator[tuple[float, dict[str, Mention]]]:
    """Yield the ways in which substances fill slots, with scores; what the title says may be said again."""
    if not mentions:
        yield 0.0, {}
        return
    first, others = mentions[0], mentions[1:]
    for key, worth in _places(item, first, resolver, named):
        for score, filled in _assignments(item, others, resolver, named):
            if key not in filled:
                yield score + worth, {key: first, **filled}
    if first.classes == {"?"} or (first.aside and (first.meaning is None or first.in_brackets)):
        yield from _assignments(item, others, resolver, named)


def _places(item: GeneralProcedure, mention: Mention, resolver: Resolver, named: bool) -> Iterator[tuple[str, float]]:
    """Yield the slots that a substance may fill, with what that is worth."""
    for slot in item.slots:
        worth = _worth(item, slot, mention, resolver, named)
        if worth:
            yield slot.key, worth
    asset = mention.meaning.asset if mention.meaning is not None else ""
    meant = {asset, mention.smiles} - {""}
    is_mixture = mention.meaning is not None and bool(mention.meaning.parts)
    is_solvent = is_mixture or (bool(asset) and resolver.catalog.get(asset).category in SOLVENTS)
    if item.solvent and (is_solvent or meant & _accepted((item.solvent,), resolver.catalog)):
        yield "S", 3.0 if mention.part == "solvent" else 0.2
    if asset == WATER and item.type is None and item.solvent:
        yield "S", 1.0
    elif asset == WATER and any(portion.name == "water" for action in item.actions for portion in action.takes):
        yield WATER, 2.0


def _worth(item: GeneralProcedure, slot: Slot, mention: Mention, resolver: Resolver, named: bool) -> float:
    """Return how well a substance fills a slot; 0 if it does not."""
    if _accepts(slot, mention, resolver):
        return 4.0
    is_first, smiles = slot == item.slots[0], mention.smiles or _asset_smiles(mention, resolver)
    if smiles and _is_of(slot, smiles):
        return 3.0
    if mention.meaning is not None:
        returns = named and is_first and item.retro and smiles and len(backward(item.retro, smiles)) == 1
        return 1.0 if ANY in slot.classes else 1.5 if returns else 0.0
    if slot.role != "reactant" or not slot.classes:
        return 0.0
    if mention.classes & set(slot.classes):
        return 2.0
    if named and is_first and item.type == "protection_deprotection" and mention.classes & set(_words_of(item.product)):
        return 0.3  # "Boc deprotection of a piperidine" names what is set free
    return 0.3 if ANY in slot.classes or (is_first and (mention.loose or not mention.classes)) else 0.0


def _accepts(slot: Slot, mention: Mention, resolver: Resolver) -> bool:
    if not slot.accepts:
        return False
    known = _accepted(slot.accepts, resolver.catalog)
    meant = {mention.meaning.asset, mention.meaning.smiles} if mention.meaning is not None else set()
    return bool(meant & known - {""}) or normalize(mention.text) in known


@lru_cache(maxsize=1024)
def _accepted(names: tuple[str, ...], catalog: Catalog) -> frozenset[str]:
    """Return the assets, structures and normalized names of substances."""
    plain = Resolver(catalog, parser=False)
    found = plain.resolve([Material(name=name, role="reagent") for name in names])
    return frozenset(form for r in found for form in (r.asset, r.smiles, normalize(r.name)) if form)


def _asset_smiles(mention: Mention, resolver: Resolver) -> str:
    asset = mention.meaning.asset if mention.meaning is not None else ""
    return resolver.catalog.get(asset).smiles if asset else ""


def _has(smiles: str, patterns: Sequence[str]) -> bool:
    try:
        structure = standard(smiles)
    except MissingDependencyError:
        return False
    return any(matches(structure, smarts) for smarts in patterns)


def _with_product(fit: Fit, products: Sequence[Mention], resolver: Resolver) -> Fit | None:
    """Return a fit with the structures of its substances and its product, or None if the wish names another product."""
    item, score = fit.procedure, fit.score
    structures = {key: smiles for key, m in fit.filled.items() if (smiles := m.smiles or _asset_smiles(m, resolver))}
    core = [slot.key for slot in item.slots if slot.in_equation]
    head = item.slots[0]
    if item.retro and head.key in structures and not _is_of(head, structures[head.key]):
        ways = backward(item.retro, structures[head.key])
        structures.update(zip(core[:1], ways[0], strict=False) if ways else ())
    named = next((m for m in products if m.smiles or _asset_smiles(m, resolver)), None)
    wanted = (named.smiles or _asset_smiles(named, resolver)) if named is not None else ""
    score += sum(_agreement(item, mention) for mention in products if mention is not named)
    if item.losses is not None:
        known = [structures[key] for key in core if key in structures]
        counts = balanced(known, wanted, item.losses) if wanted and len(known) == len(core) else ()
        fit = replace(fit, counts=dict(zip(core, counts, strict=False)), product=wanted, named_product=named)
        return replace(fit, score=score, structures=structures) if counts else None
    if not item.equations:
        return replace(fit, score=score, structures=structures, product=wanted, named_product=named)
    if all(key in structures for key in core):
        reactants = [structures[key] for key in core]
        made = [smiles for equation in item.equations for smiles in forward([equation], reactants)]
        chosen = (
            [smiles for smiles in made if same(smiles, wanted)] if wanted else list(forward(item.equations, reactants))
        )
        if not chosen:
            return None
        product = chosen[0] if len(chosen) == 1 else ""
        return replace(
            fit, score=score + 5.0 * bool(wanted), structures=structures, product=product, named_product=named
        )
    if wanted and item.retro:
        known_keys = [(place, structures[key]) for place, key in enumerate(core) if key in structures]
        outcomes = [way for way in backward(item.retro, wanted) if len(way) == len(core)]
        outcomes = [way for way in outcomes if all(same(way[place], smiles) for place, smiles in known_keys)]
        outcomes = list({frozenset(way): way for way in outcomes}.values())
        if not outcomes:
            return None
        if len(outcomes) == 1:
            structures.update(
                {key: smiles for key, smiles in zip(core, outcomes[0], strict=True) if key not in structures}
            )
        score += 4.0
    elif wanted and any(key not in structures and key not in fit.filled for key in core):
        return None
    if wanted and not may_be_product(item.equations, wanted):
        return None
    return replace(fit, score=score, structures=structures, product=wanted, named_product=named)


def _agreement(item: GeneralProcedure, mention: Mention) -> float:
    """Return what it is worth that a wish names the product by its class, below 0 if it is another class."""
    agrees = mention.classes & set(_words_of(item.product)) or _is_word_of(item.product, mention.text)
    return 2.0 if agrees else -2.0 if mention.classes - {"?"} else 0.0


def _is_of(slot: Slot, smiles: str) -> bool:
    classes = general_procedures().classes
    patterns = [smarts for name in slot.classes if name != ANY for smarts in classes[name].smarts]
    return _has(smiles, patterns)


def _words_of(product: str) -> tuple[str, ...]:
    return tuple(name for name in general_procedures().classes if re.search(rf"\b{re.escape(name)}\b", product))


def _is_word_of(product: str, text: str) -> bool:
    words = {word.lower().rstrip("s") for word in re.findall(r"[A-Za-z]{4,}", text)}
    return bool(words & {word.rstrip("s") for word in re.findall(r"[a-z]{4,}", product.lower())})


def _experiment(text: str, fit: Fit, wish: StatedWish, resolver: Resolver) -> tuple[Experiment, tuple[str, ...]]:
    """Return the experiment of a wish, with its assumptions and hazards, one sentence each."""
    item = fit.procedure
    notes = [
        f"written as: {item.name} ({item.source})",
        "amounts and conditions that the text does not state: assumed"
        if wish.states_any
        else "amounts for 10 mmol of the substrate, temperatures and times: assumed",
    ]
    notes += [f"{phrase!r} is taken to name a substance that the text names again" for phrase in fit.echoes]
    product = fit.named_product.text if fit.named_product is not None else ""
    title = product or fit.product or item.product
    materials: dict[str, Material] = {}
    for slot in item.slots:
        mention, smiles = fit.filled.get(slot.key), fit.structures.get(slot.key, "")
        if mention is not None and mention.meaning is not None and same(smiles, mention.smiles or smiles):
            materials[slot.key] = Material(name=mention.meaning.name, role=slot.role, smiles=mention.smiles)
        elif smiles and slot.classes:
            derived = product or (mention.text if mention is not None else "")
            name = f"{slot.classes[0]} that gives {derived or title}"[:200]
            notes.append(f"{slot.classes[0]}: its structure {smiles} follows from the product, assumed")
            materials[slot.key] = Material(name=name, role=slot.role, smiles=smiles)
        elif mention is not None:
            materials[slot.key] = Material(name=f"{PLACEHOLDER}{mention.text}"[:200], role=slot.role)
        elif slot.default:
            notes.append(f"{slot.role} {slot.default}: assumed")
            materials[slot.key] = Material(name=slot.default, role=slot.role)
        else:
            what = slot.classes[0] if slot.classes and slot.classes[0] != ANY else "substance"
            materials[slot.key] = Material(name=f"{PLACEHOLDER}{what}", role=slot.role)
    if item.solvent:
        medium = fit.filled.get("S") or next((m for m in fit.filled.values() if m.part == "solvent"), None)
        notes += [] if medium is not None else [f"solvent {item.solvent}: assumed"]
        name = medium.meaning.name if medium is not None and medium.meaning is not None else item.solvent
        materials["S"] = Material(name=name, role="solvent")
    taken = dict.fromkeys(portion.name for action in item.actions for portion in action.takes)
    for key in taken:
        materials.setdefault(key, Material(name=key, role="workup"))
    meanings = Resolver(resolver.catalog, parser=False).resolve(materials.values())
    known = {key: _properties(meaning, resolver) for key, meaning in zip(materials, meanings, strict=True)}
    actions = [
        action.model_copy(
            update={
                "takes": tuple(
                    _portion(p, materials[p.name], known[p.name][0], fit.counts.get(p.name, 1)) for p in action.takes
                )
            }
        )
        for action in scaled_actions(item.actions, wish, fit.filled, known)
    ]
    if len([key for key in fit.structures if key in {s.key for s in item.slots if s.in_equation}]) and not fit.product:
        notes.append("the structure of the product is not known: several are possible, or a substrate is not named")
    core = [fit.structures.get(slot.key, "") for slot in item.slots if slot.in_equation]
    distinct = {material.name: material for material in reversed(list(materials.values()))}
    experiment = Experiment(
        id=f"wish_{item.id[:30]}_{hashlib.sha256(text.encode()).hexdigest()[:10]}",
        name=(f"{item.name}: {product}" if product else item.name)[:300],
        reaction_type=item.type,
        reaction=f"{'.'.join(core)}>>{fit.product}" if fit.product and all(core) and item.type is not None else "",
        product=f"{product or item.product}{f' ({fit.product})' if fit.product else ''}"[:500],
        description=" ".join((text, f"General procedure: {item.source}; all not stated is assumed.", *item.hazards))[
            :4000
        ],
        materials=tuple(reversed(distinct.values())),
        actions=tuple(actions),
        origin="text",
    )
    return experiment, (*notes, *(f"hazard: {hazard}" for hazard in item.hazards))


def _properties(meaning: Resolution, resolver: Resolver) -> tuple[float | None, float | None]:
    """Return the molar mass, g/mol, and the density of a liquid, g/mL, where they are known."""
    if meaning.asset:
        chemistry = resolver.catalog.get(meaning.asset).chemistry
        return (chemistry.molar_mass, chemistry.density) if chemistry is not None else (None, None)
    return (molar_mass(meaning.smiles), physical_data(meaning.smiles).density) if meaning.smiles else (None, None)


def _portion(portion: Portion, material: Material, weight: float | None, count: int) -> Portion:
    """Return a portion of a material, `count` times its moles, with their mass."""
    stated = MMOL.match(portion.amount)
    if stated is None:
        return Portion(name=material.name, amount=portion.amount)
    moles = float(stated[1]) * count
    amount = f"{moles:g} mmol"
    return Portion(name=material.name, amount=f"{moles * weight / 1000.0:.3g} g, {amount}" if weight else amount)
