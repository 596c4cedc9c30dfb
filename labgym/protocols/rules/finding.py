"""What a validation rule looks at and what it reports."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

from labgym.assets import Asset, Catalog
from labgym.protocols.contents import Situation, situations
from labgym.protocols.model import Protocol

Severity = Literal["fault", "advice"]


@dataclass(frozen=True)
class Finding:
    """A breach of a rule.

    Attributes:
        rule: name of the rule, kebab-case.
        step: index of the step at fault, or None where the whole protocol is.
        message: what is wrong, naming the object and the value.
        suggestion: how to mend it.
        severity: fault where the step cannot be done so or must not; advice where it can be done better.
    """

    rule: str
    step: int | None
    message: str
    suggestion: str
    severity: Severity = "fault"


@dataclass(frozen=True)
class Case:
    """A protocol and the catalogue that its names are grounded in."""

    protocol: Protocol
    catalog: Catalog

    def asset(self, name: str) -> Asset | None:
        """Return the asset of exactly that name, or None."""
        return self.catalog.get(name) if name in self.catalog else None

    @cached_property
    def situations(self) -> tuple[Situation, ...]:
        """What each step handles, in the order of the steps."""
        return situations(self.protocol, self.catalog)
