"""The validation suite's rules, by theme; each is a function of a case: a protocol and the catalogue."""

from labgym.protocols.rules import constraints, grounding, safety, sequence
from labgym.protocols.rules.finding import Case, Finding

ALL = (*grounding.RULES, *sequence.RULES, *safety.RULES, *constraints.RULES)

__all__ = ["ALL", "Case", "Finding"]
