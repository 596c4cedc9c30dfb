"""Evaporations of a written protocol whose batch overfills the flask: they are carried out in portions."""

from __future__ import annotations

from labgym.assets import Catalog
from labgym.protocols.apparatus import APPARATUS
from labgym.protocols.capability import capacity
from labgym.protocols.contents import situations
from labgym.protocols.errors import RefusalError
from labgym.protocols.model import Protocol
from labgym.protocols.portions import EVAPORATOR, in_words, portions_for


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
