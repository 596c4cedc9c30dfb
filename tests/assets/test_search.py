"""What people write leads to the asset they mean, and never to another substance."""

from __future__ import annotations

import contextlib

import pytest
from every_case import for_each
from hypothesis import example, given
from hypothesis import strategies as st

from labgym.assets import Catalog
from labgym.assets.search import normalize, surface_forms
from labgym.errors import UnknownNameError

CATALOG = Catalog.load()

MEANINGS = {
    "RotaryEvaporator": ["rotovap", "Rotavap", "rotary evaporator", "ROTARY-EVAPORATOR", "旋转蒸发仪", "旋蒸"],
    "RoundBottomFlask": ["RBF", "round-bottom flask", "round bottomed flask", "圆底烧瓶", "round bottom flasks"],
    "ErlenmeyerFlask": ["conical flask", "Erlenmeyer", "锥形瓶", "三角瓶"],
    "BuchnerFunnel": ["Büchner funnel", "buchner  funnel", "Buechner funnel", "布氏漏斗"],
    "SeparatoryFunnel": ["sep funnel", "separating funnel", "seperatory funnel", "分液漏斗"],
    "MagneticHotplateStirrer": ["hotplate", "hot plate", "stirrer hotplate", "HeatingPlate", "磁力加热搅拌器"],
    "MagneticStirrer": ["magnetic stirrer", "stir plate", "磁力搅拌器"],
    "FumeHood": ["hood", "fume hood", "fume cupboard", "通风橱"],
    "GloveBox": ["glove box", "glovebox", "dry box", "手套箱"],
    "LiquidChromatograph": ["HPLC", "liquid chromatography", "液相色谱仪"],
    "GasChromatograph": ["GC", "gas chromatograph"],
    "ElectronicScale": ["balance", "electronic balance", "scale", "电子天平"],
    "EmergencyShower": ["safety shower", "紧急喷淋"],
    "FlammableCabinet": ["flammable liquid storage cabinet", "易燃品柜"],
    "SodiumHydroxide": ["NaOH", "caustic soda", "sodium hydroxide", "氢氧化钠", "1310-73-2", "烧碱"],
    "EthylAcetate": ["EtOAc", "ethyl acetate", "EA", "乙酸乙酯", "141-78-6"],
    "Dichloromethane": ["DCM", "CH2Cl2", "CH₂Cl₂", "methylene chloride", "二氯甲烷", "dichlormethane"],
    "NNDimethylformamide": ["DMF", "N,N-dimethylformamide", "dimethylformamide", "二甲基甲酰胺"],
    "Tetrahydrofuran": ["THF", "tetrahydrofuran", "四氢呋喃"],
    "SulfuricAcid": ["H2SO4", "H₂SO₄", "sulphuric acid", "sulfuric acid", "硫酸"],
    "HydrochloricAcid": ["HCl", "hydrochloric acid", "conc. HCl", "盐酸"],
    "SodiumSulfite": ["sodium sulfite", "sodium sulphite", "Na2SO3"],
    "PalladiumOnCarbon": ["Pd/C", "palladium on carbon", "钯碳"],
    "DiTertButylDicarbonate": ["Boc2O", "Boc anhydride", "di-tert-butyl dicarbonate"],
    "LithiumAluminumHydride": ["LiAlH4", "LAH", "lithium aluminium hydride", "lithium aluminum hydride"],
    "Ethanol": ["EtOH", "alcohol", "乙醇", "酒精", "ethanoll"],
    "DeionizedWater": ["water", "H2O", "去离子水"],
    "CesiumCarbonate": ["Cs2CO3", "caesium carbonate"],
    "OneFourDioxane": ["1,4-dioxane", "dioxane"],
}

# Substances that the catalogue does not hold, each one slip of the pen from one that it does.
STRANGERS = [
    "sodium nitrate",
    "methyl acetate",
    "dimethyl ether",
    "benzyl chloride",
    "calcium carbonate",
    "lithium hydroxide",
    "iron(II) chloride",
    "malic acid",
    "o-toluidine",
    "pyrimidine",
    "potassium chloride",
    "sodium chlorate",
    "ammonium bromide",
    "hexene",
    "propanol",
    "acetyl bromide",
    "chlorobenzene",
]


@for_each(("text", "name"), [(text, name) for name, texts in MEANINGS.items() for text in texts])
def test_finds_what_is_meant(text, name):
    assert CATALOG.find(text).name == name


@for_each("asset", CATALOG.assets)
def test_every_synonym_finds_its_asset_in_any_case_and_spacing(asset):
    for form in surface_forms(asset):
        for text in (form, form.upper(), form.lower(), f"  {form} ", form.replace(" ", "-")):
            assert CATALOG.find(text).name == asset.name, text


@pytest.mark.parametrize("text", STRANGERS)
def test_another_substance_is_never_taken_for_a_misspelling(text):
    with pytest.raises(UnknownNameError, match="nearest"):
        CATALOG.find(text)


@pytest.mark.parametrize("text", ["", "   ", "???", "xyzzy", "a", None, 7, "x" * 100_000, "\x00", "🧪"])
def test_nonsense_is_refused_in_one_line(text):
    with pytest.raises(UnknownNameError) as caught:
        CATALOG.find(text)
    assert "\n" not in str(caught.value)


@given(st.text(max_size=60))
def test_any_text_finds_an_asset_or_is_refused(text):
    with contextlib.suppress(UnknownNameError):
        assert CATALOG.find(text).name in CATALOG


@example("𝛂")
@example("Άλφα")
@given(st.text(max_size=60))
def test_normalising_twice_changes_nothing(text):
    assert normalize(normalize(text)) == normalize(text)


def test_nearest_lists_the_best_first():
    assert CATALOG.nearest("rotary evaporatr")[0] == "RotaryEvaporator"
    assert len(CATALOG.nearest("acid", count=3)) <= 3
