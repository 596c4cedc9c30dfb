"""Which reagent plays which part: what the text names, stand-ins for classes, and what the kind of reaction needs."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass

from labgym.assets import Asset, Catalog
from labgym.protocols.amounts import read_amount
from labgym.protocols.synthesis.reading import Clause
from labgym.protocols.synthesis.transformations import Slot, Transformation, transformations

ASSUMED = " (assumed)"
SOLVENTS = ("organic_solvent", "solvent")
PROTECTIVE_GASES = ("NitrogenGas", "ArgonGas")
AIDS = {"adsorbent": "5 g", "drying_agent": "5 g"}
"""Amounts of what takes no part in the reaction."""
COOLANTS = ("DryIce",)
SAME_SCALE = 0.05
"""Batches that differ by less are of one size."""
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
_MOLAR, _SHARE = re.compile(r"\((\d+(?:\.\d+)?) M\b"), re.compile(r"\((?:[<=]*\d+-)?(\d+)\s?%")
_SCALABLE = re.compile(r"(\d+(?:\.\d+)?)(\s*(?:kg|mg|g|mmol|mol|mL|L)\b)")


@dataclass(frozen=True)
class Part:
    """A reagent in its part.

    Attributes:
        amount: as written, "(assumed)" where the text does not give it.
        when: charged first, added afterwards, or the medium.
        named: whether the text names it, itself or by its class.
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


@dataclass(frozen=True)
class Cast:
    """The parts of a reaction, and how large the batch is beside the table's."""

    parts: tuple[Part, ...]
    factor: float


def cast(kind: Transformation, clauses: Sequence[Clause]) -> Cast:
    """Return the parts of a reaction, those that the text leaves open filled as the kind of reaction says."""
    named = _named(clauses)
    media = {name for clause in clauses for name in clause.media()}
    classes = _classes(clauses)
    chosen: dict[int, _Named] = {}
    for wanted in (_is_default, _is_accepted):
        for position, slot in enumerate(kind.slots):
            if position not in chosen:
                taken = {item.name for item in chosen.values()}
                found = next((n for n in named if n.name not in taken and wanted(slot, n.name)), None)
                if found:
                    chosen[position] = found
    for position, slot in enumerate(kind.slots):
        if position not in chosen:
            found = next((c for c in classes if c.stands_for in slot.classes), None)
            if found:
                classes.remove(found)
                chosen[position] = _Named(_stand_in(slot, found.stands_for), found.amount, found.stands_for)
    taken = {item.name for item in chosen.values()}
    rest = [item for item in named if item.name not in taken and item.name not in COOLANTS]
    for position, slot in enumerate(kind.slots):
        if position not in chosen:
            like = next((n for n in rest if _alike(slot, n.name)), None)
            if like:
                rest.remove(like)
                chosen[position] = like
    factor = _scale(kind, chosen)
    parts = [
        _part(slot, chosen.get(i), factor) for i, slot in enumerate(kind.slots) if i in chosen or not slot.optional
    ]
    return Cast((*_merged(parts), *_others(kind, rest, parts, factor, media)), factor)


def scaled(amount: str, factor: float) -> str:
    """Return an amount times a factor, three figures kept."""

    def times(match: re.Match[str]) -> str:
        return f"{_figure(float(match[1]) * factor)}{match[2]}"

    return _SCALABLE.sub(times, amount)


def _named(clauses: Sequence[Clause]) -> list[_Named]:
    found: dict[str, str] = {}
    for clause in clauses:
        for name in clause.names("reagent"):
            found[name] = found.get(name) or clause.amounts.get(name, "")
    return [_Named(name, amount) for name, amount in found.items()]


def _classes(clauses: Sequence[Clause]) -> list[_Named]:
    found: dict[str, str] = {}
    for clause in clauses:
        for name in clause.names("class"):
            found[name] = found.get(name) or clause.amounts.get(name, "")
    return [_Named("", amount, name) for name, amount in found.items()]


def _is_default(slot: Slot, name: str) -> bool:
    return name == slot.asset


def _is_accepted(slot: Slot, name: str) -> bool:
    return name in slot.accepts


def _alike(slot: Slot, name: str) -> bool:
    """Say whether a reagent is of the kind that a slot is for, though not listed; substrates are never guessed."""
    asset, usual = Catalog.load().get(name), Catalog.load().get(slot.asset)
    return "substrate" not in slot.role and asset.category == usual.category and asset.category not in SOLVENTS


def _stand_in(slot: Slot, substance_class: str) -> str:
    usual = transformations().stand_ins[substance_class]
    return usual if usual == slot.asset or usual in slot.accepts else slot.asset


def _part(slot: Slot, named: _Named | None, factor: float) -> Part:
    catalog = Catalog.load()
    if named is None:
        return Part(catalog.get(slot.asset), slot.role, scaled(slot.amount, factor) + ASSUMED, slot.when, named=False)
    asset = catalog.get(named.name)
    usual = slot.amount if asset.name == slot.asset else _equimolar(asset, slot.amount)
    amount = named.amount or scaled(usual, factor) + ASSUMED
    return Part(asset, slot.role, amount, slot.when, named=True, stands_for=named.stands_for)


def _equimolar(asset: Asset, amount: str) -> str:
    """Return as many moles of another reagent as an amount holds, weighed or measured."""
    moles, chemistry = read_amount(amount).moles, asset.chemistry
    if asset.category in AIDS:
        return AIDS[asset.category]
    if moles is None and chemistry is not None and chemistry.state == "solid":
        return amount.replace("mL", "g")
    if moles is None or chemistry is None or not chemistry.molar_mass or chemistry.state == "gas":
        return amount
    grams = moles * chemistry.molar_mass
    millimoles = f"{moles * 1000:.3g} mmol"
    molar, share = _strength(asset)
    if molar:
        return f"{_figure(1000.0 * moles / molar)} mL of {molar:g} M, {millimoles}"
    if chemistry.state == "liquid" and chemistry.density:
        return f"{_figure(grams / share / chemistry.density)} mL, {millimoles}"
    return f"{_figure(grams)} g, {millimoles}"


def _figure(value: float) -> str:
    return f"{float(f'{value:.3g}'):g}"


def _strength(asset: Asset) -> tuple[float | None, float]:
    """Return mol/L and the share by mass of a reagent that is a solution, by its name: "(1 M in THF)", "(37%)"."""
    name = asset.synonyms_en[0] if asset.synonyms_en else ""
    molar, share = _MOLAR.search(name), _SHARE.search(name)
    return (float(molar[1]) if molar else None), (float(share[1]) / 100.0 if share else 1.0)


def _scale(kind: Transformation, chosen: dict[int, _Named]) -> float:
    """Return how much larger the text's batch is than the table's, by the first reagent whose amount it gives."""
    for position, slot in enumerate(kind.slots):
        given = chosen.get(position)
        if given is None or not given.amount:
            continue
        asset = Catalog.load().get(given.name)
        ours, usual = _moles(asset, given.amount), _moles(Catalog.load().get(slot.asset), slot.amount)
        if ours and usual:
            factor = ours / usual
            return 1.0 if abs(factor - 1.0) < SAME_SCALE else factor
    return 1.0


def _moles(asset: Asset, amount: str) -> float | None:
    stated, chemistry = read_amount(amount), asset.chemistry
    if stated.moles is not None:
        return stated.moles
    if chemistry is None or not chemistry.molar_mass:
        return None
    if stated.mass is not None:
        return stated.mass / chemistry.molar_mass
    if stated.volume is None or chemistry.state != "liquid" or chemistry.density is None:
        return None
    return stated.volume * chemistry.density / chemistry.molar_mass


def _merged(parts: Sequence[Part]) -> tuple[Part, ...]:
    """Return the parts with a reagent that fills two slots once."""
    found: dict[str, Part] = {}
    for part in parts:
        found.setdefault(part.asset.name, part)
    return tuple(found.values())


def _is_medium(asset: Asset, said: Collection[str]) -> bool:
    liquid = asset.chemistry is not None and asset.chemistry.state == "liquid"
    return asset.category in SOLVENTS or (asset.name in said and liquid)


def _others(
    kind: Transformation, rest: Iterable[_Named], parts: Sequence[Part], factor: float, said: Collection[str]
) -> Iterable[Part]:
    """Yield the solvents and the reagents that the kind of reaction has no slot for.

    Args:
        said: what the text says that the reaction is done in.
    """
    catalog = Catalog.load()
    taken = {part.asset.name for part in parts}
    left = [item for item in rest if item.name not in taken]
    usual = kind.solvent
    usual_name = usual.asset if usual else ""
    media = [item for item in left if item.name == usual_name or _is_medium(catalog.get(item.name), said)]
    for place, item in enumerate(media):
        volume = usual.amount if usual else "30 mL"
        amount = item.amount or scaled(volume, factor) + ASSUMED
        yield Part(catalog.get(item.name), "co-solvent" if place else "solvent", amount, "medium", named=True)
    if not media and usual and usual.asset not in taken:
        amount = scaled(usual.amount, factor) + ASSUMED
        yield Part(catalog.get(usual.asset), "solvent", amount, "medium", named=False)
    for item in left:
        asset = catalog.get(item.name)
        if item not in media and asset.name not in PROTECTIVE_GASES:
            amount = item.amount or scaled(_equimolar(asset, kind.slots[0].amount), factor) + ASSUMED
            yield Part(asset, ROLES.get(asset.category, "reagent"), amount, "add", named=True)
