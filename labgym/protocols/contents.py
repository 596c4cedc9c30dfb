"""Contents of the vessels during a protocol: a lower estimate, step by step.

Reagents go into the vessel of the step that uses them, divided equally if several steps use one. The batch moves with
the work-up: into the separating funnel, the beaker of the quench, the filter flask, the rotary evaporator. Unstated
amounts count as zero, so a vessel that is too small by this estimate is too small in any case.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

from labgym.assets import Asset, Catalog
from labgym.protocols.amounts import read_amount, volume_of, water_in
from labgym.protocols.capability import capacity
from labgym.protocols.model import Protocol, Step

VESSELS = ("flask", "beaker", "reactor", "vessel", "tube", "vial", "dish", "crucible")
SEPARATING, FILTRATE = "SeparatoryFunnel", "FilterFlask"
WATER = "DeionizedWater"
STILL = ("Weigh", "Measure", "Prepare", "Monitor", "Analyze", "Clean")
"""Actions that do not move the batch."""
CARRYING = (
    *("Extract", "Wash", "PhaseSeparation", "DrySolution", "Quench", "Acidify", "Basify", "Neutralize", "Filter"),
    *("Concentrate", "Crystallize", "Transfer", "Dilute", "Distill", "Partition", "Pour"),
)
"""Actions that move the batch into another vessel."""
SOLID = ("DrySolid", "Recrystallize", "Chromatograph")
"""Actions that start with the bare product, without the liquids of earlier steps."""
_WATERY = frozenset({"aqueous", "strong_acid", "oxidizing_acid"})
_QUENCHED = frozenset({"metal_hydride", "organometallic", "alkali_metal", "acyl_halide", "anhydride", "chlorosilane"})
MADE_ASIDE = "in a separate vessel"
"""Words of a step that makes a solution which does not meet the batch yet."""
ASIDE_ADDED = "transfer the solution that was made aside"
"""Words of the step that adds it."""
_ASIDE = "aside"
"""Key of the contents of solutions that were made aside; the first transfer adds all of them."""
_AQUEOUS_KEPT = re.compile(r"\bkeeps? the aqueous (?:layer|phase)\b", re.IGNORECASE)
STRIPPING_MARGIN_K = 100.0
"""Evaporation removes liquids that boil up to this far above the bath temperature, degrees Celsius."""


@dataclass(frozen=True)
class Situation:
    """A step with the place, vessel, contents and devices that it handles.

    Attributes:
        step: the step.
        place: its location; None if the catalog lacks it.
        vessel: the vessel that holds the batch; None if it cannot be determined.
        contents: mL of each reagent in the vessel at the fullest; 0 for solids and gases.
        added: the reagents that the step itself uses.
        devices: the instruments that it uses.
        source: name of the vessel in which the batch is before the step, or "".
    """

    step: Step
    place: Asset | None
    vessel: Asset | None
    contents: Mapping[str, float]
    added: tuple[Asset, ...] = ()
    devices: tuple[Asset, ...] = ()
    source: str = ""

    @property
    def volume(self) -> float:
        """Lower estimate of the volume in the vessel at the fullest, mL."""
        return sum(self.contents.values())

    def bulk(self, share: float = 0.1) -> tuple[str, ...]:
        """Return the liquids that make up at least a given share of the volume."""
        return tuple(name for name, part in self.contents.items() if part > 0.0 and part >= share * self.volume)


def is_vessel(asset: Asset) -> bool:
    """Return whether an asset can hold a batch: flasks, beakers, reactors, tubes and dishes of known capacity."""
    return capacity(asset) is not None and (asset.subtype in VESSELS or asset.family == SEPARATING)


def situations(protocol: Protocol, catalog: Catalog) -> tuple[Situation, ...]:
    """Return the situation of each step; names that the catalog lacks are ignored."""
    return tuple(_BatchTracker(protocol, catalog).steps())


@dataclass
class _BatchTracker:
    """Follows the batch through the steps.

    Attributes:
        volumes: mL of each reagent by vessel; solutions that are made aside have a separate key.
        batch: the vessel that holds the batch, or "".
    """

    protocol: Protocol
    catalog: Catalog
    volumes: dict[str, dict[str, float]] = field(default_factory=dict)
    batch: str = ""

    def steps(self) -> Iterator[Situation]:
        for step in self.protocol.steps:
            used = [self.catalog.get(name) for name in step.uses if name in self.catalog]
            devices = tuple(asset for asset in used if asset.kind == "instrument")
            added = tuple(asset for asset in used if asset.kind == "reagent")
            if self._is_aside(step):
                yield self._make_aside(step, devices, added)
                continue
            target = self._target(step, devices)
            contents = self._during(step, target, added)
            place = self.catalog.get(step.location) if step.location in self.catalog else None
            vessel = self.catalog.get(target) if target else None
            yield Situation(step, place, vessel, dict(contents), added, devices, self.batch)
            self._after(step, target, contents, added, devices)

    def _is_aside(self, step: Step) -> bool:
        later = (other for other in self.protocol.steps if other.index > step.index)
        return step.text.rstrip(".").endswith(MADE_ASIDE) and any(ASIDE_ADDED in other.text for other in later)

    def _make_aside(self, step: Step, devices: tuple[Asset, ...], added: tuple[Asset, ...]) -> Situation:
        vessel = max(filter(is_vessel, devices), key=lambda asset: capacity(asset) or 0.0, default=None)
        target = "" if vessel is None else vessel.name
        contents = {reagent.name: self._share(step, target, reagent) for reagent in added}
        waiting = self.volumes.setdefault(_ASIDE, {})
        for name, part in contents.items():
            waiting[name] = waiting.get(name, 0.0) + part
        place = self.catalog.get(step.location) if step.location in self.catalog else None
        return Situation(step, place, vessel, dict(contents), added, devices)

    def _target(self, step: Step, devices: tuple[Asset, ...]) -> str:
        """Return the vessel of the batch during a step: the previous one if it is used, else the largest."""
        names = [asset.name for asset in devices if is_vessel(asset)]
        separating = [name for name in names if self._family(name) == SEPARATING]
        if separating:
            return separating[0]
        filtrate = [name for name in names if self._family(name) == FILTRATE]
        if filtrate and (step.action == "Filter" or names == filtrate):
            return filtrate[0]
        names = [name for name in names if name not in filtrate]
        if not names or self.batch in names:
            return "" if step.action == "Chromatograph" else self.batch
        return max(names, key=lambda name: capacity(self.catalog.get(name)) or 0.0)

    def _family(self, name: str) -> str:
        """Return the kind of vessel of an asset name, whatever its size."""
        return self.catalog.get(name).family if name else ""

    def _during(self, step: Step, target: str, added: tuple[Asset, ...]) -> dict[str, float]:
        contents = {} if step.action in SOLID else dict(self.volumes.get(target, {}))
        if _moves(step) and target != self.batch:
            for name, part in self.volumes.get(self.batch, {}).items():
                contents[name] = contents.get(name, 0.0) + part
        if ASIDE_ADDED in step.text:
            for name, part in self.volumes.pop(_ASIDE, {}).items():
                contents[name] = contents.get(name, 0.0) + part
        shares = {reagent.name: self._share(step, target, reagent) for reagent in added}
        if self._family(target) == SEPARATING:
            # Washes are consecutive, so only the largest of them is in the funnel at a time.
            washes = [reagent.name for reagent in added if _is_aqueous(reagent)]
            largest = max(washes, key=lambda name: shares[name], default="")
            shares |= {name: 0.0 for name in washes if name != largest}
        for name, share in shares.items():
            contents[name] = contents.get(name, 0.0) + share
        more = water_in(step.text) - shares.get(WATER, 0.0)
        if step.action not in STILL and more > 0.0:
            contents[WATER] = contents.get(WATER, 0.0) + more
        return contents

    def _share(self, step: Step, target: str, reagent: Asset) -> float:
        """Return the mL that a step adds at once; a reagent that is weighed out for a later step adds nothing."""
        steps = [other for other in self.protocol.steps if reagent.name in other.uses and other.action not in STILL]
        if step.action in STILL and steps:
            return 0.0
        stated = [use.amount for use in self.protocol.reagents if use.name == reagent.name]
        parts = [part for text in stated for part in text.split("; ")]
        if len(parts) == len(steps) > 1:  # what a builder lists for several steps, in their order
            stated, steps = [parts[next(k for k, other in enumerate(steps) if other is step)]], [step]
        total = 0.0
        for text in stated:
            amount = read_amount(text)
            times = 1 if self._family(target) == SEPARATING else amount.portions
            total += volume_of(reagent, amount) * times
        return total / max(1, len(steps))

    def _after(
        self,
        step: Step,
        target: str,
        contents: dict[str, float],
        added: tuple[Asset, ...],
        devices: tuple[Asset, ...],
    ) -> None:
        if step.action in STILL and not (step.action == "Weigh" and added and target):
            return
        remaining = self._remaining(step, target, contents, added)
        names = [asset.name for asset in devices if is_vessel(asset) and asset.name != target]
        if self._family(target) == SEPARATING and names:
            target = names[-1]
        if _moves(step):
            self.volumes.pop(self.batch, None)
        self.batch = target
        if target:
            self.volumes[target] = remaining

    def _remaining(
        self, step: Step, target: str, contents: dict[str, float], added: tuple[Asset, ...]
    ) -> dict[str, float]:
        """Return the contents of the vessel after the step."""
        if step.action in (*SOLID, "Distill"):
            return {}
        if step.action == "Concentrate":
            limit = (step.temperature if step.temperature is not None else 40.0) + STRIPPING_MARGIN_K
            return {name: part for name, part in contents.items() if not self._boils_by(name, limit)}
        if self._family(target) == SEPARATING and _AQUEOUS_KEPT.search(step.text):
            extracted = {asset.name for asset in added if not _is_aqueous(asset)}
            return {name: part for name, part in contents.items() if name not in extracted}
        if self._family(target) == SEPARATING and step.action in ("Extract", "Partition"):
            organic = [asset for asset in added if not _is_aqueous(asset) and contents[asset.name] > 0.0]
            return {asset.name: self._whole(asset) for asset in organic}
        if self._family(target) == SEPARATING and step.action in CARRYING:
            return {name: part for name, part in contents.items() if not _is_aqueous(self.catalog.get(name))}
        onto_water = any(asset.name == WATER or not _WATERY.isdisjoint(asset.groups) for asset in added)
        if step.action == "Quench" or (step.action == "Pour" and onto_water):
            return {name: part for name, part in contents.items() if not _is_quenched(self.catalog.get(name))}
        return contents

    def _whole(self, reagent: Asset) -> float:
        amounts = [read_amount(use.amount) for use in self.protocol.reagents if use.name == reagent.name]
        return sum(volume_of(reagent, amount) * amount.portions for amount in amounts)

    def _boils_by(self, name: str, limit: float) -> bool:
        boiling = self.catalog.get(name).boiling_point
        return boiling is None or boiling <= limit


def _moves(step: Step) -> bool:
    return step.action in CARRYING or "pour" in step.text.lower() or "transfer" in step.text.lower()


def _is_aqueous(reagent: Asset) -> bool:
    """Return whether a reagent goes into the aqueous layer: solutions of salts, mineral acids and bases."""
    return reagent.phase == "solid" or not _WATERY.isdisjoint(reagent.groups)


def _is_quenched(reagent: Asset) -> bool:
    chemistry = reagent.chemistry
    return chemistry is not None and (chemistry.water_reactive or not _QUENCHED.isdisjoint(chemistry.groups))
