"""The protocol under construction: its steps, and the reagents and instruments that they use."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from labgym.assets import Asset, Catalog
from labgym.protocols.apparatus import APPARATUS
from labgym.protocols.model import ReagentUse, Step


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
