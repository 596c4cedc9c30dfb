"""The arguments that a layout is generated from."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

from labgym.assets import Asset, Catalog
from labgym.layouts.floor import Floor
from labgym.layouts.habits import Habits
from labgym.layouts.holdings import Holdings
from labgym.layouts.placement import Placement, resized
from labgym.layouts.roles import stand_ins
from labgym.layouts.rules.rule_sets import RuleSet
from labgym.layouts.rules.thresholds import Profile
from labgym.layouts.style import Style
from labgym.layouts.variants import Furniture, draw_variants
from labgym.protocols import Protocol


@dataclass(frozen=True)
class Request:
    """Everything that decides a generated layout.

    Attributes:
        rules: rule set that the layout satisfies, with its thresholds.
        protocol: what the laboratory is for; of several protocols, their combination.
        seed: 0 to 2^53 - 1.
        catalog: source of every asset. habits: where furniture usually stands.
        fixed: floor and wall objects that must stay where they are.
        several: the protocols that `protocol` combines, empty if it is one.
        style: how densely and how regularly the floor is furnished.
        family: name of the family that the floor is of; empty for other floors.
        holdings: what exists; None if nothing is known about it.
        clutter: level of loose objects, 0 to 3.
    """

    protocol: Protocol
    floor: Floor
    rules: RuleSet
    seed: int
    catalog: Catalog
    habits: Habits
    fixed: tuple[Placement, ...] = ()
    several: tuple[Protocol, ...] = ()
    style: Style = field(default_factory=Style)
    family: str = ""
    holdings: Holdings | None = None
    clutter: int = 0

    @property
    def profile(self) -> Profile:
        """The thresholds that the layout satisfies."""
        return self.rules.profile

    @property
    def protocols(self) -> tuple[Protocol, ...]:
        """The protocols that the laboratory is for."""
        return self.several or (self.protocol,)

    @cached_property
    def furniture(self) -> Furniture:
        """The catalog, with the variants that the floor's style and the seed choose.

        Where an inventory counts, existing pieces take the roles of required ones instead that do not exist.
        """
        if self.holdings is not None:
            habits = self.habits
            required = [piece.asset for piece in habits.furniture if piece.level == "required"]
            required += [*self.protocol.required_assets(), *(habits.always.keys() - set(self.protocol.locations))]
            return Furniture(self.catalog, stand_ins(self.catalog, required, self.holdings.counts))
        return Furniture(self.catalog, draw_variants(self.catalog, self.style.variety, self.seed))

    def fixed_asset(self, placement: Placement) -> Asset:
        """Return the catalog entry of a fixed object, with the object's size if it has one.

        Raises:
            UnknownNameError: the catalog has no such asset.
        """
        asset = self.catalog.get(placement.asset)
        return asset if placement.size is None else resized(asset, placement.size)
