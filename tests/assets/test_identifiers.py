"""Identifiers and physical data of reagents agree with RDKit, with the GHS criteria and with molecular volumes."""

from __future__ import annotations

from collections import Counter

import pytest
from every_case import for_each

from labgym.assets import Catalog
from labgym.assets.structures import canonical

Chem = pytest.importorskip("rdkit.Chem")
Descriptors = pytest.importorskip("rdkit.Chem.Descriptors")
formulas = pytest.importorskip("rdkit.Chem.rdMolDescriptors")

REAGENTS = Catalog.published().of_kind("reagent")
DRAWN = [asset for asset in REAGENTS if asset.chemistry.smiles is not None]
drawn = for_each("asset", DRAWN)

MIXTURES = {
    "Celite": "diatomaceous earth",
    "MolecularSieves": "zeolite",
    "PetroleumEther": "distillation fraction",
    "Xylene": "isomers",
}
"""Reagents without a structure, and why."""
HYDRATES = {
    "CopperIISulfate": 5,
    "Hydroxybenzotriazole": 1,
    "HydrazineHydrate": 1,
    "PToluenesulfonicAcid": 1,
    "TinIIChloride": 2,
    "AmmoniumHydroxide": 1,
}
"""Molecules of water that the bottled form has for each of the substance."""
RADICALS = {"ActivatedCharcoal", "Lithium", "Magnesium", "Potassium", "Sodium", "CopperIISulfate", "TinIIChloride"}
"""Elements, and metal ions whose lone electrons are none of a radical."""

# Contributions of Abraham and McGowan, Chromatographia 23 (1987) 243, mL/mol; 6.56 off for each bond.
MCGOWAN = {
    "C": 16.35, "H": 8.71, "O": 12.43, "N": 14.39, "F": 10.48, "Cl": 20.95, "Br": 26.21, "I": 34.53, "S": 22.91,
    "P": 24.87, "Si": 26.83, "B": 18.32,
}  # fmt: skip
LOOSE = {
    "HydrobromicAcid": "48 % in water, of which the structure is the solute alone",
    "TrifluoroaceticAcid": "fluorinated liquids pack loosely",
    "TrifluoroaceticAnhydride": "fluorinated liquids pack loosely",
}
DOUBTED = {"BoronTrifluorideEtherate": "suppliers give 58 to 64 C, and H226 all the same"}


def test_only_mixtures_have_no_structure() -> None:
    assert {asset.name for asset in REAGENTS} - {asset.name for asset in DRAWN} == set(MIXTURES)


@drawn
def test_the_formula_is_that_of_the_structure(asset) -> None:
    assert formulas.CalcMolFormula(Chem.MolFromSmiles(asset.chemistry.smiles)) == asset.chemistry.formula


@drawn
def test_the_molar_mass_is_that_of_the_structure(asset) -> None:
    mass = Descriptors.MolWt(Chem.MolFromSmiles(asset.chemistry.smiles))
    assert asset.chemistry.molar_mass == pytest.approx(mass, abs=0.02)


@drawn
def test_a_structure_is_neutral_and_no_radical(asset) -> None:
    molecule = Chem.MolFromSmiles(asset.chemistry.smiles)
    assert Chem.GetFormalCharge(molecule) == 0
    assert bool(Descriptors.NumRadicalElectrons(molecule)) == (asset.name in RADICALS)


@drawn
def test_water_in_a_structure_is_water_in_the_bottle(asset) -> None:
    water = asset.chemistry.smiles.split(".").count("O") if asset.name != "DeionizedWater" else 0
    assert water == HYDRATES.get(asset.name, 0)


@drawn
def test_the_canonical_form_is_the_same_substance(asset) -> None:
    assert canonical(canonical(asset.chemistry.smiles)) == canonical(asset.chemistry.smiles)


def test_no_two_reagents_are_one_substance() -> None:
    structures = Counter(canonical(asset.chemistry.smiles) for asset in DRAWN)
    numbers = Counter(asset.chemistry.cas for asset in REAGENTS)
    assert [smiles for smiles, count in structures.items() if count > 1] == []
    assert [number for number, count in numbers.items() if count > 1] == []


@drawn
def test_density_fits_the_volume_of_the_molecules(asset) -> None:
    """Molecules fill 0.70 to 0.99 of a liquid by McGowan's volumes, water and strongly bound liquids the most."""
    chemistry = asset.chemistry
    molecule = Chem.AddHs(Chem.MolFromSmiles(chemistry.smiles))
    symbols = [atom.GetSymbol() for atom in molecule.GetAtoms()]
    if chemistry.density is None or not set(symbols) <= set(MCGOWAN):
        return
    volume = sum(MCGOWAN[symbol] for symbol in symbols) - 6.56 * molecule.GetNumBonds()
    share = volume / (chemistry.molar_mass / chemistry.density)
    assert (0.70 <= share <= 0.99) == (asset.name not in LOOSE)


@for_each("asset", REAGENTS)
def test_flash_and_boiling_point_are_in_the_category_of_the_statement(asset) -> None:
    """Table 2.6.1 of the GHS: categories 1 to 3 of flammable liquids."""
    chemistry = asset.chemistry
    codes, flash, boiling = set(chemistry.h_codes), chemistry.flash_point, chemistry.boiling_point
    if chemistry.state != "liquid" and "H226" not in codes:
        assert not codes & {"H224", "H225"}
        return
    category = None
    if flash is not None and flash <= 60.0:
        category = "H226" if flash >= 23.0 else "H224" if boiling is not None and boiling <= 35.0 else "H225"
    stated = next((code for code in ("H224", "H225", "H226") if code in codes), None)
    assert stated == category or asset.name in DOUBTED


@for_each("asset", REAGENTS)
def test_state_fits_the_boiling_point(asset) -> None:
    chemistry = asset.chemistry
    if chemistry.boiling_point is not None and asset.name != "DryIce":  # sublimes
        assert (chemistry.boiling_point < 20.0) == (chemistry.state == "gas")
    if chemistry.flash_point is not None and chemistry.boiling_point is not None:
        assert 25.0 <= chemistry.boiling_point - chemistry.flash_point <= 220.0
