"""Names in a text that are neither assets of the catalog nor ordinary words: unknown substances."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from functools import lru_cache

from labgym.protocols.language import Mention, concepts
from labgym.protocols.language.concepts import lexicon
from labgym.protocols.language.vocabulary import is_ordinary, is_particle, is_verbal_ending, ordinary_chinese
from labgym.protocols.synthesis.derivatives import derivatives
from labgym.protocols.synthesis.operations import operation_stem, operations, table
from labgym.units import UNITS

SHORTEST_NAME = 6
_METALS = (
    r"sodium|potassium|lithium|calcium|barium|zinc|copper|silver|gold|iron|lead|mercury|nickel|cobalt|manganese|tin|"
    r"ammonium|c(?:a)?esium|magnesium|alumini?um|palladium|platinum|titanium|boron|phosphorus|sulfur|chromium|rhodium|"
    r"ruthenium|samarium|indium|bismuth|cerium|hydrogen|thallium|osmium|selenium|arsenic"
)
_SALT = re.compile(
    rf"\b(?:{_METALS})(?:\s?\([iv]+\))?\s(?:(?:tri|di|per|bi|hydrogen\s)?[a-z-]*(?:ide|ate|ite)s?)\b", re.IGNORECASE
)
_BINARY = re.compile(
    r"\b[a-z]{3,20}\s(?:mono|di|tri|tetra|penta|hexa)(?:oxide|chloride|bromide|fluoride|iodide|sulfide|selenide)s?\b"
    r"|\b(?P<oxidized>[a-z]{3,20}(?:ic|ous))\s(?:oxide|chloride|bromide|fluoride|iodide|sulfate|nitrate|acetate)s?\b",
    re.IGNORECASE,
)
"""A compound of two elements by their numbers, "carbon dioxide", or by a state of oxidation, "cyanuric chloride"."""
_ELEMENT = re.compile(
    rf"(?:{_METALS})(?:\s(?:powder|dust|turnings|granules|filings|wool|metal))?"
    r"(?=[,;.)]|\s(?:with|and|in|to|at|under)\b|$)",
    re.IGNORECASE,
)
"""A metal by its name alone."""
_PARENT = re.compile(
    r"(?:di|tri)?(?:bor|sil|germ|stann|phosph|ars|alum)ane|(?:alumin|zirconi|titani|ceri|magnesi|yttri|thori)a"
)
"""The names of hydrides and of oxides that are the same in each language: borane, alumina."""
_ACID = re.compile(
    r"\b(?:\d[\d,']{0,20}-|[opm]-)?[a-z][a-z0-9,()\[\]'-]{0,80}(?:ic|ous)\s(?:acid|anhydride)\b", re.IGNORECASE
)
_NAMED_AFTER = re.compile(
    r"(?<=[a-z0-9,]\s)(?!(?:Grignard|Wittig|Lewis|Br[oö]nsted|Schiff|Dean|Hickman|Liebig|Dimroth|The|A|An|This|Raney)\b)"
    r"[A-Z][a-zéöüäø]{3,20}(?:-[A-Z][a-zéöüäø]{2,20}){0,2}(?:['’]s?)?\s(?:reagent|base|acid|salt|catalyst|complex|ylide|auxiliary|sultam)\b"
)
"""A substance named after somebody: "Lawesson's reagent", "Meldrum's acid", "Lindlar catalyst"; not the first word."""
_RADICALS = (
    r"[a-z]{4,}onium\s|[a-z]{4,}(?:magnesium|zinc)\s|"
    r"(?:[a-z0-9,()\[\]'-]{1,60}+(?<=[a-z]yl) ){0,4}[a-z0-9,()\[\]'-]{0,60}[a-z]yl[ -]"
)
_TWO_WORDS = re.compile(
    rf"(?<![\w-])(?:{_RADICALS})(?:(?:magnesium|lithium|zinc)\s?)?"
    r"(?:chloride|bromide|iodide|fluoride|alcohol|amine|ether|ketone|azide|cyanide|isocyanate|acetate|formate|benzoate|"
    r"acrylate|aniline|phenol|pyridine|benzene|toluene|nitrite|nitrate|mercaptan|thiol|tosylate|mesylate|triflate|"
    r"chloroformate|acetoacetate|malonate)s?\b",
    re.IGNORECASE,
)
_WORD = re.compile(r"(?<![A-Za-z0-9])(?:\d[\d,']{0,20}-|[NOopm]-)?[A-Za-z][A-Za-z0-9,()\[\]'-]*[A-Za-z)]")
_ENDING = re.compile(
    r"(?:ane|ene|yne|ol|one|al|amine|aniline|amide|imide|ate|ide|ite|ine|azole|ophene|furan|aldehyde|nitrile|yl|oxide|"
    r"indole|silane|borane|lactone|lactam|acid|phthalein|lithium|oate|azine|urea|hydride)s?$"
)
_TRIVIAL_ENDING = re.compile(
    r"(?:[a-z]{3}(?:(?<!p)(?<!l)(?<!o)(?<!n)ose|(?:r|v|th|n|z|d|x|s|eg|tral|dan|(?<!cyc)l|[uj])one|(?:n|s|e|d|a|th|(?<!di)(?<!ac)c|(?<!al)(?<!ip)p|"
    r"(?<!com)(?<!tur)(?<!car)(?<!cu)(?<!um)b)ine|[tzdnf]ole|[tdnl]ase|"
    r"(?:b|ant|orn|al|ost|ol)ane|(?:pt|os|char|ot|ar)ide|(?:ll|dr|ar|ir|at|ot|on|er|al|th|[a-z][lsv]|en)in|[st]id)|"
    r"[a-z]{2}(?:[^vi\W]ene|adiene|zil|[znsr]oin)|[a-z]{2}(?:i|er|an|en|in|th|e|ym|ac|acr|ech|it|yt|es|alo|phen)ol)s?$"
)
"""Endings of trivial names that hardly any word of another kind has: limonene, estrone, quinine, geraniol, vanillin."""
_CLASS = (
    r"(?:aldehyde|nitrile|amide|imide|lactam|lactone|azole|azine|ophene|furan|indole|silane|siloxane|phthalein|amine|"
    r"aniline|phenone|quinone|sulfone|sulfoxide|oxime|hydrazone|carbazone|azide|carbamate|imine|silanol|anilide|adduct)s?"
)
_OF_CLASS = re.compile(rf"[a-z]{{3}}{_CLASS}$")
"""A name that ends in the name of a class of substances, whatever its stem is: caprolactam."""
_BROAD_ENDING = re.compile(r"[a-z]{2}(?:one|ane|ene|yne|[nr]al|ol|ine|in|ide|ose)s?$")
"""Endings of names where hardly anything but a name can be: after the verb of a transformation."""
_TRANSFORMED = re.compile(
    r"\b(?:reduc|oxidi[sz]|acet?ylat|benzoylat|alkylat|acylat|methylat|benzylat|epoxidi[sz]|hydrogenat|brominat|"
    r"chlorinat|iodinat|sulfonat|tosylat|silylat|formylat|protect|deprotect|dehydrat|hydroly[sz]|condens|coupl|"
    r"cycli[sz]|esterif|saponif)(?:e|ing|y|ying|ion\sof)?\s+$|"
    r"(?:^|[.;:]\s)(?-i:[A-Z])[a-z]{2,20}(?:ate|i[sz]e|ify|ly[sz]e)\s$",
    re.IGNORECASE,
)
_ISOLATED = re.compile(
    r"\b(?:collect|isolat|filter|distil|re-?crystalli[sz]|crystalli[sz]|precipitat|sublim|chromatograph|separat|obtain|"
    r"recover|leav)[a-z]{0,4}\s(?:off\s|out\s|over\s)?(?:the\s|pure\s|crude\s){1,2}$",
    re.IGNORECASE,
)
_ISOLATES = re.compile(r"\s(?:crystalli[sz]es|separates|precipitates|sublimes|distils|settles)\b", re.IGNORECASE)
"""Text before and after the name of a substance that is collected."""
_LAMP = re.compile(r"\s(?:vapou?r\s|arc\s)?(?:lamp|arc|light|thermometer|manometer|bubbler|electrode|cathode|anode)\b")
_OBJECT = re.compile(r"\s(?!is\b|was\b|were\b|are\b|and\b|in\b|with\b|of\b|from\b|to\b)[a-z0-9]")
"""The object of an instruction after its verb; after a name there is another verb."""
_ADJECTIVE = re.compile(
    r"(?:ical|ional|ermal|gonal|idal|urnal|odontal|priate|portionate|minate|pagate|timidate|torate)s?$"
)
_MORPHEME = re.compile(
    r"meth|eth|prop|but|pent|hex|hept|oct|phen|benz|naphth|tolu|anis|chlor|brom|iod|fluor|nitr|cyan|amin|hydrox|oxy|"
    r"carb|sulf|phosph|acet|malon|succin|phthal|cinnam|salicyl|furan|thio|pyr|imid|indol|quinol|morphol|piper|azol|"
    r"silyl|boro|ket|cyclo|tert|peroxy|hydr|aldehyde|aniline|styr|allyl|vinyl"
)
_SIMPLE = re.compile(
    r"^(?:meth|eth|prop|but|pent|hex|hept|oct|non|dec)(?:an|en|yn)(?:al|ol|one|e|oic|amine|oate|amide)s?$"
)
_PROCESS = re.compile(r"(?:ation|ylat(?:e|ed|ing)|lysis|ify|ified|ised|ized|ically|ic|ity|ment|ness|ing|ed|tic)$")
_SYMBOLS = (
    "H He Li Be B C N O F Na Mg Al Si P S Cl Ar K Ca Sc Ti V Cr Mn Fe Co Ni Cu Zn Ga Ge As Se Br Rb Sr Y Zr Nb Mo Ru "
    "Rh Pd Ag Cd In Sn Sb Te I Cs Ba La Ce Sm W Re Os Ir Pt Au Hg Tl Pb Bi U"
)
_GENERIC = re.compile(r"\b(?:alk|ar|ac|sil|carbon|hydrox|sulfon|phosphor|phen)yl\b", re.IGNORECASE)
_HAN = (
    "甲乙丙丁戊己庚辛壬癸苯酚酸醇酮醛胺酯醚烷烯炔腈酐氯溴碘氟硝羟氨对间邻叔异正仲环三四硫磷钠钾锂钙镁铝铁铜锌银汞铅锡"
    "氢氧氮杂噻吩呋喃吡啶咪唑喹啉吗萘蒽芴肼脲胍肟"
)


def unlisted(text: str, mentioned: Sequence[Mention]) -> tuple[tuple[int, int], ...]:
    """Return the spans of names that are neither mentions nor ordinary words, in order, overlaps resolved.

    Names that look like chemistry count wherever they are; other unknown words only where a substance would be.
    """
    names = [*_compounds(text), *_words(text), *_formulas(text), *_salts(text, mentioned), *_unknown(text, mentioned)]
    names += [match.span() for match in _NUMBERED.finditer(text)]
    names += derivatives(text, mentioned)
    spans: list[tuple[int, int]] = []
    for start, end in sorted((*names, *_chinese(text, mentioned)), key=lambda span: (span[0] - span[1], span[0])):
        covered = any(m.start <= start and end <= m.end for m in mentioned)
        if not covered and not any(start < b and a < end for a, b in spans):
            spans.append((start, end))
    return tuple(sorted(spans))


def chemical_names(text: str) -> bool:
    """Return whether a text has a word that looks like the name or formula of any substance."""
    return any(True for _ in (*_compounds(text), *_words(text), *_formulas(text)))


def is_named_like_a_substance(text: str) -> bool:
    """Return whether a phrase may name a substance, if the wording announces one."""
    words = [word.lower().strip("(),'-") for word in text.split()]
    return any(len(word) >= SHORTEST_NAME and _ENDING.search(word) and not _is_operation(word) for word in words)


def _compounds(text: str) -> Iterator[tuple[int, int]]:
    """Names of several words: salts, acids, alkyl derivatives."""
    for pattern in (_SALT, _BINARY, _ACID, _TWO_WORDS, _NAMED_AFTER):
        for match in pattern.finditer(text):
            if pattern is _BINARY and is_ordinary(match["oxidized"] or ""):
                if match["oxidized"]:
                    continue
            generic = _GENERIC.search(match[0]) and pattern is _TWO_WORDS and not _MORPHEME.findall(match[0].lower())
            if not generic and not _is_operation(match[0]):
                yield match.span()


def _words(text: str) -> Iterator[tuple[int, int]]:
    common = frozenset(table().unlisted_words)
    for match in _WORD.finditer(text):
        start, end = match.span()
        while text[end - 1] == ")" and not _balanced(text[start:end]):
            end -= 1
        word = text[start:end].strip("(),'-").lower()
        if _LAMP.match(text, end) or _is_imperative(text, start, end):
            continue
        plain = word[0].isdigit() or not (_is_operation(word) or concepts(word))
        if word in common or word.rstrip("s") in common or (plain and _looks_chemical(word)):
            yield start, end


def _looks_chemical(word: str) -> bool:
    if _SIMPLE.match(word):
        return True
    if not _ENDING.search(word) or (_PROCESS.search(word) and not word[0].isdigit()):
        return False
    return len(_MORPHEME.findall(word)) >= (1 if word[0].isdigit() else 2)


def _has_name_of_substance(word: str) -> bool:
    """Return whether a word where a substance may be is built like the name of one.

    It has two chemical stems, one and a chemical ending, or an ending that hardly any other word has, or it is a
    trivial name or brand of the table.
    """
    parts = [part for part in re.split(r"[^a-z]+", word) if part]
    common = table().unlisted_words
    if _PARENT.fullmatch(word) or _OF_CLASS.search(word):
        return True
    if any(part in common or part.removesuffix("s") in common for part in parts):
        return True
    if _ADJECTIVE.search(word):
        return False
    if _TRIVIAL_ENDING.search(word):
        return True
    stems = len(_MORPHEME.findall(word))
    return not _PROCESS.search(word) and (stems > 1 or (stems == 1 and _ENDING.search(word) is not None))


def _formulas(text: str) -> Iterator[tuple[int, int]]:
    for match in _formula().finditer(text):
        token = match[0]
        elements = re.findall(r"[A-Z][a-z]?", token)
        if len(elements) >= 2 and token not in table().group_formulas and re.search(r"\d|[a-z]", token):
            yield match.span()


def _salts(text: str, mentioned: Sequence[Mention]) -> Iterator[tuple[int, int]]:
    """Yield names that continue as another substance: "aniline hydrochloride", "benzaldehyde dimethyl acetal"."""
    for mention in mentioned:
        match = _SALT_OF.match(text, mention.end)
        if match is not None and mention.kind == "reagent":
            yield mention.start, match.end()


def _unknown(text: str, mentioned: Sequence[Mention]) -> Iterator[tuple[int, int]]:
    """Yield English words that are unknown here and look like a name, carry an amount, or are where a substance is."""
    for start, end in _tokens(text):
        token = text[start:end]
        handled = _TRANSFORMED.search(text[max(start - 24, 0) : start]) or _is_isolated(text, start, end)
        transformed = bool(handled and _BROAD_ENDING.search(token) and not re.fullmatch(_CLASS, token))
        covered = sum(min(end, m.end) - max(start, m.start) for m in mentioned if m.start < end and start < m.end)
        if covered and not any(m.start < start or end < m.end for m in mentioned if m.start < end and start < m.end):
            rest = token
            for mention in mentioned:
                if start <= mention.start < end:
                    rest = rest.replace(mention.text, "", 1)
            if is_ordinary(rest) or len(rest.strip("-,()'0123456789")) < 2:
                continue
        elif covered:
            continue
        head, tail = text[:start], text[end:]
        element = _ELEMENT.match(text, start)
        if (is_ordinary(token) if transformed else _is_known(token)) and not (element and _POSITION.search(head)):
            continue
        if _LAMP.match(tail) or _is_imperative(text, start, end):
            continue
        weighed = _AMOUNT_AFTER.match(tail) or _AMOUNT_BEFORE.search(head)
        expected = _POSITION.search(head) is not None
        if not expected and not re.fullmatch(_CLASS, token):
            expected = _is_ordered(head, mentioned) or _follows_operation(head)
        ester = _RADICAL_WORDS.search(head) is not None and _ENDING.search(token) is not None
        named = expected and (element is not None or _has_name_of_substance(token.lower()))
        if weighed or ester or transformed or named or _NAME_LIKE.search(token):
            if not _NOUN_AFTER.match(tail) and not _EXCLUDED.search(head):
                yield _with_radicals(text, start), end


def _is_isolated(text: str, start: int, end: int) -> bool:
    """Return whether a text collects what a word names: "collect the tannin", "until tannin separates"."""
    return bool(_ISOLATED.search(text, max(start - 40, 0), start) or _ISOLATES.match(text, end))


def _is_imperative(text: str, start: int, end: int) -> bool:
    """Return whether a word is the verb of an instruction: "Nitrosate diphenylamine"."""
    first = not text[:start].strip() or text[:start].rstrip()[-1] in ".;:。；"
    return first and text[start:end].endswith(("ate", "ize", "ise", "ify")) and _OBJECT.match(text, end) is not None


def _is_ordered(head: str, mentioned: Sequence[Mention]) -> bool:
    """Return whether the word before a text's end begins a sentence and names nothing: "Saponify" before "estrone"."""
    verb = _IMPERATIVE.search(head)
    return verb is not None and not any(m.start <= verb.start(1) < m.end for m in mentioned)


def _follows_operation(head: str) -> bool:
    """Return whether the word before a text's end is the verb of an operation: "Grind", "irradiated", "take up"."""
    verb = _VERB_BEFORE.search(head[-100:])
    if verb is None:
        return False
    word = verb[1].lower()
    stems = (operation_stem(word), *(concept.english.match(word) for concept in lexicon().values()))
    return any(stem is not None and is_verbal_ending(word[stem.end() :]) for stem in stems)


def _tokens(text: str) -> Iterator[tuple[int, int]]:
    """Yield the spans of words with their locants and brackets, without the punctuation around them."""
    for chunk in _CHUNK.finditer(text):
        for piece in _PIECE.finditer(chunk[0]):
            start, end = chunk.start() + piece.start(), chunk.start() + piece.end()
            while start < end and (text[start] in "([{'\"-" and not _balanced(text[start:end])):
                start += 1
            while start < end and (
                text[end - 1] in ".,;:!?'\"-" or (text[end - 1] in ")]}" and not _balanced(text[start:end]))
            ):
                end -= 1
            if start < end and text[start] == "(" and text[end - 1] == ")":
                start, end = start + 1, end - 1
            token = text[start:end]
            if len(re.findall(r"[A-Za-z]", token)) > 1 and not _QUANTITY.fullmatch(token):
                yield start, end


def _balanced(token: str) -> bool:
    return all(token.count(a) == token.count(b) for a, b in ("()", "[]", "{}"))


def _is_known(token: str) -> bool:
    if is_ordinary(token) or token in table().group_formulas or token.lower() in _UNITS:
        return True
    lowered = token.lower()
    stems = (operation_stem(lowered), *(c.english.match(lowered) for c in lexicon().values()))
    return any(stem is not None and is_verbal_ending(lowered[stem.end() :]) for stem in stems)


def _with_radicals(text: str, start: int) -> int:
    """Return where a name begins whose last word begins at `start`: radicals and metals before it belong to it."""
    match = _RADICAL_WORDS.search(text, 0, start)
    return match.start() if match is not None else start


_NUMBERED = re.compile(
    r"\b(?:compound|substrate|intermediate|ketone|aldehyde|alcohol|amine|acid|ester|bromide|diol|olefin|alkene|product)"
    r"\s+\(?\d{1,2}[a-z]?\)?(?![\w.]*\s*(?:g\b|mg|mmol|mol|m?L\b|°|%|equiv|eq|h\b|min|C\b))(?![\d.])",
    re.IGNORECASE,
)
"""A substance by its number in another text: "compound 3", "the ketone 5a"."""
_UNITS = frozenset(spelling for units in UNITS.values() for spellings in units.values() for spelling in spellings)
_CHUNK = re.compile(r"[^\s\u3000-\u303f\u3400-\u9fff\uff00-\uffef;→]+")
_PIECE = re.compile(r"(?:[^/,+=]|(?<=\d),(?=[\dNO])|(?<=[NO]),(?=[NO]))+")
_QUANTITY = re.compile(
    r"[~<>≈±]?[-−–]?\d[\d.,:x×/–-]*(?:[mkμµu]?g|[mμµu]?l|m?mol|m|n|mm|cm|nm|h|hr|hrs|min|mins|s|d|°?c|°?f|k|cc|oz|lb|lbs|"
    r"bar|mbar|psi|atm|kpa|mpa|torr|w|a|å|eq|equiv|hz|rpm|x|th|st|nd|rd|ppm|v|%|mol%|fold)?",
    re.IGNORECASE,
)
_NAME_LIKE = re.compile(
    r"^(?>\D*\d).*[A-Za-z]{2}|^(?>.*?[A-Za-z]{2}).*\d|^(?>[^A-Z]*[A-Z])[^A-Z]*[A-Z]|^[a-z]-[A-Za-z]{4}|\[|\("
)
"""Digits or several capitals in a word: HATU, T3P, 2-naphthol, SPhos, Pd(dppf)Cl2."""
_SALT_OF = re.compile(
    r"\s(?:mono|di|hemi)?(?:hydrochloride|hydrobromide|hydroiodide|sulfate|sulphate|nitrate|phosphate|tosylate|acetate|"
    r"oxalate|tartrate|N-oxide|oxide|methiodide|picrate|imine|oxime|hydrazone|semicarbazone|cyanohydrin|"
    r"anhydride|(?:di)?(?:methyl|ethyl|propyl|butyl|benzyl|phenyl|tert-butyl|silyl|vinyl|enol)\s(?:ester|ether|"
    r"acetal|ketal|imine|amide|hydrazone))s?\b",
    re.IGNORECASE,
)
_N = r"\d+(?:\.\d+)?\s*(?:[mkμµu]?g|[mμµu]?l|m?mol|equiv|eq|oz|cc|lb|grams?|drops?)\b"
_AMOUNT_AFTER = re.compile(rf"\s*[(（]\s*{_N}|\s*,\s*{_N}", re.IGNORECASE)
_AMOUNT_BEFORE = re.compile(rf"(?<!\d){_N}\s+(?:of\s+)?(?:crude\s+|the\s+|dry\s+)?$", re.IGNORECASE)
_MODIFIER = (
    r"(?:(?:[a-z]*yl|an?|the|some|any|crude|pure|dry|fresh|excess|little|solid|liquid|commercial|cold|hot|dilute|aqueous|"
    r"more|[a-z]{2,12}(?:ed|en|ing|ly))\s+){0,4}"
)
_VERB_BEFORE = re.compile(rf"(?<![A-Za-z])([A-Za-z]{{3,20}})\s+(?:(?:up|off|out|down)\s+)?{_MODIFIER}$", re.IGNORECASE)
_POSITION = re.compile(
    rf"(?:^|[,;:(+/.]|\b(?:with|of|from|using|in|into|to|and|or|plus|between|by|via|over|on|onto|through|as|until|then|up|catalytic|pass|bubble|admit|introduce|"
    rf"cat\.|reduc\w*+|oxidi\w*+|coupl\w*+|treat\w*+|add\w*+|dissolv\w*+|protect\w*+|deprotect\w*+|bromin\w*+|chlorin\w*+|"
    rf"acet?yl\w*+|alkyl\w*+|acyl\w*+|hydro\w*+|esteri\w*+|conver\w*+|react\w*+|condens\w*+|epoxidi\w*+|heat\w*+|stir\w*+|"
    rf"recrystalli\w*+|distil\w*+|purif\w*+|nitrat\w*+|tosyl\w*+|silyl\w*+|dehydr\w*+|methyl\w*+|benzyl\w*+|mix\w*+|take\w*+))"
    rf"\s*{_MODIFIER}$",
    re.IGNORECASE,
)
_IMPERATIVE = re.compile(rf"(?:^|[.;:。；]\s*)([A-Z][a-z]{{1,20}}(?:-[a-z]{{1,20}})?)\s+{_MODIFIER}$")
"""The first word of a sentence, an imperative for the next word: "Saponify ethyl lactate"."""
_NOUN_AFTER = re.compile(
    r"\s+(?:reaction|synthesis|conditions?|work-?up|procedure|protocol|method|apparatus|flask|funnel|trap|bath|column|"
    r"coupling|reduction|oxidation|condensation|addition|esterification|rearrangement|conversion|modification|type|"
    r"product|crystals|needles|foam|oil|colou?r)\b",
    re.IGNORECASE,
)
_EXCLUDED = re.compile(
    r"(?<![a-z])(?:exclu\w+|absence|free|protect\w* from|without|avoid\w*|away from|removal|loss|evolution|called|"
    r"named|like|"
    r"excess|residual|remaining|leftover|destroy\w*|decompos\w*|test\w* for|check\w* for|"
    r"dr\.|prof\.|mr\.|ms\.|mrs\.)\s+(?:of\s+|the\s+|any\s+|all\s+)*$",
    re.IGNORECASE,
)
_RADICAL_WORDS = re.compile(
    r"(?:(?<![A-Za-z-])(?:[A-Za-z0-9,'-]{0,60}yl|(?<![\d°/])(?<![\d°]\s)[A-Z][A-Za-z]?\(?[IV]{0,3}\)?)\s){1,5}$"
)
"""Radicals and metals at the end of a text; "M" of "0.01 M" and "C" of "80 C" are units."""


def _chinese(text: str, mentioned: Sequence[Mention]) -> Iterator[tuple[int, int]]:
    """Yield the rest of a Chinese text between mentions, ordinary words and particles, if it may be a name."""
    free = [True] * len(text)
    names = [(m.start, m.end) for m in mentioned if m.kind != "class"]
    for start, end in (*names, *ordinary_chinese(text)):
        free[start:end] = [False] * (end - start)
    for mention in mentioned:
        # A class after another character is the end of a name: 酮 in 雌酮.
        before = mention.start - 1
        inside = before >= 0 and free[before] and _HAN_RUN.match(text[before]) and not is_particle(text[before])
        if mention.kind == "class" and not inside:
            free[mention.start : mention.end] = [False] * (mention.end - mention.start)
    for match in _HAN_RUN.finditer(text):
        start, end = match.span()
        while start < end and not free[start]:
            start += 1
        for a, b in _free_runs([f and text[i] not in _JOINING for i, f in enumerate(free)], start, end):
            for name_start, name_end in _name_in(text, a, b):
                joined = next((m for m in mentioned if m.start < name_start <= m.end and m.kind == "reagent"), None)
                if joined is None or not _is_chemical(text[name_start]):
                    yield name_start, name_end
                    continue
                locants = _LOCANTS.search(text, 0, joined.start)
                yield (locants.start() if locants is not None else joined.start), name_end


def _free_runs(free: Sequence[bool], start: int, end: int) -> Iterator[tuple[int, int]]:
    begin: int | None = None
    for place in range(start, end + 1):
        if place < end and free[place]:
            begin = place if begin is None else begin
        elif begin is not None:
            yield begin, place
            begin = None


def _name_in(text: str, start: int, end: int) -> Iterator[tuple[int, int]]:
    """Yield the name in an unexplained run: particles at its ends go, except where they begin a chemical name."""
    while (
        start < end
        and is_particle(text[start])
        and not (text[start] == "对" and _is_chemical(text[start + 1 : start + 2]))
    ):
        start += 1
    while end > start and is_particle(text[end - 1]) and text[end - 1] not in "酸碱盐":
        end -= 1
    run = text[start:end]
    if not run or _names_a_process(run) or run in ("酸", "碱", "盐"):
        return
    chemical = any(_is_chemical(char) for char in run)
    while chemical and start > 0 and _is_chemical(text[start - 1]):
        start -= 1
    if (chemical or len(run) > 1) and not all(is_particle(char) for char in run):
        locants = _LOCANTS.search(text, 0, start)
        yield (locants.start() if locants is not None else start), end


def _is_chemical(char: str) -> bool:
    return bool(char) and char in _HAN


_JOINING = frozenset("与和及跟同将把用以由从的在于到入")
"""Particles that are part of no name."""
_HAN_RUN = re.compile(r"[\u3400-\u9fff]+")
_LOCANTS = re.compile(r"(?:[A-Za-z0-9,'α-ω]{1,20}-){1,6}$")


def _names_a_process(name: str) -> bool:
    """Return whether a Chinese name is a word for an operation or transformation, such as 酯化 or 氧化."""
    return name.endswith("化") or name in ("还原胺", "重氮", "叠氮")


def _is_operation(text: str) -> bool:
    return bool(operations(text))


@lru_cache(maxsize=1)
def _formula() -> re.Pattern[str]:
    symbols = "|".join(sorted(_SYMBOLS.split(), key=len, reverse=True))
    return re.compile(
        rf"(?<![A-Za-z0-9])(?:(?:{symbols})\d{{0,2}}|\((?:(?:{symbols}|Me|Et|Ph|Ac)\d{{0,2}})+\)\d{{0,2}}){{2,}}(?![A-Za-z0-9])"
    )
