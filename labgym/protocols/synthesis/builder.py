"""The protocol under construction: its steps, its reagents and instruments, and its first and last steps."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field

from labgym.assets import Asset, Catalog
from labgym.protocols.apparatus import APPARATUS
from labgym.protocols.model import ReagentUse, Step

GLOVE_BOX = (
    *("AluminumChloride", "Lithium", "LithiumAluminumHydride", "Potassium", "PotassiumTertButoxide", "Sodium"),
    *("SodiumEthoxide", "SodiumHydride", "SodiumMethoxide", "TertButyldimethylsilylChloride"),
)
"""Solids that are weighed without moisture."""
_WORDS = re.compile(r"[A-Z]+(?=[A-Z][a-z])|[A-Z]?[a-z]+|[A-Z]+|\d+")


@dataclass
class ProtocolBuilder:
    """Steps in order, with the reagents and instruments that they need.

    Attributes:
        catalog: the assets that steps may use.
        steps: the steps so far, counted from 1.
        notes: what was assumed or changed, one sentence each.
    """

    catalog: Catalog
    steps: list[Step] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    _uses: dict[str, list[tuple[str, str]]] = field(default_factory=dict)
    _instruments: dict[str, None] = field(default_factory=dict)

    def take(self, asset: Asset, role: str, amount: str) -> str:
        """List a reagent in a role and return its name; the same reagent in two roles is one entry."""
        entry = self._uses.setdefault(asset.name, [])
        if role not in [listed for listed, _ in entry]:
            entry.append((role, amount))
        return asset.name

    def takes(self, name: str) -> bool:
        """Return whether a reagent is listed."""
        return name in self._uses

    def do(
        self,
        action: str,
        text: str,
        reagents: Sequence[str] = (),
        temperature: float | None = None,
        duration: float | None = None,
        setup: str = "",
        **slots: Sequence[str],
    ) -> None:
        """Append a step with the devices and the place that `APPARATUS` gives for its action.

        Args:
            action: name of the action.
            text: the instruction.
            reagents: names of the reagents that the step uses.
            temperature: degrees Celsius.
            duration: minutes; the usual duration of the action if None.
            setup: key of `APPARATUS`, if it differs from the action.
            slots: names of assets for the slots of the apparatus.
        """
        apparatus = APPARATUS[setup or action]
        self.append(
            Step(
                index=len(self.steps) + 1,
                location=apparatus.place,
                action=action,
                text=text,
                uses=tuple(dict.fromkeys((*apparatus.fill(**slots), *reagents))),
                temperature=temperature,
                duration=duration or apparatus.minutes,
            )
        )

    def append(self, step: Step) -> None:
        """Append a step under the next index and list the instruments that it uses."""
        for name in step.uses:
            if self.catalog.get(name).kind == "instrument":
                self._instruments.setdefault(name)
        self.steps.append(step.model_copy(update={"index": len(self.steps) + 1}))

    def prepend(self, count: int) -> None:
        """Move the last `count` steps to the front and renumber all steps."""
        steps = [*self.steps[-count:], *self.steps[:-count]] if count else self.steps
        self.steps, self._instruments = [], {}
        for step in steps:
            self.append(step)

    @property
    def reagents(self) -> tuple[ReagentUse, ...]:
        """The reagents with all their roles and amounts."""
        return tuple(
            ReagentUse(
                name=name,
                role=" and ".join(role for role, _ in entry),
                amount="; ".join(amount for _, amount in entry),
            )
            for name, entry in self._uses.items()
        )

    @property
    def instruments(self) -> tuple[str, ...]:
        """The instruments, each once."""
        return tuple(self._instruments)


def weigh_first(builder: ProtocolBuilder, vessel: str) -> None:
    """Insert the preparation before all other steps: solids are weighed, moisture-sensitive ones in the glove box."""
    catalog = builder.catalog
    solids = [use.name for use in builder.reagents if catalog.get(use.name).phase == "solid"]
    dry = tuple(name for name in solids if name in GLOVE_BOX or is_pyrophoric(catalog.get(name)))
    open_ = tuple(name for name in solids if name not in dry)
    count = len(builder.steps)
    liquids = "carry the closed bottles of the liquids to the hood."
    if open_:
        names = ", ".join(short_name(name, catalog) for name in open_)
        builder.do("Weigh", f"Weigh {names}; {liquids}", open_)
    else:
        builder.do("Measure", f"Lay out the dry {short_name(vessel, catalog)}; {liquids}", vessel=(vessel,))
    if dry:
        names = ", ".join(short_name(name, catalog) for name in dry)
        builder.do("Weigh", f"Weigh {names} in the glove box into a stoppered vial.", dry, setup="WeighDry")
    builder.prepend(len(builder.steps) - count)


def clean_up(builder: ProtocolBuilder) -> None:
    """Append the last step: waste by kind, and the glassware."""
    groups = [group for use in builder.reagents for group in builder.catalog.get(use.name).groups]
    halogens = any("halogen" in group for group in groups)
    waste = "halogenated and other solvent waste apart" if halogens else "solvent and aqueous waste apart"
    builder.do("Clean", f"Collect {waste} and wash the glassware.")


def short_name(name: str, catalog: Catalog) -> str:
    """Return the name that a step's text uses for an asset.

    A reagent has its first English synonym without a remark in parentheses; anything else its canonical name in words,
    as "three neck flask" or "NMR tube".
    """
    asset = catalog.get(name)
    if asset.kind == "reagent" and asset.synonyms_en:
        return asset.synonyms_en[0].split(" (")[0]
    return " ".join(word if word.isupper() else word.lower() for word in _WORDS.findall(name))


def is_pyrophoric(asset: Asset) -> bool:
    """Return whether a reagent ignites in air."""
    return asset.chemistry is not None and asset.chemistry.pyrophoric
