"""Operations without their means: read by hand in the library as published, and made by taking the means away."""

from __future__ import annotations

import pytest

from labgym.assets import Catalog
from labgym.layouts.places import published_protocols
from labgym.protocols import Protocol, ReagentUse, Step, examine, protocols

CATALOG = Catalog.load()
KINDS = (
    "weighing-means",
    "measuring-means",
    "stirring-means",
    "heating-means",
    "cooling-reach",
    "device-means",
    "agent-means",
)


def faults(protocol: Protocol) -> set[tuple[str, int | None]]:
    findings = [finding for finding in examine(protocol) if finding.severity == "fault"]
    return {(finding.rule, finding.step) for finding in findings if finding.rule in KINDS}


def one(
    action: str, text: str, uses: str, temperature: float | None = None, place: str = "FumeHood", **amounts: str
) -> Protocol:
    """Return a protocol of a charge at room temperature and one further step, which is step 2."""
    names = uses.split()
    reagents = {name: "5 mL" for name in ["Toluene", *names] if CATALOG.get(name).kind == "reagent"} | amounts
    charge = Step(index=1, location="FumeHood", action="Add", text="Charge.", uses=("GraduatedCylinder", "Toluene"))
    tools = [name for name in dict.fromkeys(["GraduatedCylinder", *names]) if CATALOG.get(name).kind == "instrument"]
    return Protocol(
        id="one",
        name="One",
        reaction_type="substitution",
        product="something",
        reagents=tuple(ReagentUse(name=name, role="r", amount=amount) for name, amount in reagents.items()),
        instruments=tuple(tools),
        steps=(
            charge,
            Step(index=2, location=place, action=action, text=text, uses=tuple(names), temperature=temperature),
        ),
    )


# What a chemist found in the library as it was published, by reading.
@pytest.mark.parametrize(
    ("name", "kind", "step"),
    [
        ("red_03", "stirring-means", 3),
        ("cyc_02", "measuring-means", 2),
        ("cyc_02", "cooling-reach", 5),
        ("fgt_02", "agent-means", 7),
        ("alk_03", "cooling-reach", 2),
        ("sub_03", "cooling-reach", 2),
        ("cyc_01", "cooling-reach", 4),
        ("red_02", "weighing-means", 5),
        ("cyc_04", "stirring-means", 4),
        ("fgt_01", "device-means", 7),
    ],
)
def test_errors_of_the_published_library_are_found(name: str, kind: str, step: int) -> None:
    assert (kind, step) in faults(published_protocols()[name])


@pytest.mark.parametrize("name", protocols())
def test_the_library_has_no_such_error_and_every_route_is_as_published(name: str) -> None:
    assert faults(protocols()[name]) == set()
    assert protocols()[name].route == published_protocols()[name].route


REMOVALS = {
    "weighing-means": {"ElectronicScale", "AnalyticalBalance"},
    "measuring-means": {"GraduatedCylinder", "Pipette", "Syringe", "Burette"},
    "stirring-means": {"MagneticStirrer", "MagneticHotplateStirrer", "OverheadStirrer", "GlassRod"},
    "cooling-reach": {"IceBath", "CoolingBathDewar", "LowTemperatureBath"},
    "device-means": {"SeparatoryFunnel", "RotaryEvaporator", "BuchnerFunnel", "FrittedFunnel", "DistillationHead"},
}


@pytest.mark.cases(50)
@pytest.mark.parametrize("kind", REMOVALS)
@pytest.mark.parametrize("name", protocols())
def test_what_is_taken_away_is_missed(name: str, kind: str) -> None:
    protocol = protocols()[name]
    gone = REMOVALS[kind] & set(protocol.instruments)
    if kind == "stirring-means":
        needed = [step for step in protocol.steps if step.action == "Stir" and gone & set(step.uses)]
    elif kind == "measuring-means":
        needed = [step for step in protocol.steps if gone & set(step.uses)]
    else:
        needed = [step for step in protocol.steps if gone & set(step.uses) and step.action != "Recrystallize"]
    if not needed:
        pytest.skip("the protocol has no such means")
    steps = tuple(
        step.model_copy(update={"uses": tuple(use for use in step.uses if use not in gone)}) for step in protocol.steps
    )
    kept = tuple(instrument for instrument in protocol.instruments if instrument not in gone)
    assert kind in {rule for rule, _ in faults(protocol.model_copy(update={"steps": steps, "instruments": kept}))}


FAULTY = {
    "weighs by eye": one("Weigh", "Weigh the acid.", "Beaker BenzoicAcid", BenzoicAcid="2 g"),
    "stirs with nothing": one("Stir", "Stir for an hour.", "RoundBottomFlask", 22),
    "stirs in words": one("Add", "Add acetone to the stirred mixture.", "RoundBottomFlask Acetone", 22),
    "drops into a still flask": one("Add", "Add acetone dropwise.", "RoundBottomFlask DroppingFunnel Acetone", 22),
    "refluxes a slurry": one(
        "Reflux", "Reflux.", "RoundBottomFlask RefluxCondenser HeatingMantle PotassiumCarbonate", 110,
        PotassiumCarbonate="5 g",
    ),
    "cools without a bath": one("Cool", "Cool to 4 C.", "RoundBottomFlask MagneticStirrer", 4),
    "pours onto ice from nowhere": one("Quench", "Pour onto crushed ice.", "Beaker"),
    "keeps a flask at 60 C": one("Add", "Add acetone at 60 C.", "RoundBottomFlask Acetone", 60),
    "extracts in a beaker": one("Extract", "Extract with ethyl acetate.", "Beaker EthylAcetate", 22),
    "filters through nothing": one("Filter", "Collect the solid.", "FilterFlask", 22),
    "evaporates in a flask": one("Concentrate", "Evaporate.", "RoundBottomFlask", 40),
    "reflux without a condenser": one("Reflux", "Reflux, stirred.", "RoundBottomFlask MagneticHotplateStirrer", 110),
    "destroys with nothing": one("Add", "Destroy the excess peroxide.", "RoundBottomFlask", 22),
    "destroys an oxidant with base": one(
        "Quench", "Destroy the bromine with hydroxide.", "RoundBottomFlask SodiumHydroxide MagneticStirrer", 22
    ),
    "quenches with nothing": one("Quench", "Quench the mixture.", "RoundBottomFlask MagneticStirrer", 22),
}  # fmt: skip
SOUND = {
    "weighs": one("Weigh", "Weigh the acid.", "ElectronicScale BenzoicAcid", BenzoicAcid="2 g"),
    "weighs in the glove box": one("Weigh", "Weigh it.", "SodiumHydride", place="GloveBox", SodiumHydride="2 g"),
    "stirs": one("Stir", "Stir for an hour.", "RoundBottomFlask MagneticStirrer", 22),
    "shakes by hand": one("Stir", "Stopper and shake.", "SeparatoryFunnel", 22),
    "swirls": one("Add", "Add acetone dropwise with swirling.", "ErlenmeyerFlask Pipette Acetone", 22),
    "boils one liquid": one("Reflux", "Reflux.", "RoundBottomFlask RefluxCondenser HeatingMantle", 110),
    "boils on stones": one(
        "Reflux", "Reflux with boiling stones.", "RoundBottomFlask RefluxCondenser HeatingMantle BenzoicAcid", 110
    ),
    "cools": one("Cool", "Cool to 4 C.", "RoundBottomFlask IceBath MagneticStirrer", 4),
    "pours onto ice": one("Quench", "Pour onto crushed ice.", "Beaker IceBath", 3),
    "warms by itself": one("Add", "Add acetone; the mixture warms.", "RoundBottomFlask Acetone", 40),
    "keeps a flask at 60 C": one("Add", "Add acetone at 60 C.", "RoundBottomFlask WaterBath Acetone", 60),
    "room temperature": one("Add", "Cool to room temperature and add acetone.", "RoundBottomFlask Acetone", 20),
    "destroys with a reductant": one(
        "Add", "Destroy the excess peroxide with sulfite.", "RoundBottomFlask SodiumSulfite", 22, SodiumSulfite="5 mL"
    ),
    "quenches with water": one("Quench", "Quench with water.", "RoundBottomFlask MagneticStirrer", 22),
}


@pytest.mark.parametrize("name", FAULTY)
def test_an_operation_without_its_means_is_a_fault(name: str) -> None:
    assert any(step == 2 for _, step in faults(FAULTY[name]))


@pytest.mark.parametrize("name", SOUND)
def test_an_operation_with_its_means_is_none(name: str) -> None:
    assert faults(SOUND[name]) == set()


def test_the_remedy_for_ice_is_the_ice_bath() -> None:
    (finding,) = [f for f in examine(FAULTY["cools without a bath"]) if f.rule == "cooling-reach"]
    assert "IceBath" in finding.suggestion
