"""Pairs in one vessel: what literature calls explosive is a fault at its temperature, what chemists do is none.

The cases are incidents and limits of Bretherick's Handbook, Prudent Practices and Organic Process Research &
Development, not entries of the table.
"""

from __future__ import annotations

import pytest

from labgym.assets import Catalog
from labgym.assets.mixing import limit_of
from labgym.assets.substances import Substance
from labgym.protocols import Finding, Protocol, ReagentUse, Step, examine, protocols
from labgym.protocols.experiments import experiments
from labgym.protocols.synthesis.staging import stage

CATALOG = Catalog.load()


def heated(reagents: dict[str, str], *temperatures: float, place: str = "FumeHood") -> Protocol:
    """Return a protocol that charges a flask at the first temperature and goes through the others."""
    names = tuple(reagents)
    steps = [
        Step(index=1, action="Add", text="Charge the flask.", uses=("RoundBottomFlask", *names), location=place,
             temperature=temperatures[0]),
        *(
            Step(index=number, action="Stir", text="Go on.", uses=("RoundBottomFlask",), location=place,
                 temperature=celsius)
            for number, celsius in enumerate(temperatures[1:], 2)
        ),
    ]  # fmt: skip
    return Protocol(
        id="mixed", name="A mixture", reaction_type="substitution", product="a product", description="A mixture.",
        reagents=tuple(ReagentUse(name=name, amount=amount, role="reagent") for name, amount in reagents.items()),
        instruments=("RoundBottomFlask",), steps=tuple(steps),
    )  # fmt: skip


def faults(protocol: Protocol) -> list[Finding]:
    return [each for each in examine(protocol, CATALOG) if each.rule == "violent-mixture" and each.severity == "fault"]


DANGEROUS = {
    "sodium hydride in hot DMSO": ({"SodiumHydride": "1 g", "DimethylSulfoxide": "20 mL"}, (22.0, 120.0)),
    "sodium hydride in hot DMF": ({"SodiumHydride": "1 g", "NNDimethylformamide": "20 mL"}, (0.0, 80.0)),
    "borohydride in hot DMF": ({"SodiumBorohydride": "1 g", "NNDimethylformamide": "20 mL"}, (22.0, 100.0)),
    "thionyl chloride in hot DMF": ({"ThionylChloride": "5 mL", "NNDimethylformamide": "20 mL"}, (0.0, 80.0)),
    "POCl3 in hot DMF": ({"PhosphorusOxychloride": "5 mL", "NNDimethylformamide": "20 mL"}, (0.0, 90.0)),
    "oxalyl chloride added to DMSO warm": ({"OxalylChloride": "2 mL", "DimethylSulfoxide": "10 mL"}, (22.0,)),
    "acetyl chloride in DMSO": ({"AcetylChloride": "2 mL", "DimethylSulfoxide": "10 mL"}, (22.0,)),
    "tert-butoxide in chloroform": ({"PotassiumTertButoxide": "2 g", "Chloroform": "20 mL"}, (25.0,)),
    "sodium in dichloromethane": ({"Sodium": "1 g", "Dichloromethane": "20 mL"}, (0.0,)),
    "magnesium in chloroform": ({"Magnesium": "1 g", "Chloroform": "20 mL"}, (22.0,)),
    "azide in chloroform": ({"SodiumAzide": "1 g", "Chloroform": "20 mL"}, (22.0,)),
    "azide and acetic acid": ({"SodiumAzide": "1 g", "AceticAcid": "20 mL"}, (0.0,)),
    "LAH and water": ({"LithiumAluminumHydride": "1 g", "DeionizedWater": "20 mL"}, (0.0,)),
    "butyllithium and DCM": ({"NButyllithium": "5 mL", "Dichloromethane": "20 mL"}, (-20.0,)),
    "nitric acid and ethanol": ({"NitricAcid": "5 mL", "Ethanol": "20 mL"}, (0.0,)),
    "nitric acid and acetone": ({"NitricAcid": "5 mL", "Acetone": "20 mL"}, (0.0,)),
    "perchloric acid and DMSO": ({"PerchloricAcid": "5 mL", "DimethylSulfoxide": "20 mL"}, (22.0,)),
    "chromium trioxide in warm DMF": ({"ChromiumTrioxide": "2 g", "NNDimethylformamide": "20 mL"}, (22.0, 60.0)),
    "permanganate and sulfuric acid": ({"PotassiumPermanganate": "2 g", "SulfuricAcid": "5 mL"}, (22.0,)),
    "bleach and hydrochloric acid": ({"SodiumHypochlorite": "20 mL", "HydrochloricAcid": "5 mL"}, (22.0,)),
    "bleach and ammonia": ({"SodiumHypochlorite": "20 mL", "AmmoniumHydroxide": "5 mL"}, (22.0,)),
    "cyanide and acid": ({"SodiumCyanoborohydride": "1 g", "NitricAcid": "5 mL"}, (0.0,)),
    "hydride and peroxide": ({"SodiumHydride": "1 g", "HydrogenPeroxide": "5 mL"}, (0.0,)),
    "benzoyl peroxide and aniline": ({"BenzoylPeroxide": "1 g", "Aniline": "5 mL"}, (22.0,)),
    "peroxide in hot acetic acid": ({"HydrogenPeroxide": "5 mL", "AceticAcid": "20 mL"}, (22.0, 90.0)),
    "hot DMSO with sulfuric acid": ({"SulfuricAcid": "1 mL", "DimethylSulfoxide": "20 mL"}, (22.0, 120.0)),
    "warm peracid and pyridine": ({"MetaChloroperbenzoicAcid": "2 g", "Pyridine": "1 mL"}, (0.0, 60.0)),
    "chloroform, acetone and base": ({"Chloroform": "20 mL", "Acetone": "20 mL", "SodiumHydroxide": "2 g"}, (5.0,)),
}  # fmt: skip


@pytest.mark.parametrize("place", ["FumeHood", "GloveBox"])
@pytest.mark.parametrize("reagents, temperatures", DANGEROUS.values(), ids=DANGEROUS)
def test_an_explosive_pair_is_a_fault_in_a_hood_too(
    reagents: dict[str, str], temperatures: tuple[float, ...], place: str
) -> None:
    found = faults(heated(reagents, *temperatures, place=place))
    assert found, "no fault"
    assert any(all(name in finding.message for name in list(reagents)[:2]) for finding in found)
    assert found[0].step == len(temperatures)


ORDINARY = {
    "sodium hydride in cold DMF": ({"SodiumHydride": "1 g", "NNDimethylformamide": "20 mL"}, (0.0, 22.0)),
    "catalytic DMF in thionyl chloride": ({"ThionylChloride": "20 mL", "NNDimethylformamide": "0.1 mL"}, (0.0, 78.0)),
    "borohydride in methanol": ({"SodiumBorohydride": "1 g", "Methanol": "30 mL"}, (0.0, 22.0)),
    "thionyl chloride in methanol": ({"ThionylChloride": "5 mL", "Methanol": "50 mL"}, (0.0, 60.0)),
    "Swern": ({"OxalylChloride": "2 mL", "DimethylSulfoxide": "4 mL", "Dichloromethane": "40 mL"}, (-78.0, 20.0)),
    "Fischer": ({"SulfuricAcid": "2 mL", "Methanol": "30 mL", "BenzoicAcid": "10 g"}, (22.0, 65.0)),
    "azide in DMF": ({"SodiumAzide": "1 g", "NNDimethylformamide": "20 mL", "BenzylBromide": "2 g"}, (22.0, 50.0)),
    "Grignard": ({"Magnesium": "1 g", "Bromobenzene": "5 mL", "DiethylEther": "50 mL", "Iodine": "9 mg"}, (22.0, 35)),
    "MnO2": ({"ManganeseDioxide": "10 g", "BenzylAlcohol": "1 g", "Dichloromethane": "50 mL"}, (22.0, 40.0)),
    "acid and carbonate": ({"AceticAcid": "2 mL", "SodiumBicarbonate": "2 g", "DeionizedWater": "20 mL"}, (22.0,)),
    "bromine and hydrogen chloride": ({"Bromine": "1 mL", "HydrochloricAcid": "5 mL"}, (22.0, 60.0)),
    "N-oxide": ({"MetaChloroperbenzoicAcid": "2 g", "Pyridine": "1 mL", "Dichloromethane": "50 mL"}, (0.0, 22.0)),
    "iron in acetic acid": ({"IronPowder": "5 g", "AceticAcid": "40 mL", "Nitrobenzene": "5 g"}, (60.0, 100.0)),
}  # fmt: skip


@pytest.mark.parametrize("reagents, temperatures", ORDINARY.values(), ids=ORDINARY)
def test_a_reaction_that_chemists_run_on_purpose_is_no_fault(
    reagents: dict[str, str], temperatures: tuple[float, ...]
) -> None:
    assert faults(heated(reagents, *temperatures)) == []


def test_butyllithium_and_an_alkyl_iodide_stay_a_pair_however_long_they_were_kept() -> None:
    cold = heated({"NButyllithium": "5 mL", "MethylIodide": "2 mL", "Tetrahydrofuran": "30 mL"}, -40.0, 22.0, 40.0)
    waited = (cold.steps[0], cold.steps[1].model_copy(update={"duration": 600.0}), cold.steps[2])
    assert faults(cold.model_copy(update={"steps": waited}))


def test_chlorine_and_oxygen_in_an_organic_molecule_make_no_perchlorate() -> None:
    ester = Substance(
        name="Ester", names=("ester",), smiles="CCOC(=O)COc1ccc(C(=O)CC)cc1Cl", formula="C13H15ClO4", source="opsin",
        state="solid", groups=("ester", "ketone", "ether", "aryl_halide"), flags=("peroxide_former",),
    )  # fmt: skip
    salt = Substance(
        name="LithiumPerchlorate", names=("LiClO4",), smiles="[Li+].[O-][Cl+3]([O-])([O-])[O-]", formula="ClLiO4",
        source="table", state="solid", groups=("strong_oxidizer",), flags=("oxidizer",),
    )  # fmt: skip
    catalog, shares = CATALOG.including((ester, salt)), {"Methanol": 1.0}
    assert limit_of(catalog.get("Ester"), catalog.get("Methanol"), shares) is None
    limit = limit_of(catalog.get("LithiumPerchlorate"), catalog.get("Methanol"), shares)
    assert limit is not None
    assert limit.is_never


def test_a_pair_that_was_added_cold_is_a_fault_when_a_later_step_heats_it() -> None:
    reagents = {"SodiumHydride": "1 g", "DimethylSulfoxide": "20 mL"}
    assert faults(heated(reagents, 0.0, 22.0)) == []
    assert [finding.step for finding in faults(heated(reagents, 0.0, 22.0, 90.0))] == [3]


@pytest.mark.parametrize("protocol", protocols().values(), ids=protocols())
def test_the_published_protocols_stay_within_the_limits(protocol: Protocol) -> None:
    assert faults(protocol) == []


@pytest.mark.parametrize("every", [8, pytest.param(1, marks=pytest.mark.slow)])
def test_the_experiments_that_can_be_staged_stay_within_the_limits(every: int) -> None:
    staged = []
    for experiment in [*experiments().values()][::every]:
        try:
            staged.append(stage(experiment, CATALOG))
        except ValueError:
            continue
    assert len(staged) > 150 / every
    assert [(protocol.id, found) for protocol in staged if (found := faults(protocol))] == []
