"""Each operation has its means: a balance, a measure, a stirrer, heat, a device, an agent that destroys.

Cooling is checked by `labgym.protocols.rules.temperatures.cold_is_reached`, the heat of heated actions by
`labgym.protocols.rules.safety.heat_has_a_source`.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from labgym.assets import Asset
from labgym.protocols.amounts import Amount, read_amount
from labgym.protocols.apparatus import APPARATUS
from labgym.protocols.capability import stirs, weighs
from labgym.protocols.contents import ASIDE_ADDED, STILL, Situation
from labgym.protocols.rules.conditions import MISCIBLE
from labgym.protocols.rules.finding import Finding, ProtocolCase
from labgym.protocols.rules.safety import HEATED_ACTIONS
from labgym.quantities import ROOM_RANGE

MEASURES = ("measuring", "pipette", "syringe", "pump")
"""Subtypes of instruments that measure a volume of liquid."""
ESTIMATED = ("drying_agent", "adsorbent")
"""Categories of solids that are taken by eye, until they are enough."""
STIRRING = ("stirrer", "shaker", "mixer", "reactor", "rotavap")
"""Subtypes of devices that keep a mixture moving; so do an ultrasonic bath and, by hand, a glass rod."""
BOILING = ("Reflux", "Heat", "Distill")
GRADUAL = re.compile(r"\b(?:dropwise|drop\s+(?:in|by\s+drop)|in\s+(?:small\s+)?portions|portionwise)\b", re.I)
"""An addition that must be mixed in while it goes on."""
STIRRED = re.compile(r"(?<!without )(?<!not )\bstir(?:red|ring|s)?\b", re.I)
BY_HAND = re.compile(r"\b(?:swirl|shak|invert)\w*|\bmix(?:ed)? well\b|\bby hand\b", re.I)
STONES = re.compile(r"\bboiling\s+(?:stones?|chips?)\b|\banti-?bumping\b", re.I)
BY_ITSELF = re.compile(r"\b(?:warms|exotherm\w*|heat of (?:the )?reaction|still (?:hot|warm)|hot mixture)\b", re.I)
DESTROYS = re.compile(
    r"\b(?:destroy(?:s|ing)?|quench(?:es|ing)?|decompos(?:e|es|ing)|deactivat(?:e|es|ing)|inactivat(?:e|es|ing)|"
    r"discharg(?:e|es|ing)|oxidi[sz]e\s+(?:traces|residu\w+))\b",
    re.I,
)
AGENT = re.compile(
    r"\b(?:with|by|into|onto|on|in|using|add|adding)\b[^.;]{0,60}?\b(?:water|ice|isopropanol|ethanol|methanol|alcohol|"
    r"acetone|ethyl acetate|bleach|hypochlorite|permanganate|urea|ammonium chloride|ammonia|amine|acid|hydroxide|"
    r"hydrogen peroxide|bicarbonate|carbonate|alkali|base|brine)\b",
    re.I,
)
"""The agent that destroys, after the word that introduces it; the destroyed substance is not an agent."""
REDUCTANT = re.compile(
    r"\b(?:(?:meta)?(?:bi)?sulfites?|thiosulfates?|dithionites?|ascorb\w+|iodide|"
    r"iron\(II\)\s*\w*|ferrous \w+|sulfur dioxide|dimethyl sulfide|borohydride|isopropanol|formic acid)\b",
    re.I,
)
OXIDANT = re.compile(r"\b(?:peroxides?|oxidant|oxidi[sz]er|permanganate|purple|hypochlorite|bromine|chromate)\b", re.I)
REDUCING = frozenset({"sulfite", "weak_reducer", "strong_reducer", "metal_hydride"})


def weighed_reagents_have_a_balance(case: ProtocolCase) -> Iterator[Finding]:
    """Check that steps which weigh use a balance, or the glove box with its own, and that solids by mass have one."""
    balance = glove_box = False
    for situation in case.situations:
        step = situation.step
        held = any(weighs(asset) is not None for asset in situation.devices)
        boxed = situation.place is not None and situation.place.category == "containment"
        balance, glove_box = balance or held, glove_box or boxed
        if step.action == "Weigh" and not held and not boxed:
            message = f"step {step.index} weighs without a balance"
            yield Finding("weighing-means", step.index, message, "add ElectronicScale to its uses")
    for situation, reagent in _first_uses(case):
        amount, solid = _amount(case, reagent), reagent.phase == "solid"
        by_mass = amount.volume is None and (amount.mass is not None or amount.moles is not None)
        if solid and by_mass and not balance and not glove_box and not _is_estimated(reagent):
            message = f"step {situation.step.index} takes {reagent.name} by mass, but the protocol has no balance"
            yield Finding("weighing-means", situation.step.index, message, "weigh it first, with ElectronicScale")
            return


def liquids_are_measured(case: ProtocolCase) -> Iterator[Finding]:
    """A protocol that takes liquids has a cylinder, pipette, burette or syringe, or a balance for those with a mass."""
    devices = [asset for situation in case.situations for asset in situation.devices]
    if any(asset.subtype in MEASURES and asset.category != "vacuum" for asset in devices):
        return
    balance = any(weighs(asset) is not None for asset in devices)
    for situation, reagent in _first_uses(case):
        if reagent.phase in (None, "gas"):
            continue
        amount = _amount(case, reagent)
        by_volume = amount.volume is not None and (amount.mass is None or not balance)
        by_mass = reagent.phase == "liquid" and amount.volume is None and not balance
        if by_volume or by_mass:
            message = f"step {situation.step.index} takes {reagent.name}, a liquid, but the protocol cannot measure it"
            yield Finding("measuring-means", situation.step.index, message, "add GraduatedCylinder to its uses")
            return


def mixtures_are_stirred(case: ProtocolCase) -> Iterator[Finding]:
    """A step that stirs, adds dropwise or in portions, or boils a mixture of two phases, uses a stirrer.

    Swirling and shaking by hand count where the text says so, and boiling stones where the mixture boils.
    """
    for situation in case.situations:
        step = situation.step
        if step.action in STILL or any(_moves(asset) for asset in situation.devices) or BY_HAND.search(step.text):
            continue
        if step.action in BOILING and STONES.search(step.text):
            continue
        reason = _why_stirred(case, situation)
        if reason:
            message = f"step {step.index} ({step.action}) {reason} without a stirrer"
            yield Finding("stirring-means", step.index, message, "add MagneticStirrer or OverheadStirrer to its uses")


def warm_steps_are_heated(case: ProtocolCase) -> Iterator[Finding]:
    """A step that is warmer than the room and than the step before uses a heat source."""
    before = ROOM_RANGE[1]
    for situation in case.situations:
        step, temperature = situation.step, situation.step.temperature
        if step.action in STILL:
            continue
        sources = any(asset.hazards.heat_source or asset.subtype == "reactor" for asset in situation.devices)
        if temperature is not None and temperature > before and step.action not in HEATED_ACTIONS and not sources:
            if not BY_ITSELF.search(step.text):
                message = f"step {step.index} ({step.action}) is at {temperature:g} C without a heat source"
                suggestion = "add MagneticHotplateStirrer or WaterBath to its uses"
                yield Finding("heating-means", step.index, message, suggestion)
        before = max(ROOM_RANGE[1], temperature or 0.0)


def actions_have_their_devices(case: ProtocolCase) -> Iterator[Finding]:
    """A step uses one device of each kind that its action needs, as `labgym.protocols.apparatus.APPARATUS` lists."""
    for situation in case.situations:
        step = situation.step
        if step.action == "Stir" or step.action not in APPARATUS:
            continue
        roles = {name for asset in situation.devices for name in (asset.role, asset.family)}
        for choice in APPARATUS[step.action].needs:
            if roles.isdisjoint(choice):
                message = f"step {step.index} ({step.action}) uses none of {', '.join(sorted(choice))}"
                yield Finding("device-means", step.index, message, f"add {min(choice)} to its uses")


def destruction_names_its_agent(case: ProtocolCase) -> Iterator[Finding]:
    """A step that quenches or destroys something names what does it; an oxidant is destroyed by a reductant."""
    for situation in case.situations:
        step = situation.step
        verb = DESTROYS.search(step.text)
        if verb is None and step.action != "Quench":
            continue
        rest = step.text[: verb.start()] + step.text[verb.end() :] if verb else step.text
        oxidant = verb is not None and OXIDANT.search(step.text)
        if oxidant:
            agents = [a for a in situation.added if a.chemistry and not REDUCING.isdisjoint(a.chemistry.groups)]
            named = bool(agents) or REDUCTANT.search(rest)
            what, remedy = f"{verb[0].lower() if verb else ''} {oxidant[0].lower()}", "add SodiumSulfite to its uses"
        else:
            named = bool(situation.added) or ASIDE_ADDED in step.text or AGENT.search(rest) or REDUCTANT.search(rest)
            what, remedy = (verb[0].lower() if verb else "quench"), "add the reagent that does it to its uses"
        if not named:
            message = f"step {step.index} ({step.action}) says {what!r} and names nothing that does it"
            yield Finding("agent-means", step.index, message, remedy)


def _why_stirred(case: ProtocolCase, situation: Situation) -> str:
    """Return why a step needs a stirrer, or an empty text."""
    step = situation.step
    if step.action == "Stir" or STIRRED.search(step.text):
        return "stirs"
    if GRADUAL.search(step.text) and situation.added:
        return f"adds {situation.added[0].name} gradually"
    if step.action in ("Heat", "Reflux") and _phases(case, situation) > 1:
        return "heats a mixture of two phases"
    return ""


def _phases(case: ProtocolCase, situation: Situation) -> int:
    """Return the least number of phases in the vessel: solids, water, and oils that water does not dissolve."""
    assets = [case.catalog.get(name) for name in situation.contents]
    solids = any(asset.phase == "solid" and not situation.contents[asset.name] for asset in assets)
    liquids = situation.bulk(0.02)
    aqueous = any("aqueous" in case.catalog.get(name).groups for name in liquids)
    oils = any("aqueous" not in case.catalog.get(n).groups and n not in MISCIBLE for n in liquids)
    return solids + (2 if aqueous and oils else 1 if liquids else 0)


def _moves(asset: Asset) -> bool:
    stirs_itself = asset.subtype in STIRRING and asset.category != "consumable"
    return stirs_itself or stirs(asset) is not None or asset.category == "cleaning" or asset.subtype == "rod"


def _first_uses(case: ProtocolCase) -> Iterator[tuple[Situation, Asset]]:
    """Yield each reagent with the first step that puts it into a mixture."""
    seen: set[str] = set()
    for situation in case.situations:
        for asset in situation.added:
            if situation.step.action not in STILL and asset.name not in seen:
                seen.add(asset.name)
                yield situation, asset


def _amount(case: ProtocolCase, reagent: Asset) -> Amount:
    return read_amount(next((use.amount for use in case.protocol.reagents if use.name == reagent.name), ""))


def _is_estimated(reagent: Asset) -> bool:
    return reagent.category in ESTIMATED


RULES = (
    weighed_reagents_have_a_balance,
    liquids_are_measured,
    mixtures_are_stirred,
    warm_steps_are_heated,
    actions_have_their_devices,
    destruction_names_its_agent,
)
