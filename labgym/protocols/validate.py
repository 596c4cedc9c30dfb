"""The validation suite: the rules that a protocol must satisfy before a layout is generated (paper, appendix B)."""

from __future__ import annotations

from collections.abc import Sequence

from labgym.assets import Catalog
from labgym.errors import LabgymError
from labgym.protocols.errors import RefusalError
from labgym.protocols.model import Protocol
from labgym.protocols.rules import ALL, EQUIPMENT, Finding, ProtocolCase
from labgym.protocols.rules.hazards import DANGEROUS_PRODUCT


class ProtocolError(LabgymError, ValueError):
    """A protocol breaks rules of the validation suite.

    Attributes:
        protocol: id of the protocol.
        findings: all violations.
    """

    def __init__(self, protocol: str, findings: Sequence[Finding]) -> None:
        self.protocol = protocol
        self.findings = tuple(findings)
        first = self.findings[0]
        more = f" (and {len(self.findings) - 1} more findings)" if len(self.findings) > 1 else ""
        super().__init__(f"protocol {protocol!r}: {first.message}; {first.suggestion} [{first.rule}]{more}")


def validate(protocol: Protocol, catalog: Catalog | None = None) -> tuple[Finding, ...]:
    """Return every violation of the suite's rules, in the order of the rules; empty if the protocol is sound.

    Args:
        protocol: any protocol that satisfies the schema.
        catalog: the assets that the protocol names; the default catalog if None.
    """
    case = ProtocolCase(protocol, protocol.assets(catalog))
    return tuple(finding for rule in ALL for finding in rule(case))


def examine(protocol: Protocol, catalog: Catalog | None = None) -> tuple[Finding, ...]:
    """Return the findings of `validate`, followed by those about equipment and hazards.

    The additional rules go beyond the paper: they compare volumes, temperatures, pressures and speeds with the
    specifications of the catalog, and consider the hazards of what each vessel holds. A step with a fault cannot or
    must not be carried out as written; advice names a better way.

    Args:
        protocol: any protocol that satisfies the schema.
        catalog: the assets that the protocol names; the default catalog if None.
    """
    case = ProtocolCase(protocol, protocol.assets(catalog))
    return tuple(finding for rule in (*ALL, *EQUIPMENT) for finding in rule(case))


def faults(findings: Sequence[Finding]) -> list[Finding]:
    """Return the findings with which a protocol must not be written.

    Raises:
        RefusalError: the product is dangerous, so that no other protocol of it is written either.
    """
    for finding in findings:
        if finding.rule == DANGEROUS_PRODUCT:
            raise RefusalError("unsafe", finding.message)
    return [finding for finding in findings if finding.severity == "fault"]


def check(protocol: Protocol, catalog: Catalog | None = None) -> Protocol:
    """Return the protocol unchanged if it satisfies the validation suite.

    Raises:
        ProtocolError: it violates rules; the error carries all findings and names the first.
    """
    findings = validate(protocol, catalog)
    if findings:
        raise ProtocolError(protocol.id, findings)
    return protocol
