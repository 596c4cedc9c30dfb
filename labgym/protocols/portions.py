"""Evaporation in portions: a batch that overfills the flask of the rotary evaporator is evaporated bit by bit."""

from __future__ import annotations

import math
import re

from labgym.assets import Asset
from labgym.protocols.capability import capacity
from labgym.protocols.model import Step

EVAPORATOR = "RotaryEvaporator"
FILLING = 0.5
"""Largest filling of a flask on the rotary evaporator."""
_PORTIONS = re.compile(r"\bin (\d{1,2}) portions\b", re.IGNORECASE)


def portions(step: Step) -> int:
    """Return the number of portions in which a step evaporates its batch, 1 if its text says nothing."""
    stated = _PORTIONS.search(step.text) if step.action == "Concentrate" else None
    return max(1, int(stated[1])) if stated is not None else 1


def portions_for(volume: float, flask: Asset, evaporator: Asset) -> int | None:
    """Return the least number of portions in which a volume fits a flask on the evaporator.

    Args:
        volume: mL.

    Returns:
        None if the evaporator's receiver, which is as large as its own flask, does not take the volume.
    """
    holds, receives = capacity(flask), capacity(evaporator)
    if holds is None or receives is None or volume > receives:
        return None
    return max(1, math.ceil(volume / (FILLING * holds)))


def in_words(count: int, flask: Asset) -> str:
    """Return how a step names its portions: "in 3 portions of at most 125 mL"."""
    return f"in {count} portions of at most {FILLING * (capacity(flask) or 0.0):g} mL"
