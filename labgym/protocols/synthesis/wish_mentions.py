"""The substances and classes of substances that a wish names."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Literal

from labgym.assets.search import normalize
from labgym.assets.structures import canonical
from labgym.assets.substances import is_generic
from labgym.errors import LabgymError
from labgym.protocols.errors import RefusalError
from labgym.protocols.experiments.model import Material
from labgym.protocols.language.vocabulary import is_ordinary
from labgym.protocols.reading.figures import QuantitySpan
from labgym.protocols.substances import Resolver
from labgym.protocols.substances.opening import Resolution
from labgym.protocols.synthesis.general_procedures import general_procedures

Part = Literal["substance", "product", "solvent"]
MAX_MENTIONS = 8
"""Most substances of a wish."""
STRENGTH = re.compile(r"^(\d{1,3}(?:\.\d{1,3})?)\s?(M|N|%)$")
_BREAKER = re.compile(
    r"(?:[\w,]{1,20}-){0,3}(?:\w{2,24}(?:ation|ition|ution|ction|lysis|ission|rangement|pling)s?|removal|metathesis|drying|"
    r"(?:de|re)?(?:reduc|oxidi[sz]|protect|hydroly[sz]|hydrogenat|coupl|alkylat|acylat|methylat|brominat|chlorinat|"
    r"iodinat|condens|cycli[sz]|esterif|(?:mes|tos)ylat(?!e)|silylat|epoxid|distil|recrystalli[sz]|crystalli[sz]|purif|"
    r"dissol|dehydrat|saponif|aminat|substitut|formylat|remov|cleav|dried|olefinat|isolat|chromatograph)\w*|(?:reflux|heat|stirr|warm|cool)ing|"
    r"n?-?boc|fmoc|cbz|tbs|tbdms|tips|swern|suzuki\S*|sonogashira|heck|buchwald\S*|stille|negishi|grignard|wittig|hwe|"
    r"horner\S*|aldol|mannich\S*|knoevenagel|michael|aza-michael|williamson|mitsunobu|snar|appel|diels-alder|steglich|"
    r"fischer|biginelli|hofmann|hantzsch\S*|claisen\S*|gabriel|thermal(?:ly)?|reductive(?:ly)?|"
    r"catalytic|radical|basic|acidic|aromatic|nucleophilic|(?:regio|chemo|stereo|enantio)?selective(?:ly)?)",
    re.IGNORECASE,
)
"""Words of transformations, which end the name of a substance."""
_QUALIFIER = re.compile(r"(?:ly|(?<!remov)al|ive|ic)$|(?:reflux|heat|stirr|warm|cool)ing$", re.IGNORECASE)
_IMPERATIVE = re.compile(r"[A-Za-z]{3,14}(?:ate|ify|ize|ise)")
_PARTICIPLE = re.compile(r"\w{0,12}-?\w{3,14}ed", re.IGNORECASE)
_ARTICLES = frozenset(("a", "an", "the", "its", "crude", "dry"))
_MEANS = re.compile(r"-(?:mediated|catalyzed|catalysed|promoted|induced|assisted|based)$", re.IGNORECASE)
_KIND = re.compile(
    r"^(?:(?:crude|pure|free|primary|secondary|tertiary|terminal|benzylic|allylic|aromatic|aliphatic|cyclic|final|"
    r"intermediate|resulting|protected|substituted|methyl|ethyl|benzyl) )*",
    re.IGNORECASE,
)
_OPEN_ENDING = re.compile(
    r"\b(?:derivative|intermediate|precursor|compound|analog(?:ue)?|substrate|moiety|ring)s?$", re.IGNORECASE
)
_SMILES = re.compile(r"(?:[BCNOPSFIHbcnops\d=#@+\\/()\[\].%-]|Cl|Br|Si|Hg|Ag|Pb|Ni|Na|Li|Sn|Mg|Zn){4,300}")
_SALT = re.compile(r"(?<=\S) (?:hydrochloride|hydrobromide|salt|group)s?$", re.IGNORECASE)
_BRACKET = re.compile(r"\([A-Za-z-]{2,30}\)?$")
_PRODUCT_BEFORE = re.compile(
    r"(?:\b(?:to|into|as|giving|affording|forming|yielding)|"
    r"\bto (?:form|give|yield|afford|obtain|synthesi[sz]e|make|prepare)|"
    r"\b(?:synthesis|preparation|formation) of|^(?:make|prepare|synthesi[sz]e|form))"
    r"(?: (?:the|an?|its|desired|corresponding))*$",
    re.IGNORECASE,
)
_FOLLOWED_AS_PRODUCT = re.compile(r"^\s*(?:synthesis|formation)\b", re.IGNORECASE)
_SOLVENT_BEFORE = re.compile(r"\b(?:in|in refluxing|in dry|in anhydrous)$", re.IGNORECASE)
_ONTO = re.compile(r"\bto(?: (?:an?|the))?$", re.IGNORECASE)
_ADDS = re.compile(r"\baddition\b|\badd(?:ed|ing)?\b|\bbound\b|\bcoupl\w{2,4}\b|\battach", re.IGNORECASE)


@dataclass(frozen=True)
class Mention:
    """A substance, or a class of substances, that a wish names.

    Attributes:
        part: "product", "solvent" or "substance", by the words before it.
        aside: whether it may say again what something else says: in a title, in brackets, or "the" class.
        loose: whether its words say that it is not all of its name ("a pyridine derivative").
        in_title, in_brackets: where it stands.
        definite: whether "the" or "its" stands before it.
        strength: of a solution, as "4 M".
        amounts: of it that the wish states.
        meaning: None if it names a class or nothing that is known.
        classes: by its words.
    """

    text: str
    start: int
    end: int
    part: Part
    aside: bool = False
    loose: bool = False
    in_title: bool = False
    in_brackets: bool = False
    definite: bool = False
    strength: str = ""
    meaning: Resolution | None = None
    classes: frozenset[str] = frozenset()
    amounts: tuple[QuantitySpan, ...] = ()

    @property
    def smiles(self) -> str:
        """Its structure, or ""."""
        return self.meaning.smiles if self.meaning is not None else ""


def mentions_of(text: str, resolver: Resolver) -> tuple[Mention, ...]:
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
        bare = _SALT.sub("", _OPEN_ENDING.sub("", draft.text).strip())
        table = general_procedures().classes
        kinds = {bare, _KIND.sub("", bare)}
        found = frozenset(name for name, item in table.items() if any(_ends_with(item.words, k) for k in kinds))
        if meaning is None:
            found |= {n for n, item in table.items() if item.parts and re.search(item.parts, bare, re.IGNORECASE)}
        if meaning is None and not found and all(is_ordinary(word) for word in draft.text.split()) and not is_open:
            found = frozenset(("?",))
        repeats = draft.definite and meaning is None and bool(found - {"?"})
        mention = replace(draft, meaning=meaning, classes=found, aside=draft.aside or repeats)
        identity = (meaning.asset or meaning.smiles) if meaning is not None else normalize(bare)
        if identity in mentions and mentions[identity].aside and not mention.aside:
            del mentions[identity]
        mentions.setdefault(identity, mention)
    return tuple(mentions.values())


def _drawn(text: str) -> Resolution | None:
    """Return the meaning of a SMILES, or None if a text is none."""
    if _SMILES.fullmatch(text) is None or text.islower():
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
    """Yield the phrases between words without content, and whether each is left open: "a ketone", "an X derivative"."""
    fillers = general_procedures().fillers
    run: list[tuple[int, int]] = []
    before, strength = "", ""
    part: Part = "substance"
    for begin, end, ends in (*_words(text), (len(text), len(text), True)):
        word = text[begin:end]
        pair = text[begin : end + 2].strip()
        is_strength = is_strength_of(pair) or is_strength_of(word)
        breaks = is_strength or not word or word.lower() in fillers or is_transformation(word, first=begin == 0)
        if word in ("M", "N", "%") and strength:
            continue
        if breaks and not ends and _is_adjective(word, run, before):
            breaks = False
        belongs = word == "on" or (word.lower() == "reagent" and _is_named_after(text, run))
        if not breaks or (belongs and run):
            run.append((begin, end))
            if not ends:
                continue
        if run and not _OPEN_ENDING.fullmatch(text[run[0][0] : run[-1][1]]):
            draft, is_open = _draft(text, run[0][0], run[-1][1], before.strip(), part)
            yield replace(draft, strength=strength), is_open
            part, before, strength = draft.part, "", ""
        run.clear()
        if is_strength:
            strength = pair if is_strength_of(pair) else word
        elif breaks:
            before = f"{before} {word}"[-60:]


def _is_named_after(text: str, run: list[tuple[int, int]]) -> bool:
    """Return whether a phrase is a name of a person: "Lawesson's" reagent, "Jones" reagent."""
    name = text[run[0][0] : run[-1][1]] if run else ""
    return name.endswith("'s") or (name.isalpha() and name.istitle())


def _is_adjective(word: str, run: list[tuple[int, int]], before: str) -> bool:
    """Return whether a participle describes the substance that follows: "a protected amine", "Fmoc-protected"."""
    if word.lower() in general_procedures().fillers or _PARTICIPLE.fullmatch(word) is None:
        return False
    return bool(run) or "-" in word or before.rpartition(" ")[2].lower() in _ARTICLES


def _words(text: str) -> Iterator[tuple[int, int, bool]]:
    """Yield the places of words without punctuation, and whether a phrase ends behind each."""
    for match in re.finditer(r"\S+", text):
        begin, word = match.start(), match[0].rstrip(".,;:")
        if _BRACKET.match(word):
            yield begin, begin, True
            begin, word = begin + 1, word[1:]
        if word.endswith(")") and word.count(")") > word.count("("):
            word = word[:-1]
        if means := _MEANS.search(word):
            yield begin, begin + means.start(), True
            continue
        yield begin, begin + len(word), begin + len(word) < match.end()


def _draft(text: str, start: int, end: int, lead: str, last: Part) -> tuple[Mention, bool]:
    """Return the mention of a phrase by the words before it, and whether it is left open.

    Args:
        lead: the words without content before it. last: what the phrase before it is.
    """
    phrase = text[start:end]
    part: Part = last if lead.endswith("and") else "substance"
    adds = _ONTO.search(lead) is not None and _ADDS.search(text[:start]) is not None
    if (_PRODUCT_BEFORE.search(lead) and not adds) or _FOLLOWED_AS_PRODUCT.match(text[end:]):
        part = "product"
    elif _SOLVENT_BEFORE.search(lead):
        part = "solvent"
    article = re.search(r"\b(an?|the|its)$", lead)
    kind = _KIND.sub("", phrase).lower().removesuffix("s")
    is_class = article is not None and (kind in general_procedures().classes or is_generic(kind))
    is_class = is_class or (kind in general_procedures().classes and phrase.endswith("s"))
    is_part = text[end:].lower().startswith((" group", " moiety")) or phrase.lower().endswith(" ether")
    is_class = is_class or (article is not None and article[1] == "the" and is_part)
    indefinite = article is not None and article[1] in ("a", "an")
    loose = _OPEN_ENDING.search(phrase) is not None
    in_title, in_brackets = start < text.find(": "), text[max(0, start - 1) : start] == "("
    aside = in_title or in_brackets or is_class
    definite = article is not None and article[1] in ("the", "its")
    mention = Mention(phrase, start, end, part, aside, loose, in_title, in_brackets, definite)
    return mention, indefinite or is_class or loose


def is_strength_of(word: str) -> bool:
    """Return whether a text is the strength of a solution: "4 M"."""
    return STRENGTH.match(word) is not None


def is_transformation(word: str, first: bool = False) -> bool:
    """Return whether a word names a transformation or qualifies one; the `first` of a text may be an imperative."""
    return _BREAKER.fullmatch(word) is not None or (first and _IMPERATIVE.fullmatch(word) is not None)


def is_qualifier(word: str) -> bool:
    """Return whether a word only qualifies a transformation: "regioselective", "refluxing"."""
    return _QUALIFIER.search(word) is not None
