"""The validation suite: what a protocol must satisfy before a laboratory is built for it (paper, appendix B)."""

from __future__ import annotations

from collections.abc import Sequence

from labgym.assets import Catalog
from labgym.errors import LabgymError
from labgym.protocols.model import Protocol
from labgym.protocols.rules import ALL, EQUIPMENT, Case, Finding


class ProtocolError(LabgymError, ValueError):
    """A protocol that breaks rules of the validation suite.

    Attributes:
        protocol: its id.
        findings: every breach.
    """

    def __init__(self, protocol: str, findings: Sequence[Finding]) -> None:
        self.protocol = protocol
        self.findings = tuple(findings)
        first = self.findings[0]
        more = f" (and {len(self.findings) - 1} more findings)" if len(self.findings) > 1 else ""
        super().__init__(f"protocol {protocol!r}: {first.message}; {first.suggestion} [{first.rule}]{more}")


def validate(protocol: Protocol, catalog: Catalog | None = None) -> tuple[Finding, ...]:
    """Return every breach of the suite's rules, in the order of the rules; empty where the protocol is sound.

    Args:
        protocol: any protocol that satisfies the schema.
        catalog: the assets to ground names in; the published catalogue by default.
    """
    case = Case(protocol, catalog if catalog is not None else Catalog.load())
    return tuple(finding for rule in ALL for finding in rule(case))


def examine(protocol: Protocol, catalog: Catalog | None = None) -> tuple[Finding, ...]:
    """Return what `validate` finds and then what speaks against doing the steps with the equipment that they name.

    Beyond the paper: volumes, temperatures, pressures and speeds against the specifications of the catalogue, and
    hazards of what a vessel holds at each step. Faults cannot or must not be done so; advice can be done better.
    """
    case = Case(protocol, catalog if catalog is not None else Catalog.load())
    return tuple(finding for rule in (*ALL, *EQUIPMENT) for finding in rule(case))


def check(protocol: Protocol, catalog: Catalog | None = None) -> Protocol:
    """Return the protocol where it is sound.

    Raises:
        ProtocolError: it is not; carries all findings and names the first.
    """
    findings = validate(protocol, catalog)
    if findings:
        raise ProtocolError(protocol.id, findings)
    return protocol
