"""Steps against what the equipment can do: for each rule a protocol that breaks it and the nearest that does not."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from labgym.assets import Catalog
from labgym.protocols import Finding, Protocol, ReagentUse, Step, examine, protocols, validate
from labgym.protocols.rules import EQUIPMENT, ProtocolCase
from labgym.protocols.rules.vessels import vapour_pressure

CATALOG = Catalog.load()


def step(
    action: str, uses: str, temperature: float | None = None, text: str = "", place: str = "FumeHood"
) -> dict[str, Any]:
    return {
        "location": place,
        "action": action,
        "text": text or action,
        "uses": tuple(uses.split()),
        "temperature": temperature,
        "duration": 10.0,
    }


def made(amounts: dict[str, str], *steps: dict[str, Any], product: str = "something") -> Protocol:
    """Return a protocol of those steps; reagents without an amount are of no account."""
    used = dict.fromkeys(name for each in steps for name in each["uses"])
    reagents = [name for name in used if CATALOG.get(name).kind == "reagent"]
    return Protocol(
        id="made",
        name="Made",
        reaction_type="substitution",
        product=product,
        reagents=tuple(
            ReagentUse(name=name, role="r", amount=amounts.get(name, "")) for name in reagents or ["Ethanol"]
        ),
        instruments=tuple(name for name in used if CATALOG.get(name).kind == "instrument") or ("Beaker",),
        steps=tuple(Step(index=index, **each) for index, each in enumerate(steps, start=1)),
    )


def solvents(amounts: dict[str, str], *steps: dict[str, Any]) -> Protocol:
    """Return a protocol of those steps in which every reagent with an amount is a solvent."""
    protocol = made(amounts, *steps)
    uses = tuple(use.model_copy(update={"role": "solvent"}) if use.amount else use for use in protocol.reagents)
    return protocol.model_copy(update={"reagents": uses})


def found(protocol: Protocol) -> list[Finding]:
    basic = set(validate(protocol))
    return [finding for finding in examine(protocol) if finding not in basic]


def initiated(initiator: str, temperature: float) -> Protocol:
    """Return a bromination of toluene in xylene with an amount of AIBN."""
    uses = "RoundBottomFlask OilBath RefluxCondenser MagneticStirrer Toluene Xylene AIBN"
    amounts = {"Toluene": "5.3 mL, 50 mmol", "Xylene": "60 mL", "AIBN": initiator}
    protocol = made(amounts, step("Heat", uses, temperature))
    roles = {"Xylene": "solvent"}
    used = tuple(use.model_copy(update={"role": roles.get(use.name, "r")}) for use in protocol.reagents)
    return protocol.model_copy(update={"reagents": used})


FLASK, BATH = "RoundBottomFlask MagneticHotplateStirrer", "RoundBottomFlask OilBath"
CHARGE = step("Add", "RoundBottomFlask Toluene")
# rule, step at fault, name in the suggestion, a protocol that breaks it, the nearest that does not
CASES: dict[str, tuple[str, int, str, Protocol, Protocol]] = {
    "400 mL in a 250 mL flask": (
        "vessel-volume",
        1,
        "RoundBottomFlask500",
        made({"Toluene": "400 mL"}, CHARGE),
        made({"Toluene": "250 mL"}, CHARGE),
    ),
    "400 mL over two steps": (
        "vessel-volume",
        2,
        "RoundBottomFlask500",
        made({"Toluene": "200 mL", "Ethanol": "200 mL"}, CHARGE, step("Add", "RoundBottomFlask Ethanol")),
        made({"Toluene": "100 mL", "Ethanol": "100 mL"}, CHARGE, step("Add", "RoundBottomFlask Ethanol")),
    ),
    "a mass of liquid by its density": (
        "vessel-volume",
        1,
        "RoundBottomFlask500",
        made({"Toluene": "240 g"}, CHARGE),
        made({"SulfuricAcid": "240 g"}, step("Add", "RoundBottomFlask SulfuricAcid")),
    ),
    "water in the text": (
        "vessel-volume",
        1,
        "RoundBottomFlask500",
        made({"Toluene": "20 mL"}, step("Add", "RoundBottomFlask Toluene", text="Charge water (250 mL) and toluene.")),
        made({"Toluene": "20 mL"}, step("Add", "RoundBottomFlask Toluene", text="Charge water (200 mL) and toluene.")),
    ),
    "the batch and a wash in the funnel": (
        "vessel-volume",
        2,
        "SeparatoryFunnel1000",
        made(
            {"Toluene": "200 mL", "HydrochloricAcid": "2 x 60 mL"},
            CHARGE,
            step("Wash", "SeparatoryFunnel HydrochloricAcid"),
        ),
        made(
            {"Toluene": "200 mL", "HydrochloricAcid": "3 x 40 mL"},
            CHARGE,
            step("Wash", "SeparatoryFunnel HydrochloricAcid"),
        ),
    ),
    "a boiling flask without headroom": (
        "vessel-headroom",
        2,
        "RoundBottomFlask500",
        made({"Toluene": "200 mL"}, CHARGE, step("Reflux", f"{BATH} RefluxCondenser", 110)),
        made({"Toluene": "160 mL"}, CHARGE, step("Reflux", f"{BATH} RefluxCondenser", 110)),
    ),
    "a dropping funnel too small": (
        "funnel-volume",
        1,
        "portions",
        made({"Toluene": "150 mL"}, step("Add", "ThreeNeckFlask DroppingFunnel Toluene")),
        made({"Toluene": "90 mL"}, step("Add", "ThreeNeckFlask DroppingFunnel Toluene")),
    ),
    "a flat flask in a mantle": (
        "vessel-fits-heater",
        1,
        "RoundBottomFlask",
        made({}, step("Heat", "ErlenmeyerFlask HeatingMantle", 40)),
        made({}, step("Heat", "RoundBottomFlask HeatingMantle", 40)),
    ),
    "a stoppered flask heated": (
        "sealed-vessel",
        2,
        "PressureTube",
        made({"Toluene": "20 mL"}, CHARGE, step("Heat", BATH, 80, "Stopper the flask and heat.")),
        made({"Toluene": "20 mL"}, CHARGE, step("Heat", BATH, 80, "Heat the unstoppered flask.")),
    ),
    "a pressure tube too hot": (
        "vessel-pressure",
        1,
        "MicrowaveReactor",
        made({"Acetone": "10 mL"}, step("Heat", "PressureTube OilBath Acetone", 170)),
        made({"Acetone": "10 mL"}, step("Heat", "PressureTube OilBath Acetone", 120)),
    ),
    "an evacuated conical flask": (
        "vacuum-glass",
        1,
        "SchlenkFlask",
        made({}, step("DryVacuum", "ErlenmeyerFlask VacuumPump", 22)),
        made({}, step("DryVacuum", "RoundBottomFlask VacuumPump", 22)),
    ),
    "ice for -30 C": (
        "cooling-reach",
        1,
        "LowTemperatureBath",
        made({}, step("Cool", "RoundBottomFlask IceBath", -30)),
        made({}, step("Cool", "RoundBottomFlask IceBath", -10)),
    ),
    "no bath for -78 C": (
        "cooling-reach",
        1,
        "CoolingBathDewar",
        made({}, step("Cool", "RoundBottomFlask", -78)),
        made({}, step("Cool", "RoundBottomFlask CoolingBathDewar", -78)),
    ),
    "a thermometer beyond its scale": (
        "temperature-limit",
        1,
        "Thermometer",
        made({}, step("Heat", "Thermometer RoundBottomFlask SandBath", 280)),
        made({}, step("Heat", "Thermometer RoundBottomFlask SandBath", 240)),
    ),
    "acetone boiled off": (
        "boils-off",
        1,
        "RefluxCondenser",
        made({"Acetone": "50 mL"}, step("Heat", f"{FLASK} Acetone", 60)),
        made({"Acetone": "50 mL"}, step("Heat", f"{FLASK} Acetone", 50)),
    ),
    "acetone boiled off for want of a condenser": (
        "boils-off",
        1,
        "RefluxCondenser",
        made({"Acetone": "50 mL"}, step("Heat", f"{FLASK} Acetone", 60)),
        made({"Acetone": "50 mL"}, step("Heat", f"{FLASK} Acetone RefluxCondenser", 60)),
    ),
    "dichloromethane refluxed at 110 C": (
        "reflux-temperature",
        1,
        "PressureTube",
        made({"Dichloromethane": "50 mL"}, step("Reflux", f"{BATH} RefluxCondenser Dichloromethane", 110)),
        made({"Dichloromethane": "50 mL"}, step("Reflux", f"{BATH} RefluxCondenser Dichloromethane", 40)),
    ),
    "a product dried while it melts": (
        "dries-above-melting",
        1,
        "20 C",
        made({}, step("DrySolid", "DryingOven", 60, place="DryingStation"), product="benzyl phenyl ether, mp 40-41 C"),
        made({}, step("DrySolid", "DryingOven", 30, place="DryingStation"), product="benzyl phenyl ether, mp 40-41 C"),
    ),
    "a heated azide": (
        "explosive-heated",
        1,
        "60 C",
        made({"TertButylHydroperoxide": "5 mL"}, step("Heat", f"{FLASK} TertButylHydroperoxide", 90)),
        made({"TertButylHydroperoxide": "5 mL"}, step("Heat", f"{FLASK} TertButylHydroperoxide", 50)),
    ),
    "an initiator without a solvent": (
        "explosive-heated",
        1,
        "60 C",
        made({"Styrene": "10 mL", "AIBN": "0.1 g"}, step("Heat", f"{FLASK} {BATH} Styrene AIBN", 80)),
        made({"Styrene": "10 mL", "AIBN": "0.1 g"}, step("Heat", f"{FLASK} {BATH} Styrene AIBN", 60)),
    ),
    "as many moles of an initiator as of the substrate": (
        "explosive-heated",
        1,
        "60 C",
        initiated("8.2 g, 50 mmol", 81),
        initiated("0.16 g, 1 mmol", 81),
    ),
    "an initiator above the temperature of boiling toluene": (
        "explosive-heated",
        1,
        "115 C",
        initiated("0.16 g, 1 mmol", 130),
        initiated("0.16 g, 1 mmol", 110),
    ),
    "hydride quenched warm": (
        "quench-cold",
        2,
        "IceBath",
        made(
            {},
            step("Add", "ThreeNeckFlask LithiumAluminumHydride", 0, "Under nitrogen."),
            step("Quench", "ThreeNeckFlask", 40),
        ),
        made(
            {},
            step("Add", "ThreeNeckFlask LithiumAluminumHydride", 0, "Under nitrogen."),
            step("Quench", "ThreeNeckFlask", 5),
        ),
    ),
    "a flame at ether": (
        "flame-near-flammable",
        1,
        "use ",
        made({"DiethylEther": "20 mL"}, step("Heat", "Beaker BunsenBurner DiethylEther", 30)),
        made({"DiethylEther": "20 mL"}, step("Heat", "Beaker WaterBath DiethylEther", 30)),
    ),
    "a flame at ethanol of an earlier step": (
        "flame-near-flammable",
        2,
        "use ",
        made({"Ethanol": "20 mL"}, step("Add", "Beaker Ethanol"), step("Heat", "Beaker BunsenBurner", 60)),
        made(
            {"DeionizedWater": "20 mL"}, step("Add", "Beaker DeionizedWater"), step("Heat", "Beaker BunsenBurner", 60)
        ),
    ),
    "a flame where another step pours ether": (
        "flame-near-flammable",
        1,
        "DiethylEther",
        made({}, step("Heat", "Crucible BunsenBurner", 900), step("Extract", "SeparatoryFunnel DiethylEther")),
        made(
            {},
            step("Heat", "Crucible BunsenBurner", 900, place="MainWorkbench"),
            step("Extract", "SeparatoryFunnel DiethylEther"),
        ),
    ),
    "a batch in methanol on the bench": (
        "carried-vapour",
        2,
        "FumeHood",
        made({"Methanol": "20 mL"}, step("Add", "Beaker Methanol"), step("Stir", "Beaker", 22, place="MainWorkbench")),
        made(
            {"DeionizedWater": "20 mL"},
            step("Add", "Beaker DeionizedWater"),
            step("Stir", "Beaker", 22, place="MainWorkbench"),
        ),
    ),
    "a lethal gas at an exhaust arm": (
        "hood-draws",
        1,
        "FumeHood",
        made({}, step("Add", "Beaker Bromine", place="PurificationBench")),
        made({}, step("Add", "Beaker Bromine")),
    ),
    "water onto sulfuric acid": (
        "acid-into-water",
        2,
        "onto water",
        made(
            {"SulfuricAcid": "50 mL"},
            step("Add", "Beaker SulfuricAcid"),
            step("Quench", "Beaker", 5, "Add 50 mL of water slowly."),
        ),
        made(
            {"SulfuricAcid": "50 mL"},
            step("Add", "Beaker SulfuricAcid"),
            step("Quench", "Beaker", 5, "Pour onto crushed ice, then add water."),
        ),
    ),
    "a product that explodes": (
        "dangerous-product",
        None,
        "another product",
        made({}, step("Stir", "RoundBottomFlask Toluene"), product="phenyl azide"),
        made({}, step("Stir", "RoundBottomFlask Toluene"), product="benzyl azide"),
    ),
    "tetrahydrofuran distilled untested": (
        "peroxides-tested",
        1,
        "test for peroxides",
        made({}, step("Distill", f"{BATH} DistillationHead Tetrahydrofuran", 66)),
        made(
            {},
            step("Test", "Tetrahydrofuran", text="Test for peroxides."),
            step("Distill", f"{BATH} DistillationHead Tetrahydrofuran", 66),
        ),
    ),
    "butyllithium in air": (
        "inert-gas",
        1,
        "SchlenkLine",
        made({}, step("Add", "ThreeNeckFlask NButyllithium")),
        made({}, step("Add", "ThreeNeckFlask NButyllithium SchlenkLine")),
    ),
    "bleach and acid without a scrubber": (
        "toxic-gas",
        1,
        "GasWashBottle",
        made({}, step("Add", "ThreeNeckFlask SodiumHypochlorite AceticAcid")),
        made({}, step("Add", "ThreeNeckFlask SodiumHypochlorite AceticAcid GasWashBottle")),
    ),
    "glass in a furnace": (
        "temperature-limit",
        1,
        "Crucible",
        made({}, step("Heat", "Beaker MuffleFurnace", 700)),
        made({}, step("Heat", "Crucible MuffleFurnace", 700)),
    ),
    "a plastic tube in hot oil": (
        "temperature-limit",
        1,
        "use ",
        made({}, step("Heat", "CentrifugeTube OilBath", 150)),
        made({}, step("Heat", "TestTube OilBath", 150)),
    ),
    "an azide in dichloromethane": (
        "violent-mixture",
        1,
        "another solvent",
        made({}, step("Add", "RoundBottomFlask SodiumAzide Dichloromethane")),
        made({}, step("Add", "RoundBottomFlask SodiumAzide DimethylSulfoxide")),
    ),
    "nitric acid and acetone": (
        "violent-mixture",
        2,
        "another solvent",
        made({}, step("Add", "Beaker NitricAcid"), step("Add", "Beaker Acetone")),
        made({}, step("Add", "Beaker SulfuricAcid"), step("Add", "Beaker Acetone")),
    ),
    "a vacuum deeper than the pump's": (
        "vacuum-reach",
        1,
        "RotaryVanePump",
        made({}, step("Distill", "RoundBottomFlask VacuumPump OilBath", 90, "Distil at 0.1 mbar.")),
        made({}, step("Distill", "RoundBottomFlask VacuumPump OilBath", 90, "Distil at 10 mbar.")),
    ),
    "a vacuum in other units": (
        "vacuum-reach",
        1,
        "RotaryVanePump",
        made({}, step("Distill", "RoundBottomFlask VacuumPump OilBath", 90, "Distil at 3 mmHg.")),
        made({}, step("Distill", "RoundBottomFlask VacuumPump OilBath", 90, "Distil at 20 Torr.")),
    ),
    "a vacuum without a pump": (
        "vacuum-source",
        1,
        "RotaryVanePump",
        made({}, step("Distill", "RoundBottomFlask OilBath", 90, "Distil under vacuum.")),
        made({}, step("Distill", "RoundBottomFlask OilBath", 90, "Distil.")),
    ),
    "a stirrer too slow": (
        "speed-reach",
        1,
        "Centrifuge",
        made({}, step("Centrifuge", "CentrifugeTube Centrifuge", 22, "Spin at 15000 rpm.")),
        made({}, step("Centrifuge", "CentrifugeTube Centrifuge", 22, "Spin at 10000 rpm.")),
    ),
    "a force beyond the rotor's": (
        "force-reach",
        1,
        "Centrifuge",
        made({}, step("Centrifuge", "CentrifugeTube Centrifuge", 22, "Spin at 20,000 x g.")),
        made({}, step("Centrifuge", "CentrifugeTube Centrifuge", 22, "Spin at 4,000 x g.")),
    ),
    "a flow beyond the pump's": (
        "flow-reach",
        1,
        "PeristalticPump",
        made({}, step("Add", "ThreeNeckFlask SyringePump", 22, "Feed at 200 mL/min.")),
        made({}, step("Add", "ThreeNeckFlask SyringePump", 22, "Feed at 0.5 mL/min.")),
    ),
    "a lamp of another colour": (
        "wavelength-reach",
        1,
        "UVCabinet",
        made({}, step("Irradiate", "TestTube PhotoReactor", 22, "Irradiate at 365 nm.")),
        made({}, step("Irradiate", "TestTube PhotoReactor", 22, "Irradiate with blue light of 455 nm.")),
    ),
    "a pressure beyond the bottle's": (
        "pressure-reach",
        1,
        "PressureTube",
        made({}, step("Hydrogenate", "HydrogenationApparatus Hydrogen", 22, "Shake under 10 bar of hydrogen.")),
        made({}, step("Hydrogenate", "HydrogenationApparatus Hydrogen", 22, "Shake under 50 psi of hydrogen.")),
    ),
    "a batch beyond its stirrer": (
        "stirring-volume",
        1,
        "MagneticHotplateStirrer",
        made({"DeionizedWater": "15 L"}, step("Stir", "LargeBeaker MagneticStirrer DeionizedWater", 22)),
        made({"DeionizedWater": "500 mL"}, step("Stir", "LargeBeaker MagneticStirrer DeionizedWater", 22)),
    ),
    "a reactor's stirrer in the air": (
        "vessel-working",
        1,
        "RoundBottomFlask500",
        made({"Toluene": "300 mL"}, step("Stir", "JacketedReactor Toluene", 22)),
        made({"Toluene": "1.2 L"}, step("Stir", "JacketedReactor Toluene", 22)),
    ),
    "a heated flask without headroom": (
        "vessel-headroom",
        2,
        "RoundBottomFlask500",
        made({"Toluene": "200 mL"}, CHARGE, step("Heat", BATH, 80)),
        made({"Toluene": "200 mL"}, CHARGE, step("Stir", FLASK, 22)),
    ),
    "chromatographs too heavy for a trolley": (
        "bench-load",
        2,
        "GCMS",
        made(
            {},
            step("Analyze", "LiquidChromatograph", place="MobileBench"),
            step("Analyze", "GCMS", place="MobileBench"),
        ),
        made({}, step("Analyze", "GCMS", place="MobileBench"), step("Analyze", "GCMS", place="MobileBench")),
    ),
    "a pinch on a coarse balance": (
        "balance-range",
        1,
        "AnalyticalBalance",
        made({"BenzoicAcid": "20 mg"}, step("Weigh", "ElectronicScale BenzoicAcid", place="PreparationBench")),
        made({"BenzoicAcid": "0.2 g"}, step("Weigh", "ElectronicScale BenzoicAcid", place="PreparationBench")),
    ),
    "a peracid in acetone": (
        "peracid-in-ketone",
        1,
        "Dichloromethane",
        made({"Acetone": "80 mL"}, step("Add", "RoundBottomFlask Acetone Cyclohexene MetaChloroperbenzoicAcid", 0)),
        made(
            {"Dichloromethane": "80 mL", "Cyclohexanone": "4 mL"},
            step("Add", "RoundBottomFlask Dichloromethane Cyclohexanone MetaChloroperbenzoicAcid", 0),
        ),
    ),
    "an aluminium hydride in alcohol": (
        "hydride-in-protic",
        1,
        "Tetrahydrofuran",
        made({"Ethanol": "60 mL"}, step("Add", "RoundBottomFlask Ethanol LithiumAluminumHydride", 0)),
        made(
            {"Tetrahydrofuran": "60 mL", "DeionizedWater": "5 mL"},
            step("Add", "RoundBottomFlask Tetrahydrofuran LithiumAluminumHydride", 0),
            step("Quench", "RoundBottomFlask IceBath DeionizedWater", 5),
        ),
    ),
    "borohydride in boiling acetic acid": (
        "borohydride-in-acid",
        2,
        "below 30 C",
        made(
            {"AceticAcid": "50 mL"},
            step("Add", "RoundBottomFlask AceticAcid SodiumBorohydride", 15),
            step("Reflux", "RoundBottomFlask RefluxCondenser OilBath", 118),
        ),
        made({"AceticAcid": "50 mL"}, step("Add", "RoundBottomFlask AceticAcid SodiumBorohydride", 15)),
    ),
    "borohydride in boiling ethanol": (
        "borohydride-in-alcohol",
        1,
        "room temperature",
        made(
            {"Ethanol": "50 mL"},
            step("Reflux", "RoundBottomFlask RefluxCondenser OilBath Ethanol SodiumBorohydride", 78),
        ),
        made({"Ethanol": "50 mL"}, step("Stir", "RoundBottomFlask Ethanol SodiumBorohydride", 20)),
    ),
    "a Grignard reagent in methanol": (
        "grignard-in-protic",
        1,
        "dry DiethylEther",
        made(
            {"Methanol": "50 mL"},
            step("Reflux", "ThreeNeckFlask RefluxCondenser OilBath Methanol Magnesium Bromobenzene", 60),
        ),
        made(
            {"DiethylEther": "50 mL"},
            step("Reflux", "ThreeNeckFlask RefluxCondenser OilBath DiethylEther Magnesium Bromobenzene", 34),
        ),
    ),
    "the quenching acid in the reaction": (
        "quench-order",
        2,
        "Quench step",
        made(
            {"HydrochloricAcid": "20 mL"},
            step("MakeSolution", "ThreeNeckFlask Dichloromethane AluminumChloride", 0),
            step("Add", "ThreeNeckFlask DroppingFunnel AcetylChloride HydrochloricAcid", 0),
        ),
        made(
            {"HydrochloricAcid": "20 mL"},
            step("MakeSolution", "ThreeNeckFlask Dichloromethane AluminumChloride", 0),
            step("Add", "ThreeNeckFlask DroppingFunnel AcetylChloride", 0),
            step("Quench", "LargeBeaker IceBath HydrochloricAcid", 5),
        ),
    ),
    "a wash without an organic layer": (
        "layer-missing",
        2,
        "EthylAcetate",
        solvents(
            {"Methanol": "50 mL"},
            step("Stir", "RoundBottomFlask Methanol", 22),
            step("Wash", "SeparatoryFunnel ErlenmeyerFlask SodiumBicarbonate", 22),
        ),
        solvents(
            {"Methanol": "50 mL", "EthylAcetate": "60 mL"},
            step("Stir", "RoundBottomFlask Methanol", 22),
            step("Extract", "SeparatoryFunnel ErlenmeyerFlask EthylAcetate", 22),
            step("Wash", "SeparatoryFunnel ErlenmeyerFlask SodiumBicarbonate", 22),
        ),
    ),
    "a wet distillation": (
        "dry-before-distillation",
        2,
        "MagnesiumSulfate",
        made(
            {},
            step("Wash", "SeparatoryFunnel ErlenmeyerFlask SodiumBicarbonate", 22),
            step("Distill", "RoundBottomFlask DistillationHead LiebigCondenser OilBath", 90),
        ),
        made(
            {},
            step("Wash", "SeparatoryFunnel ErlenmeyerFlask SodiumBicarbonate", 22),
            step("DrySolution", "ErlenmeyerFlask MagnesiumSulfate", 22),
            step("Distill", "RoundBottomFlask DistillationHead LiebigCondenser OilBath", 90),
        ),
    ),
    "a solid through a dropping funnel": (
        "solid-in-funnel",
        1,
        "portions",
        made(
            {"SodiumTriacetoxyborohydride": "3.2 g"},
            step("Add", "ThreeNeckFlask DroppingFunnel SodiumTriacetoxyborohydride", 22),
        ),
        made(
            {"SodiumHydroxide": "20 mL of 10 % aq."}, step("Add", "ThreeNeckFlask DroppingFunnel SodiumHydroxide", 22)
        ),
    ),
    "palladium on carbon in the rotary evaporator": (
        "catalyst-filtered",
        2,
        "Celite",
        made(
            {},
            step("Stir", "RoundBottomFlask Ethanol PalladiumOnCarbon", 22),
            step("Concentrate", "RotaryEvaporator RoundBottomFlask", 40, place="RotaryEvaporatorStation"),
        ),
        made(
            {},
            step("Stir", "RoundBottomFlask Ethanol PalladiumOnCarbon", 22),
            step("Filter", "BuchnerFunnel FilterFlask Celite", 22),
            step("Concentrate", "RotaryEvaporator RoundBottomFlask", 40, place="RotaryEvaporatorStation"),
        ),
    ),
    "palladium on carbon weighed as metal": (
        "catalyst-loading",
        1,
        "0.213 g",
        made(
            {"PalladiumOnCarbon": "0.0213 g, 0.2 mmol"}, step("Stir", "RoundBottomFlask Ethanol PalladiumOnCarbon", 22)
        ),
        made(
            {"PalladiumOnCarbon": "0.213 g, 0.2 mmol Pd"},
            step("Stir", "RoundBottomFlask Ethanol PalladiumOnCarbon", 22),
        ),
    ),
    "a palladium(0) complex in air": (
        "catalyst-inert",
        1,
        "SchlenkLine",
        made({}, step("Add", "ThreeNeckFlask TetrakisTriphenylphosphinePalladium", 22)),
        made({}, step("Add", "ThreeNeckFlask SchlenkLine NitrogenGas TetrakisTriphenylphosphinePalladium", 22)),
    ),
    "hydrogen at 5 bar in a balloon": (
        "pressure-reach",
        1,
        "HydrogenBalloon",
        made(
            {}, step("Hydrogenate", "HydrogenBalloon RoundBottomFlask Hydrogen", 22, "Shake under 5 bar of hydrogen.")
        ),
        made(
            {}, step("Hydrogenate", "HydrogenBalloon RoundBottomFlask Hydrogen", 22, "Shake under 1 bar of hydrogen.")
        ),
    ),
    "a stirred flask far above its boiling point under a condenser": (
        "reflux-temperature",
        2,
        "PressureTube",
        made(
            {"Acetone": "50 mL"},
            step("Stir", "RoundBottomFlask Acetone", 22),
            step("Heat", "RoundBottomFlask RefluxCondenser OilBath", 120),
        ),
        made(
            {"Acetone": "50 mL"},
            step("Stir", "RoundBottomFlask Acetone", 22),
            step("Heat", "RoundBottomFlask RefluxCondenser OilBath", 60),
        ),
    ),
    "an oxidation with hydrogen peroxide that is no test for peroxides": (
        "peroxides-tested",
        2,
        "test for peroxides",
        made(
            {"Tetrahydrofuran": "50 mL"},
            step("Add", "RoundBottomFlask Tetrahydrofuran", 22, "Add tetrahydrofuran to the 30% hydrogen peroxide."),
            step("Distill", "RoundBottomFlask DistillationHead OilBath", 66),
        ),
        made(
            {"Tetrahydrofuran": "50 mL"},
            step("Add", "RoundBottomFlask Tetrahydrofuran", 22, "Test the tetrahydrofuran for peroxides."),
            step("Distill", "RoundBottomFlask DistillationHead OilBath", 66),
        ),
    ),
    "water into acid in an ice bath": (
        "acid-into-water",
        2,
        "onto water",
        made(
            {"SulfuricAcid": "50 mL"},
            step("Add", "Beaker SulfuricAcid", 5),
            step(
                "Add",
                "Beaker IceBath DeionizedWater",
                5,
                "Add 50 mL of water to the concentrated sulfuric acid in an ice bath.",
            ),
        ),
        made(
            {"SulfuricAcid": "50 mL"},
            step("Add", "Beaker SulfuricAcid", 5),
            step(
                "Add",
                "LargeBeaker IceBath DeionizedWater",
                5,
                "Pour the acid slowly onto ice in a beaker in an ice bath.",
            ),
        ),
    ),
    "butyllithium beside a trap of liquid nitrogen": (
        "inert-gas",
        1,
        "under nitrogen",
        made(
            {},
            step(
                "Add",
                "ThreeNeckFlask ColdTrap NButyllithium",
                -78,
                "Add butyllithium; cool the trap with liquid nitrogen.",
            ),
        ),
        made({}, step("Add", "ThreeNeckFlask NButyllithium", -78, "Add butyllithium under nitrogen.")),
    ),
}


@pytest.mark.parametrize("name", CASES)
def test_a_protocol_that_breaks_a_rule_is_found_at_its_step_with_a_way_out(name):
    rule, index, way_out, broken, _ = CASES[name]
    findings = [finding for finding in found(broken) if finding.rule == rule]
    assert [finding.step for finding in findings] == [index]
    assert way_out in findings[0].suggestion + findings[0].message
    assert index is None or f"step {index}" in findings[0].message


@pytest.mark.parametrize("name", CASES)
def test_the_nearest_protocol_that_keeps_the_rule_is_not_found(name):
    rule, _, _, _, sound = CASES[name]
    assert [finding for finding in found(sound) if finding.rule == rule] == []


def test_every_rule_has_a_case():
    cases = [ProtocolCase(broken, CATALOG) for _, _, _, broken, _ in CASES.values()]
    assert [rule.__name__ for rule in EQUIPMENT if not any(list(rule(case)) for case in cases)] == []


def test_a_plate_that_is_not_hot_enough_gets_one_named_that_is():
    cold = made({}, step("Heat", "Crucible OilBath", 250))
    findings = [finding for finding in examine(cold) if finding.rule == "heat-source"]
    assert [finding.step for finding in findings] == [1]
    assert "SandBath" in findings[0].suggestion
    hot = made({}, step("Heat", "Crucible SandBath", 250))
    assert "heat-source" not in [finding.rule for finding in examine(hot)]


@pytest.mark.parametrize(("velocity", "rules"), [(0.2, ["hood-draws"]), (0.3, []), (0.5, [])])
@pytest.mark.parametrize("reagent", ["Chloroform", "Bromine"])
def test_a_hood_that_hardly_draws_holds_no_vapour_back(reagent, velocity, rules):
    hood = CATALOG.get("FumeHood")
    slow = hood.model_copy(update={"specs": hood.specs.model_copy(update={"face_velocity_m_s": velocity})})
    catalog = Catalog([slow if asset.name == "FumeHood" else asset for asset in CATALOG])
    findings = examine(made({}, step("Add", f"Beaker {reagent}")), catalog)
    assert [finding.rule for finding in findings if finding.rule == "hood-draws"] == rules
    harmless = examine(made({}, step("Add", "Beaker DeionizedWater")), catalog)
    assert "hood-draws" not in [finding.rule for finding in harmless]


def test_what_is_unknown_leaves_no_reactor_too_empty():
    protocol = made({"Toluene": "300 mL"}, step("Stir", "JacketedReactor Toluene Ethanol", 22))
    assert "vessel-working" not in [finding.rule for finding in examine(protocol)]


def test_a_toxic_liquid_at_an_open_bench_is_sent_to_the_hood():
    bench = made({}, step("Add", "Beaker Chloroform", place="MainWorkbench"))
    assert [f.rule for f in examine(bench) if "FumeHood" in f.suggestion] == ["location-safe"]
    hood = made({}, step("Add", "Beaker Chloroform"))
    assert not [f for f in examine(hood) if f.rule == "location-safe"]


def test_the_published_protocols_ask_nothing_impossible_of_their_equipment():
    faults = {
        (name, finding.rule)
        for name, protocol in protocols().items()
        for finding in found(protocol)
        if finding.severity == "fault"
    }
    assert faults == set()


def test_names_that_the_catalogue_lacks_do_not_stop_the_examination():
    protocol = made({"Toluene": "400 mL"}, CHARGE)
    odd = protocol.steps[0].model_copy(update={"uses": (*protocol.steps[0].uses, "Unobtainium"), "location": "Nowhere"})
    rules = [finding.rule for finding in examine(protocol.model_copy(update={"steps": (odd,)}))]
    assert {"asset-exists", "vessel-volume"} <= set(rules)


@pytest.mark.parametrize(
    ("boiling_point", "temperature", "associated", "bar", "tolerance"),
    [
        (100.0, 100.0, True, 1.013, 1e-9),
        (100.0, 150.0, True, 4.76, 0.1),
        (78.3, 150.0, True, 9.8, 0.2),
        (56.1, 150.0, False, 11.7, 0.25),
        (110.6, 200.0, False, 7.5, 0.25),
    ],
)
def test_vapour_pressures_are_near_those_of_steam_tables(boiling_point, temperature, associated, bar, tolerance):
    assert vapour_pressure(boiling_point, temperature, associated) == pytest.approx(bar, rel=tolerance)


NAMES = [asset.name for asset in CATALOG]
STEPS = st.builds(
    step,
    action=st.sampled_from(
        ("Weigh", "Add", "Heat", "Reflux", "Distill", "Concentrate", "Quench", "Wash", "Filter", "Odd")
    ),
    uses=st.lists(st.sampled_from(NAMES), max_size=6).map(" ".join),
    temperature=st.none() | st.floats(-273.0, 2999.0),
    text=st.text(max_size=40)
    | st.sampled_from(
        ("stoppered, 0 mbar", "99999 rpm", "99 bar, 99 x g", "100 nm, 9 mL/min", "add water (1 L)", "pour", "vacuum")
    ),
    place=st.sampled_from(NAMES),
)
AMOUNTS = st.dictionaries(st.sampled_from(NAMES), st.sampled_from(("", "0 mL", "3 x 1 L", "9 kg", "1 mol", "1e9 mL")))


@settings(max_examples=150, deadline=None)
@given(AMOUNTS, st.lists(STEPS, min_size=1, max_size=8))
def test_any_protocol_of_catalogue_names_is_examined_without_failing(amounts, steps):
    protocol = made(amounts, *steps)
    findings = examine(protocol)
    assert all(finding.step is None or 1 <= finding.step <= len(steps) for finding in findings)
    assert all("\n" not in finding.message and finding.suggestion for finding in findings)
    assert findings == examine(protocol)


def mixture(part: str, percent: float, rest: str, *uses: str, temperature: float = 22.0) -> Protocol:
    """Return a protocol with a liquid as a percentage of a mixture, and with what has no volume."""
    amounts = {part: f"{percent:g} mL", rest: f"{100.0 - percent:g} mL"}
    return made(amounts, step("Add", " ".join(("RoundBottomFlask", part, rest, *uses)), temperature))


def washed(percent: float) -> Protocol:
    return solvents(
        {"Methanol": f"{100.0 - percent:g} mL", "EthylAcetate": f"{percent:g} mL"},
        step("Stir", "RoundBottomFlask Methanol EthylAcetate", 22),
        step("Wash", "SeparatoryFunnel ErlenmeyerFlask SodiumBicarbonate", 22),
    )


def palladium(share: float) -> Protocol:
    amount = f"{106.42 * 0.2 * share:.4f} mg, 0.2 mmol"
    return made({"PalladiumOnCarbon": amount}, step("Stir", "RoundBottomFlask Ethanol PalladiumOnCarbon", 22))


def borohydride(solvent: str, celsius: float) -> Protocol:
    return mixture(solvent, 60.0, "DeionizedWater", "SodiumBorohydride", temperature=celsius)


@pytest.mark.parametrize(
    ("rule", "make", "breaks", "keeps"),
    [
        (
            "peracid-in-ketone",
            lambda x: mixture("Acetone", x, "Dichloromethane", "MetaChloroperbenzoicAcid"),
            25.3,
            24.7,
        ),
        ("hydride-in-protic", lambda x: mixture("Ethanol", x, "Tetrahydrofuran", "LithiumAluminumHydride"), 10.1, 9.9),
        ("grignard-in-protic", lambda x: mixture("Ethanol", x, "DiethylEther", "Magnesium", "BenzylBromide"), 5.1, 4.9),
        ("borohydride-in-acid", lambda x: borohydride("AceticAcid", x), 30.1, 30.0),
        ("borohydride-in-alcohol", lambda x: borohydride("Methanol", x), 60.1, 60.0),
        ("layer-missing", washed, 4.9, 5.1),
        ("catalyst-loading", palladium, 1.24, 1.26),
        ("catalyst-loading", palladium, 0.76, 0.74),
    ],
)
def test_limits_of_shares_and_temperatures_are_those_of_their_sources(rule, make, breaks, keeps):
    assert rule in {finding.rule for finding in examine(make(breaks))}
    assert rule not in {finding.rule for finding in examine(make(keeps))}


def test_a_borohydride_needs_a_quarter_of_the_volume_as_acid_or_alcohol():
    for rule, liquid, celsius in (("acid", "AceticAcid", 40.0), ("alcohol", "Methanol", 70.0)):
        for percent, breaks in ((25.3, True), (24.7, False)):
            protocol = mixture(liquid, percent, "DeionizedWater", "SodiumBorohydride", temperature=celsius)
            assert (f"borohydride-in-{rule}" in {finding.rule for finding in examine(protocol)}) is breaks
