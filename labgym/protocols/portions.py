"""Portions: a batch that overfills the largest flask, funnel or evaporator passes through it bit by bit."""

from __future__ import annotations

import math
import re

from labgym.assets import Asset
from labgym.protocols.capability import capacity
from labgym.protocols.model import Step

EVAPORATOR = "RotaryEvaporator"
PORTION_FILLING = 0.8
"""Largest filling of a funnel or filter flask by one portion."""
FILLING = 0.5
"""Largest filling of a flask on the rotary evaporator."""
_PORTIONS = re.compile(r"\bin (\d{1,2}) portions\b", re.IGNORECASE)
_BATCH_PORTIONS = re.compile(r"\bthe batch in (\d{1,2}) portions\b", re.IGNORECASE)


def portions(step: Step) -> int:
    """Return in how many portions a step evaporates or passes on its batch, 1 if its text says nothing."""
    stated = (_PORTIONS if step.action == "Concentrate" else _BATCH_PORTIONS).search(step.text)
    return max(1, int(stated[1])) if stated is not None else 1


def portions_for(volume: float, flask: Asset) -> int:
    """Return the least number of portions in which a volume in mL fits a flask on the evaporator."""
    holds = capacity(flask)
    return max(1, math.ceil(volume / (FILLING * holds))) if holds else 1


def in_words(count: int, flask: Asset) -> str:
    """Return how a step names its portions: "in 3 portions of at most 125 mL"."""
    return f"in {count} portions of at most {FILLING * (capacity(flask) or 0.0):g} mL"
