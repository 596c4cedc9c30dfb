"""The cast of a reaction: which reagent fills which slot, from the text, as a stand-in for a class, or by default.

A substrate is never assumed: the text names it, or the class that it stands for.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, replace

from labgym.assets import Asset, Catalog
from labgym.protocols.amounts import (
    equimolar,
    figure,
    measured,
    moles_of,
    of_strength,
    read_amount,
    rounded_volume,
    scaled,
    together,
)
from labgym.protocols.errors import RefusalError
from labgym.protocols.synthesis.reading import Clause
from labgym.protocols.synthesis.transformations import Slot, Transformation, transformations

ASSUMED = " (assumed)"
BATCHES = (1e-5, 1e3)
"""Smallest and largest batch relative to the table's, whose batches are of some grams in some 40 mL."""
SOLVENTS = ("organic_solvent", "solvent")
PROTECTIVE_GASES = ("NitrogenGas", "ArgonGas")
COOLANTS = ("DryIce",)
SAME_SCALE = 0.05
"""Relative difference up to which two batches have the same size."""
ROLES = {
    "catalyst": "catalyst",
    "organic_base": "base",
    "inorganic_base": "base",
    "organic_acid": "acid",
    "inorganic_acid": "acid",
    "oxidizer": "oxidant",
    "reducing_agent": "reductant",
    "drying_agent": "drying agent",
    "inorganic_salt": "salt",
}
SUBSTRATES = ("carbonyl compound", "halide")
"""Roles of substrates whose names do not say so."""
CATALYTIC = 0.05
"""Equivalents of a reagent that the text calls catalytic."""
_RELATIVE = re.compile(r"(?<!\d)(\d+(?:\.\d+)?) (equiv|mol%|wt%)")
_MOLES = re.compile(r"(?<!\d)(\d+(?:\.\d+)?)( mmol\b)")
_VOLUME = re.compile(r"(?<![\d.x] )(?<![\d.])(\d+(?:\.\d+)?)( mL\b)")


@dataclass(frozen=True)
class Participant:
    """A reagent with its role in the reaction.

    Attributes:
        asset: the reagent.
        role: such as "substrate" or "solvent".
        amount: as written, followed by "(assumed)" if the text does not give it.
        when: "charge" (first), "add" (afterwards) or "medium".
        named: whether the text names it, directly or by its class.
        stands_for: class of substances that it stands in for, or "".
    """

    asset: Asset
    role: str
    amount: str
    when: str
    named: bool
    stands_for: str = ""


@dataclass(frozen=True)
class _Named:
    name: str
    amount: str
    stands_for: str = ""
    strength: str = ""
    catalytic: bool = False


@dataclass(frozen=True)
class ReactionCast:
    """The participants of a reaction, and the size of the batch relative to that of the table."""

    parts: tuple[Participant, ...]
    factor: float


def cast(kind: Transformation, clauses: Sequence[Clause], catalog: Catalog) -> ReactionCast:
    """Return the participants of a reaction; slots that the text leaves open get the defaults of its kind."""
    named = _named(clauses)
    media = {name for clause in clauses for name in clause.media()}
    classes = _classes(clauses)
    chosen: dict[int, _Named] = {}
    for fits in (_is_default, _is_accepted):
        for position, slot in enumerate(kind.slots):
            if position not in chosen:
                used = {item.name for item in chosen.values()}
                match = next((n for n in named if n.name not in used and fits(slot, n.name)), None)
                if match:
                    chosen[position] = match
    for position, slot in enumerate(kind.slots):
        if position not in chosen:
            match = next((c for c in classes if c.stands_for in slot.classes), None)
            if match:
                classes.remove(match)
                chosen[position] = _Named(_stand_in(slot, match.stands_for), match.amount, match.stands_for)
    used = {item.name for item in chosen.values()}
    rest = [item for item in named if item.name not in used and item.name not in COOLANTS]
    for position, slot in enumerate(kind.slots):
        if position not in chosen:
            like = next((n for n in rest if _alike(slot, n.name, catalog)), None)
            if like:
                rest.remove(like)
                chosen[position] = like
    _refuse_assumed_substrate(kind, chosen, [item.name for item in rest])
    factor = _scale(kind, chosen, catalog)
    parts = [
        _part(slot, chosen.get(i), factor, catalog)
        for i, slot in enumerate(kind.slots)
        if i in chosen or not slot.optional
    ]
    everything = (*_merged(parts), *_others(kind, rest, parts, factor, media, catalog))
    weighed = tuple(_sensible(_weighed_out(part, parts)) for part in everything)
    ratios = [mixture for clause in clauses for mixture in clause.mixtures]
    return ReactionCast(_in_ratio(weighed, ratios), factor)


def _sensible(part: Participant) -> Participant:
    """Return a participant with its assumed volume rounded to a measurable one: 3.91 mL becomes 4 mL."""
    volume = _VOLUME.search(part.amount) if part.amount.endswith(ASSUMED) else None
    if volume is None:
        return part
    rounded = rounded_volume(volume)
    change = float(rounded.split()[0]) / float(volume[1])
    amount = part.amount.replace(volume[0], rounded, 1)
    if change != 1.0:
        amount = _MOLES.sub(lambda match: f"{figure(float(match[1]) * change, 2)}{match[2]}", amount)
    return replace(part, amount=amount)


def _in_ratio(parts: Sequence[Participant], ratios: Sequence[Sequence[tuple[str, float]]]) -> tuple[Participant, ...]:
    """Return participants whose assumed volumes have the ratio that the text gives; their sum is unchanged.

    Args:
        ratios: mixtures by asset name, with the shares of the volume.
    """
    by_name = {part.asset.name: part for part in parts}
    for ratio in ratios:
        volumes = [read_amount(by_name[name].amount).volume if name in by_name else None for name, _ in ratio]
        assumed = all(by_name[name].amount.endswith(ASSUMED) for name, _ in ratio if name in by_name)
        if not assumed or any(volume is None for volume in volumes):
            continue
        total = sum(volume for volume in volumes if volume is not None)
        for name, share in ratio:
            by_name[name] = replace(by_name[name], amount=f"{figure(total * share)} mL{ASSUMED}")
    return tuple(by_name[part.asset.name] for part in parts)


def _refuse_assumed_substrate(kind: Transformation, chosen: Collection[int], rest: Sequence[str]) -> None:
    """Raise an error unless the text names all substrates.

    Raises:
        RefusalError: names the missing substrate.
    """
    for position, slot in enumerate(kind.slots):
        if is_substrate(slot.role) and not slot.optional and position not in chosen:
            classes = " or ".join(f"{'an' if name[0] in 'aeiou' else 'a'} {name}" for name in slot.classes)
            what = f"the {slot.role}" + (f" ({classes})" if classes else "")
            accepted = ", ".join(dict.fromkeys((slot.asset, *slot.accepts)))
            others = f" among {', '.join(rest)}" if rest else ""
            message = f"the template {kind.name!r} finds no {what.removeprefix('the ')}{others}; it takes {accepted}"
            if classes:
                message += f", or {classes} of your own (labgym assets add-reagent)"
            message += ": name one of them"
            raise RefusalError("no-reaction", message)


def is_substrate(role: str) -> bool:
    """Return whether a role is that of a substrate, which makes the experiment what it is."""
    return "substrate" in role or role in SUBSTRATES


def _weighed_out(part: Participant, parts: Sequence[Participant]) -> Participant:
    """Return a participant whose amount in equivalents, mol% or wt% has its mass or volume with it."""
    relative = _RELATIVE.search(part.amount)
    if relative is None or read_amount(part.amount).mass or read_amount(part.amount).volume:
        return part
    limiting = next((p for p in parts if is_substrate(p.role)), parts[0])
    base, number = moles_of(limiting.asset, limiting.amount), float(relative[1])
    if base is None or limiting is part:
        return part
    if relative[2] == "wt%":
        chemistry = limiting.asset.chemistry
        grams = number / 100.0 * base * (chemistry.molar_mass or 0.0) if chemistry is not None else 0.0
        return replace(part, amount=f"{part.amount}, {figure(grams)} g")
    moles = base * (number if relative[2] == "equiv" else number / 100.0)
    assumed = ASSUMED if part.amount.endswith(ASSUMED) else ""
    return replace(part, amount=f"{part.amount.removesuffix(ASSUMED)}, {measured(part.asset, moles)}{assumed}")


def _named(clauses: Sequence[Clause]) -> list[_Named]:
    named: dict[str, _Named] = {}
    for clause in clauses:
        for name in clause.names("reagent"):
            earlier = named.get(name, _Named(name, ""))
            named[name] = replace(
                earlier,
                amount=together(earlier.amount, clause.amounts.get(name, "")),
                strength=earlier.strength or clause.strengths.get(name, ""),
                catalytic=earlier.catalytic or name in clause.catalytic,
            )
    return list(named.values())


def _classes(clauses: Sequence[Clause]) -> list[_Named]:
    amounts: dict[str, str] = {}
    for clause in clauses:
        for name in clause.names("class"):
            amounts[name] = amounts.get(name) or clause.amounts.get(name, "")
    return [_Named("", amount, name) for name, amount in amounts.items()]


def _is_default(slot: Slot, name: str) -> bool:
    return name == slot.asset


def _is_accepted(slot: Slot, name: str) -> bool:
    return name in slot.accepts


def _alike(slot: Slot, name: str, catalog: Catalog) -> bool:
    """Return whether a reagent that a slot does not list is of the slot's category; substrates are never guessed."""
    asset, usual = catalog.get(name), catalog.get(slot.asset)
    if "substrate" in slot.role or asset.category in SOLVENTS:
        return False
    if name in catalog.own:  # its entry has no category, but its reactive groups
        groups = [set(each.groups) for each in (asset, usual)]
        return bool(groups[1]) and groups[0] >= groups[1]
    return asset.category == usual.category


def _stand_in(slot: Slot, substance_class: str) -> str:
    usual = transformations().stand_ins[substance_class]
    return usual if usual == slot.asset or usual in slot.accepts else slot.asset


def _part(slot: Slot, named: _Named | None, factor: float, catalog: Catalog) -> Participant:
    if named is None:
        return Participant(
            catalog.get(slot.asset), slot.role, scaled(slot.amount, factor) + ASSUMED, slot.when, named=False
        )
    asset, default = catalog.get(named.name), catalog.get(slot.asset)
    other_catalyst = (
        "catalyst" in slot.role and "base" not in slot.role and asset.name != slot.asset and asset.phase == "solid"
    )
    if (named.catalytic or other_catalyst) and not named.amount:
        usual, factor = f"{CATALYTIC:g} equiv", 1.0
    else:
        usual = slot.amount if asset.name == slot.asset else equimolar(asset, slot.amount, default)
    amount = named.amount or of_strength(scaled(usual, factor), named.strength) + ASSUMED
    return Participant(asset, slot.role, amount, slot.when, named=True, stands_for=named.stands_for)


def _scale(kind: Transformation, chosen: dict[int, _Named], catalog: Catalog) -> float:
    """Return the size of the text's batch relative to the table's, by the first reagent with an amount.

    Raises:
        RefusalError: the batch is far beyond all vessels, or far below all balances.
    """
    for position, slot in enumerate(kind.slots):
        item = chosen.get(position)
        if item is None or not item.amount:
            continue
        ours, usual = moles_of(catalog.get(item.name), item.amount), moles_of(catalog.get(slot.asset), slot.amount)
        if ours and usual:
            factor = ours / usual
            if not BATCHES[0] <= factor <= BATCHES[1]:
                what = "large for every vessel" if factor > 1.0 else "small for every balance"
                message = f"a batch with {item.amount} of {item.name} is too {what} of the catalog"
                raise RefusalError("infeasible", f"{message}; usual is {slot.amount}")
            return 1.0 if abs(factor - 1.0) < SAME_SCALE else factor
    return 1.0


def _merged(parts: Sequence[Participant]) -> tuple[Participant, ...]:
    """Return the participants, each reagent once even if it fills two slots."""
    by_name: dict[str, Participant] = {}
    for part in parts:
        by_name.setdefault(part.asset.name, part)
    return tuple(by_name.values())


def _is_medium(asset: Asset, media: Collection[str]) -> bool:
    return asset.category in SOLVENTS or (asset.name in media and asset.phase == "liquid")


def _others(
    kind: Transformation,
    rest: Iterable[_Named],
    parts: Sequence[Participant],
    factor: float,
    stated_media: Collection[str],
    catalog: Catalog,
) -> Iterable[Participant]:
    """Yield the solvents and the reagents that the kind of reaction has no slot for.

    Args:
        stated_media: names of the reagents that the text says the reaction is done in.
    """
    used = {part.asset.name for part in parts}
    left = [item for item in rest if item.name not in used]
    usual_solvent = kind.solvent
    usual_name = usual_solvent.asset if usual_solvent else ""
    media = [item for item in left if item.name == usual_name or _is_medium(catalog.get(item.name), stated_media)]
    for place, item in enumerate(media):
        volume = usual_solvent.amount if usual_solvent else "30 mL"
        amount = item.amount or of_strength(scaled(volume, factor), item.strength) + ASSUMED
        yield Participant(catalog.get(item.name), "co-solvent" if place else "solvent", amount, "medium", named=True)
    dissolves = any(part.named and _is_medium(part.asset, stated_media) for part in parts)
    if not media and usual_solvent and usual_solvent.asset not in used and not dissolves:
        amount = scaled(usual_solvent.amount, factor) + ASSUMED
        yield Participant(catalog.get(usual_solvent.asset), "solvent", amount, "medium", named=False)
    for item in left:
        asset = catalog.get(item.name)
        if item not in media and asset.name not in PROTECTIVE_GASES:
            usual = f"{CATALYTIC:g} equiv" if item.catalytic else ""
            first = kind.slots[0]
            usual = usual or scaled(equimolar(asset, first.amount, catalog.get(first.asset)), factor)
            amount = item.amount or of_strength(usual, item.strength) + ASSUMED
            yield Participant(asset, ROLES.get(asset.category, "reagent"), amount, "add", named=True)
