"""Sizes: each step gets the smallest vessels, measures, balances, baths and machines of the catalog that do its work.

A protocol is drafted with kinds, such as SeparatoryFunnel. `fitted` follows the batch through the steps and replaces
each kind by the smallest of its sizes that fits, or by the next larger kind of vessel. Where the largest machine is too
small, the batch passes in portions. Apparatus that is higher than its hood moves to a hood that holds it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass

from labgym.assets import Asset, Catalog
from labgym.protocols.amounts import read_amount
from labgym.protocols.apparatus import APPARATUS, NECKED_VESSELS, REACTION_VESSELS, vessel_for
from labgym.protocols.capability import capacity, weighs
from labgym.protocols.contents import CARRYING, FILTRATE, SEPARATING, SOLID, STILL, Situation, is_vessel, situations
from labgym.protocols.model import Protocol, Step
from labgym.protocols.portions import EVAPORATOR, FILLING, PORTION_FILLING, in_words, portions, portions_for
from labgym.protocols.rules.machines import READABLE
from labgym.quantities import ROOM_RANGE

VESSEL_FILL = 0.9
"""Largest share of an open vessel that a batch at rest may fill."""
HEATED_FILL = {"Concentrate": FILLING, "Distill": 0.66, "Heat": 0.66, "Reflux": 0.66}
"""Largest share of a vessel in which a batch boils, by action."""
LARGER = {
    "CrystallizingDish": "Beaker",
    "ErlenmeyerFlask": "Beaker",
    "Beaker": "JacketedReactor",
    "RoundBottomFlask": "ThreeNeckFlask",
    "ThreeNeckFlask": "JacketedReactor",
}
"""The kind of vessel that takes a batch for which every size of a kind is too small."""
WEIGHED_INTO = "SampleVial"
"""Vessel in which a solid waits for the reaction."""
OPEN_FLASKS = ("RoundBottomFlask", "ThreeNeckFlask")
RESTING = (*OPEN_FLASKS, "Beaker", "ErlenmeyerFlask", "JacketedReactor")
"""Kinds of vessels in which a batch can be worked on."""
SELF_CONTAINED = ("JacketedReactor", "PressureReactor", "HydrogenationApparatus")
"""Vessels with a built-in stirrer and a jacket or heater."""
CLOSED = ("PressureTube", "PressureReactor", "HydrogenationApparatus")
"""Vessels that were chosen by the pressure that they withstand."""
CIRCULATOR = "ReactorCirculator"
THERMAL = ("bath", "mantle", "stirrer")
"""Subtypes of devices that a self-contained vessel needs none of."""
BATH_GAP_M = 0.02
"""Least difference between the widths of a bath and of the vessel in it, meters."""
OVERHEAD_FROM_ML = 2000.0
"""Capacity of a flask from which on it is stirred from above, mL."""
WELL_ML = 2000.0
"""Capacity of the largest flask that the well of a refrigerated bath takes, mL."""
REVISIONS = 4
"""Number of times that a step is fitted while its vessel, and so what it holds, changes."""
COLUMN = "ChromatographyColumn"
LOAD_G_PER_MM2 = 0.001
"""Crude product that a column separates at once, by the square of its bore: Still, Kahn, Mitra, J. Org. Chem. 1978, 43,
2923, for a difference of 0.2 in Rf."""
RECEIVERS_FILLED = 3.0
"""Number of times that the receiver of an evaporator is filled before a larger machine is taken."""
CAKES = 2.0
"""Volume that is filtered at once, as a multiple of the bowl of the funnel."""


def fitted(protocol: Protocol, catalog: Catalog) -> Protocol:
    """Return a protocol whose steps use the smallest sizes that fit, in portions where the largest is too small."""
    reaction = _reaction_vessel(protocol, catalog)
    drafted, position = protocol, 0
    while position < len(protocol.steps):
        # What a step's vessel holds depends on the steps before it, which are fitted, and on the vessel itself.
        draft = protocol.steps[position]
        for revision in range(REVISIONS):
            situation = situations(protocol, catalog)[position]
            if _overfills(situation, reaction):
                break
            step = _StepFitter(protocol, catalog, situation, reaction, draft, revision > 0).fitted()
            if step == situation.step:
                break
            protocol = _with_step(protocol, position, step)
        position += 1
        if _overfills(situation, reaction):
            kinds = NECKED_VESSELS if catalog.get(reaction).family in REACTION_VESSELS else (reaction,)
            larger = vessel_for(situation.volume, catalog, kinds, VESSEL_FILL)
            drafted = protocol = _renamed(drafted, reaction, larger)
            reaction, position = larger, 0
    names = dict.fromkeys(name for step in protocol.steps for name in step.uses)
    instruments = tuple(name for name in names if catalog.get(name).kind == "instrument")
    return protocol.model_copy(update={"instruments": instruments})


def _reaction_vessel(protocol: Protocol, catalog: Catalog) -> str:
    """Return the name of the vessel in which a reaction begins, or ""."""
    steps = [step for step in protocol.steps if step.action not in STILL]
    used = [catalog.get(name) for step in steps[:1] for name in step.uses]
    return next((asset.name for asset in used if asset.family in (*OPEN_FLASKS, *SELF_CONTAINED)), "")


def _overfills(situation: Situation, reaction: str) -> bool:
    """Return whether a step puts more into the reaction vessel than it holds."""
    vessel = situation.vessel
    if vessel is None or vessel.name != reaction or situation.source not in ("", WEIGHED_INTO, reaction):
        return False
    return situation.volume > VESSEL_FILL * (capacity(vessel) or 0.0)


def _with_step(protocol: Protocol, position: int, step: Step) -> Protocol:
    steps = (*protocol.steps[:position], step, *protocol.steps[position + 1 :])
    return protocol.model_copy(update={"steps": steps})


def _renamed(protocol: Protocol, old: str, new: str) -> Protocol:
    """Return a protocol whose steps use one asset in place of another, except for flasks of evaporations."""
    steps = [
        step.model_copy(update={"uses": tuple(new if name == old else name for name in step.uses)})
        if step.action != "Concentrate"
        else step
        for step in protocol.steps
    ]
    return protocol.model_copy(update={"steps": tuple(steps)})


def smallest(assets: Iterable[Asset], fits: Callable[[Asset], bool]) -> Asset | None:
    """Return the first of some assets that fits, or None."""
    return next((asset for asset in assets if fits(asset)), None)


@dataclass
class _StepFitter:
    """Chooses the sizes of one step.

    Attributes:
        reaction: name of the vessel in which the reaction begins, which was chosen for all that goes into it.
        draft: the step with the text and the duration of the draft.
        revised: whether the step was fitted before: its vessel may only grow, so that the revisions come to an end.
    """

    protocol: Protocol
    catalog: Catalog
    situation: Situation
    reaction: str
    draft: Step
    revised: bool

    def fitted(self) -> Step:
        step = self.situation.step
        names: list[str] = []
        for name in step.uses:
            asset = self.catalog.get(name)
            names += [name] if asset.kind != "instrument" else self._sizes(asset)
        uses = tuple(dict.fromkeys(self._conditioned([self.catalog.get(name) for name in names])))
        minutes, text = self._worded([self.catalog.get(name) for name in uses])
        update = {"uses": uses, "text": text, "duration": minutes, "location": self._place(uses)}
        return step.model_copy(update=update)

    def _sizes(self, asset: Asset) -> list[str]:
        """Return what takes the place of an instrument by the volumes and masses of the step."""
        sizes, volume = self.catalog.sizes(asset.name), self._volume
        if asset.family == EVAPORATOR:
            return [_or_largest(sizes, lambda size: volume <= RECEIVERS_FILLED * (capacity(size) or 0.0)).name]
        if weighs(asset) is not None and self.situation.step.action == "Weigh":
            return list(dict.fromkeys(self._balances(asset)))
        if asset.family == "GraduatedCylinder":
            return list(dict.fromkeys(self._measures(sizes)))
        if asset.family == "DroppingFunnel":
            return [_or_largest(sizes, lambda size: sum(self._poured()) <= (capacity(size) or 0.0)).name]
        if asset.family == COLUMN:
            return [_or_largest(sizes, lambda size: self._crude <= load_of(size)).name]
        if asset.family == "BuchnerFunnel" and volume > 0.0:
            return [_or_largest(sizes, lambda size: volume <= CAKES * bowl_of(size)).name]
        return [self._vessel(asset).name] if is_vessel(asset) else [asset.name]

    def _vessel(self, asset: Asset) -> Asset:
        """Return the vessel for the batch: the one that it is in, or the smallest that takes it."""
        source = self.situation.source
        if asset.family in CLOSED or (asset.name == self.reaction and source in ("", WEIGHED_INTO, self.reaction)):
            return asset
        if source and self._stays(self.catalog.get(source), asset):
            return self.catalog.get(source)
        return asset if self._volume <= 0.0 else self._smallest(asset, self.revised)

    def _smallest(self, asset: Asset, grows: bool) -> Asset:
        """Return the smallest size of a vessel or of the next larger kind that takes the batch.

        Args:
            grows: whether sizes below that of the vessel are left out.
        """
        evaporates = self.draft.action == "Concentrate"
        most = self._evaporator_ml() if evaporates else REACTION_VESSELS.get(asset.family, math.inf)
        least = capacity(asset) or 0.0 if grows else 0.0
        sizes = [size for size in self.catalog.sizes(asset.name) if least <= (capacity(size) or 0.0) <= most]
        fitting = smallest(sizes, self._takes)
        larger = LARGER.get(asset.family, "")
        if fitting is None and larger in self.catalog and not evaporates:
            return self._smallest(self.catalog.get(larger), False)
        if fitting is not None and (capacity(fitting) or 0.0) >= OVERHEAD_FROM_ML:
            # A hood has no room for several large flasks with their mantles: one is washed and used again.
            earlier = {name for step in self.protocol.steps[: self.situation.step.index - 1] for name in step.uses}
            fitting = smallest(sizes, lambda size: size.name in earlier and self._takes(size)) or fitting
        return fitting or (sizes[-1] if sizes else asset)

    @property
    def _volume(self) -> float:
        """Volume of the batch, mL; what is distilled is at least the crude product at 1 g/mL."""
        return max(self.situation.volume, self._crude) if self.draft.action == "Distill" else self.situation.volume

    @property
    def _crude(self) -> float:
        """Estimated mass of the crude product, g: that of the heaviest reactant with stated moles."""
        amounts = [read_amount(use.amount) for use in self.protocol.reagents]
        return max((amount.mass or 0.0 for amount in amounts if amount.moles is not None), default=0.0)

    def _poured(self) -> tuple[float, ...]:
        """Return the mL of each liquid that the step adds, at 1 g/mL if its density is not known."""
        amounts = {use.name: read_amount(use.amount).mass for use in self.protocol.reagents}
        added = self.situation.added
        parts = [
            self.situation.contents.get(asset.name) or (amounts.get(asset.name) if asset.phase == "liquid" else None)
            for asset in added
        ]
        return tuple(part for part in parts if part)

    def _stays(self, source: Asset, drafted: Asset) -> bool:
        """Return whether the batch stays in the vessel in which it is, in place of a drafted vessel."""
        action = self.situation.step.action
        rests = source.family in RESTING and drafted.family in OPEN_FLASKS and action not in (*CARRYING, *SOLID)
        rests = rests and not (action == "DryVacuum" and source.family not in OPEN_FLASKS)
        heated = action in HEATED_FILL and action != "Concentrate"
        too_large = heated and (capacity(source) or 0.0) > REACTION_VESSELS.get(source.family, math.inf)
        return (rests or source.family == drafted.family) and self._takes(source) and not too_large

    def _takes(self, vessel: Asset) -> bool:
        fill = HEATED_FILL.get(self.situation.step.action, VESSEL_FILL)
        if vessel.family in (SEPARATING, FILTRATE):
            fill = PORTION_FILLING
        return self._volume <= fill * (capacity(vessel) or 0.0)

    def _evaporator_ml(self) -> float:
        evaporators = [asset for asset in self.situation.devices if asset.family == EVAPORATOR]
        chosen = [self.catalog.get(name) for asset in evaporators for name in self._sizes(asset)]
        return max((capacity(asset) or 0.0 for asset in chosen), default=math.inf)

    def _balances(self, usual: Asset) -> Iterator[str]:
        """Yield a balance for each mass: the usual one if it weighs it to within 10 %."""
        balances = [asset for asset in self.catalog.of_kind("instrument") if weighs(asset) is not None]
        balances.sort(key=lambda asset: (asset is not usual, weighs(asset)))
        amounts = {use.name: read_amount(use.amount).mass for use in self.protocol.reagents}
        masses = [mass for asset in self.situation.added if (mass := amounts.get(asset.name)) is not None]
        for mass in masses:
            fitting = smallest(balances, lambda asset, mass=mass: _weighs_well(asset, mass))  # type: ignore[misc]
            yield (fitting or usual).name
        if not masses:
            yield usual.name

    def _measures(self, cylinders: tuple[Asset, ...]) -> Iterator[str]:
        """Yield a pipette or cylinder for each liquid that the step adds."""
        pipettes = self.catalog.sizes("Micropipette") if "Micropipette" in self.catalog else ()
        measured = self._poured() or (self.situation.volume,)
        if not any(measured):
            yield cylinders[0].family
            return
        for part in measured:
            yield _or_largest((*pipettes, *cylinders), lambda size, part=part: part <= (capacity(size) or 0.0)).name  # type: ignore[misc]

    def _conditioned(self, devices: list[Asset]) -> Iterator[str]:
        """Yield the devices, with baths, mantles and stirrers that fit the vessel."""
        vessel = self._main(devices)
        if vessel is None or self.situation.step.action in STILL:
            yield from (asset.name for asset in devices)
            return
        own = vessel.family in SELF_CONTAINED
        at = self.situation.step.temperature
        tempered = any(asset.subtype in ("bath", "mantle") for asset in devices) or (
            at is not None and not ROOM_RANGE[0] <= at <= ROOM_RANGE[1]
        )
        for asset in devices:
            if own and asset.subtype in THERMAL and asset.category != "consumable":
                continue
            yield from self._around(asset, vessel)
        if vessel.family == "JacketedReactor" and tempered and CIRCULATOR in self.catalog:
            yield CIRCULATOR

    def _around(self, asset: Asset, vessel: Asset) -> Iterator[str]:
        """Yield what takes the place of a bath, mantle or stirrer around a vessel."""
        holds, sizes = capacity(vessel) or 0.0, self.catalog.sizes(asset.name)
        is_flask = vessel.family in OPEN_FLASKS
        if asset.subtype == "mantle":
            yield _or_largest(sizes, lambda size: holds <= (capacity(size) or 0.0)).name
        elif asset.family == "LowTemperatureBath" and holds > WELL_ML:
            dewars = self.catalog.sizes("CoolingBathDewar")
            yield from (_or_largest(dewars, lambda size: _surrounds(size, vessel)).name, "OverheadStirrer")
        elif asset.family in ("IceBath", "CoolingBathDewar"):
            yield _or_largest(sizes, lambda size: _surrounds(size, vessel)).name
        elif asset.family == "OilBath" and (not _surrounds(asset, vessel) or (is_flask and holds >= OVERHEAD_FROM_ML)):
            if is_flask:
                mantles = self.catalog.sizes("HeatingMantle")
                yield _or_largest(mantles, lambda size: holds <= (capacity(size) or 0.0)).name
        elif asset.family in ("MagneticStirrer", "MagneticHotplateStirrer") and is_flask and holds >= OVERHEAD_FROM_ML:
            yield "OverheadStirrer"
        else:
            yield asset.name

    def _main(self, devices: list[Asset]) -> Asset | None:
        """Return the vessel of the step that holds the batch: the largest."""
        vessels = [asset for asset in devices if asset.kind == "instrument" and is_vessel(asset)]
        return max(vessels, key=lambda asset: capacity(asset) or 0.0, default=None)

    def _worded(self, devices: list[Asset]) -> tuple[float | None, str]:
        """Return the duration and the text of the step, with its portions and transfers."""
        step, text = self.draft, self._transferring(devices)
        count, clause = self._portions(devices)
        if count <= 1 or portions(step) > 1:
            return step.duration, text
        is_usual = step.action in APPARATUS and step.duration == APPARATUS[step.action].minutes
        return (count * step.duration if step.duration and is_usual else step.duration), text.rstrip(".") + clause

    def _portions(self, devices: list[Asset]) -> tuple[int, str]:
        """Return the number of portions in which the batch fits the devices of the step, and how its text says so."""
        volume, step = self.situation.volume, self.draft
        of_family = {asset.family: asset for asset in devices}
        evaporator, column = of_family.get(EVAPORATOR), of_family.get(COLUMN)
        vessel = self._main([asset for asset in devices if asset is not evaporator])
        if step.action not in ("Recrystallize", "Crystallize"):
            vessel = of_family.get(SEPARATING) or of_family.get(FILTRATE) or vessel
        count = 1
        if column is not None:
            count = math.ceil(self._crude / load_of(column))
        elif vessel is not None and evaporator is not None and step.action == "Concentrate":
            count = portions_for(volume, vessel)
            emptied = "; empty the receiver in between" if volume > (capacity(evaporator) or 0.0) else ""
            return count, f", {in_words(count, vessel)}{emptied}."
        elif vessel is not None and vessel.name != self.reaction and volume > (capacity(vessel) or 0.0):
            count = math.ceil(volume / (PORTION_FILLING * (capacity(vessel) or 0.0)))
        return count, f"; pass the batch in {count} portions."

    def _transferring(self, devices: list[Asset]) -> str:
        """Return the text of the step, with a transfer if the batch leaves an open vessel in which it would stay."""
        source, vessel, text = self.situation.source, self._main(devices), self.draft.text
        stays = self.draft.action not in (*CARRYING, *SOLID, *STILL) and "transfer" not in text.lower()
        if not stays or vessel is None or source in ("", vessel.name):
            return text
        if self.catalog.get(source).family not in RESTING:
            return text
        return f"{text.rstrip('.')}; first transfer the batch to a {vessel.subtype} of {capacity(vessel):g} mL."

    def _place(self, uses: Iterable[str]) -> str:
        """Return the place of the step: a higher hood if its own is too low."""
        location = self.catalog.get(self.situation.step.location)
        devices = [self.catalog.get(name) for name in uses]
        tallest = max(
            (a.size.height for a in devices if a.kind == "instrument" and a.placing == "desktop"), default=0.0
        )
        if not location.fume_hood or tallest <= _headroom(location):
            return location.name
        hoods = sorted((hood for hood in self.catalog.roles if hood.fume_hood), key=lambda hood: hood.size.width)
        fitting = smallest(hoods, lambda hood: tallest <= _headroom(hood))
        return (fitting or location).name


def bowl_of(funnel: Asset) -> float:
    """Return the volume of a Buchner funnel's bowl, mL: a cylinder that is a third as deep as wide."""
    return math.pi / 12.0 * (funnel.specs.diameter_mm or 0.0) ** 3 / 1000.0


def load_of(column: Asset) -> float:
    """Return the mass of crude product that a column separates at once, g."""
    return LOAD_G_PER_MM2 * (column.specs.diameter_mm or 0.0) ** 2


def _or_largest(sizes: tuple[Asset, ...], fits: Callable[[Asset], bool]) -> Asset:
    return smallest(sizes, fits) or sizes[-1]


def _surrounds(bath: Asset, vessel: Asset) -> bool:
    return vessel.size.depth + BATH_GAP_M <= bath.size.short


def _headroom(hood: Asset) -> float:
    return hood.surfaces[0].headroom or math.inf


def _weighs_well(balance: Asset, mass: float) -> bool:
    least, most = weighs(balance) or (math.inf, 0.0)
    return READABLE * least <= mass <= most
