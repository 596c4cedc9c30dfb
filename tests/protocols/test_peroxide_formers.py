"""Ethers are not concentrated to dryness untested; rotary evaporation of a fresh solvent is ordinary."""

from __future__ import annotations

import pytest

from labgym.assets import Catalog
from labgym.protocols import Protocol, ReagentUse, Step, examine, library

CATALOG = Catalog.load()
STILL = "RoundBottomFlask DistillationHead WaterBath"
ROTARY = "RoundBottomFlask RotaryEvaporator"
TEST = "Test the ether for peroxides."


def concentrated(ether: str, action: str, devices: str, text: str, before: str = "Add the ether.") -> Protocol:
    """Return a protocol that adds an ether to a flask and concentrates it."""
    uses = tuple(devices.split())
    return Protocol(
        id="made",
        name="Made",
        reaction_type="substitution",
        product="something",
        reagents=(ReagentUse(name=ether, role="solvent", amount="50 mL"),),
        instruments=uses,
        steps=(
            Step(index=1, location="FumeHood", action="Add", text=before, uses=("RoundBottomFlask", ether)),
            Step(index=2, location="FumeHood", action=action, text=text, uses=uses, temperature=40.0, duration=20.0),
        ),
    )


def severities(protocol: Protocol) -> list[str]:
    """Return the severities of the findings about peroxides."""
    return [finding.severity for finding in examine(protocol, CATALOG) if finding.rule == "peroxides-tested"]


@pytest.mark.parametrize("ether", ["DiethylEther", "Tetrahydrofuran", "OneFourDioxane"])
@pytest.mark.parametrize(
    ("action", "devices", "text", "before", "expected"),
    [
        ("Distill", STILL, "Distil the ether.", "Add the ether.", ["fault"]),
        ("Distill", STILL, "Distil the ether to dryness.", "Add the ether.", ["fault"]),
        ("Distill", STILL, "Distil the ether, never to dryness.", TEST, []),
        ("Distill", STILL, "Distil the ether to dryness.", TEST, ["advice"]),
        ("Distill", STILL, "Distil half of the ether.", "Add the ether stabilized with BHT.", []),
        ("Concentrate", STILL, "Evaporate the ether to dryness on the bath.", "Add the ether.", ["fault"]),
        ("Concentrate", STILL, "Evaporate the ether to dryness on the bath.", TEST, ["advice"]),
        ("Concentrate", ROTARY, "Evaporate the ether.", "Add the ether.", []),
        ("Concentrate", ROTARY, "Evaporate the ether to dryness.", "Add the ether.", ["advice"]),
    ],
)
def test_an_ether_is_concentrated_with_care(
    ether: str, action: str, devices: str, text: str, before: str, expected: list[str]
) -> None:
    assert severities(concentrated(ether, action, devices, text, before)) == expected


@pytest.mark.parametrize("solvent", ["MethylTertButylEther", "EthylAcetate", "Toluene", "Anisole"])
def test_a_solvent_that_forms_hardly_any_peroxide_may_be_distilled_to_dryness(solvent: str) -> None:
    assert severities(concentrated(solvent, "Distill", STILL, "Distil it to dryness.")) == []


def test_the_library_has_no_finding_about_peroxides() -> None:
    assert {
        protocol.id: severities(protocol) for protocol in library.protocols().values() if severities(protocol)
    } == {}
