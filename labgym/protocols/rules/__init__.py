"""The rules of the validation suite, by theme; a rule is a function of a case: a protocol and the catalog."""

from labgym.protocols.rules import (
    conditions,
    grounding,
    hazards,
    machines,
    means,
    safety,
    sequence,
    temperatures,
    vessels,
)
from labgym.protocols.rules.finding import Finding, ProtocolCase

ALL = (*grounding.RULES, *sequence.RULES, *safety.RULES, *grounding.CONSTRAINT_RULES)
"""The paper's suite."""
EQUIPMENT = (
    *vessels.RULES,
    *temperatures.RULES,
    *hazards.RULES,
    *machines.RULES,
    *conditions.RULES,
    *means.RULES,
    *conditions.MIXING_RULES,
)
"""Rules about equipment, hazards and conditions."""

__all__ = ["ALL", "EQUIPMENT", "Finding", "ProtocolCase"]
