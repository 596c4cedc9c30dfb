"""Rules on fire, toxic vapor and violent reactions, for everything that a step handles, also from earlier steps."""

from __future__ import annotations

import re
from collections.abc import Iterator

from labgym.assets import Asset, pairs
from labgym.assets.plausibility import FACE_VELOCITY_M_S
from labgym.protocols.amounts import read_amount
from labgym.protocols.capability import heats_to, is_ventilated, needs_ventilation
from labgym.protocols.contents import SEPARATING, STILL, WATER, Situation
from labgym.protocols.errors import RefusalError
from labgym.protocols.refusals import refuse_to_make
from labgym.protocols.rules.finding import Finding, ProtocolCase

DANGEROUS_PRODUCT = "dangerous-product"
"""Rule whose findings no change of the steps removes."""
LEAST_FACE_VELOCITY_M_S = FACE_VELOCITY_M_S[0]
"""Lowest face velocity at which a hood contains vapors, m/s (EN 14175 and ANSI/ASSP Z9.5 practice: 0.3 to 0.5)."""
FATAL = ("H300", "H310", "H330")
INERT = re.compile(r"(?<!liquid )\b(?:nitrogen|argon)\b(?!\s+(?:trap|dewar))|\b(?:inert|glove\s?box|schlenk)\b", re.I)
"""An inert gas above the mixture; liquid nitrogen in a cold trap does not count."""
INERT_DEVICES = ("SchlenkLine", "NitrogenCylinder", "ArgonCylinder")
PEROXIDE_TEST = re.compile(
    r"\b(?:test|check|assay|examin|try)\w*\b[^.;]{0,60}\bperoxides?\b|\bperoxide[- ](?:test|strip|free|indicator)|"
    r"\bperoxides?\b[^.;]{0,30}\b(?:test|strip|absent|absence|negative)|\bfree (?:of|from) peroxides?\b",
    re.I,
)
"""A test of the liquid for peroxides; the reagent hydrogen peroxide does not count."""
STABILIZED = re.compile(r"\b(?:stabili[sz]ed|inhibited|BHT|butylated hydroxytoluene)\b", re.I)
TO_DRYNESS = re.compile(r"\bto (?:complete )?dryness\b", re.I)
NOT_TO_DRYNESS = re.compile(
    r"\b(?:not?|never|avoid|without|nearly|almost)\b[^.;]{0,40}\bto (?:complete )?dryness\b", re.I
)
REDUCED_PRESSURE = frozenset({"RotaryEvaporator", "RotaryVanePump", "SchlenkLine", "VacuumOven", "VacuumPump"})
PEROXIDES_IN_STORAGE = frozenset({"diisopropyl ether", "diisopropylether", "isopropyl ether", "divinyl ether"})
"""Ethers of class A: they form explosive peroxides in the bottle, without concentration."""
POURED_ONTO = re.compile(
    r"\b(?:in|into|on|onto|to|over)\s+(?:[\w,-]+\s+){0,5}?(?:water|ice)\b(?![\s-]*(?:water\s+)?(?:bath|cool))", re.I
)
"""The mixture goes onto water or ice; "in an ice bath" does not count."""
WATER_INTO_ACID = re.compile(
    r"\b(?:water|ice)\b\s+(?:\w+\s+){0,3}?(?:to|into|onto|over)\s+(?:the\s+|an?\s+)?(?:[\w-]+\s+){0,3}?"
    r"(?:acid|mixture|flask|solution)\b",
    re.I,
)
WATER_ADDED = re.compile(r"\b(?:add|adding|dilute|diluting|dilution)\b[^.;]{0,60}\bwater\b", re.I)
CONCENTRATED = frozenset({"oxidizing_acid"})
DILUTE_PERCENT, DILUTE_MOLARITY = 51.0, 7.3
"""Strength up to which sulfuric acid is dilute (UN 2796 of the UN Model Regulations); mol/L at 1.40 g/mL."""
TOXIC_GAS = ("acid_with_toxic_gas_former", "acid_with_hypochlorite", "hypochlorite_with_ammonia_or_amine")
"""Pairs of the segregation rules that give off a toxic gas when they meet."""
SCRUBBERS = ("GasWashBottle", "ColdTrap")


def flames_are_away_from_flammables(case: ProtocolCase) -> Iterator[Finding]:
    """No flame or glowing element is used with a flammable reagent, or at a place where another step opens one."""
    for situation in case.situations:
        for flame in (asset for asset in situation.devices if _is_flame(asset)):
            near = [name for name in situation.contents if case.catalog.get(name).hazards.flammable]
            if near:
                message = f"step {situation.step.index} burns {flame.name} at {near[0]}, which is flammable"
                yield Finding("flame-near-flammable", situation.step.index, message, _flameless(case, situation))
            else:
                yield from _flame_in_the_room(case, situation, flame)


def carried_vapours_are_ventilated(case: ProtocolCase) -> Iterator[Finding]:
    """A batch that still contains a volatile or toxic reagent is handled only at ventilated places."""
    for situation in case.situations:
        step, place = situation.step, situation.place
        if place is None or is_ventilated(place) or step.action in STILL or situation.vessel is None:
            continue
        if situation.vessel not in situation.devices:
            continue
        added = [asset.name for asset in situation.added]
        for name in situation.bulk(0.05):
            if name not in added and needs_ventilation(case.catalog.get(name)):
                message = f"step {step.index} handles a batch with {name} at {step.location}, which is not ventilated"
                yield Finding("carried-vapour", step.index, message, "move the step to FumeHood")
                break


def hoods_draw_enough(case: ProtocolCase) -> Iterator[Finding]:
    """Volatile or toxic reagents are opened in a hood with sufficient air flow; fatal ones only in a hood."""
    for situation in case.situations:
        step, place = situation.step, situation.place
        if place is None or step.action in STILL or place.category == "containment":
            continue
        fatal = [asset.name for asset in situation.added if _has_statement(asset, FATAL)]
        vapours = [asset.name for asset in situation.added if needs_ventilation(asset)]
        opened = fatal or (vapours if place.fume_hood else [])
        velocity = place.specs.face_velocity_m_s
        if not opened or (place.fume_hood and (velocity is None or velocity >= LEAST_FACE_VELOCITY_M_S)):
            continue
        problem = f"draws only {velocity:g} m/s" if place.fume_hood else "is not a hood"
        why = "is fatal" if fatal else "is volatile or toxic"
        message = f"step {step.index} opens {opened[0]}, which {why}, at {place.name}, which {problem}"
        yield Finding(
            "hood-draws",
            step.index,
            message,
            f"use a hood with at least {LEAST_FACE_VELOCITY_M_S:g} m/s, such as FumeHood",
        )


def acid_goes_into_water(case: ProtocolCase) -> Iterator[Finding]:
    """Water is not added to concentrated sulfuric or nitric acid."""
    for situation in case.situations:
        step = situation.step
        acids = [
            name
            for name, volume in situation.contents.items()
            if volume >= 5.0
            and not CONCENTRATED.isdisjoint(case.catalog.get(name).groups)
            and not _is_dilute(case, name)
        ]
        watered = WATER in [asset.name for asset in situation.added] or WATER_ADDED.search(step.text)
        onto_water = POURED_ONTO.search(step.text) and not WATER_INTO_ACID.search(step.text)
        if acids and watered and not onto_water:
            message = f"step {step.index} ({step.action}) adds water to {acids[0]}"
            yield Finding("acid-into-water", step.index, message, "pour the acid slowly onto water or ice, and stir")


def peroxides_are_tested_for(case: ProtocolCase) -> Iterator[Finding]:
    """Peroxide formers are tested for peroxides, or stabilized, before they are concentrated.

    Distillation without a test is a fault, and so is evaporation to dryness with heat alone. Evaporation of a fresh
    solvent under reduced pressure is not, unless the solvent forms explosive peroxides without concentration. To
    dryness there is advice in any case: at least a tenth of the liquid should stay. Source: Prudent Practices in the
    Laboratory, on peroxidizable chemicals, whose classes A (peroxides without concentration) and B (on concentration)
    these are.
    """
    safe = False
    for situation in case.situations:
        text, action = situation.step.text, situation.step.action
        safe = safe or bool(PEROXIDE_TEST.search(text) or STABILIZED.search(text))
        if action not in ("Distill", "Concentrate"):
            continue
        dry = bool(TO_DRYNESS.search(text)) and not NOT_TO_DRYNESS.search(text)
        pumped = any(asset.family in REDUCED_PRESSURE for asset in situation.devices)
        formers = [asset for name in situation.contents if forms_peroxides(asset := case.catalog.get(name))]
        severe = [asset for asset in formers if forms_peroxides_in_storage(asset)]
        if not formers:
            continue
        name = (severe or formers)[0].name
        verb = "distils" if action == "Distill" else "evaporates"
        what = f"step {situation.step.index} {verb} {name}, which forms explosive peroxides"
        if not safe and (action == "Distill" or severe or (dry and not pumped)):
            suggestion = "test for peroxides before the step, and do not distil to dryness"
            yield Finding("peroxides-tested", situation.step.index, f"{what}, without a peroxide test", suggestion)
        elif dry:
            suggestion = "leave a tenth of the liquid, or use a fresh, stabilized solvent behind the sash"
            yield Finding("peroxides-tested", situation.step.index, f"{what}, to dryness", suggestion, "advice")


def forms_peroxides(asset: Asset) -> bool:
    """Return whether a reagent forms peroxides."""
    return asset.chemistry is not None and asset.chemistry.peroxide_former


def forms_peroxides_in_storage(asset: Asset) -> bool:
    """Return whether an ether forms explosive peroxides in its bottle, without concentration."""
    return not PEROXIDES_IN_STORAGE.isdisjoint(form.lower() for form in (asset.name, *asset.synonyms_en))


def pyrophorics_see_no_air(case: ProtocolCase) -> Iterator[Finding]:
    """Check that pyrophoric substances are handled in a glove box or under an inert gas."""
    for situation in case.situations:
        step = situation.step
        names = [asset.name for asset in situation.added if asset.chemistry is not None and asset.chemistry.pyrophoric]
        inert = any(asset.name in INERT_DEVICES for asset in situation.devices) or INERT.search(step.text)
        if names and not inert and (situation.place is None or situation.place.category != "containment"):
            message = f"step {step.index} handles {names[0]}, which catches fire in air, without an inert gas"
            yield Finding("inert-gas", step.index, message, "work at GloveBox, or with SchlenkLine under nitrogen")


def toxic_gases_are_caught(case: ProtocolCase) -> Iterator[Finding]:
    """Reagents that form a toxic gas are combined with a scrubber."""
    for situation in case.situations:
        added = [asset.name for asset in situation.added]
        caught = any(asset.name in SCRUBBERS for asset in situation.devices)
        if situation.step.action in STILL or caught:
            continue
        for a, b, hazard in pairs(case.catalog.get(name) for name in situation.contents):
            in_turn = situation.vessel is not None and situation.vessel.name == SEPARATING and {a, b} <= set(added)
            hydrazine = any("hydrazine" in case.catalog.get(name).groups for name in (a, b))
            if hazard.kind in TOXIC_GAS and (a in added or b in added) and not in_turn and not hydrazine:
                message = f"step {situation.step.index} brings {a} and {b} together, which gives off a toxic gas"
                suggestion = "lead the gas through GasWashBottle, or add slowly and cold with the sash down"
                yield Finding("toxic-gas", situation.step.index, message, suggestion, "advice")


def _flame_in_the_room(case: ProtocolCase, situation: Situation, flame: Asset) -> Iterator[Finding]:
    step = situation.step
    for other in case.situations:
        flammable = [asset.name for asset in other.added if asset.hazards.flammable]
        if other.step.location == step.location and other.step.action not in STILL and flammable:
            message = (
                f"step {step.index} burns {flame.name} at {step.location}, where step {other.step.index} opens "
                f"{flammable[0]}"
            )
            suggestion = f"clear {flammable[0]} away first, or heat without a flame: {_flameless(case, situation)}"
            yield Finding("flame-near-flammable", step.index, message, suggestion, "advice")
            return


def _flameless(case: ProtocolCase, situation: Situation) -> str:
    temperature = situation.step.temperature if situation.step.temperature is not None else 100.0
    fit = [
        (limit, asset.name)
        for asset in case.catalog.of_kind("instrument")
        if asset.category == "heating" and asset.heat_class in ("bath", "hot_surface") and not _is_flame(asset)
        if (limit := heats_to(asset)) is not None and limit >= temperature + 10.0
    ]
    return f"use {min(fit)[1]}" if fit else "use MuffleFurnace in another room"


def _is_flame(asset: Asset) -> bool:
    return asset.heat_class == "flame" or asset.subtype == "gun"


def _has_statement(asset: Asset, codes: tuple[str, ...]) -> bool:
    return asset.chemistry is not None and not set(codes).isdisjoint(asset.chemistry.h_codes)


def _is_dilute(case: ProtocolCase, name: str) -> bool:
    """Return whether a protocol takes an acid as a dilute solution only."""
    amounts = [
        read_amount(part) for use in case.protocol.reagents if use.name == name for part in use.amount.split("; ")
    ]
    return bool(amounts) and all(
        (amount.percent is not None and amount.percent <= DILUTE_PERCENT)
        or (amount.molarity is not None and amount.molarity <= DILUTE_MOLARITY)
        for amount in amounts
    )


def products_may_be_made(case: ProtocolCase) -> Iterator[Finding]:
    """Check that the product is not an explosive, a weapon, a controlled drug or a substance that kills in traces."""
    try:
        refuse_to_make(case.protocol.name, case.protocol.product)
    except RefusalError as error:
        yield Finding(DANGEROUS_PRODUCT, None, str(error), "choose another product")


RULES = (
    products_may_be_made,
    flames_are_away_from_flammables,
    carried_vapours_are_ventilated,
    hoods_draw_enough,
    acid_goes_into_water,
    peroxides_are_tested_for,
    pyrophorics_see_no_air,
    toxic_gases_are_caught,
)
