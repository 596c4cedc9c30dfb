"""Tokens of a procedure: words, names, figures and brackets, by sentence, without the characterization data."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import accumulate
from typing import Literal

from labgym.protocols.reading.figures import QuantitySpan
from labgym.protocols.reading.lexicon import AUXILIARIES, QUALITIES, SUBSTANCES, VerbWord, names_substance, verb_word

TokenKind = Literal["word", "name", "verb", "figure", "mark", "group"]
_CHUNK = re.compile(r"(?:\((?:\d{0,2}[a-z]?[RSEZ]{1,2}\*?, ){1,9}(?=\d{0,2}[a-z]?[RSEZ]{1,2}\*?\)))?\S+")
"""A word; spaces between the descriptors of a stereoisomer are a part of it: "(2S, 4S)-1-phenyl"."""
LONGEST_BRACKET = 400
"""Longest bracket, characters; a longer one is taken for two signs that do not belong together."""
_OPEN, _CLOSE = "([{", ")]}"
_LEADING, _TRAILING = "\"'*{}=?!~/,;:", ",;:\"'*?!=/([{"
_OCR_TAIL = re.compile(r"^\d{1,2}(?:[A-Z(·].*)?$")
_OCR_HEAD = re.compile(r"^(?:[A-Za-z)]*+[\d(\[\]·.-])*+[a-z)]*+[A-Z][A-Za-z)]*+$")
_ABBREVIATIONS = frozenset(
    [
        "aq.",
        "aqu.",
        "conc.",
        "sat.",
        "satd.",
        "dil.",
        "ca.",
        "approx.",
        "i.e.",
        "e.g.",
        "no.",
        "nos.",
        "fig.",
        "ex.",
        "ref.",
        "vol.",
        "wt.",
        "temp.",
        "b.p.",
        "m.p.",
        "m.",
        "lit.",
        "cf.",
        "vs.",
        "abs.",
        "anh.",
        "cat.",
        "equiv.",
        "eq.",
        "quant.",
        "r.t.",
        "r.t",
        "vac.",
        "prep.",
        "st.",
        "dr.",
        "co.",
        "inc.",
        "resp.",
        "et.",
        "al.",
        "etc.",
        "anhyd.",
        "anhydr.",
        "soln.",
        "sol.",
        "sec.",
        "tert.",
        "prim.",
        *("j.", "chem.", "soc.", "amer.", "het.", "org.", "pat.", "lett.", "synth.", "commun.", "pp."),
    ]
)
_DATA = re.compile(
    r"(?<![A-Za-z0-9])(?:\d{1,3} ?[HCFPN][- ]{0,2}NMR|NMR\b|[mM]\. ?[pP]\b\.?|[mM][pP]\b|"
    r"[mM]elting (?:at|near|point|range|with)|[bB]oiling (?:at|from|near) (?:about )?(?=\d)"
    r"|melt(?:s|ed (?:at|from|between))\b|(?:decomposes|distills?) (?:at|above) (?=\d)|m\.r\. "
    r"|[Ww]eight: (?=\d)|(?<!was )(?<!is )(?<!were )boil(?:ed|s) at (?=\d)"
    r"|(?:ES|EI|CI|FAB|LR|HR|LC|GC|MALDI|ESI|APCI|DCI|FD)[-+/ ]{0,2}MS\b(?! (?:showed|indicated|"
    r"analysis showed|revealed|confirmed))"
    r"|MS[- ]?(?=[(:=+mME[])|HRMS|m/[ze]\b|M/[ZE]\b|IR ?(?=[(:])|I\.R\.|FT-?IR|R ?f\b ?[=:0(~]|"
    r"[Mm]ass spec\b|(?:IR|UV|[Ii]nfrared|resonance|[Mm]ass)[- ](?:absorption )?spectr|TLC (?:in|analysis) |"
    r"(?<=\()(?:crude |isolated )?[Yy]ield:? (?=\d)|"
    r"Rf[- ]values?|[Tt]hin[- ]layer chromatogram\b|"
    r"[ν\u03bdv] ?max\b|τ ?[(:]|[Aa]cid number|n\.m\.r|[mM]pt\b|Smp\.|[mM]\.pt\.|"
    r"[Tt]he (?:(?:crude|overall|isolated|total) )?(?:purity|yield)(?: of [^.;]{0,60})? (?:was|is)\b|m\. ?(?=\d{2,3}°)|"
    r"RF: |Anal(?:ysis|\.)|Elemental|TLC:|Rt ?="
    r"|n ?D ?2[05]|nD2|[Rr]efractive index|calc(?:d|'d|ulated for)\b|[Bb]\. ?p\b\.?|"
    r"[Bb]oiling point|bp\b|ultraviolet absorption"
    r"|infrared (?:absorption )?spect|Yield ?[=:]|optical rotation|UV ?[(:]|λ|HPLC(?:[- ]purity|"
    r" ?: )|[Pp]urity ?[=:]|MH\+|\[M ?[+-]"
    r"|(?:n\.?m\.?r\.?|pmr|ir)(?: spectrum)? \((?=[A-Z])"
    r"|δ ?H? ?\((?=[A-Z\d])|[Ff]ound[:,]|[Oo]verall crude yield|appearance:)"
)
_ROTATION = re.compile(r"\[α\]|\[a\] ?D(?![a-z])")


@dataclass(frozen=True)
class Token:
    """A word, name, figure or mark of a sentence, or a bracket with its tokens.

    Attributes:
        start, end: the span in the text.
        low: the word in lower case.
        inner: tokens of a bracket.
    """

    start: int
    end: int
    text: str
    low: str
    kind: TokenKind
    figure: QuantitySpan | None = None
    verb: VerbWord | None = None
    inner: tuple[Token, ...] = ()


@dataclass(frozen=True)
class Sentence:
    """A sentence: its tokens, and the span of the characterization data at its end, if there are some."""

    tokens: tuple[Token, ...]
    data: tuple[int, int] | None = None


def sentences(text: str, figures: Sequence[QuantitySpan]) -> list[Sentence]:
    """Return the sentences of a text.

    Args:
        text: with one spelling of each sign.
        figures: of the text, in order.
    """
    flat = _joined(list(_flat(text, figures)))
    return [_without_data(text, _grouped(part)) for part in _split(flat)]


def _flat(text: str, figures: Sequence[QuantitySpan]) -> Iterator[Token]:
    at = 0
    for figure in figures:
        yield from _words(text, at, figure.start)
        yield Token(figure.start, figure.end, figure.text, figure.text.lower(), "figure", figure)
        at = figure.end
    yield from _words(text, at, len(text))


def _words(text: str, start: int, end: int) -> Iterator[Token]:
    for match in _CHUNK.finditer(text, start, end):
        yield from _chunk(text, match.start(), match.end())


def _chunk(text: str, start: int, end: int) -> Iterator[Token]:
    """Yield the marks around a word, and the word, which keeps its balanced brackets."""
    partners = _partners(text, start, end)
    closed = set(partners.values())
    tail: list[int] = []
    while start < end:
        first, last = text[start], text[end - 1]
        glued = first == "." and text[start + 1 : start + 2].isalpha()
        leads = first in _LEADING and start not in partners
        if leads or first in _CLOSE or glued or (first in _OPEN and start not in partners):
            yield _mark(text, start)
            start += 1
        elif last in _TRAILING or (last in _CLOSE and end - 1 not in closed) or _is_stop(text, start, end):
            end -= 1
            tail.append(end)
        elif first in _OPEN and partners[start] == end - 1:
            yield _mark(text, start)
            start, end = start + 1, end - 1
            tail.append(end)
        else:
            break
    if start < end:
        yield from _parted(text, start, end)
    for place in reversed(tail):
        yield _mark(text, place)


def _is_stop(text: str, start: int, end: int) -> bool:
    """Return whether a word ends with a full stop that is no part of an abbreviation."""
    return text[end - 1] == "." and not (end - start < 10 and text[start:end].lower() in _ABBREVIATIONS)


def _partners(text: str, start: int, end: int) -> dict[int, int]:
    """Return the places of closing brackets by those of their opening ones."""
    opened: list[int] = []
    found: dict[int, int] = {}
    for place in range(start, end):
        if text[place] in _OPEN:
            opened.append(place)
        elif text[place] in _CLOSE and opened:
            found[opened.pop()] = place
    return found


def _mark(text: str, place: int) -> Token:
    return Token(place, place + 1, text[place], text[place], "mark")


def _parted(text: str, start: int, end: int) -> Iterator[Token]:
    """Yield a word, or the names of a pair such as "EtOAc/hexane" with the sign between them."""
    cuts = list(_pair_cuts(text, start, end))
    for first, last in zip([start, *(cut + 1 for cut in cuts)], [*cuts, end], strict=True):
        if first > start:
            yield _mark(text, first - 1)
        word = text[first:last]
        low = word.lower()
        verb = verb_word(low)
        kind: TokenKind = "verb" if verb is not None else "name" if names_substance(word) else "word"
        if not any(map(str.isalnum, word)):
            kind = "mark"
        yield Token(first, last, word, low, kind, None, verb)


def _pair_cuts(text: str, start: int, end: int) -> Iterator[int]:
    word = text[start:end]
    if len(word) > 200 or not any(sign in word for sign in "/:-"):
        return
    for sign in "/:":
        parts = word.split(sign)
        fused = sign == ":" and "[" in word
        if len(parts) > 1 and not fused and all(_is_partner(part) for part in parts) and word.lower() != "pd/c":
            at = start
            for part in parts[:-1]:
                at += len(part)
                yield at
                at += 1
            return
    parts = word.split("-")
    if len(parts) > 1 and all(part.lower() in SUBSTANCES and len(part) > 3 for part in parts):
        yield from (start + length - 1 for length in accumulate(len(part) + 1 for part in parts[:-1]))


def _is_partner(part: str) -> bool:
    return len(part) > 1 and (names_substance(part) or (_OCR_TAIL.match(part) is not None and not part.isdigit()))


def _joined(tokens: list[Token]) -> list[Token]:
    """Return tokens with formulas whole that spaces part: "NaHCO 3", "K 2CO 3"; and "N, N-" names."""
    joined: list[Token] = []
    for token in tokens:
        last = joined[-1] if joined else None
        split = last is not None and token.kind in ("word", "name") and last.kind in ("word", "name")
        if split and last is not None and token.start == last.end + 1 and _continues(last.text, token.text):
            word = f"{last.text} {token.text}"
            solid = word.replace(" ", "")
            joined[-1] = Token(last.start, token.end, word, solid.lower(), "name" if names_substance(solid) else "word")
        else:
            joined.append(token)
    return joined


def _continues(head: str, tail: str) -> bool:
    if len(head) > 60 or len(tail) > 40:
        return False
    plain = head.replace(" ", "")
    return (
        _OCR_TAIL.match(tail) is not None
        and _OCR_HEAD.match(plain) is not None
        and len(plain) < 20
        and _is_formula(plain)
    )


def _is_formula(word: str) -> bool:
    return names_substance(f"{word}2") and (len(word) < 4 or not word.isalpha() or not word[1:].islower())


def _split(tokens: Sequence[Token]) -> Iterator[list[Token]]:
    """Yield the tokens of each sentence; a full stop inside brackets ends none."""
    part: list[Token] = []
    depth = 0
    paired = _pairs(tokens)
    for place, token in enumerate(tokens):
        part.append(token)
        if place in paired and token.text in _OPEN:
            depth += 1
        elif place in paired and token.text in _CLOSE:
            depth = max(0, depth - 1)
        elif token.text in (".", ";") and token.kind == "mark":
            follows = tokens[place + 1] if place + 1 < len(tokens) else None
            last = tokens[place - 1] if place else None
            ends = (
                token.text == "."
                and last is not None
                and last.kind in ("word", "verb", "name")
                and len(last.text) > 3
                and last.end == token.start
            )
            counted = last is not None and last.figure is not None and last.figure.kind in ("repeats", "time")
            ends = ends or (token.text == "." and counted)
            glued = last is not None and last.figure is not None and last.figure.kind == "molarity"
            glued = glued and follows is not None and follows.start == token.end
            glued = glued or (follows is not None and last is not None and _is_torn(last, follows))
            glued = glued or (follows is not None and _is_measured_before(part, follows))
            if follows is None or (
                depth == 0 and not glued and (_begins(follows, token) or (ends and follows.kind == "name"))
            ):
                yield part
                part, depth = [], 0
        elif token.kind == "figure" and depth == 0 and token.text.endswith("."):
            follows = tokens[place + 1] if place + 1 < len(tokens) else None
            begins = follows is not None and (len(follows.text) > 1 or follows.text == "A")
            if follows is not None and begins and (follows.text[:1].isupper() or _begins_with_number(follows)):
                yield part
                part = []
    if part:
        yield part


def _is_torn(last: Token, follows: Token) -> bool:
    """Return whether a misprinted full stop tears a name: "anhydrous. magnesium. sulfate"."""
    return (
        follows.kind == "name"
        and follows.text[:1].islower()
        and follows.text.islower()
        and (last.low in QUALITIES or last.kind == "name")
    )


def _is_measured_before(part: Sequence[Token], follows: Token) -> bool:
    """Return whether a full stop ends the unit of what a formula behind it names: "A mixture of 1.38 g. K2CO3"."""
    figure = part[-2].figure if len(part) > 1 else None
    amount = figure is not None and figure.kind in ("mass", "volume")
    formula = follows.kind == "name" and len(follows.text) > 1 and not follows.text[1].islower()
    return amount and formula and not any(token.kind == "verb" for token in part)


def _begins_with_number(token: Token) -> bool:
    weighed = token.figure is not None and token.figure.kind in ("mass", "volume", "molarity")
    return (token.kind == "name" or weighed) and token.text[:1].isdigit()


def _pairs(tokens: Sequence[Token]) -> set[int]:
    """Return the indices of brackets that have a partner near them."""
    opened: list[int] = []
    found: set[int] = set()
    for place, token in enumerate(tokens):
        if token.kind == "mark" and token.text in _OPEN:
            opened.append(place)
        elif token.kind == "mark" and token.text in _CLOSE and opened:
            first = opened.pop()
            if token.start - tokens[first].start <= LONGEST_BRACKET:
                found.update((first, place))
    return found


def _begins(follows: Token, mark: Token) -> bool:
    if mark.text == ";":
        return not follows.low.endswith(("hydrochloride", "salt", "ester", "hydrobromide"))
    return follows.text[:1].isupper() or follows.text[:1].isdigit() or follows.text[:1] in "[Δδ"


def _grouped(tokens: Sequence[Token]) -> tuple[Token, ...]:
    """Return tokens with each bracket as one token."""
    stack: list[list[Token]] = [[]]
    opened: list[Token] = []
    paired = _pairs(tokens)
    for place, token in enumerate(tokens):
        if place in paired and token.text in _OPEN:
            opened.append(token)
            stack.append([])
        elif place in paired and token.text in _CLOSE and opened:
            inner, first = tuple(stack.pop()), opened.pop()
            stack[-1].append(Token(first.start, token.end, "()", "()", "group", inner=inner))
        else:
            stack[-1].append(token)
    while opened:
        inner_tokens = stack.pop()
        stack[-1].extend(inner_tokens)
        opened.pop()
    return tuple(stack[0])


def _without_inner_data(tokens: Sequence[Token], places: list[int]) -> Iterator[Token]:
    """Yield the tokens without data in brackets behind which the sentence goes on; those leave `places`.

    The data of a bracket end at its next comma: "(194 g, purity: 84%, 1 mol) was added".
    """
    last = max((token.start for token in tokens if token.kind == "verb"), default=0)
    for token in tokens:
        found = [place for place in places if token.kind == "group" and token.start < place < token.end < last]
        for place in found:
            places.remove(place)
            stop = next((item.start for item in token.inner if item.text in ",;" and item.start > place), token.end)
            token = replace(token, inner=tuple(item for item in token.inner if not place <= item.start < stop))
        yield token


def _before(tokens: Sequence[Token], cut: int) -> Iterator[Token]:
    """Yield the tokens before a place; a bracket keeps what it holds before it: "a solid (12 g, mp 161 C)"."""
    for token in tokens:
        inner = tuple(item for item in token.inner if item.end <= cut)
        if token.end <= cut:
            yield token
        elif any(item.figure is not None for item in inner):
            yield replace(token, end=inner[-1].end, inner=inner)


def _without_data(text: str, tokens: tuple[Token, ...]) -> Sentence:
    if not tokens:
        return Sentence(())
    start, end = tokens[0].start, tokens[-1].end
    places = [match.start() for match in (*_DATA.finditer(text, start, end), *_ROTATION.finditer(text, start, end))]
    tokens = tuple(_without_inner_data(tokens, places))
    places = [place for place in places if not text[max(start, place - 12) : place].rstrip(" ,(").endswith("ether")]
    if not places:
        return Sentence(tokens)
    cut = min(places)
    later = [k for k, token in enumerate(tokens) if token.start >= cut]
    done = [k - 1 for k in later if tokens[k].kind == "verb" and k and tokens[k - 1].low in AUXILIARIES]
    if done:
        stop = next((k for k in later if tokens[k].text == ","), done[0])
        head = list(_before(tokens, cut))
        if stop in (done[0], done[0] - 1):
            stop, head = done[0], head[: -1 if head and head[-1].text == "," else None]
        return Sentence((*head, *tokens[stop:]))
    kept = tuple(_before(tokens, cut))
    return Sentence(kept, (kept[-1].end if kept else start, end))


def leaves(tokens: Iterable[Token]) -> Iterator[Token]:
    """Yield the tokens of a sentence, those inside of brackets one by one."""
    for token in tokens:
        if token.kind == "group":
            yield from leaves(token.inner)
        else:
            yield token
