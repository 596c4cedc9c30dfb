"""The input and the output of validation rules: cases and findings."""

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
    """A violation of a rule.

    Attributes:
        rule: name of the rule, kebab-case.
        step: index of the step, or None if the finding concerns the whole protocol.
        message: what is wrong, with the object and the value.
        suggestion: the remedy.
        severity: "fault" if the step cannot or must not be carried out as written; "advice" if there is a better way.
    """

    rule: str
    step: int | None
    message: str
    suggestion: str
    severity: Severity = "fault"


@dataclass(frozen=True)
class ProtocolCase:
    """A protocol and the catalog that holds its assets."""

    protocol: Protocol
    catalog: Catalog

    def asset(self, name: str) -> Asset | None:
        """Return the asset with that canonical name, or None."""
        return self.catalog.get(name) if name in self.catalog else None

    @cached_property
    def situations(self) -> tuple[Situation, ...]:
        """The situation of each step, in the order of the steps."""
        return situations(self.protocol, self.catalog)
