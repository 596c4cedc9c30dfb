"""Wishes: one line that names a transformation, substances or their classes, reagents and perhaps a solvent.

A wish is carried out by a general procedure of `assets/synthesis/general_procedures.json`. Its substances fill the slots
of the procedure; what it leaves open is assumed and named in the notes. A class without a name becomes an unclassified
placeholder, which the protocol lists in `partial`. The product is what the reaction gives.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Annotated, ClassVar

from pydantic import Field

from labgym.artefacts import artefacts
from labgym.assets import Catalog
from labgym.assets.inference.substructures import matches
from labgym.assets.search import normalize
from labgym.assets.structures import canonical, standard
from labgym.documents import Document, Record
from labgym.errors import LabgymError, MissingDependencyError
from labgym.protocols.errors import RefusalError
from labgym.protocols.experiments.grounding import SOLVENTS, WATER
from labgym.protocols.experiments.model import Action, Experiment, Material, Portion, Role
from labgym.protocols.language import language_of
from labgym.protocols.language.vocabulary import is_ordinary
from labgym.protocols.model import Protocol, ReactionType
from labgym.protocols.refusals import (
    refusals,
    refuse_product,
    refuse_structure,
    refuse_structures,
    refuse_to_make,
    refuse_wish,
)
from labgym.protocols.substances import Resolver
from labgym.protocols.substances.opening import Resolution
from labgym.protocols.synthesis.equations import backward, forward, molar_mass, same
from labgym.protocols.synthesis.staging import stage
from labgym.protocols.validate import examine

MAX_WISH = 500
"""Most characters of a wish."""
MAX_MENTIONS = 8
"""Most substances of a wish."""
ANY = "ANY"
"""Class of a slot that takes every substance."""
MMOL = re.compile(r"^(\d+(?:\.\d+)?) mmol$")
_AMOUNT = re.compile(
    r"(?<![\w.,(-])-?\d{1,6}(?:\.\d{1,4})?\s?(?:[mkµ]?g|[mµ]?[Ll]|m?mol|equiv|eq|h|hours?|min|minutes?|days?|bar|°\s?C|C|K)\b"
    r"(?![-\w])|\b(?:overnight|room temperature|reflux)\b"
)
_STRENGTH = re.compile(r"^(\d{1,3}(?:\.\d{1,3})?)\s?(M|N|%)$")
_BREAKER = re.compile(
    r"(?:\w+-)*(?:\w{2,24}(?:ation|ition|ution|ction|lysis|olysis|ission|rangement|pling)s?|removal|metathesis|drying|"
    r"(?:de|re)?(?:reduc|oxidi[sz]|protect|hydroly[sz]|hydrogenat|coupl|alkylat|acylat|methylat|brominat|chlorinat|"
    r"iodinat|condens|cycli[sz]|esterif|(?:mes|tos)ylat(?!e)|silylat|epoxid|distil|recrystalli[sz]|crystalli[sz]|purif|"
    r"dissol|dehydrat|saponif|aminat|substitut|formylat|remov|cleav|dried|olefinat|isolat|chromatograph)\w*|(?:reflux|heat|stirr|warm|cool)ing|"
    r"n?-?boc|fmoc|cbz|tbs|tbdms|tips|swern|suzuki\S*|sonogashira|heck|buchwald\S*|stille|negishi|grignard|wittig|hwe|"
    r"horner\S*|aldol|mannich\S*|knoevenagel|michael|aza-michael|williamson|mitsunobu|snar|appel|diels-alder|steglich|"
    r"fischer|biginelli|hofmann|hantzsch\S*|claisen\S*|gabriel|thermal(?:ly)?|reductive(?:ly)?|"
    r"catalytic|radical|basic|acidic|aromatic|nucleophilic|(?:regio|chemo|stereo|enantio)?selective(?:ly)?)",
    re.IGNORECASE,
)
_QUALIFIER = re.compile(r".*(?:ly|al|ive|ic)$|(?:reflux|heat|stirr|warm|cool)ing$", re.IGNORECASE)
"""Words of transformations, which end the name of a substance."""
_OPEN_ENDING = re.compile(
    r"\s*\b(?:derivative|intermediate|precursor|compound|analog(?:ue)?|substrate|moiety|ring)s?$", re.IGNORECASE
)
_SMILES = re.compile(r"(?=\S*[A-Z])(?:[BCNOPSFIHbcnops\d=#@+\\/()\[\].%-]|Cl|Br|Si|Hg|Ag|Pb|Ni|Na|Li|Sn|Mg|Zn){4,300}")
_SALT = re.compile(r"(?<=\S) (?:hydrochloride|hydrobromide|salt|group)s?$", re.IGNORECASE)
_BRACKET = re.compile(r"\([A-Za-z-]{2,30}\)?$")
_PRODUCT_BEFORE = re.compile(
    r"(?:\b(?:to|into|as|giving|affording|forming|yielding)|"
    r"\bto (?:form|give|yield|afford|obtain|synthesi[sz]e|make|prepare)|"
    r"\b(?:synthesis|preparation|formation) of|^(?:make|prepare|synthesi[sz]e|form))(?: (?:the|an?|its|desired|corresponding))*$",
    re.IGNORECASE,
)
_FOLLOWED_AS_PRODUCT = re.compile(r"^\s*(?:synthesis|formation)\b", re.IGNORECASE)
_SOLVENT_BEFORE = re.compile(r"\b(?:in|in refluxing|in dry|in anhydrous)$", re.IGNORECASE)
_ADDS = re.compile(r"\baddition\b|\badd(?:ed|ing)?\b|\bbound\b", re.IGNORECASE)


class SubstanceClass(Record):
    """A class of substances: a pattern of its words, and SMARTS of which one must match."""

    words: str
    smarts: tuple[str, ...]


class Slot(Record):
    """A substance that a general procedure takes.

    Attributes:
        key: name of it in the actions.
        classes: which substances fill it, "ANY" for all. accepts: names of substances that fill it.
        default: what is assumed if the wish names nothing; "" if the wish must, or a placeholder stands for it.
        in_equation: whether the equations of the procedure have it among the reactants, in the order of the slots.
    """

    key: str
    classes: tuple[str, ...] = ()
    accepts: tuple[str, ...] = ()
    default: str = ""
    role: Role
    in_equation: bool


class GeneralProcedure(Record):
    """A general procedure; its amounts are for 10 mmol of the substrate.

    Attributes:
        words: pattern of the words that name the transformation.
        named: whether the wish has to contain such a word. dry: whether a protic solvent is dangerous or spoils it.
        solvent: that is assumed; "" if there is none.
        product: class of the product.
        equations: reaction SMARTS, of which the first that applies gives the product.
        retro: reaction SMARTS from the product to the substrates, if it leads back without doubt.
        actions: with the keys of the slots, "S" for the solvent, or names as materials.
    """

    id: Annotated[str, Field(pattern=r"^[a-z0-9_]{1,40}$")]
    name: str
    type: ReactionType | None = None
    words: str
    slots: tuple[Slot, ...]
    solvent: str = ""
    product: str
    equations: tuple[str, ...] = ()
    retro: str = ""
    actions: tuple[Action, ...]
    hazards: tuple[str, ...] = ()
    source: str
    named: bool = False
    dry: bool = False


class GeneralProcedures(Document):
    """The table; `fillers` are words without chemical content."""

    SCHEMA: ClassVar[str] = "labgym.general_procedures/1"

    fillers: frozenset[str]
    classes: dict[str, SubstanceClass]
    procedures: tuple[GeneralProcedure, ...]


@lru_cache(maxsize=1)
def general_procedures() -> GeneralProcedures:
    """Return the published table; it is read once per process."""
    return GeneralProcedures.load(artefacts("assets") / "synthesis" / "general_procedures.json")


@dataclass(frozen=True)
class Mention:
    """A substance, or a class of substances, that a wish names.

    Attributes:
        part: "product", "solvent" or "substance", by the words before it.
        aside: whether it may say again what something else says: in a title, in brackets, or "the" class.
        loose: whether its words say that it is not all of its name ("a pyridine derivative").
        strength: of a solution, as "4 M".
        meaning: None if it names a class or nothing that is known.
        classes: by its words.
    """

    text: str
    start: int
    end: int
    part: str
    aside: bool = False
    loose: bool = False
    strength: str = ""
    meaning: Resolution | None = None
    classes: frozenset[str] = frozenset()

    @property
    def smiles(self) -> str:
        return self.meaning.smiles if self.meaning is not None else ""


@dataclass(frozen=True)
class Fit:
    """A general procedure with what fills its slots, by key; "S" is the solvent."""

    procedure: GeneralProcedure
    filled: dict[str, Mention]
    score: float
    structures: dict[str, str]
    product: str = ""
    named_product: Mention | None = None
    unread: tuple[str, ...] = ()


@dataclass(frozen=True)
class Fulfillment:
    """The protocol of a wish, with assumptions and hazards, one sentence each, and the advice of the examination."""

    protocol: Protocol
    notes: tuple[str, ...]
    advice: tuple[str, ...]


def fulfill(text: str, partial: bool = False, names: Resolver | None = None) -> Fulfillment:
    """Write the protocol of a wish by the general procedure that fits best.

    Args:
        text: one English line without amounts.
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
    amount = _AMOUNT.search(text)
    if amount is not None:
        raise RefusalError("unaccounted", f"a wish has no amounts or conditions ({amount[0]!r}): write a procedure")
    resolver = names if names is not None else Resolver(Catalog.load())
    mentions = _mentions(text, resolver)
    used = [(m.start, m.end) for m in mentions if m.part != "product" and m.meaning is not None and _is_sold(m.meaning)]
    refuse_product(text, used)
    for mention in mentions:
        if mention.smiles and mention.meaning is not None and not _is_sold(mention.meaning):
            refuse_structure(mention.smiles)
    fits = [fit for item in general_procedures().procedures for fit in _fits(item, text, mentions, resolver)]
    if not fits:
        named = ", ".join(repr(mention.text[:60]) for mention in mentions) or "no substance"
        raise RefusalError("no-reaction", f"no general procedure takes what the text names ({named})")
    best = max(fits, key=lambda fit: fit.score)
    experiment, notes = _experiment(text, best, resolver)
    refuse_to_make(experiment.name, experiment.product, filter(None, [best.product]))
    unread = [f"unread: {word!r} has no effect on the general procedure" for word in best.unread]
    if unread and not partial:
        raise RefusalError(
            "unaccounted", f"{best.procedure.name}: {'; '.join(unread)}: leave it out, or accept it with --partial"
        )
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
    oxidizers = [use.name for use, hazards in uses if hazards.oxidizer or hazards.explosive]
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
    if item.type is None and oxidizers and (others or not item.id.startswith("solution")):
        raise RefusalError("unsafe", f"{item.name}: {oxidizers[0]} is an oxidizer or explosive; write a procedure")


def _is_usual(fit: Fit, solvent: str) -> bool:
    return solvent in _accepted((fit.procedure.solvent,), Catalog.load())


def _is_sold(meaning: Resolution) -> bool:
    return bool(meaning.asset) or (meaning.listed is not None and meaning.listed.sold)


def _mentions(text: str, resolver: Resolver) -> tuple[Mention, ...]:
    """Return the substances and classes that a wish names, each once."""
    drafts = list(_phrases(text))[: MAX_MENTIONS + 1]
    if len(drafts) > MAX_MENTIONS:
        raise RefusalError("no-reaction", f"a wish names at most {MAX_MENTIONS} substances: write a procedure")
    closed = [draft for draft, is_open in drafts if not is_open]
    spellings = {form for draft in closed for form in _spellings(draft.text)}
    known = {
        item.name: item
        for item in resolver.resolve([Material(name=s[:200], role="reagent") for s in sorted(spellings)])
    }
    mentions: dict[str, Mention] = {}
    for draft, is_open in drafts:
        meaning = None
        if not is_open:
            meaning = next((known[form] for form in _spellings(draft.text) if known[form].is_known), None)
            meaning = meaning or _drawn(draft.text)
        bare = _SALT.sub("", _OPEN_ENDING.sub("", draft.text))
        found = frozenset(name for name, item in general_procedures().classes.items() if _ends_with(item.words, bare))
        if meaning is None and not found and all(is_ordinary(word) for word in draft.text.split()) and not is_open:
            found = frozenset(("?",))
        mention = replace(draft, meaning=meaning, classes=found)
        identity = (meaning.asset or meaning.smiles) if meaning is not None else normalize(bare)
        if identity in mentions and mentions[identity].aside and not mention.aside:
            del mentions[identity]
        mentions.setdefault(identity, mention)
    return tuple(mentions.values())


def _drawn(text: str) -> Resolution | None:
    """Return the meaning of a SMILES, or None if a text is none."""
    if _SMILES.fullmatch(text) is None:
        return None
    try:
        return Resolution(text, smiles=canonical(text), source="user")
    except LabgymError:
        return None


def _spellings(phrase: str) -> tuple[str, ...]:
    lowered = " ".join(word if sum(map(str.isupper, word)) > 1 else word.lower() for word in phrase.split())
    return tuple(dict.fromkeys((phrase[:200], lowered[:200])))


def _ends_with(words: str, phrase: str) -> bool:
    return re.search(rf"(?<![\w-])(?:\S+-)?(?:{words})$", phrase, re.IGNORECASE) is not None


def _phrases(text: str) -> Iterator[tuple[Mention, bool]]:
    """Yield the phrases between words without content, and whether each is left open ("a ketone", "an X derivative")."""
    title_ends = text.find(": ")
    fillers = general_procedures().fillers
    run: list[tuple[str, int, int]] = []
    before = ""
    strength = ""
    last_part = "substance"

    def flushed(end_of_before: str) -> Iterator[tuple[Mention, bool]]:
        nonlocal before, strength, last_part
        if run and _OPEN_ENDING.sub("", text[run[0][1] : run[-1][2]]):
            start, end = run[0][1], run[-1][2]
            lead = before.strip()
            part = "substance"
            if _PRODUCT_BEFORE.search(lead) and not (lead.endswith("to") and _ADDS.search(text[:start])):
                part = "product"
            elif _SOLVENT_BEFORE.search(lead):
                part = "solvent"
            elif lead.endswith("and"):
                part = last_part
            if _FOLLOWED_AS_PRODUCT.match(text[end:]):
                part = "product"
            phrase = text[start:end]
            article = re.search(r"\b(an?|the|its)$", lead)
            is_class = article is not None and phrase.lower().removesuffix("s") in general_procedures().classes
            indefinite = article is not None and article[1] in ("a", "an")
            is_open = indefinite or is_class or _OPEN_ENDING.search(phrase) is not None
            aside = start < title_ends or is_class or text[max(0, start - 1) : start] == "("
            loose = _OPEN_ENDING.search(phrase) is not None
            yield Mention(phrase, start, end, part, aside, loose, strength), is_open
            last_part, strength, before = part, "", ""
        run.clear()
        before = f"{before} {end_of_before}"[-60:]

    for match in re.finditer(r"\S+", text):
        word = match[0].rstrip(".,;:")
        begin = match.start()
        if _BRACKET.match(word):
            yield from flushed("")
            word, begin = word[1:], begin + 1
        if word.endswith(")") and word.count(")") > word.count("("):
            word = word[:-1]
        end = begin + len(word)
        ends = text[end : match.end()] != ""
        pair = text[match.start() : match.end() + 2].strip()
        if _STRENGTH.match(pair) or _STRENGTH.match(word):
            yield from flushed("")
            strength = pair if _STRENGTH.match(pair) else word
        elif word in ("M", "N", "%") and strength:
            continue
        elif word == "on" and run:
            run.append((word, begin, end))
        elif not word or word.lower() in fillers or _BREAKER.fullmatch(word):
            yield from flushed(word)
        else:
            run.append((word, begin, end))
            if ends:
                yield from flushed("")
    yield from flushed("")


def _fits(item: GeneralProcedure, text: str, mentions: Sequence[Mention], resolver: Resolver) -> Iterator[Fit]:
    """Yield the best way in which the substances of a wish fill the slots of a procedure, if there is one."""
    spans = [m.span() for m in re.finditer(rf"(?<![\w-])(?:{item.words})(?![\w-])", text, re.IGNORECASE)]
    if item.named and not spans:
        return
    owned = [m for m in mentions if any(start <= m.start and m.end <= end for start, end in spans)]
    products = [m for m in mentions if m.part == "product" and m not in owned]
    rest = [m for m in mentions if m.part != "product" and m not in owned]
    for score, filled in sorted(_assignments(item, rest, resolver, bool(spans)), key=lambda pair: -pair[0])[:1]:
        fit = _with_product(Fit(item, filled, score, {}), products, resolver)
        if fit is None:
            continue
        empty = [slot for slot in item.slots if slot.key not in filled and slot.key not in fit.structures]
        if any(slot.role != "reactant" and not slot.default for slot in empty):
            continue
        open_ = sum(slot.role == "reactant" and not slot.default for slot in empty)
        accepted = any(_accepts(slot, filled[slot.key], resolver) for slot in item.slots if slot.key in filled)
        sure = [dict(_places(item, mention, resolver, False)).get(key, 0.0) >= 2.0 for key, mention in filled.items()]
        if not spans and not (all(sure) and (not open_ or (accepted and fit.score > score))):
            continue
        words = [m for m in re.finditer(r"[^\s.,;:]+", text) if _BREAKER.fullmatch(m[0])]
        unread = [w[0] for w in words if not any(s <= w.start() and w.end() <= e for s, e in spans)]
        unread = [word for word in unread if word.lower() not in general_procedures().fillers]
        if any(not _QUALIFIER.fullmatch(word) for word in unread):
            continue
        score = fit.score + 3.0 * bool(spans) - 1.0 * open_ - 1.5 * len(unread) - 0.1 * len(empty)
        unread += [m.strength for key, m in filled.items() if m.strength and not _has_strength(item, key, m.strength)]
        unread += [m.text for m in products if m.classes == {"?"} or not (m.loose or m.meaning or m.classes)]
        unread += [m.text for m in rest if m not in filled.values() and m.classes == {"?"}]
        yield replace(fit, score=score, unread=tuple(dict.fromkeys(unread)))


def _has_strength(item: GeneralProcedure, key: str, strength: str) -> bool:
    portions = [p for action in item.actions for p in action.takes if p.name == key]
    return any(
        p.amount.endswith(f"of {' '.join(_STRENGTH.match(strength).groups())}")
        for p in portions
        if _STRENGTH.match(strength)
    )


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
    if first.classes == {"?"} or (first.aside and (first.meaning is None or first.end < 0)):
        yield from _assignments(item, others, resolver, named)


def _places(item: GeneralProcedure, mention: Mention, resolver: Resolver, named: bool) -> Iterator[tuple[str, float]]:
    """Yield the slots that a substance may fill, with what that is worth."""
    table = general_procedures().classes
    for slot in item.slots:
        if _accepts(slot, mention, resolver):
            yield slot.key, 4.0
        elif mention.smiles or (mention.meaning is not None and mention.meaning.asset):
            smiles = mention.smiles or _asset_smiles(mention, resolver)
            patterns = [smarts for name in slot.classes if name != ANY for smarts in table[name].smarts]
            if smiles and _has(smiles, patterns):
                yield slot.key, 3.0
            elif ANY in slot.classes:
                yield slot.key, 1.0
            elif named and item.retro and slot == item.slots[0] and smiles and len(backward(item.retro, smiles)) == 1:
                yield slot.key, 1.5
        elif mention.meaning is None and slot.role == "reactant" and slot.classes:
            if mention.classes & set(slot.classes):
                yield slot.key, 2.0
            elif mention.loose or not mention.classes or ANY in slot.classes:
                yield slot.key, 0.3
    category = (
        resolver.catalog.get(mention.meaning.asset).category
        if mention.meaning is not None and mention.meaning.asset
        else ""
    )
    if item.solvent and category in SOLVENTS:
        yield "S", 3.0 if mention.part == "solvent" else 0.2
    if mention.meaning is not None and mention.meaning.asset == WATER:
        yield WATER, 2.0


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
    chemistry = resolver.catalog.get(asset).chemistry if asset else None
    return (chemistry.smiles or "") if chemistry is not None else ""


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
    for mention in products:
        if mention is not named:
            agrees = mention.classes & set(_words_of(item.product)) or _is_word_of(item.product, mention.text)
            known = mention.classes - {"?"}
            score += 2.0 if agrees else -2.0 if known else 0.0
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
        ways = [way for way in backward(item.retro, wanted) if len(way) == len(core)]
        ways = [way for way in ways if all(same(way[place], smiles) for place, smiles in known_keys)]
        ways = list({frozenset(way): way for way in ways}.values())
        if not ways:
            return None
        if len(ways) == 1:
            structures.update({key: smiles for key, smiles in zip(core, ways[0], strict=True) if key not in structures})
        score += 4.0
    return replace(fit, score=score, structures=structures, product=wanted, named_product=named)


def _is_of(slot: Slot, smiles: str) -> bool:
    classes = general_procedures().classes
    patterns = [smarts for name in slot.classes if name != ANY for smarts in classes[name].smarts]
    return _has(smiles, patterns)


def _words_of(product: str) -> tuple[str, ...]:
    return tuple(name for name in general_procedures().classes if re.search(rf"\b{re.escape(name)}\b", product))


def _is_word_of(product: str, text: str) -> bool:
    words = {word.lower().rstrip("s") for word in re.findall(r"[A-Za-z]{4,}", text)}
    return bool(words & {word.rstrip("s") for word in re.findall(r"[a-z]{4,}", product.lower())})


def _experiment(text: str, fit: Fit, resolver: Resolver) -> tuple[Experiment, tuple[str, ...]]:
    """Return the experiment of a wish, with its assumptions and hazards, one sentence each."""
    item = fit.procedure
    notes = [f"written as: {item.name} ({item.source})", "amounts for 10 mmol of the substrate, assumed"]
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
            materials[slot.key] = Material(name=f"unnamed {mention.text}"[:200], role=slot.role)
        elif slot.default:
            notes.append(f"{slot.role} {slot.default}: assumed")
            materials[slot.key] = Material(name=slot.default, role=slot.role)
        else:
            what = slot.classes[0] if slot.classes and slot.classes[0] != ANY else "substance"
            materials[slot.key] = Material(name=f"unnamed {what}", role=slot.role)
    if item.solvent:
        stated = fit.filled.get("S")
        notes += [] if stated is not None else [f"solvent {item.solvent}: assumed"]
        name = stated.meaning.name if stated is not None and stated.meaning is not None else item.solvent
        materials["S"] = Material(name=name, role="solvent")
    taken = dict.fromkeys(portion.name for action in item.actions for portion in action.takes)
    for key in taken:
        materials.setdefault(key, Material(name=key, role="workup"))
    meanings = Resolver(resolver.catalog, parser=False).resolve(materials.values())
    weights = dict(zip(materials, (_molar_mass(meaning, resolver) for meaning in meanings), strict=True))
    actions = [
        action.model_copy(
            update={"takes": tuple(_portion(p, materials[p.name], weights[p.name]) for p in action.takes)}
        )
        for action in item.actions
    ]
    if len([key for key in fit.structures if key in {s.key for s in item.slots if s.in_equation}]) and not fit.product:
        notes.append("the structure of the product is not known: several are possible, or a substrate is not named")
    core = [fit.structures.get(slot.key, "") for slot in item.slots if slot.in_equation]
    distinct = {material.name: material for material in reversed(list(materials.values()))}
    experiment = Experiment(
        id=f"wish_{item.id[:30]}_{hashlib.sha256(text.encode()).hexdigest()[:10]}",
        name=(product and f"{item.name}: {product}" or item.name)[:300],
        reaction_type=item.type,
        reaction=f"{'.'.join(core)}>>{fit.product}" if fit.product and all(core) and item.type is not None else "",
        product=f"{product or item.product}{f' ({fit.product})' if fit.product else ''}"[:500],
        description=f"{text} General procedure, amounts and conditions assumed: {item.source}. {'. '.join(item.hazards)}"[
            :4000
        ],
        materials=tuple(reversed(distinct.values())),
        actions=tuple(actions),
        origin="text",
    )
    return experiment, (*notes, *(f"hazard: {hazard}" for hazard in item.hazards))


def _molar_mass(meaning: Resolution, resolver: Resolver) -> float | None:
    if meaning.asset:
        chemistry = resolver.catalog.get(meaning.asset).chemistry
        return chemistry.molar_mass if chemistry is not None else None
    return molar_mass(meaning.smiles) if meaning.smiles else None


def _portion(portion: Portion, material: Material, weight: float | None) -> Portion:
    """Return a portion of a material, with the mass of its moles."""
    moles = MMOL.match(portion.amount)
    amount = f"{float(moles[1]) * weight / 1000.0:.3g} g, {portion.amount}" if moles and weight else portion.amount
    return Portion(name=material.name, amount=amount)
