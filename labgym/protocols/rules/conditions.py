"""Conditions that make a reaction dangerous or futile: solvent, temperature, partner, order of addition, work-up."""

from __future__ import annotations

import re
from collections.abc import Iterator
from itertools import combinations

from labgym.assets import Asset
from labgym.assets.mixing import Limit, limit_of
from labgym.protocols.amounts import read_amount
from labgym.protocols.contents import SEPARATING, SOLID, STILL, Situation
from labgym.protocols.rules.consumption import OXIDIZERS, moles, used_up
from labgym.protocols.rules.finding import Finding, ProtocolCase, Severity
from labgym.protocols.rules.hazards import INERT, INERT_DEVICES
from labgym.quantities import ROOM_TEMPERATURE

ENDING = (
    *("Quench", "Pour", "Acidify", "Basify", "Neutralize", "Extract", "Partition", "Wash", "Filter", "Concentrate"),
    "Clean",
)
"""Actions in which a reagent is destroyed on purpose."""
CHARGING = ("Add", "MakeSolution", "Dissolve", "Mix", "Charge")
SOLVENT_SHARE = 0.25
"""A liquid that is at least this share of the volume is a solvent of the mixture."""
PERACIDS = frozenset({"MetaChloroperbenzoicAcid", "HydrogenPeroxide", "TertButylHydroperoxide"})
DESTROYED = frozenset({"LithiumAluminumHydride", "DIBALH", "SodiumHydride", "NButyllithium"})
"""Hydrides and organometallics that protic solvents destroy with hydrogen or butane and much heat."""
BOROHYDRIDE = "SodiumBorohydride"
BOROHYDRIDE_IN_ACID, BOROHYDRIDE_IN_ALCOHOL = 30.0, 60.0
"""Temperatures above which borohydride loses hydrogen too fast to control, degrees Celsius (Gribble, Chem. Soc. Rev.
1998, 27, 395: pellets into acetic acid below 20 C; methanol consumes it within the hour at 25 C)."""
PROTIC = frozenset({"alcohol", "carboxylic_acid", "aqueous", "phenol"})
MISCIBLE = frozenset(
    (
        *("Methanol", "Ethanol", "Isopropanol", "TertButanol", "Acetone", "Acetonitrile", "Tetrahydrofuran"),
        *("OneFourDioxane", "NNDimethylformamide", "DimethylSulfoxide", "NMethylPyrrolidone", "AceticAcid"),
        *("FormicAcid", "Pyridine", "EthyleneGlycol", "Glycerol", "TrifluoroaceticAcid"),
    )
)
"""Organic liquids that form no separate layer with water."""
SOLVENTS = ("organic_solvent", "solvent")
AZEOTROPIC = frozenset({"Toluene", "Benzene"})
LAYERED = ("Wash", "PhaseSeparation")
METALLIC_PALLADIUM, TOLERANCE = 106.42, 0.25
"""Molar mass of palladium, g/mol: on carbon, 10 % of the weight is metal, so that a mole of it is ten times that."""
SUPPORTED = "noble_metal_catalyst"
AFTER_CATALYST = ("Concentrate", "Distill", "Chromatograph", "Recrystallize", "DryVacuum")
AIR_SENSITIVE = frozenset({"TetrakisTriphenylphosphinePalladium"})
_BATH = r"[ -]?(?:bath|cone|cabinet|heat|jacket|plate|table)"
STEAM = re.compile(rf"\bsteam(?!{_BATH})|水蒸气(?!浴)", re.I)
"""Words of a distillation with steam."""
STEAM_BATH = re.compile(rf"\bsteam{_BATH}|(?:水蒸气|蒸汽)浴", re.I)
"""Words for heat from steam, which the mixture does not meet."""
_SOLUTION = re.compile(r"\b(?:solution|suspension|slurry|dissolved|in \d|molten|melt)\b", re.I)
REDUCTANTS = frozenset({"sulfite", "weak_reducer", "alcohol"})
"""Groups of what destroys an oxidizer in a quench."""
FAST_PARTNERS = frozenset({"acyl_halide", "aldehyde", "anhydride", "chlorosilane", "ester", "ketone"})
"""Groups with which an organometallic has reacted when the step that brings them together is over."""
COLD_END_C = 30.0
"""Highest temperature at which a step that ends a reaction may bring together what reacts violently."""


def peracids_meet_no_ketone(case: ProtocolCase) -> Iterator[Finding]:
    """Peracids and peroxides are not used in a ketone as the solvent: cyclic peroxides form that detonate.

    Source: Bretherick's Handbook, entries on hydrogen peroxide with ketones and on 3-chloroperoxybenzoic acid.
    """
    for situation in case.situations:
        oxidants = sorted(PERACIDS.intersection(situation.contents))
        ketones = [name for name in situation.bulk(SOLVENT_SHARE) if "ketone" in _groups(case, name)]
        if situation.step.action not in (*STILL, *LAYERED) and oxidants and ketones:
            message = f"step {situation.step.index} has {oxidants[0]} in {ketones[0]}; ketones form explosive peroxides"
            yield Finding("peracid-in-ketone", situation.step.index, message, "use Dichloromethane as the solvent")
            return


def hydrides_meet_no_protic_solvent(case: ProtocolCase) -> Iterator[Finding]:
    """Aluminium hydride, sodium hydride and butyllithium are used in aprotic solvents until they are quenched.

    Source: Prudent Practices in the Laboratory, 6.D (water-reactive and pyrophoric reagents).
    """
    for situation in _reacting(case):
        reagents = sorted(DESTROYED.intersection(situation.contents))
        protic = [name for name in situation.bulk() if _is_protic(case, name)]
        if reagents and protic:
            message = f"step {situation.step.index} has {reagents[0]} in {protic[0]}, which destroys it violently"
            yield Finding(
                "hydride-in-protic", situation.step.index, message, "use a dry ether, such as Tetrahydrofuran"
            )
            return


def borohydride_stays_cold(case: ProtocolCase) -> Iterator[Finding]:
    """Borohydride is not heated in a carboxylic acid, nor boiled in an alcohol: hydrogen comes off all at once."""
    for situation in _reacting(case):
        temperature = situation.step.temperature
        if temperature is None or BOROHYDRIDE not in situation.contents:
            continue
        liquids = situation.bulk(SOLVENT_SHARE)
        acids = [name for name in liquids if "carboxylic_acid" in _groups(case, name)]
        alcohols = [name for name in liquids if "alcohol" in _groups(case, name)]
        if acids and temperature > BOROHYDRIDE_IN_ACID:
            message = f"step {situation.step.index} heats {BOROHYDRIDE} in {acids[0]} to {temperature:g} C"
            suggestion = f"stay below {BOROHYDRIDE_IN_ACID:g} C, or use SodiumTriacetoxyborohydride"
            yield Finding("borohydride-in-acid", situation.step.index, message, suggestion)
            return
        if alcohols and temperature > BOROHYDRIDE_IN_ALCOHOL:
            message = f"step {situation.step.index} heats {BOROHYDRIDE} in {alcohols[0]} to {temperature:g} C"
            suggestion = "the alcohol consumes it; stay near room temperature"
            yield Finding("borohydride-in-alcohol", situation.step.index, message, suggestion, "advice")
            return


def organometallics_stay_dry(case: ProtocolCase) -> Iterator[Finding]:
    """A Grignard reagent is made from magnesium and a halide without water, alcohols or acids until the quench."""
    for situation in _reacting(case):
        names = situation.contents
        halides = [n for n in names if _groups(case, n) & {"halogenated_organic", "aryl_halide"}]
        protic = [name for name in situation.bulk(0.05) if _is_protic(case, name)]
        if "Magnesium" in names and halides and protic:
            message = f"step {situation.step.index} makes a Grignard reagent from {halides[0]} in {protic[0]}, which"
            message += " destroys it"
            yield Finding(
                "grignard-in-protic", situation.step.index, message, "use dry DiethylEther or Tetrahydrofuran"
            )
            return


def quenches_come_after_the_reaction(case: ProtocolCase) -> Iterator[Finding]:
    """Check that reagents which destroy a Lewis acid or hydride are added only to end the reaction."""
    for situation in _reacting(case):
        step = situation.step
        if step.action not in CHARGING:
            continue
        lively = [n for n in situation.contents if _is_lively(case, n)]
        aqueous = [a.name for a in situation.added if _groups(case, a.name) & {"aqueous"} and a.name not in lively]
        if lively and aqueous:
            message = f"step {step.index} ({step.action}) adds {aqueous[0]} to {lively[0]}, which it destroys violently"
            yield Finding("quench-order", step.index, message, "add it in a Quench step after the reaction, onto ice")
            return


def washes_have_a_layer(case: ProtocolCase) -> Iterator[Finding]:
    """An organic layer is washed or separated only where a liquid that water does not dissolve is present.

    A liquid that takes part in the reaction may have become the layer, as tert-butanol becomes its bromide.
    """
    solvents = {use.name for use in case.protocol.reagents if "solvent" in use.role}
    layered = False
    for situation in case.situations:
        step, vessel = situation.step, situation.vessel
        unstated = [asset for asset in situation.added if not situation.contents.get(asset.name)]
        if step.action not in STILL and any(_is_layer(asset) for asset in unstated):
            layered = True
        elif step.action in ("Concentrate", "Distill", *SOLID):
            layered = False
        if layered or step.action not in LAYERED or vessel is None or vessel.name != SEPARATING:
            continue
        organic = [n for n in situation.bulk(0.05) if not _groups(case, n) & {"aqueous", "strong_acid", "strong_base"}]
        if organic and all(name in MISCIBLE & solvents for name in organic):
            message = f"step {step.index} ({step.action}) has no organic layer: {organic[0]} mixes with water"
            suggestion = "extract with EthylAcetate or DiethylEther first"
            severity: Severity = "fault" if step.action == "Wash" else "advice"
            yield Finding("layer-missing", step.index, message, suggestion, severity)
            return


def _is_layer(asset: Asset) -> bool:
    """Return whether a reagent is an organic solvent that water does not dissolve."""
    organic = asset.phase == "liquid" and asset.category in SOLVENTS and "aqueous" not in asset.groups
    return organic and asset.name not in MISCIBLE


def wet_layers_are_dried(case: ProtocolCase) -> Iterator[Finding]:
    """Check that organic layers are dried after contact with water and before distillation.

    Evaporating toluene or benzene dries too: both carry water over as an azeotrope.
    """
    wet: int | None = None
    for situation in case.situations:
        step = situation.step
        dried = any(asset.category == "drying_agent" for asset in situation.added)
        azeotrope = step.action == "Concentrate" and not AZEOTROPIC.isdisjoint(situation.bulk())
        if dried or azeotrope:
            wet = None
        elif step.action in ("Extract", "Wash") and any(asset.name == SEPARATING for asset in situation.devices):
            wet = step.index
        elif step.action in ("DrySolution", "DryVacuum", "Quench", "Acidify", "Basify", "Crystallize"):
            wet = None
        elif step.action == "Distill" and wet is not None and not STEAM.search(step.text):
            message = f"step {step.index} distils the layer that step {wet} left wet"
            yield Finding(
                "dry-before-distillation", step.index, message, "add a DrySolution step, with MagnesiumSulfate"
            )
            return


def funnels_take_liquids(case: ProtocolCase) -> Iterator[Finding]:
    """A solid does not go through a dropping funnel unless it is dissolved."""
    amounts = {use.name: read_amount(use.amount) for use in case.protocol.reagents}
    for situation in case.situations:
        step = situation.step
        if not any("Dropping" in asset.name for asset in situation.devices):
            continue
        dry = [a.name for a in situation.added if _state(case, a.name) == "solid" and amounts[a.name].volume is None]
        liquid = any(a.name not in dry and _state(case, a.name) != "gas" for a in situation.added)
        if dry and not liquid and not _SOLUTION.search(step.text):
            message = f"step {step.index} adds {dry[0]}, a solid, through a dropping funnel"
            yield Finding("solid-in-funnel", step.index, message, "add it in portions, or as a solution")


def supported_catalysts_are_filtered_off(case: ProtocolCase) -> Iterator[Finding]:
    """Palladium on carbon and Raney nickel are filtered off, kept wet, before the solvent is evaporated."""
    catalyst = ""
    for situation in case.situations:
        step = situation.step
        used = [asset.name for asset in situation.added if SUPPORTED in _groups(case, asset.name)]
        if step.action not in STILL:
            catalyst = used[0] if used else catalyst
        if step.action == "Filter":
            catalyst = ""
        if catalyst and step.action in AFTER_CATALYST:
            message = f"step {step.index} ({step.action}) still has {catalyst} in it"
            yield Finding("catalyst-filtered", step.index, message, "filter it off through Celite first, kept wet")
            return


def supported_catalysts_are_weighed_with_their_support(case: ProtocolCase) -> Iterator[Finding]:
    """A mass of palladium on carbon that matches its moles as pure metal is ten times too small."""
    for use in case.protocol.reagents:
        amount = read_amount(use.amount)
        if use.name != "PalladiumOnCarbon" or not amount.mass or not amount.moles:
            continue
        step = next((step.index for step in case.protocol.steps if use.name in step.uses), None)
        if step is not None and abs(amount.mass / amount.moles / METALLIC_PALLADIUM - 1.0) < TOLERANCE:
            message = f"step {step} weighs {use.name} ({use.amount}) as pure palladium; 10 % of its weight is metal"
            suggestion = f"take {10.0 * amount.mass:.3g} g of the supported catalyst"
            yield Finding("catalyst-loading", step, message, suggestion)


def sensitive_catalysts_have_inert_gas(case: ProtocolCase) -> Iterator[Finding]:
    """Palladium(0) phosphine complexes are added and heated under an inert gas, because oxygen destroys them."""
    shielded = False
    for situation in case.situations:
        step = situation.step
        inert = any(asset.name in INERT_DEVICES for asset in situation.devices) or INERT.search(step.text)
        shielded = shielded or bool(inert and step.action not in STILL)
        sensitive = [asset.name for asset in situation.added if asset.name in AIR_SENSITIVE]
        if sensitive and step.action not in STILL and not shielded:
            message = f"step {step.index} adds {sensitive[0]}, which oxygen destroys, in air"
            yield Finding("catalyst-inert", step.index, message, "purge the flask with nitrogen first: SchlenkLine")
            return


def _reacting(case: ProtocolCase) -> Iterator[Situation]:
    """Yield the steps before the first that ends the reaction."""
    for situation in case.situations:
        if situation.step.action in ENDING:
            return
        if situation.step.action not in STILL:
            yield situation


def _is_protic(case: ProtocolCase, name: str) -> bool:
    return bool(PROTIC & _groups(case, name))


def _is_lively(case: ProtocolCase, name: str) -> bool:
    """Return whether water destroys a Lewis acid or hydride violently; borohydride is used in water."""
    asset = case.catalog.get(name)
    reactive = asset.chemistry is not None and asset.chemistry.water_reactive
    hydride = name in DESTROYED
    return hydride or (reactive and "lewis_acid" in _groups(case, name))


def _groups(case: ProtocolCase, name: str) -> frozenset[str]:
    return frozenset(case.catalog.get(name).groups)


def _state(case: ProtocolCase, name: str) -> str:
    return case.catalog.get(name).phase or ""


RULES = (
    peracids_meet_no_ketone,
    hydrides_meet_no_protic_solvent,
    borohydride_stays_cold,
    organometallics_stay_dry,
    quenches_come_after_the_reaction,
    washes_have_a_layer,
    wet_layers_are_dried,
    funnels_take_liquids,
    supported_catalysts_are_filtered_off,
    supported_catalysts_are_weighed_with_their_support,
    sensitive_catalysts_have_inert_gas,
)


def pairs_stay_within_their_limits(case: ProtocolCase) -> Iterator[Finding]:
    """Every pair in a vessel satisfies the reactivity matrix at the temperatures of all its steps, in a hood or not.

    A pair counts as long as both are there: a base or metal is used up by an equimolar amount of an acid with which it
    was together in an earlier step within the limits, an organometallic by its electrophile. An addition without a
    temperature to a cold mixture is cold.
    """
    met: dict[tuple[str, str], bool] = {}
    reported: set[tuple[str, str]] = set()
    destroyed: set[str] = set()
    amounts = {use.name: moles(case.catalog.get(use.name), use.amount) for use in case.protocol.reagents}
    known = {name: value for name, value in amounts.items() if value is not None}
    last = ROOM_TEMPERATURE
    for situation in case.situations:
        if situation.step.action in STILL:
            continue
        before = len(reported)
        temperature = situation.step.temperature
        cold = last if situation.step.action in CHARGING else ROOM_TEMPERATURE
        celsius = min(ROOM_TEMPERATURE, cold) if temperature is None else temperature
        last = celsius if temperature is not None or situation.step.action in CHARGING else ROOM_TEMPERATURE
        for pair, limit in _limits(case, situation):
            if not destroyed.isdisjoint(pair) or (pair in met and _has_reacted(case, pair)):
                continue
            first = pair not in met
            ends = situation.step.action in ENDING and celsius <= COLD_END_C
            met.setdefault(pair, ends)
            if pair in reported or (limit.ends and met[pair]):
                continue
            highest = limit.meets if first and limit.meets is not None else limit.above
            if celsius > highest:
                reported.add(pair)
                yield _finding(situation, pair, limit, celsius, highest)
        if len(reported) == before:
            destroyed |= used_up(map(case.catalog.get, situation.contents), known)
        added = {group for asset in situation.added for group in asset.groups}
        if situation.step.action in ENDING and not REDUCTANTS.isdisjoint(added):
            destroyed |= {name for name in situation.contents if not OXIDIZERS.isdisjoint(_groups(case, name))}


def _has_reacted(case: ProtocolCase, pair: tuple[str, str]) -> bool:
    """Return whether a pair that was brought together within its limits is an organometallic with its electrophile."""
    first, second = (_groups(case, name) for name in pair)
    return any("organometallic" in a and not FAST_PARTNERS.isdisjoint(b) for a, b in ((first, second), (second, first)))


def _limits(case: ProtocolCase, situation: Situation) -> Iterator[tuple[tuple[str, str], Limit]]:
    """Yield the pairs in the vessel of a step that have a limit; consecutive washes do not meet."""
    assets = {name: case.catalog.get(name) for name in sorted(situation.contents)}
    shares = {name: volume / situation.volume for name, volume in situation.contents.items() if situation.volume}
    added = {asset.name for asset in situation.added}
    in_turn = situation.vessel is not None and situation.vessel.name == SEPARATING
    for a, b in combinations(assets, 2):
        limit = limit_of(assets[a], assets[b], shares, assets.values())
        if limit is not None and not (in_turn and {a, b} <= added):
            yield (a, b), limit


def _finding(situation: Situation, pair: tuple[str, str], limit: Limit, celsius: float, highest: float) -> Finding:
    together = f"step {situation.step.index} has {pair[0]} and {pair[1]} together at {celsius:g} C"
    if limit.is_never:
        suggestion = f"use another solvent or reagent instead of one of them ({limit.source})"
    else:
        suggestion = f"stay at or below {highest:g} C, or use another solvent ({limit.source})"
    return Finding("violent-mixture", situation.step.index, f"{together}: {limit.hazard}", suggestion)


MIXING_RULES = (pairs_stay_within_their_limits,)
