"""Evaporation in portions: a batch that overfills the flask of the rotary evaporator is evaporated bit by bit."""

from __future__ import annotations

import math
import re

from labgym.assets import Asset, Catalog
from labgym.protocols.apparatus import APPARATUS
from labgym.protocols.capability import capacity
from labgym.protocols.contents import situations
from labgym.protocols.errors import RefusalError
from labgym.protocols.model import Protocol, Step

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


def evaporated_in_portions(protocol: Protocol, catalog: Catalog) -> Protocol:
    """Return a protocol whose evaporations fill their flask to at most one half, in portions where one does not do.

    The usual duration counts for each portion; a duration that the text states is kept.

    Raises:
        RefusalError: the rotary evaporator does not take a batch.
    """
    steps = list(protocol.steps)
    for position, situation in enumerate(situations(protocol, catalog)):
        step, flask = situation.step, situation.vessel
        if step.action != "Concentrate" or flask is None or EVAPORATOR not in step.uses:
            continue
        evaporator = catalog.get(EVAPORATOR)
        count = portions_for(situation.volume, flask, evaporator)
        if count is None:
            most = capacity(evaporator) or 0.0
            message = f"step {step.index} evaporates about {situation.volume:.0f} mL, but {EVAPORATOR} takes at most"
            share = f"make {100.0 * most / situation.volume:.0f} % of the batch or less"
            raise RefusalError("infeasible", f"{message} {most:g} mL: {share}")
        if count > 1:
            usual = APPARATUS["Concentrate"].minutes
            minutes = count * usual if step.duration == usual else step.duration
            text = f"{step.text.rstrip('.')}, {in_words(count, flask)}."
            steps[position] = step.model_copy(update={"text": text, "duration": minutes})
    return protocol.model_copy(update={"steps": tuple(steps)})
