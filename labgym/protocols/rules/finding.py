"""What a validation rule looks at and what it reports."""

from __future__ import annotations

from dataclasses import dataclass

from labgym.assets import Asset, Catalog
from labgym.protocols.model import Protocol


@dataclass(frozen=True)
class Finding:
    """A breach of a rule.

    Attributes:
        rule: name of the rule, kebab-case.
        step: index of the step at fault, or None where the whole protocol is.
        message: what is wrong, naming the object and the value.
        suggestion: how to mend it.
    """

    rule: str
    step: int | None
    message: str
    suggestion: str


@dataclass(frozen=True)
class Case:
    """A protocol and the catalogue that its names are grounded in."""

    protocol: Protocol
    catalog: Catalog

    def asset(self, name: str) -> Asset | None:
        """Return the asset of exactly that name, or None."""
        return self.catalog.get(name) if name in self.catalog else None
