"""The protocol as it grows: steps with what they use, reagents and instruments as steps first name them."""

from __future__ import annotations

from dataclasses import dataclass, field

from labgym.assets import Asset, Catalog
from labgym.protocols.model import ReagentUse, Step

HOOD = "FumeHood"


@dataclass
class Bench:
    """Steps in order with the reagents and instruments that they need.

    Attributes:
        steps: so far, counted from 1.
        notes: what was assumed or changed, one sentence each.
    """

    steps: list[Step] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    _uses: dict[str, list[tuple[str, str]]] = field(default_factory=dict)
    _instruments: dict[str, None] = field(default_factory=dict)

    def take(self, asset: Asset, role: str, amount: str) -> str:
        """List a reagent in a role and return its name; the same reagent in two roles is one entry."""
        entry = self._uses.setdefault(asset.name, [])
        if role not in [known for known, _ in entry]:
            entry.append((role, amount))
        return asset.name

    def takes(self, name: str) -> bool:
        """Say whether a reagent is listed."""
        return name in self._uses

    def do(
        self,
        action: str,
        text: str,
        uses: tuple[str, ...] = (),
        place: str = HOOD,
        temperature: float | None = None,
        duration: float = 10.0,
    ) -> None:
        """Append a step; instruments that it uses are listed as it names them."""
        used = tuple(dict.fromkeys(uses))
        for name in used:
            if Catalog.load().get(name).kind == "instrument":
                self._instruments.setdefault(name)
        self.steps.append(
            Step(
                index=len(self.steps) + 1,
                location=place,
                action=action,
                text=text,
                uses=used,
                temperature=temperature,
                duration=duration,
            )
        )

    @property
    def reagents(self) -> tuple[ReagentUse, ...]:
        """The reagents with all their roles and amounts."""
        return tuple(
            ReagentUse(name=name, role=" and ".join(role for role, _ in entry), amount="; ".join(a for _, a in entry))
            for name, entry in self._uses.items()
        )

    @property
    def instruments(self) -> tuple[str, ...]:
        """The instruments, each once."""
        return tuple(self._instruments)
