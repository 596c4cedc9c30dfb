"""Feasibility: whether a catalog's reagents and equipment suffice for an experiment, and the obstacles if not."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Literal

from labgym.assets import Asset, Catalog
from labgym.protocols.amounts import Amount, read_amount, volume_of
from labgym.protocols.apparatus import APPARATUS, FILL
from labgym.protocols.capability import capacity, cools_to, heats_to, weighs, withstands
from labgym.protocols.contents import is_vessel
from labgym.protocols.errors import RefusalError
from labgym.protocols.experiments.grounding import SOLVENTS, WATER, Grounder, grounded
from labgym.protocols.experiments.model import Action, Atmosphere, Experiment, Verb
from labgym.protocols.refusals import refusals, refuse_making, refuse_mixture, refuse_solvent, refuse_to_make
from labgym.protocols.rules.consumption import OXIDIZERS, moles, used_up
from labgym.quantities import ROOM_RANGE

Code = Literal[
    "unlisted", "amount", "equipment", "temperature", "volume", "mass", "pressure", "atmosphere", "unsafe", "incomplete"
]

GASES: dict[Atmosphere, str] = {"nitrogen": "NitrogenGas", "argon": "ArgonGas", "hydrogen": "Hydrogen"}
WORK_UP: frozenset[Verb] = frozenset(
    (
        "Quench",
        "Extract",
        "Wash",
        "Partition",
        "PhaseSeparation",
        "CollectLayer",
        "Filter",
        "Concentrate",
        "AdjustPH",
        "Pour",
    )
)
"""Actions after which the mixture leaves the reaction flask or is divided."""
PURIFYING: frozenset[Verb] = frozenset(("Chromatograph", "Distill", "Sublime"))
"""Actions after which the batch is the product alone."""
PASSING: frozenset[Verb] = frozenset(("DrySolution", "Wash"))
"""Actions whose reagents leave the batch again."""
DESTROYING: frozenset[Verb] = frozenset(("Quench", "Pour", "AdjustPH", "Extract", "Partition"))
"""Actions whose water or alcohol destroys what is left of a hydride."""
EVAPORATED_BELOW_C = 125.0
"""Boiling point up to which a solvent is taken to be gone after evaporation, degrees Celsius."""
HEATED_FLASKS = ("bath", "mantle", "stirrer", "reactor")
"""Subtypes of devices that heat a reaction; ovens, burners and heat guns do not."""
PRESSURE_VESSELS = ("vessel", "reactor")
"""Subtypes of vessels for reactions under pressure; chromatographs withstand more but hold no reaction."""
READABLE = 10.0
"""Smallest mass that is weighed to within 10 %, as a multiple of the balance's resolution."""


@dataclass(frozen=True)
class Obstacle:
    """A reason why an experiment is infeasible: its kind, the action (counted from 1) or None, and a sentence."""

    code: Code
    action: int | None
    message: str


@dataclass(frozen=True)
class FeasibilityVerdict:
    """The filter's verdict on an experiment.

    Attributes:
        experiment: with its materials under the names of assets if it is feasible, else unchanged.
        obstacles: why it is infeasible; empty if it is feasible.
    """

    experiment: Experiment
    obstacles: tuple[Obstacle, ...]

    @property
    def feasible(self) -> bool:
        """Whether there are no obstacles."""
        return not self.obstacles


class FeasibilityFilter:
    """Compares experiments with a catalog, whose limits are computed once.

    Args:
        catalog: the assets of the laboratory; the default catalog if None.
    """

    def __init__(self, catalog: Catalog | None = None) -> None:
        self.catalog = catalog if catalog is not None else Catalog.load()
        self._grounder = Grounder(self.catalog)
        self._reagents = Catalog(self.catalog.of_kind("reagent"))
        devices = self.catalog.of_kind("instrument")
        heaters = [asset for asset in devices if asset.subtype in HEATED_FLASKS]
        self._hottest = _best(heaters, heats_to, max)
        self._oven = _best([a for a in devices if a.subtype in ("oven", "furnace")], heats_to, max)
        self._coldest = _best(devices, cools_to, min)
        self._strongest = _best([a for a in devices if a.subtype in PRESSURE_VESSELS], withstands, max)
        flasks = [asset for asset in devices if is_vessel(asset) and asset.subtype in ("flask", "reactor")]
        self._largest = _best(flasks, capacity, max)
        balances = [limits for asset in devices if (limits := weighs(asset)) is not None]
        self._finest = min((least for least, _ in balances), default=None)
        self._heaviest = max((most for _, most in balances), default=None)

    def judge(self, experiment: Experiment) -> FeasibilityVerdict:
        """Return whether an experiment is feasible, with all obstacles."""
        names = self.grounded_names(experiment)
        obstacles = [*_incomplete(experiment), *self._unlisted(experiment, names)]
        listed = {name: asset for name, asset in names.items() if asset is not None}
        for number, action in enumerate(experiment.actions, 1):
            obstacles += self._equipment(number, action)
            obstacles += self._conditions(number, action)
            obstacles += _unread(number, action)
            obstacles += _unresolved(number, action)
            obstacles += self._masses(number, action, listed)
        obstacles += self._volume(experiment, listed)
        obstacles += _unsafe(experiment, listed, self.catalog)
        return FeasibilityVerdict(experiment if obstacles else grounded(experiment, listed), tuple(obstacles))

    def grounded_names(self, experiment: Experiment) -> dict[str, str | None]:
        """Return the asset of the catalog that each material is, None if the catalog lacks it."""
        return {material.name: self._grounder.find(material) for material in experiment.materials}

    def equipment(self, experiment: Experiment, listed: dict[str, str]) -> list[Obstacle]:
        """Return the obstacles that instruments or gases remove.

        Args:
            experiment: the experiment.
            listed: assets of its materials by name, of those that the catalog has.
        """
        obstacles: list[Obstacle] = []
        for number, action in enumerate(experiment.actions, 1):
            obstacles += self._equipment(number, action)
            obstacles += self._conditions(number, action)
            obstacles += self._masses(number, action, listed)
        return [*obstacles, *self._volume(experiment, listed)]

    def flaws(self, experiment: Experiment, listed: dict[str, str]) -> list[Obstacle]:
        """Return the obstacles that no laboratory removes: what is incomplete, not understood or unsafe."""
        obstacles = [*_incomplete(experiment), *_unsafe(experiment, listed, self.catalog)]
        for number, action in enumerate(experiment.actions, 1):
            obstacles += [*_unread(number, action), *_unresolved(number, action)]
        return obstacles

    def _unlisted(self, experiment: Experiment, names: dict[str, str | None]) -> Iterator[Obstacle]:
        for material in experiment.materials:
            if names[material.name] is None:
                near = self._reagents.nearest(material.name, 3)
                hint = f"; nearest by name: {', '.join(near)}" if near else ""
                what = f"{material.role} {material.name[:80]!r}"
                yield Obstacle("unlisted", None, f"the catalog has no {what}{hint}")

    def _equipment(self, number: int, action: Action) -> Iterator[Obstacle]:
        for choice in APPARATUS[action.verb].needs if action.verb in APPARATUS else ():
            if not any(name in self.catalog for name in choice):
                message = f"{action.verb} needs {' or '.join(sorted(choice))}, which the catalog lacks"
                yield Obstacle("equipment", number, message)
        gas = GASES.get(action.atmosphere) if action.atmosphere is not None else None
        if gas is not None and gas not in self.catalog:
            yield Obstacle(
                "atmosphere", number, f"an atmosphere of {action.atmosphere} needs {gas}, which the catalog lacks"
            )

    def _conditions(self, number: int, action: Action) -> Iterator[Obstacle]:
        hottest = self._oven if action.verb == "DrySolid" else self._hottest
        at = action.temperature
        if at is not None and at > ROOM_RANGE[1] and (hottest is None or at > hottest):
            yield Obstacle("temperature", number, f"{at:g} C is above the limit of the equipment ({_limit(hottest)} C)")
        if at is not None and at < ROOM_RANGE[0] and (self._coldest is None or at < self._coldest):
            message = f"{at:g} C is below the limit of the equipment ({_limit(self._coldest)} C)"
            yield Obstacle("temperature", number, message)
        bar = action.pressure
        if bar is not None and bar > 1.5 and (self._strongest is None or bar - 1.0 > self._strongest):
            message = (
                f"{bar:g} bar exceeds the limit of the strongest vessel ({_limit(self._strongest)} bar above ambient)"
            )
            yield Obstacle("pressure", number, message)

    def _masses(self, number: int, action: Action, listed: dict[str, str]) -> Iterator[Obstacle]:
        for portion in action.takes:
            mass = read_amount(portion.amount).mass
            if mass is None or portion.name not in listed:
                continue
            if self._finest is None or mass < READABLE * self._finest:
                message = (
                    f"{mass * 1000:g} mg of {portion.name[:80]} cannot be weighed to within 10 %: "
                    f"{_weighable(mass, self._finest)}"
                )
                yield Obstacle("mass", number, message)
            elif self._heaviest is not None and mass > self._heaviest:
                yield Obstacle("mass", number, f"{mass:g} g of {portion.name[:80]} is more than any balance can weigh")

    def _volume(self, experiment: Experiment, listed: dict[str, str]) -> Iterator[Obstacle]:
        total = 0.0
        for number, action in enumerate(experiment.actions, 1):
            if action.verb in WORK_UP:
                return
            for portion in action.takes:
                total += self._millilitres(listed.get(portion.name), read_amount(portion.amount))
            if self._largest is None or total > FILL * self._largest:
                limit = _limit(self._largest)
                message = (
                    f"the flask would hold about {total:.0f} mL; the largest one has {limit} mL, filled to at most 60 %"
                )
                yield Obstacle("volume", number, message)
                return

    def _millilitres(self, name: str | None, amount: Amount) -> float:
        if name is None:
            return (amount.volume or 0.0) * amount.portions
        return volume_of(self.catalog.get(name), amount) * amount.portions


def reasons(verdicts: Iterable[FeasibilityVerdict]) -> Counter[Code]:
    """Return the number of experiments with each kind of obstacle; an experiment may have several."""
    counts: Counter[Code] = Counter()
    for verdict in verdicts:
        counts.update({obstacle.code for obstacle in verdict.obstacles})
    return counts


def _incomplete(experiment: Experiment) -> Iterator[Obstacle]:
    if not experiment.reaction.rpartition(">")[2] and not experiment.product:
        yield Obstacle(
            "incomplete",
            None,
            "it names no product: add one to the record (for XDL, to its Metadata or with --product)",
        )
    if not any(action.takes for action in experiment.actions):
        yield Obstacle("incomplete", None, "none of its actions takes a material")
    if not any(action.verb not in ("Yield", "Analyze") and not action.takes for action in experiment.actions) and (
        len(experiment.actions) < 3
    ):
        yield Obstacle("incomplete", None, "it says nothing about the reaction conditions or the work-up")


def _unread(number: int, action: Action) -> Iterator[Obstacle]:
    for portion in action.takes:
        for text in read_amount(portion.amount).unread:
            message = f"{text!r} of {portion.name[:80]} has a unit that is not known: use one such as g, mL or mmol"
            yield Obstacle("amount", number, message)


def _unresolved(number: int, action: Action) -> Iterator[Obstacle]:
    if action.verb == "Note":
        what = f"no verb expresses its step {action.note[:80]!r}: replace it by actions that do"
        yield Obstacle("incomplete", number, what)
    if action.verb in ("Refers", "Repeat"):
        what = "another procedure" if action.verb == "Refers" else "earlier actions"
        stated = f" ({action.note[:80]})" if action.note else ""
        yield Obstacle("incomplete", number, f"it refers to {what}{stated}: write those actions out")


def _unsafe(experiment: Experiment, listed: dict[str, str], catalog: Catalog) -> Iterator[Obstacle]:
    """Yield dangerous products, and reagents that must never meet where they do meet."""
    roles = {material.name: material.role for material in experiment.materials}
    solvents = {listed[name] for name, role in roles.items() if role == "solvent" and name in listed}
    solvents |= {listed[name] for name in _poured(experiment) if name in listed}
    made = experiment.reaction.rpartition(">")[2].split(".")
    checks: list[tuple[int | None, Callable[[], None]]] = [
        (None, partial(refuse_to_make, experiment.name, experiment.product, made)),
        (None, partial(refuse_making, _structures(listed.values(), catalog))),
    ]
    for place, present, added in _meetings(experiment.actions, listed, catalog):
        alike = sorted({name for reagent in present for name in _acts_as(reagent, catalog)})
        checks += [(place, partial(refuse_mixture, alike))]
        ending = added if experiment.actions[place - 1].verb in DESTROYING else frozenset()
        media = [name for name in alike if name in solvents and name not in ending]
        checks += [(place, partial(refuse_solvent, alike, media))]
    seen = set()
    for number, check in checks:
        try:
            check()
        except RefusalError as error:
            if str(error) not in seen:
                seen.add(str(error))
                yield Obstacle("unsafe", number, str(error))


def _structures(names: Iterable[str], catalog: Catalog) -> dict[str, str]:
    """Return the SMILES of the reagents whose structure is known."""
    known = ((name, catalog.get(name).chemistry) for name in names)
    return {name: item.smiles for name, item in known if item is not None and item.smiles}


def _meetings(
    actions: Sequence[Action], listed: dict[str, str], catalog: Catalog
) -> Iterator[tuple[int, frozenset[str], frozenset[str]]]:
    """Yield the reagents that may be in the vessel at each action that adds some, and those added; rather too many.

    Everything stays in the vessel except hydrides that water or an alcohol quenched, hydrides and metals that an acid
    used up in an earlier action, solutions that are made aside until they are added, liquids that washed or dried the
    batch, the solvents of a batch that was concentrated, and what a chromatography, a distillation or a sublimation
    leaves behind. The eluents of a chromatography do not meet inorganic reagents that an aqueous phase took away.
    """
    batch: set[str] = set()
    washed: set[str] = set()
    amounts: dict[str, str] = {}
    aside = made_aside(actions)
    for place, action in enumerate(actions):
        taken = [place, *(made for made, use in aside.items() if use == place)]
        portions = [portion for k in taken for portion in actions[k].takes if portion.name in listed]
        added = frozenset(listed[portion.name] for portion in portions)
        if place in aside:
            yield place + 1, added, added
            continue
        if action.verb in WORK_UP:
            batch -= _used_up(batch, amounts, catalog)
        for portion in portions:
            name = listed[portion.name]
            amounts[name] = "; ".join(filter(None, (amounts.get(name), portion.amount)))
        if added:
            kept = {name for name in batch if action.verb != "Chromatograph" or name not in washed}
            yield place + 1, added | kept, added
        if action.verb in ("Extract", "Partition", "Wash") and _has_water(batch | added, catalog):
            washed |= {name for name in batch if is_inorganic(catalog.get(name))}
        washed -= added
        batch = _after(action, batch, added, catalog)


def _used_up(batch: Iterable[str], amounts: dict[str, str], catalog: Catalog) -> frozenset[str]:
    assets = [catalog.get(name) for name in batch]
    known = {asset.name: moles(asset, amounts[asset.name]) for asset in assets if amounts.get(asset.name)}
    return used_up(assets, {name: value for name, value in known.items() if value is not None})


def _after(action: Action, batch: set[str], added: frozenset[str], catalog: Catalog) -> set[str]:
    """Return the reagents that may be in the vessel after an action."""
    if action.verb in PURIFYING and action.keep != "residue":
        return set()
    if any(_reduces(catalog.get(name)) for name in added):
        batch = {name for name in batch if OXIDIZERS.isdisjoint(catalog.get(name).groups)}
    if action.verb == "Concentrate":
        return {name for name in batch if not _evaporates(catalog.get(name))}
    if action.verb in DESTROYING and any(_is_quencher(catalog.get(name)) for name in added):
        return {name for name in batch | added if not _is_quenched(name, catalog)}
    if action.verb == "Wash" and action.keep != "aqueous" and _has_water(added, catalog):
        return {name for name in batch if not _is_quenched(name, catalog)}
    if action.verb not in PASSING or (action.verb == "Wash" and action.keep == "aqueous"):
        return batch | added
    return batch


def made_aside(actions: Sequence[Action]) -> dict[int, int]:
    """Return the place of each solution that is made in a separate vessel, with the place of the action that adds it.

    What the batch begins with is not aside.
    """
    first = next((place for place, action in enumerate(actions) if action.takes), 0)
    found = {}
    for place, action in enumerate(actions):
        if action.part == "solution" and not action.takes:
            made = [k for k in range(first + 1, place) if actions[k].verb == "MakeSolution"]
            if made:
                found[made[-1]] = place
    return found


def _has_water(names: Iterable[str], catalog: Catalog) -> bool:
    """Return whether one of the reagents of a separation is water or, like brine, a salt or acid in water."""
    return any(name == WATER or is_inorganic(catalog.get(name)) for name in names)


def _is_quenched(name: str, catalog: Catalog) -> bool:
    """Return whether water or an alcohol destroys a reagent, or one that acts like it."""
    return not refusals().destroyed_by_protic.isdisjoint(_acts_as(name, catalog))


def _reduces(asset: Asset) -> bool:
    """Return whether a reagent destroys what is left of an oxidizer: a sulfite, thiosulfate or dithionite."""
    return "sulfite" in asset.groups or asset.formula == "Na2O4S2"


def _is_quencher(asset: Asset) -> bool:
    """Return whether a reagent that ends a reaction destroys what is left of a hydride."""
    return "aqueous" in asset.groups or asset.name in refusals().protic or asset.name == WATER


def is_inorganic(asset: Asset) -> bool:
    """Return whether a reagent has a formula without carbon."""
    return bool(asset.formula) and re.search(r"C(?![a-z])", asset.formula) is None


def _evaporates(asset: Asset) -> bool:
    boiling = asset.boiling_point
    return asset.category in SOLVENTS and boiling is not None and boiling <= EVAPORATED_BELOW_C


def _acts_as(name: str, catalog: Catalog) -> Iterator[str]:
    """Yield a reagent and, for an open substance, the reagents of the catalog with exactly its reactive groups."""
    yield name
    if any(substance.name == name for substance in catalog.substances):
        groups = frozenset(catalog.get(name).groups)
        yield from (asset.name for asset in catalog.of_kind("reagent") if groups and frozenset(asset.groups) == groups)


def _poured(experiment: Experiment) -> Iterator[str]:
    """Yield the materials that go into the flask by volume alone; whatever their role, they act as solvents."""
    for action in experiment.actions:
        if action.verb in WORK_UP:
            return
        for portion in action.takes:
            amount = read_amount(portion.amount)
            if amount.volume is not None and amount.mass is None and amount.moles is None:
                yield portion.name


def _weighable(mass: float, finest: float | None) -> str:
    """Return the remedies for a mass that is too small to weigh, grams."""
    if finest is None:
        return "the catalog has no balance"
    least = READABLE * finest
    stock = max(10.0 * mass, least)
    return (
        f"weigh {stock * 1000:.3g} mg into 10 mL of a stock solution and take {10.0 * mass / stock:.2g} mL of it, or "
        f"make {least / mass:.2g} times the batch"
    )


def _best(
    assets: Iterable[Asset], measure: Callable[[Asset], float | None], best: Callable[[list[float]], float]
) -> float | None:
    values = [value for asset in assets if (value := measure(asset)) is not None]
    return best(values) if values else None


def _limit(value: float | None) -> str:
    return "none" if value is None else f"{value:g}"
