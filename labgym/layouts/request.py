"""A request: the protocols, the floor and the existing pieces that a layout is generated from."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Literal

from pydantic import ValidationError

from labgym.assets import Asset, Catalog
from labgym.errors import OptionError
from labgym.layouts.floor import Floor
from labgym.layouts.habits import Habits
from labgym.layouts.placement import Placement, resized
from labgym.layouts.roles import stand_ins
from labgym.layouts.rules.rule_sets import RuleSet
from labgym.layouts.rules.thresholds import Profile
from labgym.layouts.style import FurnitureRange, Style, draw_variants
from labgym.protocols import Protocol

Purchases = Literal["none", "required", "any"]
"""What may be bought: nothing, what protocols and safety require, or also what makes the laboratory fuller."""


@dataclass(frozen=True)
class Holdings:
    """The pieces that exist, and what may be bought.

    Attributes:
        counts: number of pieces by asset name.
        purchases: what may be bought beyond them.
    """

    counts: Mapping[str, int] = field(default_factory=dict)
    purchases: Purchases = "required"

    def including(self, standing: Iterable[str]) -> Holdings:
        """Return the same holdings with pieces that certainly exist, listed or not: the asset of each."""
        counts = dict(self.counts)
        for name, count in Counter(standing).items():
            counts[name] = max(counts.get(name, 0), count)
        return Holdings(counts, self.purchases)

    def missing(self, placed: Iterable[str]) -> dict[str, int]:
        """Return how many pieces of each asset must be bought for some pieces, by asset name.

        Args:
            placed: the asset of each piece.
        """
        counts = Counter(placed)
        lacks = {name: count - self.counts.get(name, 0) for name, count in sorted(counts.items())}
        return {name: lack for name, lack in lacks.items() if lack > 0}

    def left(self, placed: Iterable[str]) -> dict[str, int]:
        """Return how many pieces of each asset exist beyond some pieces, by asset name."""
        counts = Counter(placed)
        rest = {name: count - counts[name] for name, count in sorted(self.counts.items())}
        return {name: count for name, count in rest.items() if count > 0}

    def adds(self, name: str, placed: Iterable[str]) -> bool:
        """Return whether one more piece of an asset, which nothing requires, may be placed besides some pieces."""
        return self.purchases == "any" or sum(each == name for each in placed) < self.counts.get(name, 0)

    def equips(self, name: str, placed: Iterable[str]) -> bool:
        """Return whether one more piece of equipment, which safety requires, may be placed besides some pieces."""
        return self.purchases != "none" or self.adds(name, placed)


MOST = 5
"""Most protocols of one laboratory."""


def check_named_once(ids: Sequence[str]) -> None:
    """Check that no id of a protocol occurs twice.

    Raises:
        OptionError: names the id.
    """
    for name in ids:
        if ids.count(name) > 1:
            raise OptionError(f"protocol {name!r} is named twice; name each once")


def combination(protocols: Sequence[Protocol], catalog: Catalog) -> Protocol:
    """Return a protocol whose laboratory serves several protocols.

    Reagents and equipment are shared: each occurs as often as the protocol needs it that needs it most often. Steps
    follow one another, and the constraints of all hold.

    Raises:
        OptionError: no protocol, too many, one named twice, or more steps or reagents than a protocol can have.
    """
    if not 1 <= len(protocols) <= MOST:
        raise OptionError(f"{len(protocols)} protocols: a laboratory is for 1 to {MOST}")
    ids = [protocol.id for protocol in protocols]
    check_named_once(ids)
    if len(protocols) == 1:
        return protocols[0]
    substances = {substance.name: substance for protocol in protocols for substance in protocol.substances}
    reagents = {catalog.find(use.name).name: use for protocol in reversed(protocols) for use in protocol.reagents}
    instruments: Counter[str] = Counter()
    for protocol in protocols:
        instruments |= Counter(catalog.find(name).name for name in protocol.instruments)
    steps = [step for protocol in protocols for step in protocol.steps]
    try:
        return Protocol(
            id="-".join(ids)[:64].rstrip("-_"),
            name="; ".join(protocol.name for protocol in protocols),
            reaction_type=protocols[0].reaction_type,
            reagents=tuple(reagents[name] for name in sorted(reagents)),
            instruments=tuple(sorted(instruments.elements())),
            steps=tuple(step.model_copy(update={"index": number}) for number, step in enumerate(steps, 1)),
            chemical_constraints=tuple(dict.fromkeys(c for p in protocols for c in p.chemical_constraints)),
            spatial_constraints=tuple(dict.fromkeys(c for p in protocols for c in p.spatial_constraints)),
            substances=tuple(substances.values()),
        )
    except ValidationError as error:
        problem = error.errors()[0]
        raise OptionError(
            f"protocols {', '.join(ids)} need too much for one laboratory: {problem['loc'][0]}: {problem['msg']}; name "
            "fewer protocols"
        ) from None


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
    def furniture(self) -> FurnitureRange:
        """The catalog, with the variants that the floor's style and the seed choose.

        Where an inventory counts, existing pieces take the roles of required ones instead that do not exist.
        """
        if self.holdings is not None:
            habits = self.habits
            required = [piece.asset for piece in habits.furniture if piece.level == "required"]
            required += [*self.protocol.required_assets(), *(habits.always.keys() - set(self.protocol.locations))]
            return FurnitureRange(self.catalog, stand_ins(self.catalog, required, self.holdings.counts))
        return FurnitureRange(self.catalog, draw_variants(self.catalog, self.style.variety, self.seed))

    def fixed_asset(self, placement: Placement) -> Asset:
        """Return the catalog entry of a fixed object, with the object's size if it has one.

        Raises:
            UnknownNameError: the catalog has no such asset.
        """
        asset = self.catalog.get(placement.asset)
        return asset if placement.size is None else resized(asset, placement.size)
