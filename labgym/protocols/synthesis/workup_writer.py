"""The shared state of work-up steps: the protocol, the mixture, and amounts that fit the glassware."""

from __future__ import annotations

import re
from collections.abc import Sequence

from labgym.protocols.amounts import read_amount, scaled
from labgym.protocols.synthesis.builder import ProtocolBuilder, short_name
from labgym.protocols.synthesis.phases import ReactionMixture, WorkUpStep
from labgym.protocols.synthesis.roles import ASSUMED
from labgym.protocols.synthesis.transformations import Transformation
from labgym.protocols.synthesis.workup_plan import usual_steps
from labgym.quantities import ROOM_TEMPERATURE

FUNNEL_CAPACITY_ML, LEAST_WASH_ML = 225.0, 15.0
"""Capacity of the separating funnel, and least volume of an assumed wash or quench, mL."""
COOL_BELOW_C = 40.0
"""Temperature above which a mixture is left to cool before it is worked up, degrees Celsius."""
MIN_SCALE, MAX_SCALE = 0.5, 2.5
"""Work-up volumes follow the batch between these factors."""
_WHOLE = re.compile(r"^(\d+\.\d+) g\b")


class WorkUpWriter:
    """Writes steps of a work-up into a protocol.

    Args:
        builder: the protocol under construction.
        kind: the kind of reaction.
        mixture: the reaction mixture.
        factor: size of the batch relative to that of the table.

    Attributes:
        assumed: actions that the text does not name, in words.
    """

    def __init__(self, builder: ProtocolBuilder, kind: Transformation, mixture: ReactionMixture, factor: float) -> None:
        self.builder, self.kind, self.mixture = builder, kind, mixture
        self.volume, self.vessel = mixture.volume, mixture.vessel
        self.catalog = builder.catalog
        self.factor = min(max(factor, MIN_SCALE), MAX_SCALE)
        self.hot = mixture.hottest > COOL_BELOW_C
        self.assumed: list[str] = []

    def do(
        self,
        step: WorkUpStep,
        text: str,
        names: Sequence[str] = (),
        temperature: float | None = ROOM_TEMPERATURE,
        **slots: Sequence[str],
    ) -> None:
        """Append a step with the action and duration of a step of the work-up; see `ProtocolBuilder.do`."""
        self.builder.do(step.action, text, names, temperature, step.duration, "", **slots)

    def list_reagents(self, step: WorkUpStep, role: str, amount: str, fallback: str = "") -> tuple[str, ...]:
        """List a step's reagents, or the fallback if it has none, and return their names."""
        reagents = step.reagents or (((self.catalog.get(fallback), ""),) if fallback else ())
        return tuple(
            self.builder.take(asset, role, stated or self._fitting(scaled(amount, self.factor)) + ASSUMED)
            for asset, stated in reagents
        )

    def _fitting(self, amount: str) -> str:
        """Return an assumed volume, less where the separating funnel would overflow."""
        room = max(LEAST_WASH_ML, (FUNNEL_CAPACITY_ML - self.volume) / 2.0)
        stated = read_amount(amount).volume
        if stated is None:
            return _WHOLE.sub(lambda match: f"{round(float(match[1]))} g", amount)
        if stated <= room:
            return amount
        return scaled(amount, 5.0 * (room // 5.0) / stated)

    def names(self, names: Sequence[str]) -> str:
        """Return the names of reagents as a step names them."""
        return " and ".join(short_name(name, self.catalog) for name in names) or "water"

    def dissolved(self, names: Sequence[str]) -> str:
        """Return the names of the liquids that are poured in; solids are dissolved in water."""
        words = [
            short_name(name, self.catalog) + (" solution" if self.catalog.get(name).phase == "solid" else "")
            for name in names
        ]
        return " and ".join(words) or "water"

    def usual_reagent(self, stage: str, action: str, fallback: str) -> str:
        """Return the reagent that the kind of reaction usually takes for an action, or a fallback."""
        steps = usual_steps(self.kind, self.catalog)[stage]
        return next((step.reagents[0][0].name for step in steps if step.action == action), fallback)
