"""Protective gas and pressure of a reaction."""

from __future__ import annotations

from collections.abc import Sequence

from labgym.protocols.errors import RefusalError
from labgym.protocols.refusals import refusals
from labgym.protocols.synthesis.frame import (
    is_pyrophoric,
)
from labgym.protocols.synthesis.reading import Clause, ParsedDescription
from labgym.protocols.synthesis.roles import Participant
from labgym.quantities import StatedCondition

AIRLESS = frozenset({"Magnesium", "PalladiumOnCarbon", "RaneyNickel", "TetrakisTriphenylphosphinePalladium"})
"""Metals and catalysts that work, or are safe next to a solvent, only without air."""
BALLOON, PRESSURE_VESSEL = "HydrogenBalloon", "HydrogenationApparatus"
BALLOON_BAR, VESSEL_BAR = 1.2, 5.0
"""Highest absolute pressures of a balloon and of the hydrogenation apparatus (4 bar above the air's), bar."""


def pressure(clauses: Sequence[Clause]) -> StatedCondition | None:
    """Return the pressure above that of the air that the text gives, or None.

    Raises:
        RefusalError: no vessel of the catalog is built for it.
    """
    stated = next((c.pressure for c in clauses if c.pressure is not None and c.pressure.value > BALLOON_BAR), None)
    if stated is not None and stated.value > VESSEL_BAR:
        message = (
            f"{stated.text} is above the {VESSEL_BAR:g} bar that {PRESSURE_VESSEL} is built for: lower the pressure"
        )
        raise RefusalError("infeasible", message)
    return stated


def protective_gas(description: ParsedDescription, parts: Sequence[Participant]) -> str:
    """Return the protective gas that is needed, or ""."""
    if "ArgonGas" in description.spoken_of or "argon" in description.text.lower():
        return "ArgonGas"
    asked = "NitrogenGas" in description.spoken_of or "inert" in description.text.lower() or "氮气" in description.text
    spoilt = refusals().destroyed_by_protic | AIRLESS
    needed = any(is_pyrophoric(part.asset) or part.asset.name in spoilt for part in parts)
    return "NitrogenGas" if asked or needed else ""
