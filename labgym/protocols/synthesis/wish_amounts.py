"""Amounts and conditions that a wish states: read from it, and put into the actions of a general procedure."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

from labgym.protocols.amounts import figure, scaled
from labgym.protocols.errors import RefusalError
from labgym.protocols.experiments.model import Action, Portion
from labgym.protocols.language.vocabulary import unknown_measures, unmeasured
from labgym.protocols.reading.figures import QuantitySpan, figures, plain
from labgym.protocols.synthesis.wish_mentions import Mention

PROCEDURE_MOLES = 0.010
"""Moles of the substrate in a general procedure."""
WARM_C = 30.0
"""Temperature above which a mixture is heated, degrees Celsius."""
MMOL = re.compile(r"^(\d+(?:\.\d+)?) mmol$")
_BRACKET = re.compile(r"\(([^()]{1,80})\)")
_BEFORE_CONDITION = re.compile(r"\b(?:at|for|to|under)(?: about| ca\.?)? *$")
_REFLUX = re.compile(r"\b(?:(?:at|under|to|with) +)?reflux\b(?! *\w*ing)", re.IGNORECASE)
_BARE_NUMBER = re.compile(
    r"(?<![\w.,\[+-])[-+]?\d{1,6}(?:\.\d{1,4})?(?! ?[MN%]\b)(?: [A-Za-z]{1,14}|[A-Za-z]{2,14})\b(?![-\d,'(\[])"
)
_GAS = re.compile(
    r"\bunder (?:an? )?(?:inert )?(?:atmosphere of )?(?:(argon|ar\b)|nitrogen|n2\b|inert gas)(?: atmosphere)?",
    re.IGNORECASE,
)
_BETWEEN = re.compile(r"[\s,;]*(?:of\s+)?(?:(?:a|an|the|dry|anhydrous)\s+)*")
_HOLDS = ("Stir", "Heat", "Reflux")
_WORKUP = ("Quench", "Wash", "Extract", "Filter", "Concentrate", "AdjustPH", "Distill")


@dataclass(frozen=True)
class StatedWish:
    """A wish whose amounts and conditions are read.

    Attributes:
        text: of the same length, with blanks for what is read.
        amounts: of one substance each, next to it or in brackets after it.
        temperature: degrees Celsius. duration: minutes. reflux: whether the mixture boils under reflux.
        atmosphere: gas above the mixture.
    """

    text: str
    amounts: tuple[tuple[QuantitySpan, ...], ...] = ()
    temperature: float | None = None
    duration: float | None = None
    reflux: bool = False
    atmosphere: Literal["nitrogen", "argon"] | None = None

    @property
    def states_any(self) -> bool:
        """Whether it states an amount or a condition."""
        return bool(self.amounts) or self.reflux or (self.temperature, self.duration, self.atmosphere) != (None,) * 3


def stated_wish(text: str) -> StatedWish:
    """Read the amounts and conditions of a wish.

    Raises:
        RefusalError: it states several temperatures or times, or another figure, which only a procedure can; or an
            amount that is none.
    """
    simple = plain(text)
    numbers = [item for item in figures(simple) if item.kind not in ("molarity", "percent", "ratio", "repeats")]
    if nothing := next((item for item in numbers if item.is_amount and item.low <= 0.0), None):
        raise RefusalError("unaccounted", f"{nothing.text!r} is not an amount: give one above 0")
    amounts: list[tuple[QuantitySpan, ...]] = []
    blank = list(text)
    for match in _BRACKET.finditer(simple):
        inner = [item for item in numbers if match.start() < item.start and item.end < match.end()]
        rest = match[1]
        for item in inner:
            rest = rest.replace(item.text, "", 1)
        if inner and not rest.strip(" ,;/") and all(item.is_amount for item in inner):
            amounts.append(tuple(inner))
            blank[match.start() : match.end()] = " " * (match.end() - match.start())
    single = [item for item in numbers if not any(item in group for group in amounts)]
    amounts += [(item,) for item in single if item.is_amount]
    conditions = [item for item in single if not item.is_amount]
    temperatures = [item for item in conditions if item.kind == "temperature"]
    times = [item for item in conditions if item.kind == "time"]
    reflux = _REFLUX.search(simple)
    others = [item for item in conditions if item.kind not in ("temperature", "time")]
    if others or len(temperatures) + bool(reflux) > 1 or len(times) > 1:
        what = (others or temperatures or times)[-1].text
        raise RefusalError("unaccounted", f"a wish states one temperature and one time ({what!r}): write a procedure")
    for item in single:
        before = _BEFORE_CONDITION.search(simple[: item.start]) if not item.is_amount else None
        start = before.start() if before is not None else item.start
        blank[start : item.end] = " " * (item.end - start)
    if reflux is not None:
        blank[reflux.start() : reflux.end()] = " " * (reflux.end() - reflux.start())
    gas = _GAS.search(simple)
    if gas is not None:
        blank[gas.start() : gas.end()] = " " * (gas.end() - gas.start())
    rest = "".join(blank)
    strange = (*unmeasured(text), *unknown_measures(text), *(match[0] for match in _BARE_NUMBER.finditer(rest)))
    if strange:
        raise RefusalError("unaccounted", f"{strange[0]!r} is no known amount: give it in a unit such as g, mL or mmol")
    return StatedWish(
        text=rest,
        amounts=tuple(amounts),
        temperature=temperatures[0].value if temperatures else None,
        duration=times[0].value if times else None,
        reflux=reflux is not None,
        atmosphere=None if gas is None else "argon" if gas[1] else "nitrogen",
    )


def with_amounts(wish: StatedWish, mentions: Sequence[Mention]) -> tuple[Mention, ...]:
    """Return the mentions of a wish with their amounts.

    Raises:
        RefusalError: an amount is next to no substance, or next to one that has an amount.
    """
    several = list(mentions)
    for group in wish.amounts:
        start, end = group[0].start, group[-1].end
        after = [m for m in several if m.start >= end and _BETWEEN.fullmatch(wish.text[end : m.start])]
        before = [m for m in several if m.end <= start and not wish.text[m.end : start].strip(" (,")]
        in_brackets = len(group) > 1 or (wish.text[max(0, start - 1) : start] == " " and before and not after)
        owner = (before[-1:] or after[:1]) if in_brackets else (after[:1] or before[-1:])
        if not owner or owner[0].amounts or owner[0].part == "product":
            raise RefusalError("unaccounted", f"{group[0].text!r} belongs to no substance of the wish")
        several[several.index(owner[0])] = replace(owner[0], amounts=group)
    return tuple(several)


def moles(amounts: Sequence[QuantitySpan], weight: float | None, density: float | None) -> float | None:
    """Return the moles that amounts state, or None if they cannot be known.

    Args:
        weight: g/mol. density: g/mL.
    """
    known = {item.kind: item.value for item in amounts}
    if "substance" in known:
        return known["substance"]
    grams = known.get("mass")
    if grams is None and "volume" in known and density:
        grams = known["volume"] * density
    return grams / weight if grams is not None and weight else None


def scaled_actions(
    actions: Sequence[Action],
    wish: StatedWish,
    filled: Mapping[str, Mention],
    properties: Mapping[str, tuple[float | None, float | None]],
) -> tuple[Action, ...]:
    """Return the actions of a general procedure with what a wish states; all else is scaled to it.

    Args:
        filled: substances by key. properties: molar mass and density of each, or None.

    Raises:
        RefusalError: an amount cannot be put into the actions.
    """
    taken = {key: [p.amount for a in actions for p in a.takes if p.name == key] for key in filled}
    factor = None
    for key, mention in filled.items():
        usual = MMOL.match(taken[key][0]) if taken[key] else None
        given = moles(mention.amounts, *properties[key])
        if factor is None and given is not None and usual is not None and key != "S":
            factor = given / (float(usual[1]) / 1000.0)
    lost = [key for key, mention in filled.items() if mention.amounts and len(taken[key]) != 1]
    if lost or (factor is None and any(m.amounts for key, m in filled.items() if key != "S")):
        raise RefusalError("unaccounted", "the scale does not follow from the amounts: state the mass of the substrate")
    batch = factor if factor is not None else 1.0

    def portion(item: Portion) -> Portion:
        mention = filled.get(item.name)
        if mention is None or not mention.amounts:
            return item.model_copy(update={"amount": scaled(item.amount, batch)})
        words = [number.text for number in mention.amounts if number.kind != "equivalents"]
        known = moles(mention.amounts, *properties[item.name])
        if not words:
            known = mention.amounts[0].value * PROCEDURE_MOLES * batch
        if item.name != "S" and known is not None and not any(number.kind == "substance" for number in mention.amounts):
            words.append(f"{figure(1000.0 * known)} mmol")
        return item.model_copy(update={"amount": ", ".join(words)})

    scaled_ones = [action.model_copy(update={"takes": tuple(map(portion, action.takes))}) for action in actions]
    return tuple(_held(scaled_ones, wish))


def _held(actions: list[Action], wish: StatedWish) -> list[Action]:
    """Return actions with the conditions of a wish in the longest holding before the work-up."""
    end = next((place for place, action in enumerate(actions) if action.verb in _WORKUP), len(actions))
    if wish.atmosphere is not None:
        gas = {"atmosphere": wish.atmosphere}
        actions = [action.model_copy(update=gas) if place < end else action for place, action in enumerate(actions)]
    if wish.temperature is None and wish.duration is None and not wish.reflux:
        return actions
    holds = [place for place, action in enumerate(actions[:end]) if action.verb in _HOLDS]
    if not holds:
        raise RefusalError("unaccounted", "the general procedure holds no mixture at a temperature: write a procedure")
    main = max(holds, key=lambda place: actions[place].duration or 0.0)
    update: dict[str, object] = {} if wish.duration is None else {"duration": wish.duration}
    if wish.reflux:
        update |= {"verb": "Reflux", "temperature": None}
    elif wish.temperature is not None:
        update |= {"verb": "Heat" if wish.temperature > WARM_C else "Stir", "temperature": wish.temperature}
    changed = list(actions)
    changed[main] = actions[main].model_copy(update=update)
    for place, action in enumerate(actions[:main]):
        if wish.temperature is not None and action.takes and (action.temperature or 0.0) > wish.temperature:
            changed[place] = action.model_copy(update={"temperature": wish.temperature})
    return changed
