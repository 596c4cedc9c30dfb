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
PORTION_FILLING = 0.8
"""Largest filling of a funnel or filter flask by one portion."""
FILLING = 0.5
"""Largest filling of a flask on the rotary evaporator."""
_PORTIONS = re.compile(r"\bin (\d{1,2}) portions\b", re.IGNORECASE)
_BATCH_PORTIONS = re.compile(r"\bthe batch in (\d{1,2}) portions\b", re.IGNORECASE)
PORTIONED = ("Extract", "Filter", "Partition", "PhaseSeparation", "Wash")
"""Actions through whose funnel a large batch passes in portions."""
RECEIVERS = {"ErlenmeyerFlask": "LargeBeaker", "Beaker": "LargeBeaker", "LargeBeaker": "JacketedReactor"}
"""The next larger vessel for a batch that rests outside its flask."""


def portions(step: Step) -> int:
    """Return in how many portions a step evaporates, separates or filters its batch, 1 if its text says nothing."""
    pattern = _PORTIONS if step.action == "Concentrate" else _BATCH_PORTIONS if step.action in PORTIONED else None
    stated = pattern.search(step.text) if pattern is not None else None
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


def in_portions(protocol: Protocol, catalog: Catalog) -> Protocol:
    """Return a protocol whose large batches are evaporated, separated and filtered in portions.

    Between these steps they rest in vessels that hold them.

    Raises:
        RefusalError: the rotary evaporator does not take a batch.
    """
    for position in range(len(protocol.steps)):
        # What a step's vessel holds depends on the steps before it, which are settled.
        situation = situations(protocol, catalog)[position]
        step, vessel = situation.step, situation.vessel
        holds = None if vessel is None else capacity(vessel)
        if vessel is None or holds is None or situation.volume <= holds:
            continue
        if step.action in PORTIONED and vessel.name not in RECEIVERS:
            count = math.ceil(situation.volume / (PORTION_FILLING * holds))
            text = f"{step.text.rstrip('.')}; pass the batch in {count} portions."
            uses = tuple(RECEIVERS.get(name, name) for name in step.uses)
            step = step.model_copy(update={"text": text, "uses": tuple(dict.fromkeys(uses))})
        elif vessel.name in RECEIVERS and vessel.name in step.uses:
            larger = RECEIVERS[vessel.name]
            if situation.volume > (capacity(catalog.get(larger)) or 0.0):
                larger = RECEIVERS.get(larger, larger)
            uses = tuple(larger if name == vessel.name else name for name in step.uses)
            step = step.model_copy(update={"uses": tuple(dict.fromkeys(uses))})
        else:
            continue
        steps = list(protocol.steps)
        steps[position] = step
        named = dict.fromkeys((*protocol.instruments, *step.uses))
        used = {name for other in steps for name in other.uses}
        instruments = tuple(name for name in named if name in used and catalog.get(name).kind == "instrument")
        protocol = protocol.model_copy(update={"steps": tuple(steps), "instruments": instruments})
    return evaporated_in_portions(protocol, catalog)
