"""Shortfall: what a laboratory lacks for an experiment, as sets of assets of which any one would do."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property

from labgym.assets import Asset, Catalog
from labgym.protocols.apparatus import APPARATUS
from labgym.protocols.capability import capacity, cools_to, heats_to, weighs, withstands
from labgym.protocols.contents import is_vessel
from labgym.protocols.experiments.feasibility import GASES, Code, FeasibilityFilter, Obstacle
from labgym.protocols.experiments.model import Experiment

Alternatives = tuple[str, ...]
"""Names of assets of which any one meets a need, sorted; a substance that the catalog lacks stands for itself."""


@dataclass(frozen=True)
class Shortfall:
    """The obstacles between an experiment and a laboratory.

    Attributes:
        lacking: needs that the laboratory does not meet.
        flaws: kinds of obstacles that no purchase removes; among them limits that no asset of the catalog exceeds.
    """

    lacking: tuple[Alternatives, ...]
    flaws: tuple[Code, ...]


class NeedsFinder:
    """Finds what a laboratory lacks for experiments.

    Args:
        catalog: everything that could be bought.
        names: assets that the laboratory has.
    """

    def __init__(self, catalog: Catalog, names: Iterable[str]) -> None:
        self.catalog = catalog
        self.names = frozenset(names)
        self._everything = FeasibilityFilter(catalog)
        self._reagents = [asset for asset in catalog.assets if asset.kind == "reagent"]
        self._owned = [asset for asset in catalog.assets if asset.kind != "reagent" and asset.name in self.names]
        self._laboratory = FeasibilityFilter(Catalog([*self._reagents, *self._owned]))
        self._remedies: dict[tuple[object, ...], Alternatives] = {}

    def find(self, experiment: Experiment) -> Shortfall:
        """Return what the laboratory lacks for an experiment; materials are recognized by structure or name."""
        names = self._everything.grounded_names(experiment)
        listed = {name: asset for name, asset in names.items() if asset is not None}
        lacking: set[Alternatives] = {(asset or name,) for name, asset in names.items() if asset not in self.names}
        flaws = {obstacle.code for obstacle in self._everything.flaws(experiment, listed)}
        for action in experiment.actions:
            lacking |= set(self._devices_and_gases(action.verb, GASES.get(action.atmosphere or "air")))
        for obstacle in self._laboratory.equipment(experiment, listed):
            if obstacle.code not in ("equipment", "atmosphere"):
                alternatives = self._alternatives(experiment, obstacle, listed)
                lacking |= {alternatives} if alternatives else set()
                flaws |= set() if alternatives else {obstacle.code}
        return Shortfall(tuple(sorted(lacking)), tuple(sorted(flaws)))

    def _devices_and_gases(self, verb: str, gas: str | None) -> Iterator[Alternatives]:
        choices = [*(APPARATUS[verb].needs if verb in APPARATUS else ()), *([frozenset((gas,))] if gas else [])]
        yield from (tuple(sorted(choice)) for choice in choices if not choice & self.names)

    def _alternatives(self, experiment: Experiment, obstacle: Obstacle, listed: dict[str, str]) -> Alternatives:
        """Return the instruments each of which removes an obstacle of temperature, pressure, mass or volume."""
        part = experiment
        if obstacle.action is not None and obstacle.code != "volume":
            part = experiment.model_copy(update={"actions": (experiment.actions[obstacle.action - 1],)})
        action = part.actions[0]
        figures = (action.verb == "DrySolid", action.temperature, action.pressure)
        amount = obstacle.message.partition(" of ")[0] if obstacle.code == "mass" else obstacle.message
        key = (obstacle.code, amount, figures if obstacle.code in ("temperature", "pressure") else None)
        if key not in self._remedies:
            self._remedies[key] = tuple(
                name
                for name, candidate in self._candidates[obstacle.code]
                if all(other.code != obstacle.code for other in candidate.equipment(part, listed))
            )
        return self._remedies[key]

    @cached_property
    def _candidates(self) -> dict[Code, list[tuple[str, FeasibilityFilter]]]:
        """For each kind of obstacle, the instruments that may remove it, with the filter of the laboratory and them."""
        able: dict[Code, list[tuple[str, FeasibilityFilter]]] = {
            "temperature": [],
            "pressure": [],
            "mass": [],
            "volume": [],
        }
        for asset in self.catalog.of_kind("instrument"):
            codes = list(_abilities(asset)) if asset.name not in self.names else []
            if codes:
                extended = FeasibilityFilter(Catalog([*self._reagents, *self._owned, asset]))
                for code in codes:
                    able[code].append((asset.name, extended))
        return able


def _abilities(asset: Asset) -> Iterator[Code]:
    """Yield the kinds of obstacles that an instrument may remove."""
    if heats_to(asset) is not None or cools_to(asset) is not None:
        yield "temperature"
    if withstands(asset) is not None:
        yield "pressure"
    if weighs(asset) is not None:
        yield "mass"
    if is_vessel(asset) and capacity(asset) is not None:
        yield "volume"
